#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <png.h>
#include "base/image_module.h"
#include "import/import.h"
#include "files.h"

static int decode(struct psr_image *image, const void *bytes, size_t n, const char *name, struct psr_error *err)
{
	memset(image, 0, sizeof *image);
	return import_image_decode(image, bytes, n, name, IMPORT_MAX_PIXELS, err);
}

static void refuse_image(const void *bytes, size_t n, const char *name, int code, const char *words)
{
	struct psr_image image;
	struct psr_error err = { 0, "" };
	int rc = decode(&image, bytes, n, name, &err);

	if (rc != code || strstr(err.text, words) == NULL || strstr(err.text, name) == NULL)
		fail_msg("expected %d with \"%s\", got %d: %s", code, words, rc, err.text);
	assert_null(image.rgba);
}

/* The first of all: once it is open it stays. */
static void missing_module_is_a_clear_error(void **state)
{
	(void)state;
	assert_int_equal(setenv("PSR_IMAGE_MODULE", "/nowhere/module.so", 1), 0);
	refuse_image("BM", 2, "a.bmp", PSR_ERR_UNSUPPORTED,
	             "cannot read images: the image module cannot be loaded: /nowhere/module.so");
	refuse_image("nonsense", 8, "a.bmp", PSR_ERR_UNSUPPORTED, "not an image in a supported format");
	assert_int_equal(setenv("PSR_IMAGE_MODULE", "libm.so.6", 1), 0);
	refuse_image("BM", 2, "a.bmp", PSR_ERR_VERSION, "libm.so.6 is not psr's image module");
	unsetenv("PSR_IMAGE_MODULE");
}

static void rows_come_from_the_top(void **state)
{
	(void)state;
	static const uint8_t bgr[24] = { 0, 0, 255, 0, 0, 255, 0, 0, 255, 0, 0, 255, 9, 8, 7 };
	static const uint8_t expected[4] = { 7, 8, 9, 255 };
	uint8_t bmp[128];
	size_t n = make_bmp(bmp, 4, 2, bgr, sizeof bgr);
	struct psr_image image;

	assert_int_equal(decode(&image, bmp, n, "a.bmp", NULL), PSR_OK);
	assert_true(image.width == 4 && image.height == 2);
	assert_memory_equal(image.rgba, expected, 4);
	assert_int_equal(image.rgba[16], 255);
	free(image.rgba);
}

