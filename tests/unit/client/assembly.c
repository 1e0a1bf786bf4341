/* Rectangles become a picture; a server that lies is found out. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <zstd.h>
#include "base/random.h"
#include "client/lib/internal.h"

#define W 37
#define H 29

static uint8_t planes[PSR_N_PLANES][8 * W * H]; /* colour and depth are these: */
static uint8_t rgb[3 * W * H];
static float depth[W * H];
static struct client_decoder *decoder;

struct trial {
	struct client_assembly assembly;
	struct psr_msg_frame asked;
	struct psr_msg_frame_end end;
	struct psr_error err;
};

static uint64_t random_state = 1;

static uint32_t next_random(uint32_t below)
{
	return random_below(&random_state, below);
}

static int set_up(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof rgb; i++)
		rgb[i] = (uint8_t)next_random(256);
	for (size_t i = 0; i < W * H; i++)
		depth[i] = next_random(3) == 0 ? INFINITY : (float)next_random(100000) / 777;
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		for (size_t i = 0; i < sizeof planes[plane]; i++)
			planes[plane][i] = (uint8_t)next_random(256);
	memcpy(planes[PSR_PLANE_COLOR], rgb, sizeof rgb);
	memcpy(planes[PSR_PLANE_DEPTH], depth, sizeof depth);
	return client_decoder_create(&decoder);
}

static int tear_down(void **state)
{
	(void)state;
	client_decoder_destroy(decoder);
	return 0;
}

static void start_planes(struct trial *trial, uint8_t codec, uint32_t wanted)
{
	struct psr_msg_frame_begin begin = { .width = W, .height = H, .settings = { .scale = 1 } };
	const struct psr_frame drawn = {
		.width = W, .height = H, .rgb = planes[PSR_PLANE_COLOR], .depth = (float *)planes[PSR_PLANE_DEPTH],
		.normal = (int16_t *)planes[PSR_PLANE_NORMAL], .id = (uint32_t *)planes[PSR_PLANE_ID],
		.weight = planes[PSR_PLANE_WEIGHT], .words = (uint64_t *)planes[PSR_PLANE_WORDS],
		.block = planes[PSR_PLANE_BLOCK], .bound = (uint16_t *)planes[PSR_PLANE_BOUND],
	};
	struct psr_msg_frame *asked = &trial->asked;

	memset(trial, 0, sizeof *trial);
	asked->width = W;
	asked->height = H;
	asked->planes = wanted;
	asked->color_codec = codec;
	asked->color_quality = codec == PSR_CODEC_JPEG ? 90 : 0;
	asked->depth_format = PSR_WIRE_DEPTH_F32;
	asked->depth_codec = PSR_CODEC_ZSTD;
	asked->data_codec = wanted >> 2 ? PSR_CODEC_ZSTD : 0;
	client_assembly_init(&trial->assembly, asked, 0);
	begin.planes = asked->planes;
	begin.color_codec = asked->color_codec;
	begin.color_quality = asked->color_quality;
	begin.depth_format = asked->depth_format;
	begin.depth_codec = asked->depth_codec;
	begin.data_codec = asked->data_codec;
	memcpy(begin.background, "\x01\x02\x03", 3);
	assert_int_equal(client_assembly_begin(&trial->assembly, &begin, NULL, &trial->err), PSR_OK);
	trial->end.is_final = 1;
	trial->end.planes = asked->planes;
	trial->end.has_hashes = 1;
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (wanted >> plane & 1)
			trial->end.hash[plane] = psr_frame_hash(&drawn, plane);
}

static void start(struct trial *trial, uint8_t codec)
{
	start_planes(trial, codec, 3);
}

