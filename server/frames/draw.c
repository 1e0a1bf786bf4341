#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/mem.h"
#include "draw.h"
#include "render/need.h"
#include "resolve.h"

#define CONTROL_BYTES 2048 /* room for FRAME_BEGIN, and for FRAME_END */

struct draw_worker {
	struct psr_renderer *renderer;
	uint8_t *pixels; /* of all planes */
	uint64_t capacity;
};

struct draw_worker *draw_worker_create(void)
{
	struct draw_worker *worker = calloc(1, sizeof *worker);

	if (worker != NULL && psr_renderer_create(&worker->renderer, NULL) != PSR_OK) {
		free(worker);
		return NULL;
	}
	return worker;
}

void draw_worker_destroy(struct draw_worker *worker)
{
	if (worker == NULL)
		return;
	psr_renderer_destroy(worker->renderer);
	psr_free(worker->pixels);
	free(worker);
}

uint64_t draw_worker_bytes(const struct draw_worker *worker)
{
	return psr_renderer_bytes(worker->renderer) + worker->capacity;
}

/* The codecs of a sharp frame lose nothing. */
static void sharpen(struct psr_msg_frame *request)
{
	if (!(request->planes >> PSR_PLANE_COLOR & 1) || request->color_codec == PSR_CODEC_RAW)
		return;
	request->color_codec = PSR_CODEC_ZSTD;
	request->color_quality = 0;
}

static void add_entry(struct psr_msg_frame_end *end, unsigned id, uint64_t ns, uint64_t count)
{
	end->entry[end->n_entries++] = (struct psr_msg_report_entry){ .id = (uint16_t)id, .ns = ns, .count = count };
}

/* Frames without a budget of time or error have none. */
static void add_price(struct psr_msg_frame_end *end, unsigned id, const struct budget_price *price)
{
	if (price->ns > 0)
		add_entry(end, id, (uint64_t)price->ns, psr_settings_pack(&price->settings));
}

static void add_rmse(struct psr_msg_frame_end *end, unsigned id, const struct budget_price *price)
{
	if (price->ns > 0 && price->has_rmse)
		add_entry(end, id, 0, (uint64_t)llround(price->rmse * PSR_WIRE_RMSE_ONE));
}

/* Names the beginning that lacks most levels. */
static void add_levels(struct psr_msg_frame_end *end, const struct scene *scene)
{
	struct psr_model_prefix most = { 0 };

	for (uint32_t i = 0; i < scene->n_models; i++) {
		const struct psr_model_prefix *prefix = &scene->model[i]->card.prefix;

		if (prefix->of_levels - prefix->levels > most.of_levels - most.levels)
			most = *prefix;
	}
	if (most.levels > 0)
		add_entry(end, PSR_WIRE_REPORT_LEVELS, 0, most.levels | most.of_levels << 8);
}

/* Says which colours stand for which numbers. */
static void add_scan(struct psr_msg_frame_end *end, const struct psr_scene *scene)
{
	struct psr_scan scan;

	psr_scene_scan(&scan, scene);
	if (scan.has_intensity)
		add_entry(end, PSR_WIRE_REPORT_INTENSITIES, 0, scan.low | (uint64_t)scan.high << 16);
	for (unsigned k = 0; k < 4; k++)
		if (scan.classes[k] != 0)
			add_entry(end, (uint16_t)(PSR_WIRE_REPORT_CLASSES + k), 0, scan.classes[k]);
	if (scan.has_return)
		add_entry(end, PSR_WIRE_REPORT_RETURNS, 0, scan.orders);
}

struct times { /* clock_ns() */
	uint64_t start_ns, drawn_ns, end_ns;
};

