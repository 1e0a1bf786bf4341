/* What a set of samples reconstructs: S of [G] 5.2, warped orthographically at the target resolution. */
#ifndef PSR_SAMPLE_COVER_H
#define PSR_SAMPLE_COVER_H

#include <stddef.h>
#include <stdint.h>
#include "psr/pool.h"

struct cover_point {
	float position[3];
	uint16_t normal;    /* psr/direction.h: turned away from the viewer it does not count, */
	uint16_t two_sided; /* unless this is set */
};

/* In the frame of a view: z grows towards the viewer. */
struct cover_seen {
	float x, y, z;
};

#define COVER_CHUNK 16384

struct cover {
	struct cover_point *point;
	size_t n_points, capacity;
	/* Made by cover_look: of every COVER_CHUNK points those that count, from the same place on. */
	struct cover_seen *seen;
	uint32_t *n_seen;
};

/* Room for n points in all. MEMORY, and all is as before. */
int cover_reserve(struct cover *cover, size_t n);
void cover_fini(struct cover *cover);

/* Puts the points into a view; rows of axis are its x, y, z. */
void cover_look(struct cover *cover, const float axis[3][3], struct psr_pool *pool);

static inline struct cover_seen cover_project(const float axis[3][3], const float p[3])
{
	return (struct cover_seen){ axis[0][0] * p[0] + axis[0][1] * p[1] + axis[0][2] * p[2],
		                        axis[1][0] * p[0] + axis[1][1] * p[1] + axis[1][2] * p[2],
		                        axis[2][0] * p[0] + axis[2][1] * p[1] + axis[2][2] * p[2] };
}

/* A pixel grid laid over the view, turned about z and shifted, that holds the whole unit sphere. */
struct cover_grid {
	float cosine, sine, shift[2]; /* cosine and sine times pixels a unit; shift includes the middle */
	uint32_t side;                /* pixels, of a square */
};

/* shift in pixels, 0 <= shift < 1; a pixel is ds wide */
void cover_grid_init(struct cover_grid *grid, double angle, double shift_x, double shift_y, double ds);

static inline size_t cover_pixel(const struct cover_grid *grid, const struct cover_seen *p)
{
	uint32_t u = (uint32_t)(grid->cosine * p->x + grid->sine * p->y + grid->shift[0]);
	uint32_t v = (uint32_t)(grid->cosine * p->y - grid->sine * p->x + grid->shift[1]);

	return (size_t)v * grid->side + u;
}

/* z: side * side, becomes the greatest z of the points seen in each pixel, -inf where there is none. */
void cover_draw(const struct cover *cover, const struct cover_grid *grid, float *z);

#endif
