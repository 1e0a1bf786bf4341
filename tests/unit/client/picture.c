/* Pictures as files. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <png.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <dirent.h>
#include <unistd.h>
#include "client/lib/picture.h"
#include "proto/proto.h"

#define W 5
#define H 3

static char folder[256], name[512];
static uint8_t rgb[3 * W * H];
static float depth[W * H];
static const struct psr_frame picture = { .width = W, .height = H, .rgb = rgb, .depth = depth };

static int set_up(void **state)
{
	const char *root = getenv("TMPDIR");

	(void)state;
	for (int i = 0; i < 3 * W * H; i++)
		rgb[i] = (uint8_t)(i * 37 + 11);
	for (int i = 0; i < W * H; i++)
		depth[i] = i % 4 == 3 ? INFINITY : (float)i * 1.25f + 0.1f;
	snprintf(folder, sizeof folder, "%s/psr-picture-XXXXXX", root != NULL ? root : "/tmp");
	return mkdtemp(folder) == NULL;
}

static const char *in_folder(const char *leaf)
{
	snprintf(name, sizeof name, "%s/%s", folder, leaf);
	return name;
}

static int n_files(void)
{
	DIR *dir = opendir(folder);
	struct dirent *entry;
	int n = 0;

	while ((entry = readdir(dir)) != NULL)
		n += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
	closedir(dir);
	return n;
}

static int tear_down(void **state)
{
	DIR *dir = opendir(folder);
	struct dirent *entry;

	(void)state;
	while ((entry = readdir(dir)) != NULL)
		if (entry->d_type != DT_DIR)
			unlink(in_folder(entry->d_name));
	closedir(dir);
	return rmdir(folder);
}

static size_t read_all(const char *path, char *to, size_t size)
{
	FILE *file = fopen(path, "rb");
	size_t n;

	assert_non_null(file);
	n = fread(to, 1, size, file);
	fclose(file);
	return n;
}

static void write_text(const char *path, const char *text)
{
	FILE *file = fopen(path, "wb");

	assert_non_null(file);
	fputs(text, file);
	fclose(file);
}

static void png_has_the_same_pixels_and_says_srgb(void **state)
{
	png_image image = { .version = PNG_IMAGE_VERSION };
	uint8_t back[3 * W * H];
	char bytes[2048];
	size_t n;

	(void)state;
	assert_int_equal(psr_picture_write_color(&picture, in_folder("a.png"), NULL), PSR_OK);
	assert_true(png_image_begin_read_from_file(&image, name));
	assert_true(image.width == W && image.height == H);
	image.format = PNG_FORMAT_RGB;
	assert_true(png_image_finish_read(&image, NULL, back, 0, NULL));
	assert_memory_equal(back, rgb, sizeof rgb);
	n = read_all(name, bytes, sizeof bytes);
	assert_non_null(memmem(bytes, n, "sRGB", 4));
}

static void ppm_has_the_same_pixels(void **state)
{
	char bytes[256];
	size_t n;

	(void)state;
	assert_int_equal(psr_picture_write_color(&picture, in_folder("a.PPM"), NULL), PSR_OK);
	n = read_all(name, bytes, sizeof bytes);
	assert_int_equal(n, 11 + sizeof rgb);
	assert_memory_equal(bytes, "P6\n5 3\n255\n", 11);
	assert_memory_equal(bytes + 11, rgb, sizeof rgb);
}

static void pfm_is_bottom_up_little_endian_with_infinity(void **state)
{
	char bytes[256];
	size_t n;

	(void)state;
	assert_int_equal(psr_picture_write_depth(&picture, in_folder("a.pfm"), NULL), PSR_OK);
	n = read_all(name, bytes, sizeof bytes);
	assert_int_equal(n, 12 + sizeof depth);
	assert_memory_equal(bytes, "Pf\n5 3\n-1.0\n", 12);
	for (int y = 0; y < H; y++) {
		for (int x = 0; x < W; x++) {
			const uint8_t *p = (const uint8_t *)bytes + 12 + 4 * (W * (H - 1 - y) + x);
			uint32_t bits = p[0] | p[1] << 8 | p[2] << 16 | (uint32_t)p[3] << 24;

			assert_memory_equal(&bits, &depth[W * y + x], 4);
			if (isinf(depth[W * y + x]))
				assert_int_equal(bits, 0x7f800000);
		}
	}
}

static void npy_holds_every_plane_as_it_is(void **state)
{
	static const struct {
		unsigned plane;
		const char *descr, *shape;
	} table[PSR_N_PLANES] = {
		{ PSR_PLANE_COLOR, "|u1", "(3, 5, 3)" }, { PSR_PLANE_DEPTH, "<f4", "(3, 5)" },
		{ PSR_PLANE_NORMAL, "<i2", "(3, 5, 3)" }, { PSR_PLANE_ID, "<u4", "(3, 5)" },
		{ PSR_PLANE_WEIGHT, "|u1", "(3, 5)" }, { PSR_PLANE_WORDS, "<u8", "(3, 5)" },
		{ PSR_PLANE_BLOCK, "|u1", "(3, 5, 3)" }, { PSR_PLANE_BOUND, "<u2", "(3, 5)" },
	};
	static uint8_t data[8 * W * H];
	struct psr_frame all = { .width = W, .height = H, .rgb = data, .depth = (float *)data, .normal = (int16_t *)data,
		                       .id = (uint32_t *)data, .weight = data, .words = (uint64_t *)data, .block = data,
		                       .bound = (uint16_t *)data };

	(void)state;
	for (unsigned i = 0; i < sizeof data; i++)
		data[i] = (uint8_t)(i * 29 + 3);
	for (unsigned i = 0; i < PSR_N_PLANES; i++) {
		size_t n_data = W * H * psr_plane_pixel_bytes(table[i].plane, PSR_WIRE_DEPTH_F32), n, head;
		char bytes[512], expected[128];

		assert_int_equal(psr_picture_check_plane(table[i].plane, "a.NPY", NULL), PSR_OK);
		assert_int_equal(psr_picture_write_plane(&all, table[i].plane, in_folder("a.npy"), NULL), PSR_OK);
		n = read_all(name, bytes, sizeof bytes);
		assert_memory_equal(bytes, "\x93NUMPY\x01\x00", 8);
		head = 10 + ((size_t)(uint8_t)bytes[8] | (size_t)(uint8_t)bytes[9] << 8);
		assert_true(head % 64 == 0 && head + n_data == n);
		snprintf(expected, sizeof expected, "{'descr': '%s', 'fortran_order': False, 'shape': %s, }", table[i].descr,
		         table[i].shape);
		assert_memory_equal(bytes + 10, expected, strlen(expected));
		for (size_t k = 10 + strlen(expected); k < head; k++)
			assert_int_equal(bytes[k], k + 1 < head ? ' ' : '\n');
		assert_memory_equal(bytes + head, data, n_data);
	}
}

/* -1, 0 and 1 become 0, 127.5 and 255; a step of a code is 257 of a normal. */
static void normals_and_weights_are_pictures_to_look_at(void **state)
{
	static const int16_t normal[3 * W * H] = { 32767, 0, -32767, -128, 128, 129, [12] = 0, -32767, 0 };
	static const uint8_t weight[W * H] = { 0, 255, 7 };
	const struct psr_frame data = { .width = W, .height = H, .normal = (int16_t *)normal,
	                                  .weight = (uint8_t *)weight };
	uint8_t bytes[256];

	(void)state;
	assert_int_equal(psr_picture_write_plane(&data, PSR_PLANE_NORMAL, in_folder("n.ppm"), NULL), PSR_OK);
	assert_int_equal(read_all(name, (char *)bytes, sizeof bytes), 11 + 3 * W * H);
	assert_memory_equal(bytes + 11, ((const uint8_t[]){ 255, 128, 0, 127, 128, 128, 0, 0, 0, 0, 0, 0, 128, 0, 128 }),
	                    15);
	assert_int_equal(psr_picture_write_plane(&data, PSR_PLANE_WEIGHT, in_folder("w.ppm"), NULL), PSR_OK);
	read_all(name, (char *)bytes, sizeof bytes);
	assert_memory_equal(bytes + 11, "\0\0\0\xff\xff\xff\x07\x07\x07\0\0\0", 12);
}

