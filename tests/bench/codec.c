/* What encoding a frame costs beside the encoders themselves: the same strips by libjpeg-turbo, or by the row filter and
 * zstd, without hashes, parts and messages. Both sides take turns on one thread. Then what a base saves. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <zstd.h>
#include "base/clock.h"
#include "base/hash.h"
#include "base/stats.h"
#include "server/frames/codec.h"

#define QUALITY 80
#define MOST_ROUNDS 400

static const uint8_t background[3] = { 40, 44, 52 };

struct row {
	const char *name;
	uint32_t width, height, planes;
	unsigned color_codec, depth_format, flags;
	int has_parts;    /* as in a view above 0 */
	double changed;   /* of the rows of the picture, from frame to frame, on a base; -1: no base */
};

struct bench {
	const struct row *row;
	struct psr_msg_frame request;
	struct psr_frame frame;
	struct codec *codec;
	struct codec_parts *parts[2];
	tjhandle jpeg;
	ZSTD_CCtx *zstd;
	uint8_t *filtered, *coded;
	size_t coded_bytes;
	uint64_t bytes;
};

static void die(const char *what)
{
	fprintf(stderr, "codec: %s\n", what);
	exit(1);
}

/* A shaded ball with stripes, over background. */
static void paint(const struct psr_frame *frame)
{
	const double radius = 0.45 * (frame->width < frame->height ? frame->width : frame->height);

	for (uint32_t y = 0; y < frame->height; y++) {
		for (uint32_t x = 0; x < frame->width; x++) {
			const size_t i = (size_t)y * frame->width + x;
			const double u = (x - 0.5 * frame->width) / radius / 1.6, v = (y - 0.5 * frame->height) / radius;
			const double rest = 1 - u * u - v * v;
			const int stripe = ((int)(20 * u + 40) ^ (int)(20 * v + 40)) & 1;

			memcpy(frame->rgb + 3 * i, background, 3);
			frame->depth[i] = INFINITY;
			if (rest <= 0)
				continue;
			frame->depth[i] = (float)(3 - sqrt(rest));
			for (int c = 0; c < 3; c++)
				frame->rgb[3 * i + (size_t)c] = (uint8_t)((stripe ? 220 : 150 - 40 * c) * (0.2 + 0.8 * rest)
				                                          + (x * 7 + y * 13) % 5);
		}
	}
}

static void begin(struct bench *bench, const struct row *row)
{
	const size_t raw = (size_t)row->width * HASH_STRIP_ROWS * 4;

	*bench = (struct bench){
		.row = row,
		.request = { .width = row->width, .height = row->height, .planes = row->planes, .flags = (uint16_t)row->flags,
		             .color_codec = (uint8_t)row->color_codec,
		             .color_quality = row->color_codec == PSR_CODEC_JPEG ? QUALITY : 0,
		             .depth_format = (uint8_t)row->depth_format, .depth_codec = PSR_CODEC_ZSTD, .depth_min = 1,
		             .depth_max = 8, .camera.kind = PSR_CAMERA_PERSPECTIVE },
		.jpeg = tjInitCompress(), .zstd = ZSTD_createCCtx(),
		.coded_bytes = ZSTD_compressBound(raw) + tjBufSize((int)row->width, HASH_STRIP_ROWS, TJSAMP_444),
	};
	bench->filtered = malloc(raw);
	bench->coded = malloc(bench->coded_bytes);
	if (psr_frame_alloc(&bench->frame, row->width, row->height, 3, NULL) != PSR_OK
	    || codec_create(&bench->codec) != PSR_OK || bench->filtered == NULL || bench->coded == NULL)
		die("no memory");
	for (int i = 0; i < 2; i++)
		bench->parts[i] = codec_parts_create(row->width, row->height, row->planes);
	paint(&bench->frame);
}

static void end(struct bench *bench)
{
	psr_frame_free(&bench->frame);
	codec_destroy(bench->codec);
	for (int i = 0; i < 2; i++)
		free(bench->parts[i]);
	tjDestroy(bench->jpeg);
	ZSTD_freeCCtx(bench->zstd);
	free(bench->filtered);
	free(bench->coded);
}

static void drop(struct outq_chunk *first, void *userdata)
{
	(void)userdata;
	outq_chunks_destroy(first);
}

static double encode_us(struct bench *bench, int round)
{
	const struct row *row = bench->row;
	const struct codec_answer answer = {
		.id = 1, .request = &bench->request, .scale = 1, .background = background, .emit = drop,
		.base = row->changed >= 0 && round > 0 ? bench->parts[!(round & 1)] : NULL,
		.parts = row->has_parts ? bench->parts[round & 1] : NULL,
	};
	const uint64_t start = clock_thread_ns();
	struct codec_result result;

	if (codec_encode(&result, bench->codec, NULL, &answer, &bench->frame, NULL) != PSR_OK)
		die("a frame could not be encoded");
	bench->bytes = result.rect_bytes;
	return (double)(clock_thread_ns() - start) / 1e3;
}

