#include <assert.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include "base/hash.h"
#include "codec.h"
#include "codec_rect.h"
#include "pixels.h"

#define MAX_STRIPS (PSR_WIRE_MAX_SIDE / HASH_STRIP_ROWS) /* in a plane */
#define ALONE_BYTES 65536 /* as many pixel bytes as a thread codes alone before another one would have woken up */

struct plane {
	unsigned number, pixel_bytes, codec, quality; /* quality: the wanted one, as in parts */
	const uint8_t *pixels, *empty; /* empty: one pixel of background */
	int first_strip;
};

struct strip {
	struct outq_chunk *first, **last;
	uint64_t data_bytes, hash;
	double depth_min, depth_max; /* min > max: no finite depth */
	int is_done;
};

struct job {
	struct codec *codec;
	const struct codec_answer *answer;
	uint32_t width, height, strip_rows; /* of the frame */
	struct plane plane[PSR_N_PLANES];
	int n_planes, n_strips; /* n_strips: of all planes */
	struct strip *strip;
	/* Under the mutex: */
	pthread_mutex_t mutex;
	int code, n_emitted, is_emitting;
};

/* Which rows of a plane a strip codes. */
struct rows {
	const struct plane *plane;
	uint32_t number, y, n; /* in pixels of the frame */
	const uint8_t *pixels;
	size_t pitch;
};

/* The strip as the client will have it: each pixel scale x scale times. */
static int hash_rows(struct strip *strip, const struct job *job, struct encoder *e, const struct rows *rows)
{
	const uint32_t scale = job->answer->scale;
	const size_t n = rows->pitch * rows->n * scale * scale;
	uint8_t *large;

	if (scale == 1) {
		strip->hash = hash_strip(rows->pixels, n);
		return PSR_OK;
	}
	large = encoder_scratch(e, n);
	if (large == NULL)
		return PSR_ERR_MEMORY;
	pixels_enlarge(large, rows->pixels, job->width, rows->n, rows->plane->pixel_bytes, scale);
	strip->hash = hash_strip(large, n);
	return PSR_OK;
}

/* Turns depth into u16 for the codec; at half size takes the nearest of each 2x2 pixels. */
static int quantise(struct coded_rect *rect, struct encoder *e, const struct psr_msg_frame *request)
{
	const uint32_t step = request->depth_format == PSR_WIRE_DEPTH_U16_HALF && rect->scale == 1 ? 2 : 1;
	const uint32_t width = (rect->width + step - 1) / step, height = (rect->height + step - 1) / step;
	const struct psr_depth_range range = psr_depth_range_of(request);
	float *row = (float *)encoder_scratch(e, width * sizeof *row + (size_t)width * height * sizeof(uint16_t));
	uint16_t *q = (uint16_t *)(row + width);

	if (row == NULL)
		return PSR_ERR_MEMORY;
	for (uint32_t y = 0; y < height; y++) {
		const float *z = (const float *)(rect->pixels + y * step * rect->pitch);

		if (step == 2) {
			const int has_next = 2 * y + 1 < rect->height;

			pixels_nearest(row, z, has_next ? (const float *)((const uint8_t *)z + rect->pitch) : z, rect->width);
			z = row;
		}
		psr_depth_quantise(q + (size_t)y * width, z, width, &range);
	}
	rect->pixels = (const uint8_t *)q;
	rect->pixel_bytes = rect->component_bytes = sizeof *q;
	rect->pitch = width * sizeof *q;
	rect->width = width;
	rect->height = height;
	rect->scale *= step;
	return PSR_OK;
}

/* Codes a rectangle of the strip, in pixels of the frame; *quality becomes the quality that the client then has. */
static int code_rect(struct strip *strip, const struct job *job, struct encoder *e, const struct rows *rows,
                     struct coded_rect *rect, unsigned *quality)
{
	const struct codec_answer *answer = job->answer;
	const struct plane *plane = rows->plane;
	const uint32_t scale = answer->scale;
	int code = PSR_OK;

	rect->id = answer->id;
	rect->view = answer->view;
	rect->plane = plane->number;
	rect->codec = plane->codec;
	rect->quality = plane->quality;
	rect->pixels = rows->pixels + (rect->y - rows->y) * rows->pitch + rect->x * plane->pixel_bytes;
	rect->pitch = rows->pitch;
	rect->pixel_bytes = plane->pixel_bytes;
	rect->component_bytes = psr_plane_component_bytes(plane->number, PSR_WIRE_DEPTH_F32);
	rect->scale = scale;
	rect->w = rect->width * scale;
	rect->h = rect->height * scale;
	rect->x *= scale;
	rect->y *= scale;
	if (plane->number == PSR_PLANE_DEPTH && answer->request->depth_format != PSR_WIRE_DEPTH_F32)
		code = quantise(rect, e, answer->request);
	if (code == PSR_OK)
		code = encoder_code(strip->last, e, rect);
	if (code != PSR_OK)
		return code;
	strip->last = &(*strip->last)->next;
	strip->data_bytes += rect->bytes;
	*quality = plane->codec == PSR_CODEC_JPEG && rect->codec == PSR_CODEC_RAW ? PART_LOSSLESS : plane->quality;
	return PSR_OK;
}

