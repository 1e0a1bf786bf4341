/* What the stages of a frame share. The order of the stages is known to pipeline.c alone. */
#ifndef PSR_RENDER_RENDER_H
#define PSR_RENDER_RENDER_H

#include <stdatomic.h>
#include <stdint.h>
#include "base/pool.h"
#include "stages.h"
#include "simd/simd.h"

#define WEIGHT_ONE 256  /* weights are 0..256 */

/* ---- plan: a request, made ready ([G] 7.1) ---- */

struct plan_instance {
	uint32_t first_slot;  /* slot of block b is first_slot + b */
	uint32_t first_group; /* place of the model's group 0 among those of all instances, of which each has n_clusters */
	struct cull_view cull;
	double turn[3][3];    /* inner coordinates to camera space, a rotation */
	enum psr_why masks;   /* PSR_WHY_RAN: they are tested */
};

struct plan {
	uint32_t width, height, tiles_x, tiles_y, parts_x, parts_y;
	struct psr_window window;  /* of the picture; that of the whole if the settings have none */
	double center[2];          /* pixels from the frame's corner to where the view axis meets it */
	int perspective;
	int with_splats;
	int is_smooth;
	unsigned cull_tests;
	int is_full;
	int opaque_cells;          /* PSR_GAPS_OPAQUE */
	float finer;               /* than a pixel the samples are to be: 1 / settings' spacing */
	int exponent;              /* everything here is world * 2^-exponent, relative to the eye */
	double tangent[2];         /* of half the angles that the picture spans; perspective */
	float focal;               /* pixels a unit of x'/z', or of x' if orthographic */
	float near_z;
	/* What a cell covers lies behind scale * z' + offset of it. */
	float gap_scale[PSR_MAX_DEPTH_LEVEL + 1], gap_offset[PSR_MAX_DEPTH_LEVEL + 1];
	uint32_t n_instances, n_lights, n_slots, n_groups;
	struct plan_instance *instance;
	struct warp_instance *warp; /* what warping knows of each */
	struct strip_view view;    /* needs is filled by the cull, */
	int has_sheer;             /* and this: some block that is left is sheer */
	int is_shadow;             /* it draws a shadow map, in which sheer blocks are there or not */
	struct strip_light *light;
	const struct shadow_light *shadow; /* one a light, or NULL: none casts any in this picture. Not the plan's own */
	double frame[3][3], eye[3]; /* right, down and forward in the world, and where the camera is */
	float ambient[3];
	uint16_t background[3];    /* linear, 16 bits */
	/* One a part of the picture, parts_x in a row, or NULL: 1 where words are empty and weights are whole, since no
	 * block's samples are drawn there, nor so near that their cells cover anything of it. */
	const uint8_t *is_quiet;
	uint64_t n_samples;
	void *storage;             /* of all arrays */
	size_t storage_size;
};

int plan_make(struct plan *plan, const struct psr_scene *scene, const struct render_settings *settings,
              struct psr_error *err);
void plan_clear(struct plan *plan);

/* Centre of an instance's inner coordinates relative to a point, its rotation, and inner units in world units. */
double plan_place(double center[3], double rotation[3][3], const struct psr_instance *instance, const double from[3]);

/* Instance that a slot belongs to; the slot must be below n_slots. */
uint32_t plan_find_instance(const struct plan *plan, uint32_t slot);

/* ---- effects: what was run, and why the rest was not ---- */

void effect_note(struct psr_report *report, enum psr_effect effect, enum psr_why why, uint64_t count);

/* ---- cull: one level of each group of clusters, blocks in view, sorted into tiles ([G] 6.1) ---- */

/* Of a group of clusters, drawn is that of the coarsest level whose spacing is at most a pixel (or what the settings
 * say) as near as its blocks reach, so that they need no depth buffer but the picture's; the finest if there is none. */
struct cull_group {
	uint8_t level; /* of the cluster that is drawn */
	uint8_t fits;
};

/* A block that is left, and where it may show. */
struct cull_hit {
	uint32_t slot;
	float near;                 /* no sample's z' is less */
	uint16_t x0, x1, y0, y1;    /* pixels, inclusive, with the guard band */
	uint16_t instance;
	uint8_t level;
	uint8_t is_mixed : 1, at_border : 1; /* as of bin_entry */
	uint8_t tile_x0, tile_x1, tile_y0, tile_y1; /* inclusive */
};