static void code_strip(struct bench *bench, unsigned plane, uint32_t y, uint32_t rows)
{
	const struct row *row = bench->row;
	const size_t pixel = psr_plane_bytes(plane), raw = (size_t)row->width * rows * pixel;
	const uint8_t *pixels = (uint8_t *)psr_frame_plane(&bench->frame, plane) + (size_t)y * row->width * pixel;
	unsigned long size = bench->coded_bytes;
	unsigned char *to = bench->coded;

	if (plane == PSR_PLANE_COLOR && row->color_codec == PSR_CODEC_JPEG) {
		if (tjCompress2(bench->jpeg, pixels, (int)row->width, 0, (int)rows, TJPF_RGB, &to, &size, TJSAMP_420, QUALITY,
		                TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT)
		    != 0)
			die("libjpeg-turbo failed");
		return;
	}
	if (plane == PSR_PLANE_COLOR)
		psr_filter_rows(bench->filtered, pixels, row->width, rows, 3, 1);
	else
		psr_filter_rows(bench->filtered, pixels, row->width, rows, 1, 4);
	if (ZSTD_isError(ZSTD_compressCCtx(bench->zstd, to, size, bench->filtered, raw, 1)))
		die("zstd failed");
}

static double bare_us(struct bench *bench)
{
	const uint64_t start = clock_thread_ns();

	for (unsigned plane = 0; plane < 2; plane++)
		for (uint32_t y = 0; y < bench->row->height && bench->row->planes >> plane & 1; y += HASH_STRIP_ROWS)
			code_strip(bench, plane, y,
			           bench->row->height - y < HASH_STRIP_ROWS ? bench->row->height - y : HASH_STRIP_ROWS);
	return (double)(clock_thread_ns() - start) / 1e3;
}

static void change(struct bench *bench, int round)
{
	const uint32_t rows = (uint32_t)(bench->row->changed * bench->row->height);

	for (size_t i = 0; i < (size_t)rows * bench->row->width; i++)
		bench->frame.rgb[3 * i] ^= (uint8_t)(1 + (round & 1));
}

static void measure(const struct row *row)
{
	static double ours[MOST_ROUNDS], bare[MOST_ROUNDS], beyond[MOST_ROUNDS];
	const int n = row->width < 1000 ? MOST_ROUNDS : 40;
	struct bench bench;

	begin(&bench, row);
	encode_us(&bench, 0);
	bare_us(&bench);
	for (int i = 0; i < n; i++) {
		if (row->changed > 0)
			change(&bench, i);
		ours[i] = encode_us(&bench, i + 1);
		bare[i] = bare_us(&bench);
		beyond[i] = ours[i] - bare[i];
	}
	printf("%-44s %9.1f %9.1f %9.1f   %5.2f %9.1f\n", row->name, stats_median(ours, n), stats_median(bare, n),
	       stats_median(beyond, n), stats_median(ours, n) / stats_median(bare, n), (double)bench.bytes / 1e3);
	end(&bench);
}

int main(void)
{
	enum { COLOR = 1, DEPTH = 2, F32 = PSR_WIRE_DEPTH_F32, U16 = PSR_WIRE_DEPTH_U16, HALF = PSR_WIRE_DEPTH_U16_HALF,
		   JPEG = PSR_CODEC_JPEG, ZSTD = PSR_CODEC_ZSTD, QUIET = PSR_WIRE_FRAME_NO_HASHES };
	static const struct row rows[] = {
		{ "64x64 JPEG", 64, 64, COLOR, JPEG, 0, 0, 0, -1 },
		{ "64x64 JPEG, no hashes, parts", 64, 64, COLOR, JPEG, 0, QUIET, 1, -1 },
		{ "64x64 zstd, depth", 64, 64, COLOR | DEPTH, ZSTD, F32, 0, 0, -1 },
		{ "1920x1080 JPEG", 1920, 1080, COLOR, JPEG, 0, 0, 0, -1 },
		{ "1920x1080 JPEG, no hashes", 1920, 1080, COLOR, JPEG, 0, QUIET, 0, -1 },
		{ "1920x1080 JPEG, no hashes, parts", 1920, 1080, COLOR, JPEG, 0, QUIET, 1, -1 },
		{ "1920x1080 JPEG, on a base, nothing changed", 1920, 1080, COLOR, JPEG, 0, QUIET, 1, 0 },
		{ "1920x1080 JPEG, on a base, half changed", 1920, 1080, COLOR, JPEG, 0, QUIET, 1, 0.5 },
		{ "1920x1080 zstd", 1920, 1080, COLOR, ZSTD, 0, 0, 0, -1 },
		{ "1920x1080 JPEG, depth f32", 1920, 1080, COLOR | DEPTH, JPEG, F32, QUIET, 0, -1 },
		{ "1920x1080 JPEG, depth u16 (bare: f32)", 1920, 1080, COLOR | DEPTH, JPEG, U16, QUIET, 0, -1 },
		{ "1920x1080 JPEG, depth u16 half (bare: f32)", 1920, 1080, COLOR | DEPTH, JPEG, HALF, QUIET, 0, -1 },
	};

	printf("Medians, microseconds of one thread; bare: the encoders alone, all strips; base rows: first frame without.\n");
	printf("%-44s %9s %9s %9s   %5s %9s\n", "", "codec", "bare", "beyond", "ratio", "KB sent");
	for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
		measure(&rows[i]);
	return 0;
}