static void fill_report(struct psr_msg_frame_end *end, const struct drawing *d, const struct psr_report *report,
                        const struct times *times, uint64_t rect_bytes)
{
	static const unsigned stage_id[PSR_N_STAGES] = {
		[PSR_STAGE_PLAN] = PSR_WIRE_REPORT_PLAN, [PSR_STAGE_CULL] = PSR_WIRE_REPORT_CULL,
		[PSR_STAGE_WARP] = PSR_WIRE_REPORT_WARP, [PSR_STAGE_GAPS] = PSR_WIRE_REPORT_GAPS,
		[PSR_STAGE_RESOLVE] = PSR_WIRE_REPORT_RESOLVE, [PSR_STAGE_SHADE] = PSR_WIRE_REPORT_SHADE,
		[PSR_STAGE_FILL] = PSR_WIRE_REPORT_FILL,
	};

	for (int i = 0; i < PSR_N_STAGES; i++)
		if (stage_id[i])
			add_entry(end, stage_id[i], report->ns[i], report->count[i]);
	add_entry(end, PSR_WIRE_REPORT_ENCODE, times->end_ns - times->drawn_ns, rect_bytes);
	add_entry(end, PSR_WIRE_REPORT_QUEUE, times->start_ns - d->arrived_ns, d->n_waiting);
	add_entry(end, PSR_WIRE_REPORT_TOTAL, times->end_ns - times->start_ns, (uint64_t)psr_pool_threads(d->pool));
	add_entry(end, PSR_WIRE_REPORT_SHADOW, report->ns[PSR_STAGE_SHADOW], report->count[PSR_STAGE_SHADOW]);
	add_entry(end, PSR_WIRE_REPORT_SMOOTH, report->ns[PSR_STAGE_SMOOTH], report->count[PSR_STAGE_SMOOTH]);
	add_entry(end, PSR_WIRE_REPORT_CORES, pool_job_used_ns(), 0);
	add_price(end, PSR_WIRE_REPORT_CHOSEN, &d->choice.chosen);
	add_price(end, PSR_WIRE_REPORT_CHEAPER, &d->choice.cheaper);
	add_price(end, PSR_WIRE_REPORT_BETTER, &d->choice.better);
	add_entry(end, PSR_WIRE_REPORT_SAMPLES_WARPED, 0, report->n_samples_drawn);
	add_entry(end, PSR_WIRE_REPORT_BLOCKS_DRAWN, 0, report->n_blocks_drawn);
	add_entry(end, PSR_WIRE_REPORT_BLOCKS, 0, report->n_blocks);
	add_entry(end, PSR_WIRE_REPORT_PIXELS_COVERED, 0, report->n_covered);
	add_entry(end, PSR_WIRE_REPORT_PIXELS_FILLED, 0, report->n_filled);
	add_entry(end, PSR_WIRE_REPORT_SAMPLES, 0, report->n_samples);
	add_entry(end, PSR_WIRE_REPORT_DEPTH_LEVELS, 0, (uint64_t)__builtin_popcount(report->levels));
	add_entry(end, PSR_WIRE_REPORT_LIGHTS, 0, d->scene->scene.n_lights);
	add_entry(end, PSR_WIRE_REPORT_SHADOW_MAPS, 0, report->n_shadow_maps);
	add_entry(end, PSR_WIRE_REPORT_SHADOW_MAPS_DRAWN, 0, report->n_shadow_maps_drawn);
	add_rmse(end, PSR_WIRE_REPORT_RMSE_CHOSEN, &d->choice.chosen);
	add_rmse(end, PSR_WIRE_REPORT_RMSE_CHEAPER, &d->choice.cheaper);
	add_rmse(end, PSR_WIRE_REPORT_RMSE_BETTER, &d->choice.better);
	add_levels(end, d->scene);
	for (unsigned as = PSR_BLOCKS; as <= PSR_DPOINTS; as++)
		if (report->drawn_as[as].n > 0)
			add_entry(end, PSR_WIRE_REPORT_AS_BLOCKS + as - PSR_BLOCKS, 0,
			          report->drawn_as[as].n | (uint64_t)report->drawn_as[as].n_automatic << 32);
	if (report->octree_levels > 0)
		add_entry(end, PSR_WIRE_REPORT_FINEST, 0, report->octree_levels | report->of_levels << 8);
	add_scan(end, &d->scene->scene);
	for (unsigned i = 0; i < PSR_N_EFFECTS; i++)
		add_entry(end, PSR_WIRE_REPORT_EFFECTS + i, report->effect[i].why, report->effect[i].count);
}