/* The coded bytes of a rectangle of the plane; the caller frees them. */
static uint8_t *encode(const struct psr_msg_rect *rect, size_t *n)
{
	unsigned pixel = psr_plane_pixel_bytes(rect->plane, PSR_WIRE_DEPTH_F32);
	unsigned component = psr_plane_component_bytes(rect->plane, PSR_WIRE_DEPTH_F32);
	const uint8_t *plane = planes[rect->plane];
	size_t raw = (size_t)rect->w * rect->h * pixel;
	uint8_t *rows = malloc(raw), *out;

	for (unsigned y = 0; y < rect->h; y++)
		memcpy(rows + (size_t)y * rect->w * pixel, plane + ((size_t)(rect->y + y) * W + rect->x) * pixel,
		       rect->w * pixel);
	if (rect->codec == PSR_CODEC_RAW) {
		*n = raw;
		return rows;
	}
	if (rect->codec == PSR_CODEC_JPEG) {
		tjhandle jpeg = tjInitCompress();
		unsigned char *coded = NULL;
		unsigned long size = 0;

		assert_int_equal(tjCompress2(jpeg, rows, rect->w, 0, rect->h, TJPF_RGB, &coded, &size, TJSAMP_444, 100, 0), 0);
		out = malloc(size);
		memcpy(out, coded, size);
		*n = size;
		tjFree(coded);
		tjDestroy(jpeg);
	} else {
		uint8_t *filtered = malloc(raw);

		psr_filter_rows(filtered, rows, rect->w, rect->h, pixel / component, component);
		out = malloc(ZSTD_compressBound(raw));
		*n = ZSTD_compress(out, ZSTD_compressBound(raw), filtered, raw, 1);
		assert_false(ZSTD_isError(*n));
		free(filtered);
	}
	free(rows);
	return out;
}

/* Sends the rectangle in pieces of at most `most` bytes, each from an allocation of its own size. */
static int send_rect(struct trial *trial, struct psr_msg_rect rect, uint32_t most)
{
	size_t n;
	uint8_t *coded = encode(&rect, &n);
	int code = PSR_OK;

	rect.total = (uint32_t)n;
	for (rect.offset = 0; rect.offset < rect.total && code == PSR_OK; rect.offset += rect.bytes) {
		uint8_t *piece;

		rect.bytes = rect.total - rect.offset < most ? rect.total - rect.offset : 1 + next_random(most);
		piece = malloc(rect.bytes);
		memcpy(piece, coded + rect.offset, rect.bytes);
		rect.data = piece;
		code = client_assembly_rect(&trial->assembly, decoder, &rect, &trial->err);
		free(piece);
	}
	free(coded);
	return code;
}

static int finish(struct trial *trial, unsigned *checked)
{
	return client_assembly_end(&trial->assembly, &trial->end, checked, &trial->err);
}

static void rectangles_in_pieces_make_the_picture(void **state)
{
	static const uint8_t codecs[] = { PSR_CODEC_ZSTD, PSR_CODEC_RAW };

	(void)state;
	for (int round = 0; round < 40; round++) {
		struct trial trial;
		unsigned checked;
		uint32_t most = round < 5 ? 1 : 1 + next_random(3000);

		start(&trial, codecs[round & 1]);
		for (uint16_t y = 0; y < H;) {
			uint16_t h = (uint16_t)(1 + next_random(H - y)), split = (uint16_t)(1 + next_random(W - 1));

			for (uint8_t plane = 0; plane < 2; plane++) {
				uint8_t codec = plane == 0 ? codecs[round & 1] : PSR_CODEC_ZSTD;

				assert_int_equal(
					send_rect(&trial, (struct psr_msg_rect){ plane, codec, 1, 0, y, split, h, 0, 0, 0, NULL }, most),
					PSR_OK);
				assert_int_equal(send_rect(&trial,
				                           (struct psr_msg_rect){ plane, codec, 1, split, y, (uint16_t)(W - split), h,
				                                                  0, 0, 0, NULL },
				                           most),
				                 PSR_OK);
			}
			y = (uint16_t)(y + h);
		}
		assert_int_equal(finish(&trial, &checked), PSR_OK);
		assert_int_equal(checked, 3);
		assert_memory_equal(trial.assembly.picture.rgb, rgb, sizeof rgb);
		assert_memory_equal(trial.assembly.picture.depth, depth, sizeof depth);
		client_assembly_fini(&trial.assembly);
	}
}

