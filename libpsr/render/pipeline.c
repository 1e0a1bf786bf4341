#include <fenv.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/maths.h"
#include "base/mem.h"
#include "base/srgb.h"
#include "base/direction.h"
#include "render.h"
#include "shadow.h"

struct psr_renderer {
	const struct simd *simd;
	struct plan plan;
	struct bins bins;
	struct shadow *shadow;    /* NULL until a light casts one */
	struct fill fill;
	struct smooth smooth;
	struct sheer sheer;
	struct psr_zstack stack;
	struct refiner *refiner;
	const struct inside *inside; /* of frames with splats, or NULL */
	uint8_t *is_covered;         /* of the call of renderer_cover in progress */
	struct psr_report report; /* of renderer_warp, until renderer_finish */
	struct psr_frame *frame;  /* of the call in progress */
	int has_planes;           /* it wants more than colour and depth */
	struct shade_target target;
	float *depth;             /* where its depths go, or NULL */
	/* All of a pixel, in one piece of memory: words, levels, linear colours by channel, weights. */
	void *pixels;
	size_t pixels_size;
	uint16_t *rgb[3], *weight;
	uint8_t *bricks; /* that gaps marked */
	struct warp_counts *tile;
	/* By row of bricks. */
	struct gaps_counts *gaps;
	struct shade_counts *shade;
	float (*lit)[4];          /* diffuse light by normal */
	size_t lit_size;
	/* One a part of the picture: 1 where words are empty since an earlier frame of the same layout; so are the cells of
	 * a tile of which all parts are clean. */
	uint8_t *is_clean;
	const void *clean_pixels; /* the layout: where, how large, and with which levels */
	uint32_t clean_width, clean_height, clean_levels;
	void *counters;
	size_t counters_size;
	uint8_t srgb[65536];      /* of 16-bit linear light */
};

static int validate(const struct psr_scene *scene, const struct render_settings *settings, struct psr_error *err)
{
	uint32_t w = settings->width, h = settings->height;
	if (w < 1 || h < 1)
		return psr_fail(err, PSR_ERR_ARG, "a picture of %ux%u has no pixels", w, h);
	if (w > PSR_MAX_SIDE || h > PSR_MAX_SIDE || (uint64_t)w * h > PSR_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "a picture of %ux%u is too large: at most %d a side and %u pixels", w, h,
		                PSR_MAX_SIDE, PSR_MAX_PIXELS);
	const struct psr_window *window = &settings->window;
	if (window->picture_width > PSR_MAX_PICTURE_SIDE || window->picture_height > PSR_MAX_PICTURE_SIDE
	    || !window->picture_width != !window->picture_height || window->left < -PSR_MAX_SIDE
	    || window->top < -PSR_MAX_SIDE || window->left > PSR_MAX_PICTURE_SIDE || window->top > PSR_MAX_PICTURE_SIDE)
		return psr_fail(err, PSR_ERR_ARG, "there is no window at (%d, %d) of a picture of %ux%u", (int)window->left,
		                (int)window->top, window->picture_width, window->picture_height);
	if (settings->cull_tests & ~(unsigned)PSR_CULL_ALL)
		return psr_fail(err, PSR_ERR_ARG, "there are no tests %#x to cull by", settings->cull_tests);
	if (!(settings->gap_threshold >= 0 && settings->gap_threshold <= 64))
		return psr_fail(err, PSR_ERR_ARG, "gap threshold %g is not within 0..64 pixels", settings->gap_threshold);
	if (settings->gap_method != PSR_GAPS_BILINEAR && settings->gap_method != PSR_GAPS_OPAQUE)
		return psr_fail(err, PSR_ERR_ARG, "there is no method %d to find gaps by", (int)settings->gap_method);
	if (!(settings->spacing_px >= 1.0 / 64 && settings->spacing_px <= 64))
		return psr_fail(err, PSR_ERR_ARG, "a spacing of %g is not within 1/64..64 pixels", settings->spacing_px);
	return psr_scene_validate(scene, err);
}

/* As the pool does for its functions: what runs outside of them must not see the caller's rounding either. */
static void set_environment(fenv_t *callers)
{
	fegetenv(callers);
	fesetenv(FE_DFL_ENV);
}

