/* The kernels: what of a frame takes time, as one table of functions for each ISA. c/ has the reference of every
 * kernel; avx2/ and avx512/ have variants that give the same bits (tests/simd compares them): one evaluation tree, true
 * division, no contraction, choices by data alone. */
#ifndef PSR_SIMD_SIMD_H
#define PSR_SIMD_SIMD_H

#include <stdint.h>
#include "base/maths.h"
#include "isa.h"
#include "model/blocks.h"
#include "psr/render.h"
#include "zstack.h"

/* A sample of a one-sided block faces away when its normal (psr_direction_tens) is more than this sine beyond
 * perpendicular: what normals are quantised to. [G] 7.3.2 gives such samples weight 0 when they are shaded; here they
 * are left out when they are warped, before they hide what is behind them, so that open one-sided surfaces are seen
 * through from their backs. */
#define BACK_SINE 0.0125f

#define TILE_WIDTH 256  /* words of a tile fit L2 with room to spare */
#define TILE_HEIGHT 128 /* a multiple of the coarsest cell, so that every cell belongs to one tile */

/* What is known to be empty is known by part of a tile. */
#define PART_WIDTH 128
#define PART_HEIGHT 32
#define ALL_PARTS ((1u << TILE_HEIGHT / PART_HEIGHT * (TILE_WIDTH / PART_WIDTH)) - 1)

/* The bit of the part at pixel (x, y) of a tile. */
static inline uint32_t part_bit(uint32_t x, uint32_t y)
{
	return 1u << (y / PART_HEIGHT * (TILE_WIDTH / PART_WIDTH) + x / PART_WIDTH);
}

/* ---- cull ([G] 6.1, 6.4) ---- */

struct cull_view {
	const struct psr_blocks *blocks;
	float center_m[3][4]; /* inner coordinates to camera space */
	float scale;          /* camera space units an inner unit */
	float spacing;        /* greatest distance of neighbours at level 0, camera space */
	float eye[3];         /* inner coordinates; orthographic: unit vector to the viewer instead */
	int perspective;
	int both_sides;       /* nothing is culled for how it faces: what casts shadows does so with its back, too */
	float focal, near_z, width, height;
	float center_x, center_y; /* pixels: where the view axis meets the picture */
	int with_cones, with_splats;
	/* What visibility masks are tested against ([G] 6.3: 4x4 regions of the picture): region a of a pixel is
	 * region_scale[a] times the pixel's place plus region_from[a]. */
	float region_from[2], region_scale[2];
};

/* Pixels that a length across the surface can be stretched to where it lies in a sphere: |d(x'/z')| <= |p| |dp| /
 * z'^2, which is [G] (7.9) with the true stretch off the axis in the place of the distance alone. With theta the
 * angle between p and the axis that is 1 / (z' cos theta): the least z' and the greatest theta of the sphere bound
 * it, the latter as far from the centre's as the sphere's rim is. Seen from within the sphere, or beyond 90 degrees,
 * only |p| and z' do. `front`: the least z' of what is in the sphere, c_z - r if no more is known. */
static inline float cull_stretch(const struct cull_view *v, float cx, float cy, float cz, float r, float front)
{
	const float near = psr_choose(front > v->near_z, front, v->near_z);
	const float side2 = cx * cx + cy * cy, distance2 = side2 + cz * cz, rim2 = distance2 - r * r;
	const float reach = __builtin_sqrtf(distance2) + r;
	/* The cosine times distance2. */
	const float cosine = cz * __builtin_sqrtf(psr_where(rim2 > 0, rim2)) - __builtin_sqrtf(side2) * r;
	const int is_sharp = (rim2 > 0) & (cosine > 0) & (distance2 * near < reach * cosine);
	const float above = psr_choose(is_sharp, distance2, reach), below = near * psr_choose(is_sharp, cosine, near);
	return psr_choose(v->perspective, v->focal * above / below, v->focal);
}

#define SCREEN_SPLITS 2
#define SCREEN_SIDE (1 << SCREEN_SPLITS)
#define SCREEN_RANGES (SCREEN_SIDE * (SCREEN_SIDE + 1) / 2)