static int emit_begin(const struct drawing *d, const struct psr_msg_frame *shown, struct psr_error *err)
{
	const struct psr_msg_frame *request = &d->request;
	const struct psr_msg_frame_begin begin = {
		.pass = (uint16_t)d->frame, .refine = (uint16_t)d->refine,
		.width = request->width, .height = request->height, .planes = request->planes,
		.color_codec = shown->color_codec, .color_quality = shown->color_quality,
		.depth_format = request->depth_format, .depth_codec = request->depth_codec, .data_codec = request->data_codec,
		.background = { d->scene->background[0], d->scene->background[1], d->scene->background[2] },
		.base = d->base != NULL ? d->base->id : 0, .base_pass = d->base != NULL ? (uint16_t)d->base->frame : 0,
		.settings = d->settings,
		.depth_min = request->depth_min, .depth_max = request->depth_max, .camera = request->camera,
	};
	struct outq_chunk *chunk = outq_chunk_create(CONTROL_BYTES);
	struct psr_buf buf;
	int code;

	if (chunk == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the answer to a frame");
	buf = (struct psr_buf){ .data = chunk->data, .capacity = chunk->capacity };
	code = psr_msg_frame_begin_encode(&buf, d->id, d->view, &begin, err);
	chunk->size = buf.size;
	if (code == PSR_OK)
		d->emit(chunk, d->userdata);
	else
		outq_chunks_destroy(chunk);
	return code;
}

static uint8_t status_of(const struct drawing *d)
{
	const struct psr_msg_frame *request = &d->request;

	if (request->budget == PSR_WIRE_BUDGET_TIME && d->spent.total_ns > (double)request->time_budget_us * 1e3)
		return PSR_WIRE_FRAME_LATE;
	if (request->budget == PSR_WIRE_BUDGET_ERROR && d->spent.error_px > request->error_bound)
		return PSR_WIRE_FRAME_COARSE;
	if (request->budget == PSR_WIRE_BUDGET_RMSE && !d->choice.is_met)
		return PSR_WIRE_FRAME_COARSE;
	return PSR_WIRE_FRAME_OK;
}

struct outq_chunk *draw_take_end(struct drawing *d)
{
	struct outq_chunk *chunk = d->end_chunk;
	struct psr_buf buf = { .data = chunk->data, .capacity = chunk->capacity };

	d->end.status = status_of(d);
	if (psr_msg_frame_end_encode(&buf, d->id, d->view, &d->end, NULL) != PSR_OK)
		assert(!"a frame's end can be written");
	chunk->size = buf.size;
	d->end_chunk = NULL;
	return chunk;
}

struct codec_parts *draw_parts(const struct drawing *d)
{
	return codec_parts_create(d->request.width, d->request.height, d->request.planes);
}

int draw_fits(const struct drawing *d, const struct base *base)
{
	return codec_parts_fit(base->parts, &d->request, d->settings.scale);
}

static uint64_t planes_bytes(uint32_t planes, uint64_t n_pixels, unsigned depth_format)
{
	uint64_t bytes = 0;

	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (planes >> plane & 1)
			bytes += n_pixels * psr_plane_pixel_bytes(plane, depth_format);
	return bytes;
}

/* The room for a plane from *next on, if it is wanted. */
static void *take_plane(uint8_t **next, const struct psr_frame *picture, uint32_t wanted, unsigned plane)
{
	uint8_t *pixels = *next;

	if (!(wanted >> plane & 1))
		return NULL;
	*next += (uint64_t)picture->width * picture->height * psr_plane_pixel_bytes(plane, PSR_WIRE_DEPTH_F32);
	return pixels;
}

static int reserve_pixels(struct draw_worker *worker, const struct drawing *d, struct psr_frame *picture,
                          struct psr_error *err)
{
	const uint32_t wanted = d->request.planes;
	const uint64_t n = (uint64_t)picture->width * picture->height;
	const uint64_t bytes = planes_bytes(wanted, n, PSR_WIRE_DEPTH_F32);
	uint8_t *next;

	if (bytes > worker->capacity) {
		psr_free(worker->pixels);
		worker->capacity = 0;
		worker->pixels = psr_alloc_array(bytes, 1);
		if (worker->pixels == NULL)
			return psr_fail(err, PSR_ERR_MEMORY, "no memory for a frame of %ux%u pixels", picture->width,
			                picture->height);
		worker->capacity = bytes;
	}
	next = worker->pixels; /* those of the longest components first, so that each is aligned */
	picture->words = take_plane(&next, picture, wanted, PSR_PLANE_WORDS);
	picture->depth = take_plane(&next, picture, wanted, PSR_PLANE_DEPTH);
	picture->id = take_plane(&next, picture, wanted, PSR_PLANE_ID);
	picture->normal = take_plane(&next, picture, wanted, PSR_PLANE_NORMAL);
	picture->bound = take_plane(&next, picture, wanted, PSR_PLANE_BOUND);
	picture->weight = take_plane(&next, picture, wanted, PSR_PLANE_WEIGHT);
	picture->block = take_plane(&next, picture, wanted, PSR_PLANE_BLOCK);
	picture->rgb = take_plane(&next, picture, wanted, PSR_PLANE_COLOR);
	return PSR_OK;
}

static int is_over(const struct drawing *d)
{
	return d->refine == 0 && atomic_load_explicit(&d->used_ns, memory_order_relaxed) > d->limit_ns;
}

/* Whoever asks holds no mutex: a question is a place to give way, too. */
static int is_cancelled(void *userdata)
{
	struct drawing *d = userdata;

	pool_give_way();
	atomic_store_explicit(&d->used_ns, pool_job_used_ns(), memory_order_relaxed);
	return atomic_load_explicit(&d->is_stopped, memory_order_relaxed) || is_over(d);
}

static int is_cancelled_or_yields(void *userdata)
{
	struct drawing *d = userdata;

	return is_cancelled(d) || atomic_load_explicit(&d->must_yield, memory_order_relaxed);
}

static int draw_picture(struct drawing *d, struct draw_worker *worker, struct psr_frame *picture, struct psr_error *err)
{
	struct psr_scene scene = d->scene->scene;
	struct psr_settings settings;
	int code;

	scene.camera = d->request.camera;
	psr_settings_default(&settings, picture->width, picture->height);
	settings.spacing_px = d->settings.spacing_px;
	settings.smooth = d->settings.smooth;
	settings.with_splats = d->settings.splats;
	settings.pass = d->settings.pass > 0 ? d->settings.pass : d->refine;
	settings.cancel = (struct psr_cancel){ is_cancelled_or_yields, d };
	code = psr_render(worker->renderer, &scene, &settings, d->pool, picture, err);
	if (code == PSR_ERR_CANCELLED && atomic_load(&d->must_yield) && !atomic_load(&d->is_stopped))
		return psr_fail(err, PSR_ERR_BUSY, "the frame gave way to another one");
	return code;
}

static int draw_and_encode(struct drawing *d, struct draw_worker *worker, struct psr_error *err)
{
	struct psr_msg_frame shown = d->request;
	struct psr_frame picture = { 0 };
	const struct psr_cancel cancel = { is_cancelled, d };
	struct codec_answer answer = {
		.id = d->id, .view = d->view, .request = &shown, .scale = d->settings.scale,
		.background = d->scene->background, .base = d->base != NULL ? d->base->parts : NULL, .parts = d->parts,
		.emit = d->emit, .userdata = d->userdata, .cancel = &cancel,
	};
	struct codec_result coded;
	struct times times = { .start_ns = d->start_ns };
	int code;

	if (d->is_sharp)
		sharpen(&shown);
	picture.width = d->request.width / answer.scale;
	picture.height = d->request.height / answer.scale;
	code = reserve_pixels(worker, d, &picture, err);
	if (code == PSR_OK)
		code = draw_picture(d, worker, &picture, err);
	times.drawn_ns = clock_ns();
	if (code == PSR_OK)
		code = emit_begin(d, &shown, err);
	if (code == PSR_OK)
		code = codec_encode(&coded, d->codec, d->pool, &answer, &picture, err);
	if (code != PSR_OK)
		return code;
	times.end_ns = clock_ns();
	d->end_chunk = outq_chunk_create(CONTROL_BYTES);
	if (d->end_chunk == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the answer to a frame");
	d->end = (struct psr_msg_frame_end){
		.pass = (uint16_t)d->frame, .planes = d->request.planes, .error_px = picture.report.error_px,
		.has_hashes = !(d->request.flags & PSR_WIRE_FRAME_NO_HASHES),
		.depth_min = coded.depth_min, .depth_max = coded.depth_max,
	};
	memcpy(d->end.hash, coded.hash, sizeof d->end.hash);
	fill_report(&d->end, d, &picture.report, &times, coded.rect_bytes);
	resolve_spent(&d->spent, &picture.report, &d->settings);
	return PSR_OK;
}

int draw_frame(struct drawing *d, struct draw_worker *worker, struct psr_error *err)
{
	int code;

	d->start_ns = clock_ns();
	code = draw_and_encode(d, worker, err);
	atomic_store_explicit(&d->used_ns, pool_job_used_ns(), memory_order_relaxed);
	if (code == PSR_ERR_CANCELLED && is_over(d) && !atomic_load(&d->is_stopped))
		return psr_fail(err, PSR_ERR_LIMIT,
		                "the frame was stopped after %.3g s on the processor's cores; this server gives a frame %.3g s "
		                "(--frame-timeout): ask for fewer pixels, lights with shadows or instances, or a wider spacing",
		                (double)atomic_load(&d->used_ns) * 1e-9, (double)d->limit_ns * 1e-9);
	return code;
}

uint64_t draw_answer_bytes(const struct psr_msg_frame *request)
{
	return planes_bytes(request->planes, (uint64_t)request->width * request->height, request->depth_format);
}

uint64_t draw_bytes(const struct psr_msg_frame *request, const struct scene *scene, int n_threads)
{
	const unsigned pass = budget_most_pass(request);
	const struct renderer_need need = {
		.width = request->width, .height = request->height, .n_threads = n_threads,
		.pass = pass > request->pass_limit ? pass : request->pass_limit,
		.n_shadow_lights = scene_shadow_lights(scene), .has_sheer = scene_has_sheer(scene),
		.n_blocks = scene_blocks(scene), .has_octrees = scene_has_octrees(scene),
		.with_splats = request->settings.splats && scene_has_octrees(scene),
	};

	return renderer_need(&need) + planes_bytes(request->planes, (uint64_t)request->width * request->height,
	                                           PSR_WIRE_DEPTH_F32) + draw_answer_bytes(request);
}