int psr_renderer_create(struct psr_renderer **out, struct psr_error *err)
{
	struct psr_renderer *r = calloc(1, sizeof *r);
	fenv_t callers;
	if (r == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a renderer");
	r->simd = simd_get();
	set_environment(&callers);
	for (int i = 0; i < 65536; i++)
		r->srgb[i] = psr_linear_to_srgb((float)i / 65535.0f);
	fesetenv(&callers);
	*out = r;
	return PSR_OK;
}

void renderer_use(struct psr_renderer *r, const struct simd *simd)
{
	r->simd = simd;
}

struct refiner **renderer_refiner(struct psr_renderer *r)
{
	return &r->refiner;
}

void psr_renderer_destroy(struct psr_renderer *r)
{
	if (r == NULL)
		return;
	refiner_destroy(r->refiner);
	plan_clear(&r->plan);
	shadow_destroy(r->shadow);
	bins_clear(&r->bins);
	fill_clear(&r->fill);
	smooth_clear(&r->smooth);
	sheer_clear(&r->sheer);
	psr_free_huge(r->pixels, r->pixels_size);
	psr_free_huge(r->lit, r->lit_size);
	psr_free_huge(r->counters, r->counters_size);
	free(r);
}

uint64_t psr_renderer_bytes(const struct psr_renderer *r)
{
	const uint64_t refiner = r->refiner ? refiner_bytes(r->refiner) : 0;
	return sizeof *r + refiner + r->plan.storage_size + r->fill.storage_size + r->smooth.storage_size + r->pixels_size +
	       sheer_bytes(&r->sheer) + r->lit_size + r->counters_size + bins_bytes(&r->bins) + shadow_bytes(r->shadow);
}

static uint32_t n_rows(const struct plan *plan)
{
	return (plan->height + BRICK - 1) / BRICK;
}

/* The end of a row of bricks, in pixels. */
static uint32_t row_end(const struct plan *plan, int row)
{
	const uint32_t end = ((uint32_t)row + 1) * BRICK;
	return end < plan->height ? end : plan->height;
}

static int prepare_buffers(struct psr_renderer *r, uint32_t levels)
{
	const uint32_t w = r->plan.width, h = r->plan.height;
	const size_t area = (size_t)w * h;
	struct psr_zstack *stack = &r->stack;
	const size_t rows = n_rows(&r->plan), n_bricks = rows * ((w + BRICK - 1) / BRICK);
	size_t n_words, cells = 0;
	float *next;

	stack->width = w;
	stack->gap = warp_gap(w);
	n_words = (size_t)(w + stack->gap) * h;
	stack->height = h;
	stack->levels = levels & ~1u;
	stack->exponent = r->plan.exponent;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		uint32_t side = 1u << k;
		stack->level[k].width = (w + side - 1) / side + 2;
		stack->level[k].height = (h + side - 1) / side + 2;
		if (stack->levels >> k & 1)
			cells += (size_t)stack->level[k].width * stack->level[k].height;
	}
	r->pixels = psr_grow_huge(r->pixels, &r->pixels_size, n_words * 8 + area * 4 * 2 + cells * 4 + n_bricks);
	const size_t n_tiles = (size_t)r->plan.tiles_x * r->plan.tiles_y;
	const size_t n_parts = (size_t)r->plan.parts_x * r->plan.parts_y;
	r->counters = psr_grow_huge(r->counters, &r->counters_size,
	                            n_tiles * sizeof *r->tile + n_parts + rows * (sizeof *r->gaps + sizeof *r->shade));
	if (r->pixels == NULL || r->counters == NULL)
		return PSR_ERR_MEMORY;
	r->tile = r->counters;
	r->shade = (struct shade_counts *)(r->tile + n_tiles);
	r->gaps = (struct gaps_counts *)(r->shade + rows);
	r->is_clean = (uint8_t *)(r->gaps + rows);

	stack->word = r->pixels;
	next = (float *)(stack->word + n_words);
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		stack->level[k].z = stack->levels >> k & 1 ? next : NULL;
		if (stack->level[k].z)
			next += (size_t)stack->level[k].width * stack->level[k].height;
	}
	r->weight = (uint16_t *)next;
	for (int k = 0; k < 3; k++)
		r->rgb[k] = r->weight + (size_t)(k + 1) * area;
	r->bricks = (uint8_t *)(r->rgb[2] + area);
	if (r->clean_pixels != r->pixels || r->clean_width != w || r->clean_height != h || r->clean_levels != stack->levels)
		memset(r->is_clean, 0, n_parts);
	r->clean_pixels = r->pixels;
	r->clean_width = w;
	r->clean_height = h;
	r->clean_levels = stack->levels;
	return PSR_OK;
}

