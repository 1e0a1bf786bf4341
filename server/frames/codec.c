#include <assert.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <xxhash.h>
#include <zstd.h>
#include "base/mem.h"
#include "codec.h"

#define ZSTD_LEVEL 1
#define RECT_HEAD (PSR_HEADER_SIZE + 24) /* bytes of a RECT message before its data */

struct encoder {
	struct encoder *next;
	tjhandle jpeg;
	ZSTD_CCtx *zstd;
	uint8_t *scratch;
	size_t capacity;
};

struct codec {
	pthread_mutex_t mutex;
	struct encoder *idle;
};

struct plane {
	unsigned number, pixel_bytes, codec, quality;
	const uint8_t *pixels;
	int n_strips, first_strip;
};

struct strip {
	struct outq_chunk *chunk;
	uint64_t data_bytes;
	double depth_min, depth_max; /* min > max: no finite depth */
	int code;
};

/* The rows of a plane that a strip codes, and how. */
struct rows {
	const struct plane *plane;
	uint32_t y, n, width;
	const uint8_t *pixels;
	unsigned codec;
	const uint8_t *data; /* coded, in the encoder's scratch or the pixels themselves */
	size_t bytes;
};

struct job {
	struct codec *codec;
	uint32_t id;
	uint16_t view;
	uint32_t width, height;
	const uint8_t *background;
	struct plane plane[PSR_N_PLANES];
	int n_planes;
	struct strip *strip;
	uint64_t *hash;
};

int codec_create(struct codec **out)
{
	struct codec *codec = calloc(1, sizeof *codec);

	if (codec == NULL)
		return PSR_ERR_MEMORY;
	pthread_mutex_init(&codec->mutex, NULL);
	*out = codec;
	return PSR_OK;
}

static void destroy_encoder(struct encoder *e)
{
	if (e->jpeg != NULL)
		tjDestroy(e->jpeg);
	ZSTD_freeCCtx(e->zstd);
	psr_free(e->scratch);
	free(e);
}

void codec_destroy(struct codec *codec)
{
	if (codec == NULL)
		return;
	while (codec->idle != NULL) {
		struct encoder *e = codec->idle;

		codec->idle = e->next;
		destroy_encoder(e);
	}
	pthread_mutex_destroy(&codec->mutex);
	free(codec);
}

static struct encoder *take_encoder(struct codec *codec)
{
	struct encoder *e;

	pthread_mutex_lock(&codec->mutex);
	e = codec->idle;
	if (e != NULL)
		codec->idle = e->next;
	pthread_mutex_unlock(&codec->mutex);
	if (e != NULL)
		return e;
	e = calloc(1, sizeof *e);
	if (e == NULL)
		return NULL;
	e->jpeg = tjInitCompress();
	e->zstd = ZSTD_createCCtx();
	if (e->jpeg == NULL || e->zstd == NULL) {
		destroy_encoder(e);
		return NULL;
	}
	return e;
}

static void put_encoder(struct codec *codec, struct encoder *e)
{
	pthread_mutex_lock(&codec->mutex);
	e->next = codec->idle;
	codec->idle = e;
	pthread_mutex_unlock(&codec->mutex);
}

static int reserve(struct encoder *e, size_t n)
{
	if (e->capacity >= n)
		return PSR_OK;
	psr_free(e->scratch);
	e->capacity = 0;
	e->scratch = psr_alloc_array(n, 1);
	if (e->scratch == NULL)
		return PSR_ERR_MEMORY;
	e->capacity = n;
	return PSR_OK;
}

static int is_background(const struct plane *plane, const uint8_t *pixels, size_t n, const uint8_t background[3])
{
	const uint8_t *empty = plane->number == PSR_PLANE_COLOR ? background : psr_plane_background(plane->number);

	/* The strip is background if its first pixel is, and each equals the one before. */
	return memcmp(pixels, empty, plane->pixel_bytes) == 0
	       && memcmp(pixels, pixels + plane->pixel_bytes, (n - 1) * plane->pixel_bytes) == 0;
}

static void find_depth_range(struct strip *strip, const uint8_t *pixels, size_t n)
{
	float least = INFINITY, most = -INFINITY;

	for (size_t i = 0; i < n; i++) {
		float z;

		memcpy(&z, pixels + 4 * i, 4);
		least = z < least ? z : least;
		most = z > most && z < INFINITY ? z : most;
	}
	strip->depth_min = (double)least;
	strip->depth_max = (double)most;
}