/* Index of a range of regions among the SCREEN_RANGES of an axis. */
static inline int32_t screen_range(int32_t first, int32_t last)
{
	return last * (last + 1) / 2 + first;
}

#define CULL_BATCH 64
struct cull_batch {
	int32_t is_left[CULL_BATCH];  /* 0: nothing of the block can show, and the rest says nothing; else 1 */
	int32_t is_mixed[CULL_BATCH]; /* 1: some of its samples may face away */
	int32_t level[CULL_BATCH];    /* of the depth buffer that fits; PSR_MAX_DEPTH_LEVEL + 1 and more do not exist */
	int32_t x0[CULL_BATCH], x1[CULL_BATCH], y0[CULL_BATCH], y1[CULL_BATCH]; /* pixels, inclusive, with the guard band */
	/* Tiles, inclusive, that a sample can fall into or, with splats, a splat can reach; of the border's those that
	 * own the guard band. */
	int32_t tile_x0[CULL_BATCH], tile_x1[CULL_BATCH], tile_y0[CULL_BATCH], tile_y1[CULL_BATCH];
	/* Of regions that the pixels lie in: screen_range of x, times SCREEN_RANGES, plus that of y. */
	int32_t range[CULL_BATCH];
	float near[CULL_BATCH];        /* no sample's z' is less */
	float depth_error[CULL_BATCH]; /* half a step of depth, in pixels */
};

/* Blocks first .. first + n - 1, n at most CULL_BATCH, by frustum and cone. */
typedef void cull_fn(struct cull_batch *out, const struct cull_view *view, uint32_t first, uint32_t n);

/* ---- warp ([G] 7.1, 7.2) ---- */

/* The lattice of one projection in the picture of a frame, at level 0; at level l all but `origin` is 2^l times as
 * long, exactly. Axis a is u z', v z' or z' (without z' if orthographic). A sample of row r and column c at depth z
 * is at origin + (row of its block + r) down + (column of its block + c + (r & 1) / 2) step + z along.
 *
 * Of [G]'s forms this is the incremental one, (7.6): p, q and r are the terms of row and column, looked up and not
 * accumulated, so that no rounding adds up along a row and holes cost nothing. A row's term is a double until it is
 * the block's, so that places are as exact where the eye is near. All projections use it: (7.6') is no faster, and
 * off by pixels where A_zz is near 0 (tests/simd/forms --bench). */
struct warp_lattice {
	double origin[3], step[3], down[3], along[3];
	double row[3][8]; /* r * down + (r & 1) / 2 * step */
	float col[3][8];  /* c * step */
	struct psr_placing placing;
};

struct warp_instance {
	const struct psr_blocks *blocks;
	const struct warp_lattice *lattice; /* one a projection */
	uint32_t first_slot;
	/* The direction of sight through (u, v), in inner coordinates: u du + v dv + d0, of any length. */
	float du[3], dv[3], d0[3];
	float turn[3][3]; /* inner coordinates to camera space, a rotation */
};

/* A block that may show in a tile. */
struct bin_entry {
	uint32_t slot;
	uint16_t instance;
	uint8_t level;    /* of the depth buffer that fits the block */
	uint8_t is_mixed : 1;  /* some of its samples may face away */
	uint8_t at_border : 1; /* it may reach beyond the picture */
	uint32_t hit;     /* index in bins->hit */
};

/* One tile of the picture, and for each level the cells that belong to it: those of its pixels, and at the picture's
 * border the guard band. Pixels count from the picture's corner, cells from the guard band's. */
struct warp_target {
	const struct warp_instance *instance;
	const uint32_t *direction; /* psr_direction_tens() */
	float near_z;
	int perspective;
	uint64_t *word; /* that of (x0, y0); what is between rows is left alone */
	uint32_t stride;
	int32_t x0, y0, x1, y1;
	uint32_t clean; /* bits of parts whose words are empty before the tile is cleared */
	uint32_t bare;  /* bits of parts where nothing is drawn */
	struct warp_cells {
		float *z;
		uint32_t stride, first;
		int32_t x0, y0, x1, y1; /* pixels whose cells belong to the tile, of which `first` is one */
	} cells[PSR_MAX_DEPTH_LEVEL + 1];
};

