#include <string.h>
#include "base/clock.h"
#include "base/direction.h"
#include "base/mem.h"
#include "ewa.h"
#include "planes.h"
#include "renderer.h"

static void warp_one(int i, void *userdata)
{
	struct psr_renderer *r = userdata;
	struct buffers *b = &r->buffers;
	const struct band *band = &b->band[i];
	const uint32_t tile = band->tile;
	const int is_empty = r->bins.tile_begin[tile + 1] == r->bins.tile_begin[tile];
	const uint32_t clean = warp_parts(&r->plan, b->is_clean, tile);
	const struct warp_into into = { &b->stack, clean, NULL, b->sum };
	/* Where samples are half a plain pixel apart or less: magnified stills keep their whole discs. */
	const unsigned cut_below = r->inside != NULL ? r->inside->pass : 0;
	const struct splat_into discs = { &b->stack, clean, b->offcuts, cut_below };

	b->warp[i] = (struct warp_counts){ 0, 0, 0 };
	if (r->plan.with_splats)
		b->warp[i] = splat_tile(r->simd, &r->plan, &r->bins, &discs, tile);
	else if (band->y1 - band->y0 < TILE_HEIGHT)
		b->warp[i] = warp_band(r->simd, &r->plan, &r->bins, &into, band);
	else if (!is_empty || clean != ALL_PARTS)
		b->warp[i] = warp_tile(r->simd, &r->plan, &r->bins, &into, tile);
	if (r->plan.with_ewa && !is_empty)
		ewa_tile(r->simd, &r->plan, &r->bins, &into, tile);
}

/* Draws the words and cells of all tiles. */
static int warp_tiles(struct psr_renderer *r, struct psr_pool *pool, struct psr_report *report)
{
	const struct plan *plan = &r->plan;
	struct buffers *b = &r->buffers;
	const int n = (int)bands_make(b->band, plan, &r->bins, b->stack.levels, psr_pool_threads(pool));
	uint64_t n_occluded = 0;
	int with_occlusion = 0;

	if (psr_pool_for_until(pool, &plan->cancel, n, warp_one, r)) {
		buffers_forget(b);
		return PSR_ERR_CANCELLED;
	}
	memcpy(b->is_clean, r->bins.is_quiet, (size_t)plan->parts_x * plan->parts_y);
	for (int i = 0; i < n; i++) {
		report->count[PSR_STAGE_WARP] += b->warp[i].n_inside;
		n_occluded += b->warp[i].n_occluded;
		with_occlusion |= b->warp[i].with_occlusion;
	}
	const enum psr_why no_occlusion = plan->cull_tests & PSR_CULL_OCCLUSION ? PSR_WHY_COST : PSR_WHY_OFF;
	effect_note(report, PSR_EFFECT_OCCLUSION, with_occlusion ? PSR_WHY_RAN : no_occlusion, n_occluded);
	return PSR_OK;
}

/* A call of renderer_warp or psr_render, or a part of one. */
struct call {
	const struct psr_scene *scene;
	const struct render_settings *settings;
	struct psr_pool *pool;
	struct psr_error *err;
};

/* Ends a stage that began at *start. */
static void note_time(struct psr_report *report, enum psr_stage stage, uint64_t *start)
{
	const uint64_t end = clock_ns();

	report->ns[stage] += end - *start;
	*start = end;
}

/* From the request to the z-buffer. Keeps the shadow maps of earlier frames as they are unless the frame is lit. */
static int make_stack(struct psr_renderer *r, const struct call *call, int is_lit)
{
	const struct render_settings *settings = call->settings;
	struct psr_report *report = &r->report;
	struct psr_error *err = call->err;
	int rc = settings_validate(settings, err);

	if (rc == PSR_OK)
		rc = psr_scene_validate(call->scene, err);
	if (rc)
		return rc;
	psr_pool_wake(call->pool);
	memset(report, 0, sizeof *report);
	uint64_t start = clock_ns();
	rc = plan_make(&r->plan, call->scene, settings, err);
	if (rc)
		return rc;
	report->count[PSR_STAGE_PLAN] = r->plan.n_instances;
	representations_note(report, call->scene);
	note_time(report, PSR_STAGE_PLAN, &start);

	const struct shadow_call shadow = {
		&r->plan.cancel, r->simd, &r->bins, call->scene, call->pool, report, err,
	};
	if (is_lit)
		rc = shadow_prepare(&r->shadow, &r->plan, &shadow);
	else
		effect_note(report, PSR_EFFECT_SHADOWS, PSR_WHY_OFF, 0);
	if (rc)
		return rc;
	note_time(report, PSR_STAGE_SHADOW, &start);

	rc = cull_blocks(&r->bins, r->simd, &r->plan, call->pool, report);
	if (rc == PSR_ERR_LIMIT)
		return psr_fail(err, rc, "too many blocks for a picture of this size");
	if (rc == PSR_ERR_CANCELLED)
		return render_cancelled(err);
	if (rc || buffers_prepare(&r->buffers, &r->plan, report->levels))
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a picture of %ux%u", settings->width, settings->height);
	if (r->plan.with_ewa) {
		r->plan.view.sum = r->buffers.sum;
		r->plan.view.sum_stride = r->plan.width;
	}
	if (r->plan.is_full)
		memset(r->buffers.is_clean, 0, (size_t)r->plan.parts_x * r->plan.parts_y);
	else
		r->plan.is_quiet = r->bins.is_quiet;
	note_time(report, PSR_STAGE_CULL, &start);

	rc = warp_tiles(r, call->pool, report);
	note_time(report, PSR_STAGE_WARP, &start);
	return rc ? render_cancelled(err) : PSR_OK;
}