/* The RECTs of a coded strip, in one chunk. */
static int put_rects(struct strip *strip, const struct job *job, const struct rows *rows)
{
	const size_t total = rows->bytes;
	size_t n_pieces = (total + PSR_WIRE_MAX_RECT_DATA - 1) / PSR_WIRE_MAX_RECT_DATA;
	struct outq_chunk *chunk = outq_chunk_create(total + n_pieces * RECT_HEAD);
	struct psr_buf buf;

	if (chunk == NULL)
		return PSR_ERR_MEMORY;
	buf = (struct psr_buf){ .data = chunk->data, .capacity = chunk->capacity };
	for (size_t offset = 0; offset < total; offset += PSR_WIRE_MAX_RECT_DATA) {
		size_t bytes = total - offset < PSR_WIRE_MAX_RECT_DATA ? total - offset : PSR_WIRE_MAX_RECT_DATA;
		const struct psr_msg_rect rect = {
			.plane = (uint8_t)rows->plane->number, .codec = (uint8_t)rows->codec, .scale = 1,
			.y = (uint16_t)rows->y, .w = (uint16_t)rows->width, .h = (uint16_t)rows->n, .total = (uint32_t)total,
			.offset = (uint32_t)offset, .bytes = (uint32_t)bytes, .data = rows->data + offset,
		};
		int code = psr_msg_rect_encode(&buf, job->id, job->view, &rect, NULL);

		if (code != PSR_OK) {
			outq_chunks_destroy(chunk);
			return PSR_ERR_INTERNAL;
		}
	}
	chunk->size = buf.size;
	strip->chunk = chunk;
	strip->data_bytes = total;
	return PSR_OK;
}

static int encode_jpeg(struct encoder *e, struct rows *rows)
{
	const int quality = (int)rows->plane->quality, chroma = quality >= CODEC_CHROMA_QUALITY ? TJSAMP_444 : TJSAMP_420;
	unsigned long size = tjBufSize((int)rows->width, (int)rows->n, chroma);
	unsigned char *at;

	if (reserve(e, size) != PSR_OK)
		return PSR_ERR_MEMORY;
	at = e->scratch;
	if (tjCompress2(e->jpeg, rows->pixels, (int)rows->width, 0, (int)rows->n, TJPF_RGB, &at, &size, chroma, quality,
	                TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT) != 0)
		return PSR_ERR_INTERNAL;
	rows->data = e->scratch;
	rows->bytes = size;
	return PSR_OK;
}

static int encode_zstd(struct encoder *e, struct rows *rows)
{
	const unsigned pixel = rows->plane->pixel_bytes;
	const unsigned component = psr_plane_component_bytes(rows->plane->number, PSR_WIRE_DEPTH_F32);
	const size_t raw = (size_t)rows->width * rows->n * pixel, bound = ZSTD_compressBound(raw);

	if (reserve(e, raw + bound) != PSR_OK)
		return PSR_ERR_MEMORY;
	psr_filter_rows(e->scratch, rows->pixels, rows->width, rows->n, pixel / component, component);
	rows->bytes = ZSTD_compressCCtx(e->zstd, e->scratch + raw, bound, e->scratch, raw, ZSTD_LEVEL);
	rows->data = e->scratch + raw;
	return ZSTD_isError(rows->bytes) ? PSR_ERR_INTERNAL : PSR_OK;
}

static int encode_strip(struct strip *strip, const struct job *job, const struct plane *plane, int number)
{
	const uint32_t y = (uint32_t)number * CODEC_STRIP_ROWS;
	struct rows rows = {
		.plane = plane, .y = y, .n = job->height - y < CODEC_STRIP_ROWS ? job->height - y : CODEC_STRIP_ROWS,
		.width = job->width, .pixels = plane->pixels + (size_t)y * job->width * plane->pixel_bytes, .codec = plane->codec,
	};
	const size_t n_pixels = (size_t)rows.width * rows.n, raw = n_pixels * plane->pixel_bytes;
	struct encoder *e;
	int code = PSR_OK;

	if (plane->number == PSR_PLANE_DEPTH)
		find_depth_range(strip, rows.pixels, n_pixels);
	if (is_background(plane, rows.pixels, n_pixels, job->background))
		return PSR_OK;
	e = take_encoder(job->codec);
	if (e == NULL)
		return PSR_ERR_MEMORY;
	if (rows.codec == PSR_CODEC_JPEG)
		code = encode_jpeg(e, &rows);
	else if (rows.codec == PSR_CODEC_ZSTD)
		code = encode_zstd(e, &rows);
	if (rows.codec == PSR_CODEC_RAW || rows.bytes >= raw) {
		rows.codec = PSR_CODEC_RAW;
		rows.data = rows.pixels;
		rows.bytes = raw;
	}
	if (code == PSR_OK)
		code = put_rects(strip, job, &rows);
	put_encoder(job->codec, e);
	return code;
}