/* Lowers words, and the cells of entries with a level above 0, to the samples of the entries' blocks that fall into the
 * tile, lie beyond near_z and do not face away. Returns how many samples fell into the tile. */
typedef uint64_t warp_fn(const struct warp_target *target, const struct bin_entry *entry, uint32_t n);

/* Makes a tile empty: words but those of clean parts, and cells of the levels of the bit mask. */
typedef void warp_clear_fn(const struct warp_target *target, uint32_t levels);

/* The cells of a level from the tile's words, of which each then has the least z' of its pixels, without those of bare
 * parts: what lowering them sample by sample gives where all that was drawn belongs to that level. Those of the guard
 * band become empty. */
typedef void warp_cells_fn(const struct warp_target *target, int level);

/* ---- strips: samples that are resolved and shaded together ([G] 7.3) ---- */

#define STRIP 128
#define STRIP_PADDING 16 /* elements that listing may write beyond the last */

enum strip_needs {
	STRIP_TWO_SIDED = 1, /* some block in view is two-sided */
	STRIP_POSITION = 2,  /* some light is near, or casts shadows */
	STRIP_LIGHTS = 8,    /* some light shines */
	STRIP_SPECULAR = 4,  /* highlights are looked for whether any sample is specular or not */
	STRIP_BENT = 16,     /* some block in view is bent */
};

/* The covered pixels of a part of a row: pixel i is (x0 + x[i], y). */
struct strip_pixels {
	uint32_t n, x0, y;
	const uint64_t *word;         /* of the part; not NULL where n is not 0 */
	uint32_t covered[STRIP / 32]; /* bit x % 32 of covered[x / 32]: one of them has this x */
	uint16_t x[STRIP + STRIP_PADDING];
	uint32_t id[STRIP + STRIP_PADDING]; /* slot * 64 + sample */
	const uint64_t *at[STRIP];          /* attributes */
	uint8_t two_sided[STRIP];           /* with STRIP_TWO_SIDED */
	uint32_t has_cones;   /* whether any is of a bent block, with STRIP_BENT and where the surface's normal is needed */
	uint32_t cone[STRIP]; /* then, of bent blocks: x, y, z and sine, from the lowest byte on; else STRIP_NO_CONE */
};
#define STRIP_NO_CONE ((uint32_t)PSR_CONE_ANY << 24)

/* Their samples. Everything is in camera space; colours are linear. */
struct strip {
	const struct strip_pixels *pixels;
	uint32_t n;              /* pixels->n, and up to a multiple of STRIP_PADDING: the last sample is repeated */
	int is_specular;         /* some sample is, or the view wants it so */
	uint64_t attr[STRIP];
	uint64_t normal_word[STRIP];
	float px[STRIP], py[STRIP], pz[STRIP]; /* with STRIP_POSITION */
	float nx[STRIP], ny[STRIP], nz[STRIP]; /* turned to the eye where the block is two-sided */
	/* With STRIP_POSITION and STRIP_TWO_SIDED the normal of the surface, by which shadows and sides go: the same, or in
	 * a bent block the nearest to it that the block's cone holds. */
	float gx[STRIP], gy[STRIP], gz[STRIP];
	float vx[STRIP], vy[STRIP], vz[STRIP]; /* unit vector along the pixel's line of sight, to the eye */
	float dr[STRIP], dg[STRIP], db[STRIP];
	float sr[STRIP], sg[STRIP], sb[STRIP], exponent[STRIP]; /* where any sample is specular */
	/* Light that comes back diffusely and as highlights, before it is multiplied with colours. */
	float lr[STRIP], lg[STRIP], lb[STRIP];
	float hr[STRIP], hg[STRIP], hb[STRIP];
	uint16_t r[STRIP], g[STRIP], b[STRIP];
};

struct strip_view {
	const struct warp_instance *instance;
	uint32_t n_instances;
	const uint64_t *direction_word;
	const float (*lit)[4]; /* by normal: what strips without highlights get in the place of lights; NULL: no such
	                        * table */
	float half_width, half_height, focal; /* pixels; the former to where the view axis meets the picture */
	int perspective;
	unsigned needs; /* enum strip_needs */
};

