#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/mem.h"
#include "draw.h"
#include "wire.h"

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

/* Resolved. */
static struct psr_msg_settings settings_of(const struct psr_msg_frame *request)
{
	const struct psr_msg_settings usual = { .scale = 1, .spacing_px = 1 };

	return request->budget == PSR_WIRE_BUDGET_SETTINGS ? request->settings : usual;
}

static void add_entry(struct psr_msg_frame_end *end, unsigned id, uint64_t ns, uint64_t count)
{
	end->entry[end->n_entries++] = (struct psr_msg_report_entry){ .id = (uint16_t)id, .ns = ns, .count = count };
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
	for (unsigned i = 0; i < PSR_N_EFFECTS; i++)
		add_entry(end, PSR_WIRE_REPORT_EFFECTS + i, report->effect[i].why, report->effect[i].count);
}

static struct outq_chunk *encode_begin(const struct drawing *d, const struct codec_result *coded)
{
	const struct psr_msg_frame *request = &d->request;
	const struct psr_msg_frame_begin begin = {
		.pass = (uint16_t)d->pass, .width = request->width, .height = request->height, .planes = request->planes,
		.color_codec = request->color_codec, .color_quality = request->color_quality,
		.depth_format = request->depth_format, .depth_codec = request->depth_codec, .data_codec = request->data_codec,
		.background = { d->scene->background[0], d->scene->background[1], d->scene->background[2] },
		.settings = settings_of(request),
		.depth_min = coded->depth_min, .depth_max = coded->depth_max, .camera = request->camera,
	};
	struct outq_chunk *chunk = outq_chunk_create(CONTROL_BYTES);
	struct psr_buf buf;

	if (chunk == NULL)
		return NULL;
	buf = (struct psr_buf){ .data = chunk->data, .capacity = chunk->capacity };
	if (psr_msg_frame_begin_encode(&buf, d->id, 0, &begin, NULL) != PSR_OK) {
		outq_chunks_destroy(chunk);
		return NULL;
	}
	chunk->size = buf.size;
	return chunk;
}

static struct outq_chunk *encode_end(const struct drawing *d, const struct psr_msg_frame_end *end)
{
	struct outq_chunk *chunk = outq_chunk_create(CONTROL_BYTES);
	struct psr_buf buf;

	if (chunk == NULL)
		return NULL;
	buf = (struct psr_buf){ .data = chunk->data, .capacity = chunk->capacity };
	if (psr_msg_frame_end_encode(&buf, d->id, 0, end, NULL) != PSR_OK) {
		outq_chunks_destroy(chunk);
		return NULL;
	}
	chunk->size = buf.size;
	return chunk;
}

static int join_answer(struct drawing *d, const struct codec_result *coded, const struct psr_msg_frame_end *end,
                       struct psr_error *err)
{
	struct outq_chunk *first = encode_begin(d, coded), *last = encode_end(d, end), *at = first;

	if (first == NULL || last == NULL) {
		outq_chunks_destroy(first);
		outq_chunks_destroy(last);
		outq_chunks_destroy(coded->first);
		return psr_fail(err, PSR_ERR_INTERNAL, "the answer to a frame could not be written");
	}
	first->next = coded->first;
	while (at->next != NULL)
		at = at->next;
	at->next = last;
	d->answer = first;
	return PSR_OK;
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
	uint64_t n = (uint64_t)d->request.width * d->request.height, bytes = 0;
	uint8_t *next;

	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (wanted >> plane & 1)
			bytes += n * psr_plane_pixel_bytes(plane, PSR_WIRE_DEPTH_F32);
	if (bytes > worker->capacity) {
		psr_free(worker->pixels);
		worker->capacity = 0;
		worker->pixels = psr_alloc_array(bytes, 1);
		if (worker->pixels == NULL)
			return psr_fail(err, PSR_ERR_MEMORY, "no memory for a frame of %ux%u pixels", d->request.width,
			                d->request.height);
		worker->capacity = bytes;
	}
	picture->width = d->request.width;
	picture->height = d->request.height;
	next = worker->pixels; /* those of the longest components first, so that each is aligned */
	picture->words = take_plane(&next, picture, wanted, PSR_PLANE_WORDS);
	picture->depth = take_plane(&next, picture, wanted, PSR_PLANE_DEPTH);
	picture->id = take_plane(&next, picture, wanted, PSR_PLANE_ID);
	picture->normal = take_plane(&next, picture, wanted, PSR_PLANE_NORMAL);
	picture->weight = take_plane(&next, picture, wanted, PSR_PLANE_WEIGHT);
	picture->block = take_plane(&next, picture, wanted, PSR_PLANE_BLOCK);
	picture->rgb = take_plane(&next, picture, wanted, PSR_PLANE_COLOR);
	return PSR_OK;
}

static int is_abandoned(void *userdata)
{
	struct drawing *d = userdata;

	return atomic_load(&d->is_abandoned);
}

static int draw_pass(struct drawing *d, struct draw_worker *worker, const struct psr_scene *scene,
                     struct psr_frame *picture, struct psr_error *err)
{
	const struct psr_msg_settings asked = settings_of(&d->request);
	struct psr_settings settings;

	psr_settings_default(&settings, d->request.width, d->request.height);
	settings.spacing = asked.spacing_px;
	settings.is_smooth = asked.is_smooth;
	settings.pass = d->pass;
	settings.is_cancelled = is_abandoned;
	settings.userdata = d;
	return psr_render(worker->renderer, scene, &settings, d->pool, picture, err);
}

int draw_frame(struct drawing *d, struct draw_worker *worker, struct psr_error *err)
{
	struct psr_scene scene = d->scene->scene;
	struct psr_frame picture = { 0 };
	const struct codec_answer answer = { .id = d->id, .request = &d->request, .background = d->scene->background };
	struct codec_result coded;
	struct psr_msg_frame_end end = { .pass = (uint16_t)d->pass, .is_final = d->pass == d->last_pass,
		                             .planes = d->request.planes };
	struct times times = { .start_ns = clock_ns() };
	int code;

	wire_to_camera(&scene.camera, &d->request.camera);
	code = reserve_pixels(worker, d, &picture, err);
	if (code == PSR_OK)
		code = draw_pass(d, worker, &scene, &picture, err);
	if (code != PSR_OK)
		return code;
	if (atomic_load(&d->is_abandoned))
		return psr_fail(err, PSR_ERR_CANCELLED, "given up");
	times.drawn_ns = clock_ns();
	code = codec_encode(&coded, d->codec, d->pool, &answer, &picture, err);
	if (code != PSR_OK)
		return code;
	times.end_ns = clock_ns();
	end.error_px = picture.report.error_bound;
	memcpy(end.hash, coded.hash, sizeof end.hash);
	fill_report(&end, d, &picture.report, &times, coded.rect_bytes);
	return join_answer(d, &coded, &end, err);
}