static void every_plane_comes_back_and_starts_as_its_background(void **state)
{
	(void)state;
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
		for (unsigned others = 0; others < 2; others++) {
			const unsigned pixel = psr_plane_pixel_bytes(plane, PSR_WIRE_DEPTH_F32);
			struct psr_msg_rect rect = { (uint8_t)plane, PSR_CODEC_ZSTD, 1, 0, 0, W, 1, 0, 0, 0, NULL };
			struct trial trial;
			const uint8_t *got;
			unsigned checked;

			start_planes(&trial, PSR_CODEC_ZSTD, others ? (1u << PSR_N_PLANES) - 1 : 1u << plane);
			got = psr_frame_plane(&trial.assembly.picture, plane);
			assert_int_equal(psr_frame_plane(&trial.assembly.picture, (plane + 1) % PSR_N_PLANES) != NULL, others);
			for (size_t i = 0; i < W * H; i++)
				assert_memory_equal(got + i * pixel,
				                    plane == 0 ? (const uint8_t *)"\x01\x02\x03" : psr_plane_background(plane), pixel);
			assert_int_equal(send_rect(&trial, rect, 100), PSR_OK);
			rect.y = 1;
			rect.h = H - 1;
			rect.codec = PSR_CODEC_RAW;
			assert_int_equal(send_rect(&trial, rect, 100), PSR_OK);
			assert_memory_equal(got, planes[plane], W * H * pixel);
			for (unsigned other = 0; other < PSR_N_PLANES && others; other++) {
				rect = (struct psr_msg_rect){ (uint8_t)other, PSR_CODEC_ZSTD, 1, 0, 0, W, H, 0, 0, 0, NULL };
				assert_int_equal(send_rect(&trial, rect, 1000), PSR_OK);
			}
			assert_int_equal(finish(&trial, &checked), PSR_OK);
			assert_int_equal(checked, trial.asked.planes);
			trial.end.hash[plane] ^= 1;
			assert_int_equal(finish(&trial, &checked), PSR_ERR_FORMAT);
			assert_non_null(strstr(trial.err.text, plane == 0 ? "colour plane" : psr_plane_name(plane)));
			client_assembly_fini(&trial.assembly);
		}
	}
}

static void pixels_without_a_rectangle_are_background(void **state)
{
	struct trial trial;

	(void)state;
	start(&trial, PSR_CODEC_ZSTD);
	assert_int_equal(send_rect(&trial, (struct psr_msg_rect){ 0, PSR_CODEC_ZSTD, 1, 2, 3, 4, 5, 0, 0, 0, NULL }, 9999),
	                 PSR_OK);
	for (int y = 0; y < H; y++) {
		for (int x = 0; x < W; x++) {
			const uint8_t *pixel = trial.assembly.picture.rgb + 3 * (W * y + x);
			int inside = x >= 2 && x < 6 && y >= 3 && y < 8;

			assert_memory_equal(pixel, inside ? rgb + 3 * (W * y + x) : (const uint8_t *)"\x01\x02\x03", 3);
			assert_true(isinf(trial.assembly.picture.depth[W * y + x]));
		}
	}
	client_assembly_fini(&trial.assembly);
}