static void warp_one(int i, void *userdata)
{
	struct psr_renderer *r = userdata;
	const struct plan *plan = &r->plan;
	const uint32_t tile = (uint32_t)r->bins.by_work[i];
	const int is_empty = r->bins.tile_begin[tile + 1] == r->bins.tile_begin[tile];
	const uint32_t clean = warp_parts(plan, r->is_clean, tile);
	r->tile[tile] = (struct warp_counts){ 0, 0, 0 };
	if (!is_empty || clean != ALL_PARTS)
		r->tile[tile] = plan->with_splats ? splat_tile(r->simd, plan, &r->bins, &r->stack, tile, clean)
		                                  : warp_tile(r->simd, plan, &r->bins, &r->stack, tile, clean, NULL);
}

/* Shadow maps are drawn if what the stack shows will be lit; else those of earlier frames stay as they are. */
static int make_stack(struct psr_renderer *r, const struct psr_scene *scene, const struct render_settings *settings,
                      int is_lit, struct psr_pool *pool, struct psr_zstack **stack, struct psr_report *report,
                      struct psr_error *err)
{
	int rc = validate(scene, settings, err);
	uint64_t start, end;

	if (rc)
		return rc;
	psr_pool_wake(pool);
	memset(report, 0, sizeof *report);
	start = clock_ns();
	rc = plan_make(&r->plan, scene, settings, err);
	if (rc)
		return rc;
	report->count[PSR_STAGE_PLAN] = r->plan.n_instances;
	report->ns[PSR_STAGE_PLAN] = (end = clock_ns()) - start;
	start = end;

	if (is_lit)
		rc = shadow_prepare(&r->shadow, r->simd, &r->plan, &r->bins, scene, pool, report, err);
	else
		effect_note(report, PSR_EFFECT_SHADOWS, PSR_WHY_OFF, 0);
	if (rc)
		return rc;
	report->ns[PSR_STAGE_SHADOW] = (end = clock_ns()) - start;
	start = end;

	rc = cull_blocks(&r->bins, r->simd, &r->plan, pool, report);
	if (rc == PSR_ERR_LIMIT)
		return psr_fail(err, rc, "too many blocks for a picture of this size");
	if (rc || prepare_buffers(r, report->levels))
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a picture of %ux%u", settings->width, settings->height);
	if (r->plan.is_full)
		memset(r->is_clean, 0, (size_t)r->plan.parts_x * r->plan.parts_y);
	else
		r->plan.is_quiet = r->bins.is_quiet;
	report->ns[PSR_STAGE_CULL] = (end = clock_ns()) - start;
	start = end;

	const int n_tiles = (int)(r->plan.tiles_x * r->plan.tiles_y);
	uint64_t n_occluded = 0;
	int with_occlusion = 0;
	psr_pool_for(pool, n_tiles, warp_one, r);
	memcpy(r->is_clean, r->bins.is_quiet, (size_t)r->plan.parts_x * r->plan.parts_y);
	for (int t = 0; t < n_tiles; t++) {
		report->count[PSR_STAGE_WARP] += r->tile[t].n_inside;
		n_occluded += r->tile[t].n_occluded;
		with_occlusion |= r->tile[t].with_occlusion;
	}
	const enum psr_why no_occlusion = settings->cull_tests & PSR_CULL_OCCLUSION ? PSR_WHY_COST : PSR_WHY_OFF;
	effect_note(report, PSR_EFFECT_OCCLUSION, with_occlusion ? PSR_WHY_RAN : no_occlusion, n_occluded);
	report->ns[PSR_STAGE_WARP] = clock_ns() - start;
	r->report = *report;
	*stack = &r->stack;
	return PSR_OK;
}

