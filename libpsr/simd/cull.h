/* Kernel of the cull: blocks against the frustum ([G] 6.1) and by visibility cones ([G] 6.4). */
#ifndef PSR_SIMD_CULL_H
#define PSR_SIMD_CULL_H

#include "base/maths.h"
#include "model/cubes.h"
#include "zstack.h"

struct cull_view {
	const struct psr_blocks *blocks;
	const struct psr_cubes *cubes; /* NULL: blocks are blocks; else they are its groups */
	const struct psr_points *points; /* likewise */
	float center_m[3][4]; /* inner coordinates to camera space */
	float scale;          /* camera space units an inner unit */
	float spacing;        /* greatest distance of neighbours at level 0, camera space */
	float eye[3];         /* inner coordinates; orthographic: unit vector to the viewer */
	int perspective;
	int both_sides;       /* ignore how blocks face: backs cast shadows, too */
	float focal, near_z, width, height;
	float center_x, center_y; /* pixels: where the view axis meets the picture */
	int with_cones, with_splats;
	int reach;            /* 1: blocks draw as far as their neighbours are, where that is beyond the guard band, too */
	/* Regions of the picture for visibility masks ([G] 6.3, 4x4 of them): region a of a pixel is region_scale[a] times
	 * the pixel's coordinate plus region_from[a]. */
	float region_from[2], region_scale[2];
};

/* Whether cones are asked: those of bent blocks are, whatever the view wants, as their samples cannot tell. */
static inline int cull_asks_cones(const struct cull_view *view)
{
	return view->blocks->cone_sine != NULL && (view->with_cones || view->blocks->traits != NULL);
}

/* Returns the depth buffer's level for samples that are so far apart: the smallest k >= 0 with pixels <= 2^k ([G]
 * 7.11), from the exponent. Pixels are a stretch times a spacing times CULL_LESS: so rounding does not double the cells of a
 * picture at exactly the magnification of a level. Of NaN, 0 times infinity, k is that of 2^100. */
#define CULL_LESS (1 - 0x1p-12f)
static inline int32_t cull_level(float pixels)
{
	const int32_t bits = (int32_t)psr_bits_from_float(psr_choose(pixels < 0x1p100f, pixels, 0x1p100f));
	const int32_t exponent = ((bits + 0x7fffff) >> 23) - 127;

	return exponent > 0 ? exponent : 0;
}

/* Bounds how many pixels a unit of length on a surface inside a sphere can span: |d(x'/z')| <= |p| |dp| / z'^2, which
 * is [G] (7.9) with the true stretch off the axis. With theta the angle between p and the axis that is
 * 1 / (z' cos theta); the sphere's least z' and greatest theta bound it. Seen from within the sphere, or beyond 90
 * degrees, only |p| and z' do. `front`: the least z' in the sphere, or c_z - r. */
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

/* Let d go from the eye to the centre of a sphere of radius r, at the angle theta from a cone's axis, n be a normal
 * within alpha of the axis, and x a sample in the sphere. Then n . (x - eye) is between |d| cos(theta + alpha) - r and
 * |d| cos(theta - alpha) + r, and |x - eye| within r of |d|. The slack covers rounding, and normals of 10 bits, which
 * are off by sqrt(3) / 1022 at most. */
#define CONE_SLACK 0.0027f

#define CULL_BATCH 64

/* What a batch of cubes has together, of those that are left. */
struct cull_sum {
	uint64_t left, mixed; /* bit i: of cube i */
	int32_t x0, x1, y0, y1;
	int32_t tiles[2], level[2]; /* least and greatest: all are alike where both are the same; see cull_tiles() */
	float near, apart, depth_error; /* the least, and the greatest two */
};

struct cull_batch {
	int32_t is_left[CULL_BATCH];  /* 1: the block may show; 0: it cannot, and its other values mean nothing */
	int32_t is_mixed[CULL_BATCH]; /* 1: some of its samples may face away */
	int32_t level[CULL_BATCH];    /* of the depth buffer that fits; may exceed PSR_MAX_DEPTH_LEVEL */
	int32_t x0[CULL_BATCH], x1[CULL_BATCH], y0[CULL_BATCH], y1[CULL_BATCH]; /* pixels, inclusive, with the guard band */
	/* Tiles, inclusive, that the block's samples can fall into, or its splats reach. Border tiles own the guard band.
	 * */
	int32_t tile_x0[CULL_BATCH], tile_x1[CULL_BATCH], tile_y0[CULL_BATCH], tile_y1[CULL_BATCH];
	int32_t range[CULL_BATCH];     /* of regions: screen_range of x, times SCREEN_RANGES, plus that of y */
	float near[CULL_BATCH];        /* a lower bound of its samples' z' */
	float apart[CULL_BATCH];       /* how far neighbouring samples are from each other, in pixels, at most */
	float depth_error[CULL_BATCH]; /* half a step of depth, in pixels; of a leaf, half its diagonal; of points,
	                                * how far they may be off */
	struct cull_sum sum;           /* of cubes alone */
};

/* The tiles that cube i of a batch can draw into, as one number. */
static inline int32_t cull_tiles(const struct cull_batch *batch, uint32_t i)
{
	return batch->tile_x0[i] | batch->tile_x1[i] << 8 | batch->tile_y0[i] << 16 | batch->tile_y1[i] << 24;
}

/* Culls blocks first .. first + n - 1, n at most CULL_BATCH, by frustum and cone. Cubes are of one level.
 * cull_cones: culls cubes by their cones, which they must have. Fills is_left, is_mixed, sum.left and sum.mixed. */
typedef void cull_fn(struct cull_batch *out, const struct cull_view *view, uint32_t first, uint32_t n);

#endif
