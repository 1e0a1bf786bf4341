/* Shade: words to linear colours ([G] 7.3). Wide plans: to those of base/root.h. */
#ifndef PSR_RENDER_SHADE_H
#define PSR_RENDER_SHADE_H

#include "plan.h"

struct shade_counts {
	uint64_t n_pixels;             /* shaded */
	uint64_t n_specular;           /* among them, in strips with highlights */
	uint64_t resolve_ns, shade_ns; /* of every TIMED_EVERYth strip */
	uint64_t row_ns, fill_ns;      /* of all work on a row of bricks, and of the fill's part; pipeline.c sets them */
};

/* Whether to tabulate diffuse light by normal ([B] 4.1), and if so, the table of PSR_DIRECTIONS rows. CANCELLED.
 * */
enum psr_why shade_wants_table(const struct plan *plan);
int shade_tabulate(const struct simd *simd, const struct plan *plan, struct psr_pool *pool, float (*lit)[4]);

/* A picture: its samples, and where its colours go. */
struct shade_picture {
	const struct psr_zstack *stack;
	const uint16_t *weight;
	uint8_t *rgb;         /* sRGB, 3 * width * height, or NULL */
	const uint8_t *srgb;  /* 8 bits of 16-bit linear light */
	uint16_t *r, *g, *b;  /* 16 bits, width * height: written in bricks that are wanted, all if the plan is wide */
	const uint8_t *wants; /* a flag a brick, from fill_wants; NULL: none */
};

/* Colours the pixels of rows y0..y1-1, at least one: lit samples of weight above 0, and the background elsewhere.
 * Without rgb, and not wide, counts samples alone. Adds to the counts. */
void shade_rows(const struct simd *simd, const struct plan *plan, const struct shade_picture *picture, uint32_t y0,
                uint32_t y1, struct shade_counts *counts);

/* Lights the samples of n words, STRIP at most, from pixel (pixels->x0, pixels->y) on, the beginning of a strip. Sets
 * strip->r, g and b of the pixels pixels->x. Returns how many there are. */
uint32_t shade_part(const struct simd *simd, const struct plan *plan, const uint64_t *word, uint32_t n,
                    struct strip_pixels *pixels, struct strip *strip);

/* Reports the counts of all rows of bricks. Resolving, shading and filling run together: divides their wall time by
 * their own clocks. */
void shade_report(const struct plan *plan, const struct shade_counts *rows, uint64_t wall, int has_rgb,
                  struct psr_report *report);

#endif