int renderer_warp(struct psr_renderer *r, const struct psr_scene *scene, const struct render_settings *settings,
             struct psr_pool *pool, struct psr_zstack **stack, struct psr_report *report, struct psr_error *err)
{
	fenv_t callers;
	set_environment(&callers);
	const int rc = make_stack(r, scene, settings, 1, pool, stack, report, err);
	fesetenv(&callers);
	return rc;
}

static void gaps_one(int row, void *userdata)
{
	struct psr_renderer *r = userdata;
	const uint32_t y0 = (uint32_t)row * BRICK, y1 = row_end(&r->plan, row);
	struct psr_zstack stack = r->stack;
	if (r->plan.with_splats)
		stack.levels = 0; /* discs cover for themselves */
	r->gaps[row] = gaps_rows(r->simd, &r->plan, &stack, y0, y1, r->weight, r->bricks);
	if (r->plan.with_splats)
		r->gaps[row].n_marked += splat_close(&r->plan, &r->stack, r->inside, y0, y1, r->weight, r->bricks);
	fill_look(&r->fill, (uint32_t)row);
}

static void cover_one(int row, void *userdata)
{
	struct psr_renderer *r = userdata;
	const uint32_t y0 = (uint32_t)row * BRICK, y1 = row_end(&r->plan, row), width = r->plan.width;
	gaps_rows(r->simd, &r->plan, &r->stack, y0, y1, r->weight, r->bricks);
	for (uint32_t y = y0; y < y1; y++) {
		const uint64_t *word = psr_zstack_row(&r->stack, y);
		for (uint32_t x = 0; x < width; x++)
			r->is_covered[(size_t)y * width + x] =
				word[x] != PSR_WORD_EMPTY || r->weight[(size_t)y * width + x] < WEIGHT_ONE / 2;
	}
}

int renderer_cover(struct psr_renderer *r, const struct psr_scene *scene, const struct render_settings *settings,
                   struct psr_pool *pool, uint8_t *is_covered, struct psr_error *err)
{
	struct psr_report report;
	struct psr_zstack *stack;
	fenv_t callers;
	set_environment(&callers);
	const int rc = make_stack(r, scene, settings, 0, pool, &stack, &report, err);
	r->is_covered = is_covered;
	if (rc == PSR_OK)
		psr_pool_for(pool, (int)n_rows(&r->plan), cover_one, r);
	fesetenv(&callers);
	return rc;
}

void renderer_set_inside(struct psr_renderer *r, const struct inside *inside)
{
	r->inside = inside;
}

static void shade_one(int row, void *userdata)
{
	struct psr_renderer *r = userdata;
	const struct plan *plan = &r->plan;
	struct shade_counts counts = { 0 };
	const uint32_t y0 = (uint32_t)row * BRICK, y1 = row_end(plan, row);
	const uint64_t start = clock_ns();
	shade_rows(r->simd, plan, &r->target, &r->stack, r->weight, y0, y1, &counts);
	for (uint32_t y = y0; y < y1; y++) {
		const size_t first = (size_t)y * plan->width;
		const uint64_t *word = psr_zstack_row(&r->stack, y);
		if (r->depth != NULL)
			r->simd->depth_row(r->depth + first, word, plan->width, r->stack.exponent);
		if (r->has_planes)
			planes_row(r->simd, plan, r->frame, word, r->weight + first, y);
	}
	const uint64_t middle = clock_ns();
	if (r->target.wants)
		fill_pull(&r->fill, (uint32_t)row);
	counts.row_ns = middle - start;
	counts.fill_ns = clock_ns() - middle;
	r->shade[row] = counts;
}

static uint64_t part_of(uint64_t wall, uint64_t one, uint64_t other)
{
	return one ? (uint64_t)((double)one / (double)(one + other) * (double)wall) : 0;
}