/* A light in camera space. */
struct strip_light {
	enum psr_light_kind kind;
	float position[3], to_light[3];      /* to_light: unit, of directional lights */
	float axis[3], cos_inner, cos_outer; /* spot; axis: unit, away from the light */
	float reference2;                    /* square of the reference distance; 0: no fall-off */
	float color[3];
};

/* Lists the pixels of a part of a row, at most STRIP, that have a word and a weight above 0 (NULL: all have): n,
 * word, covered, x, id. */
typedef void strip_list_fn(struct strip_pixels *pixels, const uint64_t *word, const uint16_t *weight, uint32_t n);
/* Where their attributes are, of at least one, for which it asks the memory, and with STRIP_TWO_SIDED and STRIP_BENT
 * what their blocks are. Repeats the last one up to a multiple of STRIP_PADDING. It is worth while to find those of
 * one strip before another one is read. */
typedef void strip_find_fn(struct strip_pixels *pixels, const struct strip_view *view);
/* n, is_specular, attributes, their normals and colours, of strip->pixels, which are found. */
typedef void strip_read_fn(struct strip *strip, const struct strip_view *view);
/* What else is needed of samples that are read: turned normals, lines of sight, and with STRIP_POSITION positions, at
 * the centre of the pixel and the depth of its word. Clears the light to `ambient` and no highlight. */
typedef void strip_resolve_fn(struct strip *strip, const struct strip_view *view, const float ambient[3]);
/* Adds what a light gives: Phong's diffuse (N.L) and, if any sample is specular, (R.V)^n. How much of the light reaches
 * each sample is 0..1; NULL: all of it. */
typedef void strip_light_fn(struct strip *strip, const struct strip_light *light, const float *reaches);
/* Light by normal, as strip_light gives it, of normals first .. first + n - 1; n at most STRIP. */
typedef void strip_lit_fn(float (*lit)[4], const struct strip_view *view, const struct strip_light *light,
                          uint32_t n_lights, const float ambient[3], uint32_t first, uint32_t n);
/* Colours of 16 bits from light and colours of samples; unlit ones keep their diffuse colour. */
typedef void strip_color_fn(struct strip *strip);

#define STRIP_BRICK 32 /* pixels that are wanted in linear light, or not, together */

struct strip_target {
	uint32_t width;
	uint8_t *rgb;           /* sRGB, 3 bytes a pixel, or NULL */
	const uint8_t *srgb;    /* 8 bits of 16-bit linear light */
	const uint8_t *wants;   /* one byte for each STRIP_BRICK pixels of the part: 0 if not in linear light. NULL:
	                         * none is */
	uint16_t *r, *g, *b;    /* linear light; where pixels are not wanted, nothing is written */
	uint16_t background[3]; /* linear */
};

/* Colours of the n pixels of the part of the row: those of the samples of strip->pixels, if any, elsewhere the
 * background. */
typedef void strip_write_fn(const struct strip *strip, const struct strip_target *target, uint32_t n);

/* World depths of a row: z' of words, 2^exponent times as much; +inf where nothing is. */
typedef void depth_row_fn(float *depth, const uint64_t *word, uint32_t n, int exponent);

/* ---- shadows ([G] 7.3.1) ---- */

/* A map: for each level k in use the nearest z' in cells of 2^k texels, sunk, with a guard band of one cell. Cells hold
 * steps beyond `from`, rounded up, or SHADOW_EMPTY. Lengths are the map's own units, of which the camera's are
 * `scale`. */
#define SHADOW_EMPTY 0xffff
struct shadow_map {
	int perspective;
	float turn[3][3], move[3]; /* camera space to the map's: turn p + move */
	float scale;
	float focal, half_width, half_height, near_z;
	/* A place is compared by how its plane falls within slope_bias cells of a cell's centre, less texel_bias widths of
	 * a cell, less slack: half a cell, a cell, and what rounding takes. */
	float slope_bias, texel_bias, slack;
	float from, step;
	uint32_t levels; /* bit k: level k is in use */
	struct {
		const uint16_t *z;
		const uint16_t *seam; /* of the nearest of the cell and of the finer level's four in it; NULL where that is not
		                       * in use */
		uint32_t stride;
		float most_x, most_y; /* greatest places, in cells, at which four cells lie around */
	} level[PSR_MAX_DEPTH_LEVEL + 1];
};