struct bins { /* capacities are in bytes */
	struct bin_entry *entry;
	size_t entry_capacity;
	uint32_t *tile_begin;    /* n_tiles + 1 */
	size_t tile_capacity;
	uint64_t *by_work;       /* tiles, in the lower halves: those of most entries first, since the last that are begun
	                          * are what threads wait for */
	size_t by_work_capacity;
	uint8_t *is_quiet;       /* as plan.is_quiet */
	size_t quiet_capacity;
	struct cull_chunk *chunk;
	size_t chunk_capacity;
	struct cull_hit *hit;    /* one a block that is left, by chunk */
	size_t hit_capacity;
	uint32_t *order;         /* one an entry, for the thread that draws its tile */
	size_t order_capacity;
	struct screen_masks *masks; /* of all instances */
	size_t masks_capacity;
	struct cull_group *group; /* of all instances */
	size_t group_capacity;
	uint32_t *count;         /* chunk by tile */
	size_t count_capacity;
};

/* Also notes in plan->view what the blocks that are left need. */
int cull_blocks(struct bins *bins, const struct simd *simd, struct plan *plan, struct psr_pool *pool,
                struct psr_report *report);
size_t bins_bytes(const struct bins *bins);
void bins_clear(struct bins *bins);

/* ---- warp: samples to words and cells, by tile ([G] 7.1, 7.2) ---- */

struct warp_counts {
	uint64_t n_inside;   /* samples that fell into the tile and do not face away */
	uint32_t n_occluded; /* blocks that were left out there */
	int with_occlusion;
};

/* Words to be left between the rows of a picture: so many that pixels one below the other differ in the lower 12 bits
 * of their addresses, by which a core tells a load from the stores before it, and lie in different sets of its first
 * cache. */
uint32_t warp_gap(uint32_t width);

static inline int plan_is_quiet(const struct plan *plan, uint32_t x, uint32_t y)
{
	return plan->is_quiet && plan->is_quiet[y / PART_HEIGHT * plan->parts_x + x / PART_WIDTH];
}

/* The bits of a tile's parts that are 1 in a map of the picture's parts, and of those outside of the picture. */
uint32_t warp_parts(const struct plan *plan, const uint8_t *map, uint32_t tile);

/* A tile of the stack, with nothing clean or bare. Its words are where the picture has them, unless `own` has room for
 * them. */
void warp_target_make(struct warp_target *target, const struct plan *plan, const struct psr_zstack *stack,
                      uint32_t tile, uint64_t *own);

/* Clears a tile but for parts that are clean, by bits, and draws its blocks. Its words are the stack's, or, where `own`
 * is not NULL, WARP_OWN_WORDS there in rows WARP_OWN_STRIDE apart, for who needs no others: they stay in a cache. Cells
 * are the stack's always. */
#define WARP_OWN_STRIDE (TILE_WIDTH + 8)
#define WARP_OWN_WORDS (WARP_OWN_STRIDE * TILE_HEIGHT)
struct warp_counts warp_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                             struct psr_zstack *stack, uint32_t tile, uint32_t clean, uint64_t *own);

/* The same with splats: each sample is a disc about it, of its projection's plane brought onto the surface's, which
 * reaches its neighbours' ([B] 3). Cells are the samples', for splat_close: of two pixels where blocks need none. */
struct warp_counts splat_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                              struct psr_zstack *stack, uint32_t tile, uint32_t clean);

/* Lists the discs of a block in the place of drawing them: what of them lies in the tile, whose stride places have. */
struct sheer_list;
void splat_list(const struct plan *plan, const struct bin_entry *entry, const struct warp_target *target,
                struct sheer_list *list);

/* How much further away a block's discs count as at their rims than in their planes, in z': a step of its lattice. */
float splat_rim(const struct plan_instance *in, uint32_t block);

/* Pixels of a picture that are well inside of what its plain frame covers; the frame's pixel (0, 0) is sub-pixel (left,
 * top) of the picture, which has 2^pass along the side of a pixel. */
struct inside {
	const uint8_t *is_inside; /* width in a row */
	uint32_t width, left, top;
	unsigned pass;
};

