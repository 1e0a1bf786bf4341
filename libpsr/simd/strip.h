/* Kernels of shading ([G] 7.3): strips, samples that are resolved and lit together. */
#ifndef PSR_SIMD_STRIP_H
#define PSR_SIMD_STRIP_H

#include "psr/scene.h"
#include "warp.h"

#define STRIP 128
#define STRIP_PADDING 16 /* elements that listing may write beyond the last */

enum strip_needs {
	STRIP_TWO_SIDED = 1, /* a block in view is two-sided */
	STRIP_POSITION = 2,  /* a light is near, or casts shadows */
	STRIP_SPECULAR = 4,  /* compute highlights whether or not a sample has any */
	STRIP_BENT = 16,     /* a block in view is bent */
};

/* The pixels of a piece of a row that have a sample: pixel i is (x0 + x[i], y). */
struct strip_pixels {
	uint32_t n, x0, y;
	const uint64_t *word;         /* of the piece; not NULL where n is not 0 */
	uint32_t has_sample[STRIP / 32]; /* bit x % 32 of has_sample[x / 32]: pixel x is among them */
	uint16_t x[STRIP + STRIP_PADDING];
	uint32_t id[STRIP + STRIP_PADDING]; /* slot * 64 + sample */
	const uint64_t *at[STRIP];          /* attributes; NULL: those of leaf[i] of tree[i] */
	const struct octree *tree[STRIP];
	uint32_t leaf[STRIP];
	int has_leaves;                     /* an element of `at` is NULL */
	int only_points;                    /* all are of differential points, whose normals are not those of attributes */
	uint8_t two_sided[STRIP];           /* with STRIP_TWO_SIDED */
	uint32_t has_cones;   /* a sample's block is bent; with STRIP_BENT, where the surface's normal is needed */
	uint32_t cone[STRIP]; /* then, of bent blocks: x, y, z and sine, from the lowest byte on; else STRIP_NO_CONE */
};
#define STRIP_NO_CONE ((uint32_t)PSR_CONE_ANY << 24)

/* Their samples, in camera space; colours are linear. */
struct strip {
	const struct strip_pixels *pixels;
	uint32_t n;              /* pixels->n, rounded up to a multiple of STRIP_PADDING by repeating the last sample */
	int is_specular;         /* a sample has bits of gloss, or the view asks for STRIP_SPECULAR */
	uint64_t attr[STRIP];
	uint64_t normal_word[STRIP];
	float px[STRIP], py[STRIP], pz[STRIP]; /* with STRIP_POSITION */
	float nx[STRIP], ny[STRIP], nz[STRIP]; /* turned to the eye where the block is two-sided */
	/* With STRIP_POSITION or STRIP_TWO_SIDED: the surface's normal, which decides shadows and sides. It equals the
	 * sample's, or in a bent block is the nearest one inside the block's cone. */
	float gx[STRIP], gy[STRIP], gz[STRIP];
	float vx[STRIP], vy[STRIP], vz[STRIP]; /* unit vector along the pixel's line of sight, to the eye */
	float dr[STRIP], dg[STRIP], db[STRIP]; /* base colour; once resolved, diffuse colour */
	/* If is_specular, once resolved: what is mirrored of light from ahead (F0), 1 if anything is and else 0, the square
	 * of the lobe's width (roughness^4), N.V, N^2, and the eye's part of Smith's shadowing. */
	float sr[STRIP], sg[STRIP], sb[STRIP], shine[STRIP], width2[STRIP];
	float nv[STRIP], n2[STRIP], seen[STRIP];
	float lr[STRIP], lg[STRIP], lb[STRIP]; /* light that is scattered, before multiplication with the diffuse colour */
	float hr[STRIP], hg[STRIP], hb[STRIP]; /* if is_specular: highlights and reflected ambient light */
	uint16_t r[STRIP], g[STRIP], b[STRIP];
};