static int code_whole(struct strip *strip, const struct job *job, struct encoder *e, const struct rows *rows)
{
	struct codec_parts *parts = job->answer->parts;
	struct coded_rect rect = { .y = rows->y, .width = job->width, .height = rows->n };
	unsigned quality = PART_LOSSLESS;
	int code = PSR_OK;

	if (!pixels_are_all(rows->plane->empty, rows->pixels, (size_t)job->width * rows->n, rows->plane->pixel_bytes))
		code = code_rect(strip, job, e, rows, &rect, &quality);
	if (code == PSR_OK && parts != NULL) {
		const struct part_area all = codec_parts_all(parts, rows->number);

		codec_parts_sent(parts, rows->plane->number, rows->number, &all, quality);
	}
	return code;
}

static int code_changes(struct strip *strip, const struct job *job, struct encoder *e, const struct rows *rows)
{
	const uint32_t columns = PSR_WIRE_PART_WIDTH / job->answer->scale;
	const uint32_t n_rows = PSR_WIRE_PART_HEIGHT / job->answer->scale;
	struct codec_parts *parts = job->answer->parts;
	struct part_area area[PART_AREAS];
	const unsigned n = codec_parts_changed(area, parts, job->answer->base, rows->plane->number, rows->number,
	                                       rows->plane->quality);

	for (unsigned i = 0; i < n; i++) {
		const uint32_t x0 = area[i].x0 * columns, x1 = area[i].x1 * columns;
		const uint32_t y0 = area[i].y0 * n_rows, y1 = area[i].y1 * n_rows;
		struct coded_rect rect = {
			.x = x0, .y = rows->y + y0, .width = (x1 < job->width ? x1 : job->width) - x0,
			.height = (y1 < rows->n ? y1 : rows->n) - y0,
		};
		unsigned quality;
		int code = code_rect(strip, job, e, rows, &rect, &quality);

		if (code != PSR_OK)
			return code;
		codec_parts_sent(parts, rows->plane->number, rows->number, &area[i], quality);
	}
	return PSR_OK;
}

static int code_strip(struct strip *strip, const struct job *job, const struct rows *rows)
{
	const struct codec_answer *answer = job->answer;
	struct encoder *e = codec_take_encoder(job->codec);
	int code = PSR_OK;

	if (e == NULL)
		return PSR_ERR_MEMORY;
	if (rows->plane->number == PSR_PLANE_DEPTH)
		pixels_depth_range(&strip->depth_min, &strip->depth_max, (const float *)rows->pixels,
		                   (size_t)job->width * rows->n);
	if (!(answer->request->flags & PSR_WIRE_FRAME_NO_HASHES))
		code = hash_rows(strip, job, e, rows);
	if (answer->parts != NULL)
		codec_parts_hash(answer->parts, rows->plane->number, rows->number, rows->pixels, rows->n);
	if (code == PSR_OK)
		code = (answer->base != NULL ? code_changes : code_whole)(strip, job, e, rows);
	codec_put_encoder(job->codec, e);
	return code;
}

/* The thread that finds strips ready while no other emits does so until none is ready. */
static void emit_ready(struct job *job)
{
	if (job->is_emitting)
		return;
	job->is_emitting = 1;
	while (job->code == PSR_OK && job->n_emitted < job->n_strips && job->strip[job->n_emitted].is_done) {
		struct strip *strip = &job->strip[job->n_emitted++];
		struct outq_chunk *first = strip->first;

		strip->first = NULL;
		if (first == NULL)
			continue;
		pthread_mutex_unlock(&job->mutex);
		job->answer->emit(first, job->answer->userdata);
		pthread_mutex_lock(&job->mutex);
	}
	job->is_emitting = 0;
}

static void run(int i, void *userdata)
{
	struct job *job = userdata;
	const struct plane *plane = &job->plane[job->n_planes - 1];
	struct strip *strip = &job->strip[i];
	struct rows rows;
	int code;

	while (i < plane->first_strip)
		plane--;
	rows = (struct rows){ .plane = plane, .number = (uint32_t)(i - plane->first_strip),
		                  .pitch = (size_t)job->width * plane->pixel_bytes };
	rows.y = rows.number * job->strip_rows;
	rows.n = job->height - rows.y < job->strip_rows ? job->height - rows.y : job->strip_rows;
	rows.pixels = plane->pixels + rows.y * rows.pitch;
	strip->last = &strip->first;
	strip->depth_min = INFINITY;
	strip->depth_max = -INFINITY;
	code = code_strip(strip, job, &rows);
	pthread_mutex_lock(&job->mutex);
	strip->is_done = 1;
	if (job->code == PSR_OK)
		job->code = code;
	emit_ready(job);
	pthread_mutex_unlock(&job->mutex);
}