/* Discs do not meet everywhere. Two kinds of pixels get weight 0 and mark their brick: those that are inside (NULL:
 * nothing is known of that) and lie behind samples in each of the 3 x 3 cells about them by more than their level's
 * threshold, in a gap as narrow as a crack between such samples unless these are magnified; or before nothing and
 * within a cell, or 64 pixels, of something in two opposite directions where cells
 * are wider than two pixels of the picture; and those before nothing, or behind by more than level 1's threshold,
 * where one surface is within a cell, or some pixels, in each of eight directions. Of rows y0..y1-1, after gaps_rows.
 * Returns how many there are. */
uint32_t splat_close(const struct plan *plan, const struct psr_zstack *stack, const struct inside *inside, uint32_t y0,
                     uint32_t y1, uint16_t *weight, uint8_t *bricks);

/* ---- gaps: weights from the level buffers, and a guard against pinholes ([G] 4.6, 9.1.2) ---- */

#define BRICK GAPS_BRICK /* pixels a side; bricks are numbered in rows, those at the border may be cut off */

/* Weights of rows y0..y1-1, of which y0 is a multiple of BRICK and y1 is, too, or the height: WEIGHT_ONE * (1 -
 * coverage), by what is nearer than the pixel by more than the level's threshold; empty pixels are at infinity. A
 * pinhole has weight 0: a pixel that at least seven of its eight neighbours are before by more than level 1's
 * threshold, where those are one surface (within level 1's threshold of each other, or level 4's where the pixel is
 * empty). Sets bricks[i] to 1 where brick i has a weight below WEIGHT_ONE, else to 0. `weight` and `bricks` are of the
 * whole picture. A pure function of words and cells. */
struct gaps_counts gaps_rows(const struct simd *simd, const struct plan *plan, const struct psr_zstack *stack,
                             uint32_t y0, uint32_t y1, uint16_t *weight, uint8_t *bricks);

/* ---- shade: words to linear colours ([G] 7.3) ---- */

struct shade_counts {
	uint64_t n_pixels;   /* shaded */
	uint64_t n_specular; /* of these with highlights looked for */
	uint64_t resolve_ns, shade_ns; /* of a part of the strips */
	uint64_t row_ns, fill_ns;      /* of all that is done to a row of bricks, and of what fill does then */
};

/* Diffuse light by normal ([B] 4.1): PSR_DIRECTIONS rows; and whether that is worth while. */
enum psr_why shade_wants_table(const struct plan *plan);
void shade_tabulate(const struct simd *simd, const struct plan *plan, struct psr_pool *pool, float (*lit)[4]);

struct shade_target {
	uint8_t *rgb;         /* sRGB, 3 * width * height, or NULL */
	const uint8_t *srgb;  /* 8 bits of 16-bit linear light */
	uint16_t *r, *g, *b;  /* linear light, width * height: written in bricks that are wanted */
	const uint8_t *wants; /* one byte a brick, as of fill_wants; NULL: none */
};

/* Gives the pixels of rows y0..y1-1, at least one, their colours: samples of weight above 0, lit, and the background
 * where none is; without rgb, counts samples alone. `weight` is of the whole picture. Adds to the counts. */
void shade_rows(const struct simd *simd, const struct plan *plan, const struct shade_target *target,
                const struct psr_zstack *stack, const uint16_t *weight, uint32_t y0, uint32_t y1,
                struct shade_counts *counts);

/* Lights the samples of n words, STRIP at most, which begin at pixel (x, y) and at a whole strip. Colours are those of
 * pixels->x in strip->r, g and b. Returns how many there are. */
uint32_t shade_part(const struct simd *simd, const struct plan *plan, const uint64_t *word, uint32_t x, uint32_t y,
                    uint32_t n, struct strip_pixels *pixels, struct strip *strip);

/* ---- planes: what else is known of a row's pixels ---- */

/* Writes those of the planes normal, id, block, weight and words that the frame has, before the fill changes
 * weights. */
void planes_row(const struct simd *simd, const struct plan *plan, const struct psr_frame *frame, const uint64_t *word,
                const uint16_t *weight, uint32_t y);

/* ---- fill: pull-push ([G] 4.7, appendix) ---- */

#define FILL_LEVELS 15      /* 2^14 is the largest side */
#define FILL_BRICK_LEVELS 5 /* a brick is one cell there */

/* Cells of one level with a border that is not in the picture; `cell` is the one at (left, top). */
struct fill_level {
	uint32_t width, height; /* of the picture */
	int32_t left, top;
	uint32_t stride;
	struct fill_row cell;
};

/* What is filled. The linear colours r, g, b of pixels with weight above 0, the background's too, are valid in all
 * bricks that fill_wants names. */