static void wrong_hash_is_found(void **state)
{
	(void)state;
	for (int plane = 0; plane < 2; plane++) {
		struct trial trial;
		unsigned checked;

		start(&trial, PSR_CODEC_ZSTD);
		assert_int_equal(
			send_rect(&trial, (struct psr_msg_rect){ 0, PSR_CODEC_ZSTD, 1, 0, 0, W, H, 0, 0, 0, NULL }, 500), PSR_OK);
		assert_int_equal(
			send_rect(&trial, (struct psr_msg_rect){ 1, PSR_CODEC_ZSTD, 1, 0, 0, W, H, 0, 0, 0, NULL }, 500), PSR_OK);
		trial.end.hash[plane] ^= 1;
		assert_int_equal(finish(&trial, &checked), PSR_ERR_FORMAT);
		assert_non_null(strstr(trial.err.text, plane == 0 ? "colour" : "depth"));
		client_assembly_fini(&trial.assembly);
	}
}

static void jpeg_is_close_and_its_hash_is_not_checked(void **state)
{
	struct trial trial;
	unsigned checked;
	int worst = 0;

	(void)state;
	start(&trial, PSR_CODEC_JPEG);
	assert_int_equal(send_rect(&trial, (struct psr_msg_rect){ 0, PSR_CODEC_JPEG, 1, 0, 0, W, 16, 0, 0, 0, NULL }, 300),
	                 PSR_OK);
	assert_int_equal(
		send_rect(&trial, (struct psr_msg_rect){ 0, PSR_CODEC_JPEG, 1, 0, 16, W, H - 16, 0, 0, 0, NULL }, 300), PSR_OK);
	assert_int_equal(send_rect(&trial, (struct psr_msg_rect){ 1, PSR_CODEC_ZSTD, 1, 0, 0, W, H, 0, 0, 0, NULL }, 300),
	                 PSR_OK);
	assert_int_equal(finish(&trial, &checked), PSR_OK);
	assert_int_equal(checked, 2);
	for (size_t i = 0; i < sizeof rgb; i++) {
		int off = abs(trial.assembly.picture.rgb[i] - rgb[i]);

		worst = off > worst ? off : worst;
	}
	/* Quality 100 rounds each of the 64 coefficients of a channel by at most a half; the weights of all of them in
	 * one sample sum up to (1/sqrt(2) + 7)^2 / 4 < 14.9 at most, so that a channel is off by less than 7.5, and by 1
	 * more for its own two roundings. Blue is Y + 1.772 Cb, the greatest mixture: 8.5 * 2.772 + 1/2 < 24.1. */
	assert_true(worst <= 24);
	client_assembly_fini(&trial.assembly);
}

static void reduced_rectangles_are_enlarged(void **state)
{
	uint8_t data[3 * 10 * 8];
	struct psr_msg_rect rect = { 0, PSR_CODEC_RAW, 4, 0, 0, W, H, sizeof data, 0, sizeof data, data };
	struct trial trial;

	(void)state;
	for (size_t i = 0; i < sizeof data; i++)
		data[i] = (uint8_t)(i * 7);
	start(&trial, PSR_CODEC_RAW);
	assert_int_equal(client_assembly_rect(&trial.assembly, decoder, &rect, &trial.err), PSR_OK);
	for (int y = 0; y < H; y++)
		for (int x = 0; x < W; x++)
			assert_memory_equal(trial.assembly.picture.rgb + 3 * (W * y + x), data + 3 * (10 * (y / 4) + x / 4), 3);
	client_assembly_fini(&trial.assembly);
}