static unsigned codec_of(const struct psr_msg_frame *request, unsigned plane)
{
	return plane == PSR_PLANE_COLOR ? request->color_codec
	       : plane == PSR_PLANE_DEPTH ? request->depth_codec : request->data_codec;
}

static unsigned quality_of(const struct psr_msg_frame *request, unsigned plane)
{
	if (plane == PSR_PLANE_COLOR && request->color_codec == PSR_CODEC_JPEG)
		return request->color_quality;
	if (plane == PSR_PLANE_DEPTH && request->depth_format != PSR_WIRE_DEPTH_F32)
		return request->depth_format == PSR_WIRE_DEPTH_U16 ? 2 : 1;
	return PART_LOSSLESS;
}

/* Returns how many bytes all pixels have. */
static uint64_t add_planes(struct job *job, const struct codec_answer *answer, const struct psr_frame *frame)
{
	const struct psr_msg_frame *request = answer->request;
	const int n_strips = (int)((job->height + job->strip_rows - 1) / job->strip_rows);
	uint64_t bytes = 0;

	for (unsigned number = 0; number < PSR_N_PLANES; number++) {
		if (!(request->planes >> number & 1))
			continue;
		job->plane[job->n_planes++] = (struct plane){
			.number = number, .pixel_bytes = (unsigned)psr_plane_bytes(number), .codec = codec_of(request, number),
			.quality = quality_of(request, number), .pixels = psr_frame_plane(frame, number),
			.empty = number == PSR_PLANE_COLOR ? answer->background : psr_plane_background(number),
			.first_strip = job->n_strips,
		};
		job->n_strips += n_strips;
		bytes += (uint64_t)job->width * job->height * psr_plane_bytes(number);
	}
	return bytes;
}

static void describe(struct codec_parts *parts, const struct codec_answer *answer)
{
	const struct psr_msg_frame *request = answer->request;

	if (parts == NULL)
		return;
	assert(parts->width == request->width && parts->height == request->height && parts->planes == request->planes);
	parts->scale = answer->scale;
	parts->depth_format = request->depth_format;
	parts->range = psr_depth_range_of(request);
}

static uint64_t join_hashes(const struct strip *strip, int n_strips)
{
	uint64_t hash[MAX_STRIPS];

	for (int i = 0; i < n_strips; i++)
		hash[i] = strip[i].hash;
	return hash_join(hash, (size_t)n_strips);
}

static void collect(struct codec_result *out, const struct job *job)
{
	const int n_strips = job->n_strips / job->n_planes;
	double least = INFINITY, most = -INFINITY;

	for (int i = 0; i < job->n_strips; i++) {
		const struct strip *strip = &job->strip[i];

		out->rect_bytes += strip->data_bytes;
		least = strip->depth_min < least ? strip->depth_min : least;
		most = strip->depth_max > most ? strip->depth_max : most;
	}
	if (least <= most) {
		out->depth_min = least;
		out->depth_max = most;
	}
	if (job->answer->request->flags & PSR_WIRE_FRAME_NO_HASHES)
		return;
	for (int i = 0; i < job->n_planes; i++)
		out->hash[job->plane[i].number] = join_hashes(job->strip + job->plane[i].first_strip, n_strips);
}

int codec_encode(struct codec_result *out, struct codec *codec, struct psr_pool *pool,
                 const struct codec_answer *answer, const struct psr_frame *frame, struct psr_error *err)
{
	struct job job = {
		.codec = codec, .answer = answer, .width = frame->width, .height = frame->height,
		.strip_rows = HASH_STRIP_ROWS / answer->scale, .mutex = PTHREAD_MUTEX_INITIALIZER,
	};
	const uint64_t bytes = add_planes(&job, answer, frame);
	int code;

	assert(job.n_planes > 0 && answer->request->width == frame->width * answer->scale);
	assert(answer->base == NULL || (answer->parts != NULL && answer->parts != answer->base));
	memset(out, 0, sizeof *out);
	describe(answer->parts, answer);
	job.strip = calloc((size_t)job.n_strips, sizeof *job.strip);
	if (job.strip == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to encode a frame of %ux%u pixels", frame->width, frame->height);
	code = psr_pool_for_until(bytes <= ALONE_BYTES || job.n_strips == 1 ? NULL : pool, answer->cancel, job.n_strips, run,
	                          &job);
	if (code == PSR_OK)
		code = job.code;
	if (code == PSR_OK)
		collect(out, &job);
	for (int i = 0; i < job.n_strips; i++)
		outq_chunks_destroy(job.strip[i].first);
	free(job.strip);
	pthread_mutex_destroy(&job.mutex);
	if (code == PSR_ERR_CANCELLED)
		return psr_fail(err, code, "given up");
	if (code != PSR_OK)
		return psr_fail(err, code, "a frame of %ux%u pixels could not be encoded: %s", frame->width, frame->height,
		                psr_strerror(code));
	return PSR_OK;
}