struct fill_picture {
	const struct psr_zstack *stack;
	uint16_t *weight;      /* of pixels that are filled it becomes WEIGHT_ONE */
	const uint8_t *bricks; /* as gaps_rows marks them */
	uint16_t *r, *g, *b;
	const uint8_t *srgb;   /* 8 bits of 16-bit linear light */
	uint8_t *rgb;          /* 3 * width * height, or NULL */
	float *depth;          /* world units, or NULL */
};

struct fill {
	struct fill_level level[FILL_LEVELS]; /* of 1..top, the single cell */
	int top, brick_top;                   /* brick_top: the coarsest that bricks are pulled to by themselves */
	uint32_t width, height, bricks_x, bricks_y;
	uint8_t *pulled;  /* by brick: up to which level weights and depths are pulled */
	uint8_t *whole;   /* by brick: the finest level whose cells are whole there; brick_top + 1: none; 0: not marked */
	uint8_t *needs;   /* by brick that is marked: the greatest of `whole` around it */
	uint32_t *left;   /* by brick, a bit a row: pixels may be left that are not whole */
	uint8_t *wants;   /* by brick: how many levels are pulled from it */
	uint8_t *coarse;  /* by cell of levels from brick_top: enum fill_coarse */
	size_t coarse_first[FILL_LEVELS], n_coarse;
	int is_coarse;    /* some brick needs levels beyond brick_top */
	int needed;       /* the greatest of `needs` */
	int pushed;       /* the level that is being pushed */
	void *storage;
	size_t storage_size;
	/* The picture under way. */
	const struct simd *simd;
	const struct plan *plan;
	struct fill_picture picture;
	_Atomic int deepest; /* coarsest level with a cell of weight below a half, which has a coarser one's depth */
	_Atomic uint64_t n_changed, n_filled, n_moved; /* as of fill_counts */
};

/* A picture is filled in four steps. Those by row of bricks are for any thread, in any order; each step begins when the
 * one before is done. They come where the row's pixels are at hand: looking after gaps_rows, pulling after shading. */
int fill_begin(struct fill *fill, const struct simd *simd, const struct plan *plan, const struct fill_picture *picture);
void fill_clear(struct fill *fill);

/* 1. How far the row's bricks need coarser levels, from weights and depths. */
void fill_look(struct fill *fill, uint32_t row);

/* 2. What that takes from others: one byte a brick, not 0 where the 16-bit colours of the brick's pixels are needed. */
const uint8_t *fill_wants(struct fill *fill);

/* 3. Coarser levels from the row's colours, where they are needed; and what the next step does, for the pixels for
 * which that is enough. */
void fill_pull(struct fill *fill, uint32_t row);

/* 4. Gives every pixel of weight below WEIGHT_ONE its color and, where the weight is below a half, its depth, and
 * touches no other pixel of rgb and depth. Adds the counts and the error bound of the stage to the report. */
void fill_push(struct fill *fill, struct psr_pool *pool, struct psr_report *report);

/* -- between fill.c and fill_bricks.c -- */

static inline struct fill_row fill_row_at(const struct fill_level *level, int32_t x, int32_t y)
{
	const ptrdiff_t at = (ptrdiff_t)(y - level->top) * (ptrdiff_t)level->stride + (x - level->left);
	const struct fill_row *cell = &level->cell;
	return (struct fill_row){ cell->r + at,      cell->g + at, cell->b + at,
		                      cell->weight + at, cell->z + at, cell->near + at };
}

float fill_scale(const struct plan *plan, int level); /* of the threshold among cells of `level` */
float fill_offset(const struct plan *plan, int level);
void fill_note_depth(struct fill *fill, int level);

enum fill_coarse { FILL_PULLED = 1, FILL_NEEDED = 2 };
/* Pulls weights and depths of bricks bx0..bx1-1 of brick row `by` to a level, from the one before; returns the least
 * weight. */
uint16_t fill_pull_weights(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int level);

/* Then their colours. */
void fill_pull_colors(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int level);

/* Makes their cells of a level whole, from those of the next: early those that look at nothing but whole cells of these
 * and the bricks beside them, then the others. */
void fill_push_level(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int level, int is_early);

/* Pixels; moved: of another depth than their own. */
struct fill_counts {
	uint32_t n_changed, n_filled, n_moved;
};