static void lies_about_rectangles_are_refused(void **state)
{
	static uint8_t data[64];
	static const uint32_t raw = 3 * 4 * 4;
	const struct psr_msg_rect good = { 0, PSR_CODEC_RAW, 1, 0, 0, 4, 4, 3 * 4 * 4, 0, 10, data };
	struct psr_msg_rect bad[14];
	size_t n = 0;

	(void)state;
	for (size_t i = 0; i < 14; i++)
		bad[i] = good;
	bad[n++].plane = 2;
	bad[n++].codec = PSR_CODEC_JPEG; /* zstd was asked for */
	bad[n++].codec = PSR_CODEC_PNG;
	bad[n++].scale = 3;
	bad[n++].x = W - 3;
	bad[n++].y = H - 3;
	bad[n++].w = 65535;
	bad[n++].h = 0;
	bad[n++].total = raw + 1;
	bad[n++].total = raw - 1;
	bad[n++].total = 0;
	bad[n++].offset = 1;
	bad[n].codec = PSR_CODEC_ZSTD;
	bad[n++].total = 2 * raw + 65536 + 1;
	bad[n].codec = PSR_CODEC_ZSTD;
	bad[n++].total = 5; /* 10 bytes come */
	for (size_t i = 0; i < n; i++) {
		struct trial trial;

		start(&trial, PSR_CODEC_ZSTD);
		if (client_assembly_rect(&trial.assembly, decoder, &bad[i], &trial.err) != PSR_ERR_PROTOCOL)
			fail_msg("lie %zu was taken", i);
		client_assembly_fini(&trial.assembly);
	}
}

static void pieces_out_of_turn_are_refused(void **state)
{
	static uint8_t data[64];
	const struct psr_msg_rect first = { 0, PSR_CODEC_RAW, 1, 0, 0, 4, 4, 3 * 4 * 4, 0, 10, data };
	struct psr_msg_rect second[6];
	unsigned checked;

	(void)state;
	for (int i = 0; i < 6; i++) {
		second[i] = first;
		second[i].offset = 10;
	}
	second[0].offset = 9;
	second[1].offset = 11;
	second[2].x = 1;
	second[3].plane = 1;
	second[4].total++;
	second[5].bytes = 39; /* one more than is left */
	for (int i = 0; i < 6; i++) {
		struct trial trial;

		start(&trial, PSR_CODEC_RAW);
		assert_int_equal(client_assembly_rect(&trial.assembly, decoder, &first, &trial.err), PSR_OK);
		if (client_assembly_rect(&trial.assembly, decoder, &second[i], &trial.err) != PSR_ERR_PROTOCOL)
			fail_msg("piece %d was taken", i);
		client_assembly_fini(&trial.assembly);
		start(&trial, PSR_CODEC_RAW);
		assert_int_equal(client_assembly_rect(&trial.assembly, decoder, &first, &trial.err), PSR_OK);
		assert_int_equal(finish(&trial, &checked), PSR_ERR_PROTOCOL);
		client_assembly_fini(&trial.assembly);
	}
}

static void claimed_memory_is_not_taken_before_bytes_come(void **state)
{
	static uint8_t data[1];
	struct psr_msg_rect rect = { 0, PSR_CODEC_ZSTD, 1, 0, 0, W, H, 2 * 3 * W * H + 65536, 0, 1, data };
	struct trial trial;

	(void)state;
	start(&trial, PSR_CODEC_ZSTD);
	assert_int_equal(client_assembly_rect(&trial.assembly, decoder, &rect, &trial.err), PSR_OK);
	assert_true(trial.assembly.pieces_capacity <= 2);
	client_assembly_fini(&trial.assembly);
}

static void another_frame_than_asked_is_refused(void **state)
{
	struct psr_msg_frame asked = { .width = 8, .height = 8, .planes = 1, .color_codec = PSR_CODEC_ZSTD };
	const struct psr_msg_frame_begin good = { .width = 8, .height = 8, .planes = 1, .color_codec = PSR_CODEC_ZSTD };
	struct psr_msg_frame_begin bad[7];
	struct client_assembly assembly;
	unsigned checked;

	(void)state;
	for (int i = 0; i < 7; i++)
		bad[i] = good;
	bad[0].width = 16384;
	bad[1].height = 7;
	bad[2].planes = 3;
	bad[3].color_codec = PSR_CODEC_RAW;
	bad[4].pass = 1;
	bad[5].base = 1;
	bad[6].depth_format = PSR_WIRE_DEPTH_F32;
	for (int i = 0; i < 7; i++) {
		client_assembly_init(&assembly, &asked, 0);
		assert_int_equal(client_assembly_begin(&assembly, &bad[i], NULL, NULL), PSR_ERR_PROTOCOL);
		assert_null(assembly.picture.rgb);
		client_assembly_fini(&assembly);
	}
	client_assembly_init(&assembly, &asked, 0);
	assert_int_equal(
		client_assembly_end(&assembly, &(struct psr_msg_frame_end){ .is_final = 1, .planes = 1 }, &checked, NULL),
		PSR_ERR_PROTOCOL);
	assert_int_equal(client_assembly_begin(&assembly, &good, NULL, NULL), PSR_OK);
	assert_int_equal(client_assembly_begin(&assembly, &good, NULL, NULL), PSR_ERR_PROTOCOL);
	client_assembly_fini(&assembly);
}