/* Hashes come first: each is one long job, which should not start last. */
static void run(int i, void *userdata)
{
	struct job *job = userdata;
	const struct plane *plane = &job->plane[job->n_planes - 1];

	if (i < job->n_planes) {
		plane = &job->plane[i];
		job->hash[plane->number] = XXH64(plane->pixels, (size_t)job->width * job->height * plane->pixel_bytes, 0);
		return;
	}
	i -= job->n_planes;
	while (i < plane->first_strip)
		plane--;
	job->strip[i].code = encode_strip(&job->strip[i], job, plane, i - plane->first_strip);
}

static void add_plane(struct job *job, unsigned number, const void *pixels, unsigned codec, unsigned quality)
{
	struct plane *plane = &job->plane[job->n_planes];
	int n_strips = (int)((job->height + CODEC_STRIP_ROWS - 1) / CODEC_STRIP_ROWS);

	*plane = (struct plane){
		.number = number, .pixel_bytes = psr_plane_pixel_bytes(number, PSR_WIRE_DEPTH_F32), .codec = codec,
		.quality = quality, .pixels = pixels, .n_strips = n_strips, .first_strip = job->n_planes * n_strips,
	};
	job->n_planes++;
}

static unsigned codec_of(const struct psr_msg_frame *request, unsigned plane)
{
	return plane == PSR_PLANE_COLOR ? request->color_codec
	       : plane == PSR_PLANE_DEPTH ? request->depth_codec : request->data_codec;
}

static int collect(struct codec_result *out, const struct job *job, int n_strips)
{
	struct outq_chunk **last = &out->first;
	double least = INFINITY, most = -INFINITY;
	int code = PSR_OK;

	for (int i = 0; i < n_strips; i++) {
		struct strip *strip = &job->strip[i];

		if (strip->chunk != NULL) {
			*last = strip->chunk;
			last = &strip->chunk->next;
		}
		out->rect_bytes += strip->data_bytes;
		least = strip->depth_min < least ? strip->depth_min : least;
		most = strip->depth_max > most ? strip->depth_max : most;
		if (code == PSR_OK)
			code = strip->code;
	}
	if (least <= most) {
		out->depth_min = least;
		out->depth_max = most;
	}
	return code;
}

int codec_encode(struct codec_result *out, struct codec *codec, struct psr_pool *pool,
                 const struct codec_answer *answer, const struct psr_frame *frame, struct psr_error *err)
{
	const struct psr_msg_frame *request = answer->request;
	struct job job = {
		.codec = codec, .id = answer->id, .view = answer->view, .width = frame->width, .height = frame->height,
		.background = answer->background, .hash = out->hash,
	};
	int n_strips = 0, code;

	memset(out, 0, sizeof *out);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (request->planes >> plane & 1)
			add_plane(&job, plane, psr_frame_plane(frame, plane), codec_of(request, plane), request->color_quality);
	assert(job.n_planes > 0);
	for (int i = 0; i < job.n_planes; i++)
		n_strips += job.plane[i].n_strips;
	job.strip = calloc((size_t)n_strips, sizeof *job.strip);
	if (job.strip == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to encode a frame of %ux%u pixels", frame->width, frame->height);
	for (int i = 0; i < n_strips; i++) {
		job.strip[i].depth_min = INFINITY;
		job.strip[i].depth_max = -INFINITY;
	}
	psr_pool_for(pool, job.n_planes + n_strips, run, &job);
	code = collect(out, &job, n_strips);
	free(job.strip);
	if (code != PSR_OK) {
		outq_chunks_destroy(out->first);
		out->first = NULL;
		return psr_fail(err, code, "a frame of %ux%u pixels could not be encoded: %s", frame->width, frame->height,
		                psr_strerror(code));
	}
	return PSR_OK;
}