int renderer_warp(struct psr_renderer *r, const struct psr_scene *scene, const struct render_settings *settings,
                  struct psr_pool *pool, struct psr_zstack **stack, struct psr_error *err)
{
	const struct call call = { scene, settings, pool, err };
	fenv_t callers;

	set_environment(&callers);
	const int rc = make_stack(r, &call, 1);
	fesetenv(&callers);
	if (rc == PSR_OK)
		*stack = &r->buffers.stack;
	return rc;
}

static struct gaps_map map_of(const struct psr_renderer *r)
{
	return (struct gaps_map){ r->buffers.weight, r->buffers.bricks };
}

/* Finds the gaps of a row of bricks. */
static struct gaps_counts find_row_gaps(struct psr_renderer *r, const struct psr_zstack *stack, int row)
{
	const struct gaps_map map = map_of(r);

	return gaps_rows(r->simd, &r->plan, stack, (uint32_t)row * BRICK, brick_row_end(&r->plan, (uint32_t)row), &map);
}

static void gaps_one(int row, void *userdata)
{
	struct psr_renderer *r = userdata;
	struct buffers *b = &r->buffers;
	const struct gaps_map map = map_of(r);
	const uint32_t y0 = (uint32_t)row * BRICK, y1 = brick_row_end(&r->plan, (uint32_t)row);
	const struct splat_picture splats = { r->simd, &r->plan, &b->stack, r->inside, b->offcuts };
	struct psr_zstack stack = b->stack;

	if (r->plan.with_splats)
		stack.levels = 0; /* discs, not cells, cover what is behind them */
	b->gaps[row] = find_row_gaps(r, &stack, row);
	if (r->plan.with_splats)
		b->gaps[row].n_marked += splat_close(&splats, y0, y1, &map);
	fill_look(&r->fill, (uint32_t)row);
}

static void outline_one(int row, void *userdata)
{
	struct psr_renderer *r = userdata;
	const struct buffers *b = &r->buffers;
	const uint32_t y0 = (uint32_t)row * BRICK, y1 = brick_row_end(&r->plan, (uint32_t)row), width = r->plan.width;

	find_row_gaps(r, &b->stack, row);
	for (uint32_t y = y0; y < y1; y++) {
		const uint64_t *word = psr_zstack_row(&b->stack, y);
		const size_t first = (size_t)y * width;

		for (uint32_t x = 0; x < width; x++)
			r->is_object[first + x] = word[x] != PSR_WORD_EMPTY || b->weight[first + x] < WEIGHT_ONE / 2;
	}
}

int renderer_outline(struct psr_renderer *r, const struct psr_scene *scene, const struct render_settings *settings,
                     struct psr_pool *pool, uint8_t *is_object, struct psr_error *err)
{
	const struct call call = { scene, settings, pool, err };
	fenv_t callers;

	set_environment(&callers);
	int rc = make_stack(r, &call, 0);
	r->is_object = is_object;
	if (rc == PSR_OK && psr_pool_for_until(pool, &settings->cancel, (int)n_brick_rows(&r->plan), outline_one, r))
		rc = render_cancelled(err);
	fesetenv(&callers);
	return rc;
}