static void unfit_endings_are_refused(void **state)
{
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_picture_check_color("picture", &err), PSR_ERR_ARG);
	assert_int_equal(psr_picture_check_color("a.b/picture", &err), PSR_ERR_ARG);
	assert_int_equal(psr_picture_check_color(".png", &err), PSR_ERR_ARG);
	assert_int_equal(psr_picture_check_color("a.pfm", &err), PSR_ERR_ARG);
	assert_int_equal(psr_picture_check_depth("a.png", &err), PSR_ERR_ARG);
	assert_int_equal(psr_picture_check_depth("a.pfm", &err), PSR_OK);
	assert_int_equal(psr_picture_check_color("a.png", &err), PSR_OK);
	assert_int_equal(psr_picture_check_plane(PSR_PLANE_COLOR, "a.png", &err), PSR_OK);
	assert_int_equal(psr_picture_check_plane(PSR_PLANE_DEPTH, "a.png", &err), PSR_ERR_ARG);
	assert_int_equal(psr_picture_check_plane(PSR_PLANE_NORMAL, "a.pfm", &err), PSR_ERR_ARG);
	for (unsigned plane = PSR_PLANE_ID; plane < PSR_N_PLANES; plane++)
		if (plane != PSR_PLANE_WEIGHT) {
			assert_int_equal(psr_picture_check_plane(plane, "a.png", &err), PSR_ERR_ARG);
			assert_non_null(strstr(err.text, ".npy"));
		}
}