static void damaged_codes_are_errors_and_never_crash(void **state)
{
	static const uint8_t codecs[] = { PSR_CODEC_ZSTD, PSR_CODEC_JPEG };

	(void)state;
	for (int round = 0; round < 2000; round++) {
		struct psr_msg_rect rect = { 0, codecs[round & 1], 1, 3, 2, 16, 16, 0, 0, 0, NULL };
		struct trial trial;
		size_t n;
		uint8_t *coded = encode(&rect, &n), *exact;
		int code, n_flips = round % 4;

		if (round % 4 == 0)
			n = next_random((uint32_t)n - 1) + 1;
		for (int i = 0; i < n_flips; i++)
			coded[next_random((uint32_t)n)] ^= (uint8_t)(1 + next_random(255));
		exact = malloc(n);
		memcpy(exact, coded, n);
		rect.total = rect.bytes = (uint32_t)n;
		rect.data = exact;
		start(&trial, codecs[round & 1]);
		code = client_assembly_rect(&trial.assembly, decoder, &rect, &trial.err);
		assert_true(code == PSR_OK || code == PSR_ERR_PROTOCOL);
		if (codecs[round & 1] == PSR_CODEC_ZSTD && n_flips == 0)
			assert_int_equal(code, PSR_ERR_PROTOCOL); /* cut short */
		client_assembly_fini(&trial.assembly);
		free(exact);
		free(coded);
	}
}

static void jpeg_of_another_size_is_refused(void **state)
{
	const struct psr_msg_rect large = { 0, PSR_CODEC_JPEG, 1, 0, 0, 32, 24, 0, 0, 0, NULL };
	struct psr_msg_rect rect = { 0, PSR_CODEC_JPEG, 1, 0, 0, 16, 16, 0, 0, 0, NULL };
	struct trial trial;
	size_t n;
	uint8_t *coded = encode(&large, &n);

	(void)state;
	rect.total = rect.bytes = (uint32_t)n;
	rect.data = coded;
	start(&trial, PSR_CODEC_JPEG);
	assert_int_equal(client_assembly_rect(&trial.assembly, decoder, &rect, &trial.err), PSR_ERR_PROTOCOL);
	client_assembly_fini(&trial.assembly);
	free(coded);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rectangles_in_pieces_make_the_picture),
		cmocka_unit_test(every_plane_comes_back_and_starts_as_its_background),
		cmocka_unit_test(pixels_without_a_rectangle_are_background),
		cmocka_unit_test(wrong_hash_is_found),
		cmocka_unit_test(jpeg_is_close_and_its_hash_is_not_checked),
		cmocka_unit_test(reduced_rectangles_are_enlarged),
		cmocka_unit_test(lies_about_rectangles_are_refused),
		cmocka_unit_test(pieces_out_of_turn_are_refused),
		cmocka_unit_test(claimed_memory_is_not_taken_before_bytes_come),
		cmocka_unit_test(another_frame_than_asked_is_refused),
		cmocka_unit_test(damaged_codes_are_errors_and_never_crash),
		cmocka_unit_test(jpeg_of_another_size_is_refused),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