static void shade_one(int row, void *userdata)
{
	struct psr_renderer *r = userdata;
	const struct plan *plan = &r->plan;
	struct shade_counts counts = { 0 };
	const struct buffers *b = &r->buffers;
	const uint32_t y0 = (uint32_t)row * BRICK, y1 = brick_row_end(plan, (uint32_t)row);
	const uint64_t start = clock_ns();

	shade_rows(r->simd, plan, &r->picture, y0, y1, &counts);
	for (uint32_t y = y0; y < y1; y++) {
		const size_t first = (size_t)y * plan->width;
		const uint64_t *word = psr_zstack_row(&b->stack, y);

		if (r->depth != NULL)
			r->simd->depth_row(r->depth + first, word, plan->width, b->stack.exponent);
		if (r->has_planes && !plan_is_cancelled(plan))
			planes_row(r->simd, plan, r->frame, word, b->weight + first, y);
		if (r->place != NULL)
			r->simd->smooth_places(r->place + first, word, b->weight + first, plan->width);
	}
	const uint64_t middle = clock_ns();
	if (r->picture.wants != NULL)
		fill_pull(&r->fill, (uint32_t)row);
	counts.row_ns = middle - start;
	counts.fill_ns = clock_ns() - middle;
	b->shade[row] = counts;
}

/* Finds gaps, and how many bricks they mark. */
static int find_gaps(uint32_t *n_marked, struct psr_renderer *r, struct psr_pool *pool, struct psr_report *report)
{
	const int n = (int)n_brick_rows(&r->plan);
	const int rc = psr_pool_for_until(pool, &r->plan.cancel, n, gaps_one, r);

	*n_marked = 0;
	for (int i = 0; i < n && rc == PSR_OK; i++) {
		*n_marked += r->buffers.gaps[i].n_marked;
		report->count[PSR_STAGE_GAPS] += r->buffers.gaps[i].n_partial;
	}
	return rc;
}

static int tabulate(struct psr_renderer *r, struct psr_pool *pool, struct psr_report *report)
{
	const enum psr_why why = r->plan.is_full || !has_colors(r) ? PSR_WHY_OFF : shade_wants_table(&r->plan);

	effect_note(report, PSR_EFFECT_TABLE, why, PSR_DIRECTIONS);
	if (why != PSR_WHY_RAN)
		return PSR_OK;
	r->lit = psr_grow_huge(r->lit, &r->lit_size, PSR_DIRECTIONS * sizeof *r->lit);
	if (r->lit == NULL)
		return PSR_ERR_MEMORY;
	const int rc = shade_tabulate(r->simd, &r->plan, pool, r->lit);
	r->plan.view.lit = (const float(*)[4])r->lit;
	return rc;
}

/* Draws sheer surfaces over the frame. */
static int add_sheer(struct psr_renderer *r, struct psr_pool *pool, struct psr_report *report)
{
	const struct psr_frame *planes = r->has_planes ? r->frame : NULL;
	uint16_t *const *wide = r->buffers.rgb;
	const struct sheer_picture picture = {
		r->frame->rgb, { wide[0], wide[1], wide[2] }, r->srgb, r->depth, planes, r->buffers.stack.exponent,
	};
	const int is_wanted = has_colors(r) || r->depth != NULL, is_drawn = is_wanted && r->plan.has_sheer;
	const enum psr_why none = is_wanted ? PSR_WHY_NOTHING : PSR_WHY_OFF;
	const struct sheer *sheer = &r->sheer;
	const int rc = is_drawn ? sheer_draw(&r->sheer, r->simd, &r->plan, &r->bins, &picture, pool) : PSR_OK;

	effect_note(report, PSR_EFFECT_SHEER, is_drawn && sheer->glass.any_blocks ? PSR_WHY_RAN : none,
	            sheer->glass.n_pixels);
	effect_note(report, PSR_EFFECT_VEILS, is_drawn && sheer->thin.any_blocks ? PSR_WHY_RAN : none,
	            sheer->thin.n_pixels);
	return rc;
}

/* Says why a stage failed: the frame was cancelled, or there is no memory for its purpose. */
static int explain(int rc, const struct psr_renderer *r, const char *purpose, struct psr_error *err)
{
	if (rc == PSR_ERR_CANCELLED)
		return render_cancelled(err);
	return psr_fail(err, rc, "no memory for %s a picture of %ux%u", purpose, r->plan.width, r->plan.height);
}

/* Finds where the stages write colours and depths: smoothing has a picture of its own, sheer surfaces need depths. */
static int begin_finish(struct psr_renderer *r, enum psr_why smooth, struct psr_error *err)
{
	const struct buffers *b = &r->buffers;
	uint8_t *rgb = r->frame->rgb;

	r->depth = r->frame->depth;
	r->place = NULL;
	if (smooth == PSR_WHY_RAN) {
		if (smooth_begin(&r->smooth, &r->plan, r->frame->depth))
			return explain(PSR_ERR_MEMORY, r, "smoothing", err);
		rgb = r->smooth.rgb;
		r->depth = r->smooth.depth;
		r->place = r->smooth.place;
	}
	if (r->plan.has_sheer && (has_colors(r) || r->has_planes) && r->depth == NULL) {
		r->depth = sheer_depths(&r->sheer, &r->plan);
		if (r->depth == NULL)
			return explain(PSR_ERR_MEMORY, r, "the depths of", err);
	}
	r->picture = (struct shade_picture){ &b->stack, b->weight, rgb, r->srgb, b->rgb[0], b->rgb[1], b->rgb[2], NULL };
	const struct fill_picture fill = { &b->stack, b->weight, b->bricks, b->rgb[0], b->rgb[1],
		                               b->rgb[2], r->srgb,   rgb,       r->depth };
	const int rc = fill_begin(&r->fill, r->simd, &r->plan, &fill);
	return rc ? explain(rc, r, "filling", err) : PSR_OK;
}