static void missing_module_is_a_clear_error(void **state)
{
	struct psr_error err;

	(void)state;
	setenv("PSR_IMAGE_MODULE", "/nowhere/module.so", 1);
	assert_int_equal(psr_picture_check_color("a.webp", &err), PSR_ERR_UNSUPPORTED);
	assert_non_null(strstr(err.text, "/nowhere/module.so"));
	assert_int_equal(psr_picture_write_depth(&picture, in_folder("a.exr"), &err), PSR_ERR_UNSUPPORTED);
	assert_int_equal(access(name, F_OK), -1);
	unsetenv("PSR_IMAGE_MODULE");
}

/* The module of this build, where this configuration has one. */
static int has_module(void)
{
	const char *build = getenv("BUILD");
	char path[600];

	snprintf(path, sizeof path, "%s/lib/psr-image-oiio.so", build != NULL ? build : ".");
	return access(path, R_OK) == 0 && setenv("PSR_IMAGE_MODULE", path, 1) == 0;
}

static void module_writes_what_libpng_does_not(void **state)
{
	struct psr_error err;
	char bytes[4096];
	size_t n;

	(void)state;
	if (!has_module())
		skip();
	assert_int_equal(psr_picture_write_depth(&picture, in_folder("a.exr"), &err), PSR_OK);
	n = read_all(name, bytes, sizeof bytes);
	assert_memory_equal(bytes, "\x76\x2f\x31\x01", 4);
	/* its one channel: name Z, pixel type 2 (float) */
	assert_non_null(memmem(bytes, n, "channels\0chlist\0\x13\0\0\0Z\0\2\0\0\0", 26));
	assert_int_equal(psr_picture_write_color(&picture, in_folder("a.jpg"), &err), PSR_OK);
	assert_true(read_all(name, bytes, sizeof bytes) > 2);
	assert_memory_equal(bytes, "\xff\xd8", 2);
	if (access("/dev/full", W_OK) == 0) { /* libjpeg left to itself would end the process */
		assert_int_equal(symlink("/dev/full", in_folder("full.jpg")), 0);
		assert_int_equal(psr_picture_write_color(&picture, name, &err), PSR_ERR_IO);
		assert_non_null(strstr(err.text, "No space left"));
	}
	assert_int_equal(psr_picture_write_depth(&picture, in_folder("b.jpg"), &err), PSR_ERR_UNSUPPORTED);
	assert_int_equal(access(name, F_OK), -1);
	assert_int_equal(psr_picture_write_color(&picture, in_folder("b.nonsense"), &err), PSR_ERR_UNSUPPORTED);
	assert_non_null(strstr(err.text, ".nonsense"));
	unsetenv("PSR_IMAGE_MODULE");
}

static void missing_folder_is_not_found(void **state)
{
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_picture_write_color(&picture, in_folder("no/a.png"), &err), PSR_ERR_NOT_FOUND);
	assert_non_null(strstr(err.text, "no/a.png"));
}

static void full_device_is_an_error(void **state)
{
	static const char *const endings[] = { "full.png", "full.ppm" };
	struct psr_error err;

	(void)state;
	for (int i = 0; i < 2; i++) {
		if (access("/dev/full", W_OK) != 0)
			skip();
		assert_int_equal(symlink("/dev/full", in_folder(endings[i])), 0);
		assert_int_equal(psr_picture_write_color(&picture, name, &err), PSR_ERR_IO);
		assert_non_null(strstr(err.text, "No space left"));
	}
}