struct strip_view {
	const struct warp_instance *instance;
	uint32_t n_instances;
	const uint64_t *direction_word;
	const float (*lit)[4]; /* diffuse light by normal, for strips without highlights; NULL: add up the lights */
	float half_width, half_height, focal; /* pixels; the former to where the view axis meets the picture */
	int perspective;
	unsigned needs; /* enum strip_needs */
	const struct ewa_sum *sum; /* of the picture's pixels, of leaves as EWA splats; NULL: none */
	uint32_t sum_stride;
};

/* A light in camera space. */
struct strip_light {
	enum psr_light_kind kind;
	float position[3], to_light[3];      /* to_light: unit, of directional lights */
	float axis[3], cos_inner, cos_outer; /* spot; axis: unit, away from the light */
	float reference2;                    /* square of the reference distance; 0: no fall-off */
	float color[3];
};

struct strip_lights {
	const struct strip_light *light;
	uint32_t n;
};

/* Lists the pixels of a piece of a row, at most STRIP, that have a word and a weight above 0 (NULL: any weight): sets
 * n, word, has_sample, x and id. place_bits: those of the words' stack. */
typedef void strip_list_fn(struct strip_pixels *pixels, const uint64_t *word, const uint16_t *weight, uint32_t n,
                           unsigned place_bits);
/* Finds and prefetches the attributes of at least one pixel, and with STRIP_TWO_SIDED and STRIP_BENT its block's
 * properties. Repeats the last pixel up to a multiple of STRIP_PADDING. Finding the next strip before reading this one
 * hides the latency of memory. */
typedef void strip_find_fn(struct strip_pixels *pixels, const struct strip_view *view);
/* Reads n, is_specular, attributes, normals and colours of strip->pixels, which strip_find has found. */
typedef void strip_read_fn(struct strip *strip, const struct strip_view *view);
/* Completes samples that strip_read has read: turned normals, lines of sight, and with STRIP_POSITION positions, at the
 * centre of the pixel and the depth of its word. Sets the light to 0 and highlights to what ambient light gives. */
typedef void strip_resolve_fn(struct strip *strip, const struct strip_view *view, const float ambient[3]);
/* Adds a light (surface/lobe.h has the formulas). `reaches`: the share of the light that reaches each sample, 0..1;
 * NULL: all of it. */
typedef void strip_light_fn(struct strip *strip, const struct strip_light *light, const float *reaches);
/* Tabulates light by normal, as strip_light gives it, for normals first .. first + n - 1; n at most STRIP. */
typedef void strip_lit_fn(float (*lit)[4], const struct strip_view *view, const struct strip_lights *lights,
                          uint32_t first, uint32_t n);
/* Multiplies light and colours into 16 bits: linear up to 1, or if is_wide those of base/root.h. Adds ambient light
 * where !is_specular. Unlit samples keep their base colour. */
typedef void strip_color_fn(struct strip *strip, const float ambient[3], int is_wide);

#define STRIP_BRICK 32 /* pixels of a row that share one flag in `wants` */

struct strip_target {
	uint32_t width;
	uint8_t *rgb;           /* sRGB, 3 bytes a pixel, or NULL */
	const uint8_t *srgb;    /* 8 bits of 16-bit linear light */
	const uint8_t *wants;   /* a flag for each STRIP_BRICK pixels of the piece: write 16 bits; NULL: none */
	uint16_t *r, *g, *b;    /* the strip's 16 bits; written where wanted */
	uint16_t background[3]; /* the same of the background */
};

/* Writes the n pixels of the piece: the colours of strip->pixels, and the background elsewhere. */
typedef void strip_write_fn(const struct strip *strip, const struct strip_target *target, uint32_t n);

/* Converts the words of a row to world depths, z' 2^exponent; +inf where a word is empty. */
typedef void depth_row_fn(float *depth, const uint64_t *word, uint32_t n, int exponent);

#endif