static void linear_floats_become_srgb(void **state)
{
	(void)state;
	/* RGBE: 128 / 256 * 2^(128 - 128) = 0.5, whose sRGB code is 188; 4 is clipped */
	static const char hdr[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n"
				  "\x80\x80\x80\x80"
				  "\x80\x40\x01\x83";
	struct psr_image image;
	struct psr_error err = { 0, "" };

	if (decode(&image, hdr, sizeof hdr - 1, "sky.hdr", &err) != PSR_OK)
		fail_msg("%s", err.text);
	assert_true(image.width == 2 && image.height == 1);
	assert_true(image.rgba[0] == 188 && image.rgba[1] == 188 && image.rgba[2] == 188 && image.rgba[3] == 255);
	assert_int_equal(image.rgba[4], 255);
	free(image.rgba);
}

static void gray_images_have_three_equal_channels(void **state)
{
	(void)state;
	static const char pgm[] = "P5\n2 1\n255\n\x10\xf0";
	static const uint8_t expected[8] = { 16, 16, 16, 255, 240, 240, 240, 255 };
	struct psr_image image;
	struct psr_error err = { 0, "" };

	if (decode(&image, pgm, sizeof pgm - 1, "g.pgm", &err) != PSR_OK)
		fail_msg("%s", err.text);
	assert_memory_equal(image.rgba, expected, 8);
	free(image.rgba);
}

static void alpha_is_not_premultiplied(void **state)
{
	(void)state;
	/* TGA of 1 x 1, 32 bits, 8 of them alpha: B G R A */
	static const uint8_t tga[22] = { 0, 0, 2, [12] = 1, [14] = 1, [16] = 32, 0x28, 50, 100, 200, 128 };
	static const uint8_t expected[4] = { 200, 100, 50, 128 };
	struct psr_image image;
	struct psr_error err = { 0, "" };

	if (decode(&image, tga, sizeof tga, "a.TGA", &err) != PSR_OK)
		fail_msg("%s", err.text);
	assert_memory_equal(image.rgba, expected, 4);
	free(image.rgba);
}

static size_t make_png(uint8_t *out, size_t size, uint32_t width, uint32_t height, png_uint_32 format,
                       const void *pixels)
{
	png_image image = { .version = PNG_IMAGE_VERSION, .width = width, .height = height, .format = format };
	png_alloc_size_t n = size;

	assert_true(png_image_write_to_memory(&image, out, &n, 0, pixels, 0, NULL));
	return n;
}

/* What libpng decodes here is what the module's OpenImageIO decodes; other kinds are left to it. */
static void plain_pngs_are_read_alike_without_the_module(void **state)
{
	static const struct {
		png_uint_32 format;
		int is_plain;
	} kind[] = { { PNG_FORMAT_RGB, 1 }, { PNG_FORMAT_RGBA, 1 }, { PNG_FORMAT_GRAY, 0 }, { PNG_FORMAT_GA, 0 },
		         { PNG_FORMAT_LINEAR_RGB, 0 } };
	const struct image_module *module;
	static uint8_t pixels[7 * 5 * 8], png[4096];

	(void)state;
	assert_int_equal(image_module_open(&module, NULL), PSR_OK);
	for (size_t i = 0; i < sizeof pixels; i++)
		pixels[i] = (uint8_t)(i * i * 2654435761u >> 13);
	for (size_t i = 0; i < sizeof kind / sizeof kind[0]; i++) {
		size_t n = make_png(png, sizeof png, 7, 5, kind[i].format, pixels);
		const struct image_module_source source = { png, n, "png", 35 };
		struct psr_image image = { 0 }, decoded;
		char message[256] = "";
		uint32_t size[2];
		uint8_t *rgba;

		assert_int_equal(import_image_plain_png(&image, png, n, 35), kind[i].is_plain);
		assert_int_equal(module->read(&rgba, size, &source, message, sizeof message), PSR_OK);
		assert_int_equal(decode(&decoded, png, n, "a.png", NULL), PSR_OK);
		assert_memory_equal(decoded.rgba, rgba, 4 * 7 * 5);
		if (kind[i].is_plain) {
			assert_true(image.width == 7 && image.height == 5);
			assert_memory_equal(image.rgba, rgba, 4 * 7 * 5);
		} else {
			assert_null(image.rgba);
		}
		assert_false(import_image_plain_png(&image, png, n, 34));
		for (size_t cut = 0; cut < n; cut++)
			assert_false(import_image_plain_png(&image, png, cut, 35));
		free(image.rgba);
		free(decoded.rgba);
		free(rgba);
	}
}

static void headers_that_lie_are_refused(void **state)
{
	(void)state;
	uint8_t bmp[128], pixels[12] = { 0 };
	size_t n = make_bmp(bmp, 20000, 4, pixels, sizeof pixels);
	struct psr_image image;
	struct psr_error err;

	refuse_image(bmp, n, "huge.bmp", PSR_ERR_LIMIT, "20000 x 4");
	n = make_bmp(bmp, 4000, 4000, pixels, sizeof pixels);
	refuse_image(bmp, n, "short.bmp", PSR_ERR_FORMAT, "broken image");
	n = make_bmp(bmp, 4, 1, pixels, sizeof pixels);
	assert_int_equal(import_image_decode(&image, bmp, n, "many.bmp", 3, &err), PSR_ERR_LIMIT);
	assert_non_null(strstr(err.text, "many.bmp"));
}

static void what_is_no_image_is_refused(void **state)
{
	(void)state;
	refuse_image("hello", 5, "note.png", PSR_ERR_UNSUPPORTED, "not an image");
	refuse_image("", 0, "note.png", PSR_ERR_UNSUPPORTED, "not an image");
	refuse_image("\x89PNG\r\n\x1a\n", 8, "cut.png", PSR_ERR_FORMAT, "broken image");
	refuse_image("\xff\xd8\xff\xe0", 4, "cut.jpg", PSR_ERR_FORMAT, "broken image");
}

static void a_cut_image_is_refused(void **state)
{
	(void)state;
	static const uint8_t bgr[24] = { 1, 2, 3 };
	uint8_t bmp[128];
	size_t n = make_bmp(bmp, 4, 2, bgr, sizeof bgr);

	for (size_t cut = 2; cut < n; cut++) {
		uint8_t *exact = malloc(cut);

		assert_non_null(exact);
		memcpy(exact, bmp, cut);
		refuse_image(exact, cut, "cut.bmp", PSR_ERR_FORMAT, "");
		free(exact);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(missing_module_is_a_clear_error),
		cmocka_unit_test(rows_come_from_the_top),
		cmocka_unit_test(linear_floats_become_srgb),
		cmocka_unit_test(gray_images_have_three_equal_channels),
		cmocka_unit_test(alpha_is_not_premultiplied),
		cmocka_unit_test(plain_pngs_are_read_alike_without_the_module),
		cmocka_unit_test(headers_that_lie_are_refused),
		cmocka_unit_test(what_is_no_image_is_refused),
		cmocka_unit_test(a_cut_image_is_refused),
	};

	return cmocka_run_group_tests_name("import_image", tests, NULL, NULL);
}