static void full_disk_leaves_the_old_file(void **state)
{
	static uint8_t noise[3 * 64 * 64];
	const struct psr_frame large = { .width = 64, .height = 64, .rgb = noise };
	struct rlimit old, small;
	struct psr_error err;
	char text[16];
	int n, before, code[2];

	(void)state;
	for (size_t i = 0; i < sizeof noise; i++)
		noise[i] = (uint8_t)(i * i * 2654435761u >> 13);
	signal(SIGXFSZ, SIG_IGN);
	getrlimit(RLIMIT_FSIZE, &old);
	for (int i = 0; i < 2; i++) {
		write_text(in_folder(i == 0 ? "old.png" : "old.ppm"), "old");
		before = n_files();
		small = old;
		small.rlim_cur = 4096;
		setrlimit(RLIMIT_FSIZE, &small);
		code[i] = psr_picture_write_color(&large, name, &err);
		setrlimit(RLIMIT_FSIZE, &old);
		assert_int_equal(code[i], PSR_ERR_IO);
		n = (int)read_all(name, text, sizeof text);
		assert_int_equal(n, 3);
		assert_memory_equal(text, "old", 3);
		assert_int_equal(n_files(), before);
		assert_int_equal(psr_picture_write_color(&large, name, &err), PSR_OK);
		assert_int_equal(n_files(), before);
	}
}

static void link_to_a_file_stays_a_link(void **state)
{
	struct stat status;

	(void)state;
	write_text(in_folder("real.png"), "old");
	assert_int_equal(symlink("real.png", in_folder("link.png")), 0);
	assert_int_equal(psr_picture_write_color(&picture, name, NULL), PSR_OK);
	assert_int_equal(lstat(name, &status), 0);
	assert_true(S_ISLNK(status.st_mode));
	assert_int_equal(stat(in_folder("real.png"), &status), 0);
	assert_true(status.st_size > 3);
}

/* ---- animations ---- */

static uint32_t get_u32(const uint8_t *from)
{
	return (uint32_t)from[0] << 24 | (uint32_t)from[1] << 16 | (uint32_t)from[2] << 8 | from[3];
}

static void put_u32(uint8_t *to, uint32_t v)
{
	for (int i = 0; i < 4; i++)
		to[i] = (uint8_t)(v >> (24 - 8 * i));
}

/* As PNG defines it. */
static uint32_t crc_of(const uint8_t *bytes, size_t n)
{
	uint32_t crc = 0xffffffff;

	for (size_t i = 0; i < n; i++) {
		crc ^= bytes[i];
		for (int k = 0; k < 8; k++)
			crc = crc & 1 ? 0xedb88320 ^ crc >> 1 : crc >> 1;
	}
	return ~crc;
}

struct chunks {
	uint8_t bytes[1 << 14], still[1 << 14]; /* a frame as a PNG of its own */
	size_t n, n_still, n_head;              /* of signature, IHDR, sRGB */
	uint32_t sequence, n_frames, n_controls;
};

static void add_chunk(struct chunks *c, const char *type, const uint8_t *data, uint32_t n)
{
	uint8_t *to = c->still + c->n_still;

	put_u32(to, n);
	memcpy(to + 4, type, 4);
	if (n > 0)
		memcpy(to + 8, data, n);
	put_u32(to + 8 + n, crc_of(to + 4, n + 4));
	c->n_still += n + 12;
}

static void check_still(struct chunks *c, const uint8_t *expected)
{
	png_image image = { .version = PNG_IMAGE_VERSION };
	uint8_t got[3 * W * H];

	add_chunk(c, "IEND", NULL, 0);
	assert_true(png_image_begin_read_from_memory(&image, c->still, c->n_still));
	assert_true(image.width == W && image.height == H);
	image.format = PNG_FORMAT_RGB;
	assert_true(png_image_finish_read(&image, NULL, got, 0, NULL));
	assert_memory_equal(got, expected, sizeof got);
	c->n_still = c->n_head;
}