#define SHADOW_FACES 6

/* Of one light: no map if it casts none, one, or some faces of a cube about it. */
struct shadow_light {
	uint32_t n_maps;
	struct shadow_map map[SHADOW_FACES];
};

/* How much of a light reaches each sample of a strip with positions: 2 - 2 times the greatest coverage by a level of
 * what is nearer to the light, at most 1, and nothing where the surface faces away. 0: no sample faces the light, and
 * `reaches` has no value. */
typedef int strip_shadow_fn(const struct strip *strip, const struct shadow_light *shadow, float *reaches);

/* Makes n cells of a map of their depths, of which those above and below are given, too: all but the first and the last
 * sink, away from the light, by what their surface falls within a cell. In each direction that is the lesser of the
 * differences to the two neighbors, and 0 where these differ in sign, at an edge. A cell has its nearest sample, which
 * where two faces meet lies before the other face, though neither shadows the other. */
typedef void shadow_sink_fn(uint16_t *restrict to, const float *above, const float *own, const float *below, uint32_t n,
                            float from, float step);

/* ---- gaps ([G] 4.6) ---- */

#define GAPS_WIDTH 128 /* a multiple of the coarsest cell */
#define GAPS_BRICK 32
#define GAPS_WHOLE 256 /* the weight of a pixel that nothing covers */

/* A picture. What a cell of level k covers lies behind scale[k] * z' + offset[k] of it. */
struct gaps_target {
	const struct psr_zstack *stack;
	const float *scale, *offset; /* by level */
	uint16_t *weight;            /* stack->width * stack->height */
	int opaque_cells;            /* a cell covers its own pixels, whole, and no others */
};

struct gaps_counts {
	uint32_t n_partial;  /* pixels with a sample whose weight is below 1 */
	uint32_t n_pinholes; /* pixels, with a sample or without, that the guard took and no cell covers whole */
	uint32_t n_marked;   /* bricks with a weight below 1 */
};

/* Weights of the pixels x0 <= x < x1, y0 <= y < y1: 0..GAPS_WHOLE, of the share that no cell nearer than the pixel
 * covers, and 0 for pinholes. x0 is a multiple of GAPS_WIDTH, x1 at most GAPS_WIDTH more; y0 a multiple of GAPS_BRICK,
 * y1 at most GAPS_BRICK more. Sets marks[i] to whether brick i of the GAPS_WIDTH / GAPS_BRICK side by side has a weight
 * below GAPS_WHOLE. */
typedef struct gaps_counts gaps_fn(const struct gaps_target *target, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1,
                                   uint8_t *marks);

/* ---- fill ([G] 4.7, appendix) ---- */

#define FILL_WIDTH 256 /* parents of pixels at most, in one fill_push_picture */

/* Cells side by side. Colours are premultiplied with the weight, but in the picture itself. Outside of the picture z is
 * NaN, nearer than nothing and farther than nothing, and the weight GAPS_WHOLE. */
struct fill_row {
	uint16_t *r, *g, *b, *weight; /* each NULL where it does not matter */
	float *z;
	uint8_t *near; /* bit 2 j + i: child i of row j counts: it has a weight, and is not beyond the others */
};

/* Weights, depths and `near` of cells to[0..n-1] from cells upper[0..2n-1] and lower[0..2n-1]: of those that have a
 * weight, the ones that are not beyond scale * z + offset of the nearest. Returns the least weight. */
typedef uint16_t fill_pull_weights_fn(const struct fill_row *to, const struct fill_row *upper,
                                      const struct fill_row *lower, uint32_t n, float scale, float offset);

/* Colours of cells that have `near`, from the same cells' colours and weights. */
typedef void fill_pull_colors_fn(const struct fill_row *to, const struct fill_row *upper, const struct fill_row *lower,
                                 uint32_t n, int is_picture);

#define FILL_BLOCK 16 /* a push works on as many parents together */

/* Makes those of the cells to[0..2n-1] whole that are not, and whose parents are, with the neighbors that they look at:
 * own[0..n-1] holds the parents, of which [-1] and [n] count, too, and beside[0..n-1] the parents' neighbors above or
 * below. Depths change where the weight was below a half. */