/* Wall time of the three stages that run together, divided as their own clocks say. */
static void report_shading(const struct psr_renderer *r, struct psr_report *report, uint64_t wall)
{
	struct shade_counts all = { 0 };
	for (uint32_t i = 0; i < n_rows(&r->plan); i++) {
		all.n_pixels += r->shade[i].n_pixels;
		all.n_specular += r->shade[i].n_specular;
		all.resolve_ns += r->shade[i].resolve_ns;
		all.shade_ns += r->shade[i].shade_ns;
		all.row_ns += r->shade[i].row_ns;
		all.fill_ns += r->shade[i].fill_ns;
	}
	const unsigned needs = r->frame->rgb ? r->plan.view.needs : 0;
	const enum psr_why none = r->frame->rgb ? PSR_WHY_NOTHING : PSR_WHY_OFF;
	effect_note(report, PSR_EFFECT_TWO_SIDED, needs & STRIP_TWO_SIDED ? PSR_WHY_RAN : none, all.n_pixels);
	effect_note(report, PSR_EFFECT_POSITIONS, needs & STRIP_POSITION ? PSR_WHY_RAN : none, all.n_pixels);
	effect_note(report, PSR_EFFECT_SPECULAR, all.n_specular ? PSR_WHY_RAN : none, all.n_specular);
	const uint64_t fill_ns = part_of(wall, all.fill_ns, all.row_ns);
	report->n_covered = all.n_pixels;
	report->count[PSR_STAGE_RESOLVE] = report->count[PSR_STAGE_SHADE] = r->frame->rgb ? all.n_pixels : 0;
	report->ns[PSR_STAGE_FILL] += fill_ns;
	report->ns[PSR_STAGE_RESOLVE] = part_of(wall - fill_ns, all.resolve_ns, all.shade_ns);
	report->ns[PSR_STAGE_SHADE] = wall - fill_ns - report->ns[PSR_STAGE_RESOLVE];
}

/* Returns how many bricks have a weight below 1. */
static uint32_t find_gaps(struct psr_renderer *r, struct psr_pool *pool, struct psr_report *report)
{
	const int n = (int)n_rows(&r->plan);
	uint32_t n_marked = 0;
	psr_pool_for(pool, n, gaps_one, r);
	for (int i = 0; i < n; i++) {
		n_marked += r->gaps[i].n_marked;
		report->count[PSR_STAGE_GAPS] += r->gaps[i].n_partial;
	}
	return n_marked;
}

static int tabulate(struct psr_renderer *r, struct psr_pool *pool, struct psr_report *report)
{
	const enum psr_why why = r->plan.is_full || !r->frame->rgb ? PSR_WHY_OFF : shade_wants_table(&r->plan);
	effect_note(report, PSR_EFFECT_TABLE, why, PSR_DIRECTIONS);
	if (why != PSR_WHY_RAN)
		return PSR_OK;
	r->lit = psr_grow_huge(r->lit, &r->lit_size, PSR_DIRECTIONS * sizeof *r->lit);
	if (r->lit == NULL)
		return PSR_ERR_MEMORY;
	shade_tabulate(r->simd, &r->plan, pool, r->lit);
	r->plan.view.lit = (const float(*)[4])r->lit;
	return PSR_OK;
}

static int add_sheer(struct psr_renderer *r, struct psr_pool *pool, struct psr_report *report)
{
	const struct sheer_picture picture = { r->frame->rgb, r->srgb, r->depth, r->stack.exponent };
	const int is_wanted = r->frame->rgb || r->frame->depth, is_drawn = is_wanted && r->plan.has_sheer;
	const enum psr_why why = is_drawn ? PSR_WHY_RAN : is_wanted ? PSR_WHY_NOTHING : PSR_WHY_OFF;
	uint64_t n_pixels = 0;
	if (is_drawn && sheer_draw(&r->sheer, r->simd, &r->plan, &r->bins, &picture, pool, &n_pixels))
		return PSR_ERR_MEMORY;
	effect_note(report, PSR_EFFECT_SHEER, why, n_pixels);
	return PSR_OK;
}

static int finish_stack(struct psr_renderer *r, struct psr_zstack *stack, struct psr_pool *pool,
                        struct psr_frame *frame, struct psr_error *err)
{
	uint64_t start, end;