/* The same for their pixels. Adds to the counts. */
void fill_push_bricks(struct fill *fill, struct fill_counts *counts, uint32_t bx0, uint32_t bx1, uint32_t by,
                      int is_early);

/* ---- smooth: anti-aliasing ([G] 9.1.1) ---- */

/* A picture before it is smoothed: 3 * width * height, and its depths in world units. */
struct smooth {
	uint8_t *rgb;
	float *depth;
	void *storage;
	size_t storage_size;
	_Atomic uint64_t n_edges; /* of the picture under way */
};

/* Room for a picture, and for its depths, which are elsewhere unless `depth` is NULL. */
int smooth_begin(struct smooth *smooth, const struct plan *plan, float *depth);
void smooth_clear(struct smooth *smooth);

/* Smooths the picture into `rgb`. Returns how many pixels are at an edge. */
uint64_t smooth_picture(struct smooth *smooth, const struct simd *simd, const struct plan *plan, struct psr_pool *pool,
                        uint8_t *rgb);

/* ---- sheer: surfaces that let a part of the light through, over the finished picture ---- */

struct sheer {
	struct sheer_tile *tile; /* one a thread that has drawn any */
	int n_tiles;
	float *depth;
	size_t depth_size;
};

/* What a tile's blocks show, all of it: by place, words from the nearest on. */
struct sheer_list {
	const float *before; /* z' of what hides what is behind it */
	uint32_t *first;     /* SHEER_END: there is none */
	struct sheer_word {
		uint64_t word;
		uint32_t next;
	} *word;
	uint32_t n, capacity;
	int failed;          /* there was no memory */
};
#define SHEER_END UINT32_MAX

/* Room for more. MEMORY, which the list notes, too. */
int sheer_grow(struct sheer_list *list);

static inline void sheer_add(struct sheer_list *list, uint32_t at, uint64_t word)
{
	uint32_t *link = &list->first[at];
	if (list->n == list->capacity && sheer_grow(list))
		return;
	while (*link != SHEER_END && list->word[*link].word < word)
		link = &list->word[*link].next;
	list->word[list->n] = (struct sheer_word){ word, *link };
	*link = list->n++;
}

/* Moves the sheer entries of a tile behind its other ones, which alone are warped, and returns the first. In a shadow map
 * those that keep back half of the light or more are like others, and the rest casts none. */
uint32_t sheer_begin(const struct plan *plan, const struct bins *bins, uint32_t tile);

/* Adds blocks of a tile: samples in pixels where they are a pixel apart at most and the picture has no splats, else
 * discs. */
void sheer_list_blocks(struct sheer_list *list, const struct plan *plan, const struct bin_entry *entry, uint32_t n,
                       const struct warp_target *target);

/* A picture without sheer surfaces: sRGB or NULL, and its depths in world units. */
struct sheer_picture {
	uint8_t *rgb;
	const uint8_t *srgb; /* 8 bits of 16-bit linear light */
	float *depth;
	int exponent; /* of the stack */
};

/* Room for its depths, where nobody else has any. NULL: there is no memory. */
float *sheer_depths(struct sheer *sheer, const struct plan *plan);

/* Draws its sheer surfaces over it, the nearest of a pixel over those behind it, eight at most: each keeps back as much
 * of what is behind it as its opacity says. The depth becomes that of the nearest one where these keep back half of the
 * light, or where nothing is behind them. *n_pixels: pixels with any. A pure function of picture, plan and bins.
 * MEMORY. */
int sheer_draw(struct sheer *sheer, const struct simd *simd, const struct plan *plan, const struct bins *bins,
               const struct sheer_picture *picture, struct psr_pool *pool, uint64_t *n_pixels);
void sheer_clear(struct sheer *sheer);
uint64_t sheer_bytes(const struct sheer *sheer);

/* ---- for refinement: what the plain frame covers ---- */

/* 1 where the plain frame has a sample, or cells cover at least half of a pixel; width * height. */
int renderer_cover(struct psr_renderer *renderer, const struct psr_scene *scene, const struct render_settings *settings,
                   struct psr_pool *pool, uint8_t *is_covered, struct psr_error *err);

/* What frames with splats are inside of from now on; NULL: nothing is known. It must hold while they are drawn. */
void renderer_set_inside(struct psr_renderer *renderer, const struct inside *inside);

/* ---- for tests: a renderer that calls other kernels ---- */

void renderer_use(struct psr_renderer *renderer, const struct simd *simd);

#endif