typedef void fill_push_fn(const struct fill_row *to, const struct fill_row *own, const struct fill_row *beside,
                          uint32_t n, float scale, float offset);

/* Pixels that become whole: where they are in their row, the weights that they had, and what they get. */
#define FILL_PLACES (2 * FILL_WIDTH + 2 * FILL_BLOCK) /* room for a block more than there can be */
struct fill_places {
	uint32_t n_filled, n_moved; /* with no weight before, and now before infinity; with less than half a weight before */
	uint16_t at[FILL_PLACES], weight[FILL_PLACES], r[FILL_PLACES], g[FILL_PLACES], b[FILL_PLACES];
	float z[FILL_PLACES]; /* interpolated, whatever the weight was */
};

/* The same for pixels, in `was`, of which the weights alone change, and whose z has no meaning: in those blocks i of
 * FILL_BLOCK parents whose left[i] has a bit, which is taken out where all pixels are whole or become it. Lists the
 * pixels that become whole, and returns how many there are; anything may stand beyond them. */
typedef uint32_t fill_push_picture_fn(struct fill_places *places, uint32_t *left, uint32_t bit,
                                      const struct fill_row *was, const struct fill_row *own,
                                      const struct fill_row *beside, uint32_t n, float scale, float offset);

/* z' of n words. */
typedef void fill_depths_fn(float *z, const uint64_t *word, uint32_t n);

/* ---- smooth ([G] 9.1.1) ---- */

#define SMOOTH_WIDTH 256

/* A picture that is done, and one of the same size that it goes to. What is behind a pixel is beyond scale * z' +
 * offset of it. */
struct smooth_target {
	const uint8_t *from; /* sRGB, 3 bytes a pixel */
	uint8_t *to;
	const float *depth;  /* z', +inf where nothing is */
	uint32_t width, height;
	float scale, offset;
};

/* The pixels x0 <= x < x1, y0 <= y < y1, of which SMOOTH_WIDTH at most are side by side: each becomes the mean of
 * itself, four times, and of its four neighbours, in the place of which it stands itself where they are not of the same
 * surface. An edge lets through what is behind it: an eighth of the mean of the neighbours there for each diagonal one
 * and two for each other one, which count once and twice in that mean, six eighths at most. Neighbours in front count
 * nothing. Means are of squares of codes. Returns how many pixels have a neighbour behind. */
typedef uint32_t smooth_fn(const struct smooth_target *target, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1);

/* The greatest z' of each 8x8 pixels of a tile, as bits: far[y / 8 * (TILE_WIDTH / 8) + x / 8]; those of +inf where a
 * pixel is empty. */
#define FAR_SIDE 8
typedef void warp_far_fn(const struct warp_target *target,
                         uint32_t far[TILE_HEIGHT / FAR_SIDE * (TILE_WIDTH / FAR_SIDE)]);

struct simd {
	cull_fn *cull;
	warp_far_fn *warp_far;
	warp_clear_fn *warp_clear;
	warp_cells_fn *warp_cells;
	warp_fn *warp;
	strip_list_fn *strip_list;
	strip_find_fn *strip_find;
	strip_read_fn *strip_read;
	strip_resolve_fn *strip_resolve;
	strip_shadow_fn *strip_shadow;
	shadow_sink_fn *shadow_sink;
	strip_light_fn *strip_light;
	strip_lit_fn *strip_lit;
	strip_color_fn *strip_color;
	strip_write_fn *strip_write;
	depth_row_fn *depth_row;
	gaps_fn *gaps;
	fill_pull_weights_fn *fill_pull_weights;
	fill_pull_colors_fn *fill_pull_colors;
	fill_push_fn *fill_push;
	fill_push_picture_fn *fill_push_picture;
	fill_depths_fn *fill_depths;
	smooth_fn *smooth;
};

extern const struct simd simd_c, simd_avx2, simd_avx512;
const struct simd *simd_of(enum psr_isa isa); /* NULL if this build or machine has none */
const struct simd *simd_get(void);            /* that of psr_isa_get() */

#endif