/* From gaps to colours without holes. */
static int shade_picture(struct psr_renderer *r, struct psr_pool *pool, struct psr_report *report,
                         struct psr_error *err)
{
	uint64_t start = clock_ns();
	uint32_t n_marked;

	int rc = find_gaps(&n_marked, r, pool, report);
	note_time(report, PSR_STAGE_GAPS, &start);
	n_marked = r->plan.no_fill ? 0 : n_marked;
	if (rc == PSR_OK && n_marked)
		r->picture.wants = fill_wants(&r->fill);
	note_time(report, PSR_STAGE_FILL, &start);
	if (rc == PSR_OK)
		rc = tabulate(r, pool, report);
	if (rc == PSR_OK)
		rc = psr_pool_for_until(pool, &r->plan.cancel, (int)n_brick_rows(&r->plan), shade_one, r);
	if (rc)
		return explain(rc, r, "the light of", err);
	const uint64_t shaded = clock_ns();
	shade_report(&r->plan, r->buffers.shade, shaded - start, has_colors(r), report);
	start = shaded;
	if (n_marked && fill_push(&r->fill, pool, report))
		return render_cancelled(err);
	note_time(report, PSR_STAGE_FILL, &start);
	const enum psr_why none = r->plan.no_fill ? PSR_WHY_OFF : PSR_WHY_NOTHING;
	effect_note(report, PSR_EFFECT_FILL, n_marked ? PSR_WHY_RAN : none, report->count[PSR_STAGE_FILL]);
	return PSR_OK;
}

/* From the z-buffer to the frame. */
static int finish_stack(struct psr_renderer *r, struct psr_zstack *stack, struct psr_pool *pool,
                        struct psr_frame *frame, struct psr_error *err)
{
	const enum psr_why smooth = !r->plan.is_smooth ? PSR_WHY_OFF : frame->rgb != NULL ? PSR_WHY_RAN : PSR_WHY_NOTHING;
	struct psr_report *report = &frame->report;

	if (stack != &r->buffers.stack)
		return psr_fail(err, PSR_ERR_ARG, "the z-stack belongs to another renderer");
	if (frame->width != stack->width || frame->height != stack->height)
		return psr_fail(err, PSR_ERR_ARG, "the frame has %ux%u pixels, the z-stack %ux%u", frame->width, frame->height,
		                stack->width, stack->height);
	*report = r->report;
	r->frame = frame;
	r->has_planes = frame->normal != NULL || frame->id != NULL || frame->block != NULL
	                || frame->weight != NULL || frame->words != NULL || frame->bound != NULL;
	int rc = begin_finish(r, smooth, err);
	if (rc == PSR_OK)
		rc = shade_picture(r, pool, report, err);
	if (rc)
		return rc;
	if (frame->bound != NULL)
		planes_bound_filled(frame);

	uint64_t start = clock_ns();
	if (smooth == PSR_WHY_RAN && smooth_picture(&r->smooth, r->simd, &r->plan, pool, frame->rgb))
		return render_cancelled(err);
	report->count[PSR_STAGE_SMOOTH] = smooth == PSR_WHY_RAN ? r->smooth.n_edges : 0;
	note_time(report, PSR_STAGE_SMOOTH, &start);
	effect_note(report, PSR_EFFECT_SMOOTH, smooth, report->count[PSR_STAGE_SMOOTH]);
	effect_note(report, PSR_EFFECT_FINE, PSR_WHY_OFF, 0); /* refiner_draw() says where it runs */
	rc = add_sheer(r, pool, report);
	note_time(report, PSR_STAGE_SHADE, &start);
	return rc ? explain(rc, r, "the sheer surfaces of", err) : PSR_OK;
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
	const struct call call = { scene, settings, pool, err };
	fenv_t callers;

	set_environment(&callers);
	int rc = make_stack(r, &call, frame->rgb != NULL || settings->is_wide);
	if (rc == PSR_OK)
		rc = finish_stack(r, &r->buffers.stack, pool, frame, err);
	fesetenv(&callers);
	return rc;
}