	if (stack != &r->stack || frame->width != stack->width || frame->height != stack->height)
		return psr_fail(err, PSR_ERR_ARG, "the z-stack is not this renderer's, or of another size than the frame");
	struct psr_report *const report = &frame->report;
	*report = r->report;
	r->frame = frame;
	r->has_planes = frame->normal != NULL || frame->id != NULL || frame->block != NULL || frame->weight != NULL
	                || frame->words != NULL;

	const enum psr_why smooth = !r->plan.is_smooth ? PSR_WHY_OFF : frame->rgb ? PSR_WHY_RAN : PSR_WHY_NOTHING;
	uint8_t *rgb = frame->rgb;
	r->depth = frame->depth;
	if (smooth == PSR_WHY_RAN) {
		if (smooth_begin(&r->smooth, &r->plan, frame->depth))
			return psr_fail(err, PSR_ERR_MEMORY, "no memory for smoothing a picture of %ux%u", r->plan.width,
			                r->plan.height);
		rgb = r->smooth.rgb;
		r->depth = r->smooth.depth;
	}
	if (r->plan.has_sheer && frame->rgb && !r->depth)
		r->depth = sheer_depths(&r->sheer, &r->plan);
	if (r->plan.has_sheer && frame->rgb && !r->depth)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the depths of a picture of %ux%u", r->plan.width,
		                r->plan.height);
	r->target = (struct shade_target){ rgb, r->srgb, r->rgb[0], r->rgb[1], r->rgb[2], NULL };
	const struct fill_picture picture = { stack,     r->weight, r->bricks, r->rgb[0], r->rgb[1],
		                                  r->rgb[2], r->srgb,   rgb,       r->depth };
	if (fill_begin(&r->fill, r->simd, &r->plan, &picture))
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for filling a picture of %ux%u", r->plan.width, r->plan.height);
	start = clock_ns();
	const uint32_t n_marked = find_gaps(r, pool, report);
	report->ns[PSR_STAGE_GAPS] = (end = clock_ns()) - start;
	start = end;
	if (n_marked)
		r->target.wants = fill_wants(&r->fill);
	report->ns[PSR_STAGE_FILL] = (end = clock_ns()) - start;
	start = end;

	if (tabulate(r, pool, report))
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a table of light");
	psr_pool_for(pool, (int)n_rows(&r->plan), shade_one, r);
	report_shading(r, report, (end = clock_ns()) - start);
	start = end;
	if (n_marked)
		fill_push(&r->fill, pool, report);
	report->ns[PSR_STAGE_FILL] += (end = clock_ns()) - start;
	start = end;
	effect_note(report, PSR_EFFECT_FILL, n_marked ? PSR_WHY_RAN : PSR_WHY_NOTHING, report->count[PSR_STAGE_FILL]);
	if (smooth == PSR_WHY_RAN)
		report->count[PSR_STAGE_SMOOTH] = smooth_picture(&r->smooth, r->simd, &r->plan, pool, frame->rgb);
	end = clock_ns();
	report->ns[PSR_STAGE_SMOOTH] = end - start;
	start = end;
	effect_note(report, PSR_EFFECT_SMOOTH, smooth, report->count[PSR_STAGE_SMOOTH]);
	if (add_sheer(r, pool, report))
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for what one sees through, in a picture of %ux%u", r->plan.width,
		                r->plan.height);
	report->ns[PSR_STAGE_SHADE] += clock_ns() - start;
	return PSR_OK;
}

int renderer_finish(struct psr_renderer *r, struct psr_zstack *stack, struct psr_pool *pool, struct psr_frame *frame,
               struct psr_error *err)
{
	fenv_t callers;
	set_environment(&callers);
	const int rc = finish_stack(r, stack, pool, frame, err);
	fesetenv(&callers);
	return rc;
}

int renderer_draw(struct psr_renderer *r, const struct psr_scene *scene, const struct render_settings *settings,
               struct psr_pool *pool, struct psr_frame *frame, struct psr_error *err)
{
	struct psr_zstack *stack;
	fenv_t callers;
	int rc;

	set_environment(&callers);
	rc = make_stack(r, scene, settings, frame->rgb != NULL, pool, &stack, &frame->report, err);
	if (rc == PSR_OK)
		rc = finish_stack(r, stack, pool, frame, err);
	fesetenv(&callers);
	return rc;
}