/* One chunk of an animation of three frames. */
static void check_chunk(struct chunks *c, const uint8_t *data, const char *type, uint32_t n,
                        uint8_t frames[][3 * W * H])
{
	if (memcmp(type, "acTL", 4) == 0) {
		assert_true(n == 8 && get_u32(data) == 3 && get_u32(data + 4) == 0);
	} else if (memcmp(type, "fcTL", 4) == 0) {
		assert_true(n == 26 && get_u32(data) == c->sequence++);
		assert_true(get_u32(data + 4) == W && get_u32(data + 8) == H);
		assert_true(data[20] == 0 && data[21] == 250 && data[22] * 256 + data[23] == 1000);
		if (c->n_controls++ > 0)
			check_still(c, frames[c->n_controls - 2]);
	} else if (memcmp(type, "fdAT", 4) == 0) {
		assert_true(c->n_controls > 1 && get_u32(data) == c->sequence++);
		add_chunk(c, "IDAT", data + 4, n - 4);
	} else if (memcmp(type, "IDAT", 4) == 0) {
		assert_true(c->n_controls == 1);
		add_chunk(c, "IDAT", data, n);
	} else if (memcmp(type, "IEND", 4) == 0) {
		check_still(c, frames[c->n_controls - 1]);
	} else {
		add_chunk(c, type, data, n);
		c->n_head = c->n_still;
	}
}

static void animation_is_a_png_whose_further_frames_are_pngs_too(void **state)
{
	static uint8_t frames[3][3 * W * H];
	static struct chunks c;
	struct psr_frame frame = picture;
	struct psr_animation *animation;
	char path[512];

	(void)state;
	strcpy(path, in_folder("moves.png"));
	assert_int_equal(psr_animation_open(&animation, path, &picture, 3, 0.25, NULL), PSR_OK);
	for (int k = 0; k < 3; k++) {
		for (int i = 0; i < 3 * W * H; i++)
			frames[k][i] = (uint8_t)(rgb[i] + 80 * k);
		frame.rgb = frames[k];
		assert_int_equal(psr_animation_add(animation, &frame, NULL), PSR_OK);
	}
	assert_int_equal(psr_animation_close(animation, PSR_OK, NULL), PSR_OK);
	c.n = read_all(path, (char *)c.bytes, sizeof c.bytes);
	memcpy(c.still, c.bytes, 8);
	c.n_still = 8;
	for (size_t at = 8; at < c.n; at += get_u32(c.bytes + at) + 12) {
		uint32_t n = get_u32(c.bytes + at);

		assert_true(at + n + 12 <= c.n);
		assert_true(get_u32(c.bytes + at + 8 + n) == crc_of(c.bytes + at + 4, n + 4));
		check_chunk(&c, c.bytes + at + 8, (const char *)c.bytes + at + 4, n, frames);
	}
	assert_int_equal(c.n_controls, 3);
}

static void an_animation_that_failed_leaves_the_old_file(void **state)
{
	struct psr_animation *animation;
	char path[512], text[8] = "";

	(void)state;
	strcpy(path, in_folder("kept.png"));
	write_text(path, "old");
	assert_int_equal(psr_animation_open(&animation, path, &picture, 3, 0.25, NULL), PSR_OK);
	assert_int_equal(psr_animation_add(animation, &picture, NULL), PSR_OK);
	assert_int_equal(psr_animation_close(animation, PSR_ERR_CONNECTION, NULL), PSR_ERR_CONNECTION);
	read_all(path, text, sizeof text - 1);
	assert_string_equal(text, "old");
}

static void what_does_not_move_is_refused_as_an_animation(void **state)
{
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_animation_check("a.PNG", NULL), PSR_OK);
	assert_int_equal(psr_animation_check("a.apng", NULL), PSR_OK);
	assert_int_equal(psr_animation_check("-", NULL), PSR_OK);
	assert_int_equal(psr_animation_check("a", &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, ".png or .gif"));
	assert_int_equal(psr_animation_check("a.jpg", &err), PSR_ERR_UNSUPPORTED);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(png_has_the_same_pixels_and_says_srgb),
		cmocka_unit_test(ppm_has_the_same_pixels),
		cmocka_unit_test(pfm_is_bottom_up_little_endian_with_infinity),
		cmocka_unit_test(npy_holds_every_plane_as_it_is),
		cmocka_unit_test(normals_and_weights_are_pictures_to_look_at),
		cmocka_unit_test(unfit_endings_are_refused),
		cmocka_unit_test(missing_module_is_a_clear_error),
		cmocka_unit_test(module_writes_what_libpng_does_not),
		cmocka_unit_test(missing_folder_is_not_found),
		cmocka_unit_test(full_device_is_an_error),
		cmocka_unit_test(full_disk_leaves_the_old_file),
		cmocka_unit_test(link_to_a_file_stays_a_link),
		cmocka_unit_test(animation_is_a_png_whose_further_frames_are_pngs_too),
		cmocka_unit_test(an_animation_that_failed_leaves_the_old_file),
		cmocka_unit_test(what_does_not_move_is_refused_as_an_animation),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
