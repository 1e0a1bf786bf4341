#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "show.h"

#define PLANE(name) (1u << PSR_PLANE_##name)
#define EMPTY_WORD UINT64_C(0x7f800000ffffffff)
#define NO_SAMPLE 255 /* in the block plane */
#define BACKGROUND "\x10\x14\x28"

struct canvas {
	const struct psr_frame *picture;
	const struct psr_msg_frame_begin *begin;
	const struct psr_msg_frame_end *end;
	double forward[3];
	uint8_t *rgb;
};

/* Input of the painters of samples. */
#define OF_SAMPLES (PLANE(DEPTH) | PLANE(NORMAL) | PLANE(WORDS) | PLANE(BLOCK))

typedef void painter(uint8_t rgb[3], const struct canvas *canvas, size_t i);

struct show {
	const char *name;
	uint32_t planes;
	painter *paint;
};

static void set(uint8_t rgb[3], double r, double g, double b)
{
	rgb[0] = (uint8_t)r;
	rgb[1] = (uint8_t)g;
	rgb[2] = (uint8_t)b;
}

static uint32_t mix(uint32_t v)
{
	v = (v ^ v >> 16) * 0x7feb352du;
	v = (v ^ v >> 15) * 0x846ca68bu;
	return v ^ v >> 16;
}

/* Any of a thousand hues, in six shades. */
static void set_random(uint8_t rgb[3], uint32_t number, double light)
{
	uint32_t random = mix(number + 1);
	double hue = (double)(random & 0x3ff) / 1024 * 6, rest = hue - floor(hue);
	double high = 255 - 40 * (double)(random >> 10 & 1), low = 30 + 45 * (double)((random >> 11) % 3);
	double up = low + (high - low) * rest, down = high - (high - low) * rest;
	const double wheel[6][3] = { { high, up, low },  { down, high, low }, { low, high, up },
		                         { low, down, high }, { up, low, high },   { high, low, down } };
	const double *color = wheel[(int)hue];

	set(rgb, light * color[0], light * color[1], light * color[2]);
}

/* Returns the luminance of the picture, 0..1. */
static double grey_of(const struct canvas *canvas, size_t i)
{
	const uint8_t *c = canvas->picture->rgb + 3 * i;

	return (0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]) / 255;
}

/* Light of a lamp at the eye. */
static double light_of(const struct canvas *canvas, size_t i)
{
	const int16_t *n = canvas->picture->normal + 3 * i;
	double facing = 0;

	for (int a = 0; a < 3; a++)
		facing -= n[a] * canvas->forward[a] / 32767;
	return facing > 0 ? 0.45 + 0.55 * fmin(facing, 1) : 0.45;
}

static uint32_t block_of(const struct canvas *canvas, size_t i)
{
	return (uint32_t)canvas->picture->words[i] / 64;
}

/* ---- painters of pixels that have a sample ---- */

static void paint_blocks(uint8_t rgb[3], const struct canvas *canvas, size_t i)
{
	set_random(rgb, block_of(canvas, i), light_of(canvas, i));
}

static void paint_samples(uint8_t rgb[3], const struct canvas *canvas, size_t i)
{
	set_random(rgb, (uint32_t)canvas->picture->words[i], light_of(canvas, i));
}

static void paint_cull(uint8_t rgb[3], const struct canvas *canvas, size_t i)
{
	static const uint8_t colors[3][3] = { { 70, 200, 90 }, { 255, 150, 40 }, { 170, 100, 230 } };
	const uint8_t *color = colors[canvas->picture->block[3 * i + 2] % 3];
	double light = light_of(canvas, i) * (0.6 + 0.1 * (mix(block_of(canvas, i)) % 5));

	set(rgb, light * color[0], light * color[1], light * color[2]);
}

static void paint_levels(uint8_t rgb[3], const struct canvas *canvas, size_t i)
{
	static const uint8_t colors[8][3] = { { 220, 40, 40 }, { 240, 140, 20 }, { 225, 215, 30 }, { 50, 190, 60 },
		                                  { 30, 190, 200 }, { 50, 90, 240 }, { 150, 60, 220 }, { 240, 90, 180 } };
	const uint8_t *block = canvas->picture->block + 3 * i, *color = colors[block[0] % 8];
	double light = light_of(canvas, i), pale = block[1] % 8 / 8.0;

	set(rgb, light * (color[0] + pale * (255 - color[0])), light * (color[1] + pale * (255 - color[1])),
	    light * (color[2] + pale * (255 - color[2])));
}

static void paint_normals(uint8_t rgb[3], const struct canvas *canvas, size_t i)
{
	psr_picture_color_normals(rgb, canvas->picture->normal + 3 * i, 1);
}

#define NONE UINT32_MAX /* pictures have 2^26 pixels at most */

static size_t distance(const struct canvas *canvas, size_t i, size_t k)
{
	size_t width = canvas->picture->width;
	size_t dx = i % width > k % width ? i % width - k % width : k % width - i % width;
	size_t dy = i / width > k / width ? i / width - k / width : k / width - i / width;

	return dx * dx + dy * dy;
}

static void offer(uint32_t *nearest, const struct canvas *canvas, size_t i, size_t from)
{
	uint32_t k = nearest[from];

	if (k != NONE && (nearest[i] == NONE || distance(canvas, i, k) < distance(canvas, i, nearest[i])))
		nearest[i] = k;
}

/* Finds almost the nearest pixel with a sample: two passes hand on the neighbours' findings. */
static void find_nearest(uint32_t *nearest, const struct canvas *canvas)
{
	size_t width = canvas->picture->width, height = canvas->picture->height, n = width * height;

	for (size_t i = 0; i < n; i++)
		nearest[i] = canvas->picture->block[3 * i] == NO_SAMPLE ? NONE : (uint32_t)i;
	for (size_t i = 0; i < n; i++) {
		size_t x = i % width;

		if (x > 0)
			offer(nearest, canvas, i, i - 1);
		for (size_t at = x > 0 ? x - 1 : 0; i >= width && at <= x + 1 && at < width; at++)
			offer(nearest, canvas, i, i - width - x + at);
	}
	for (size_t i = n; i-- > 0;) {
		size_t x = i % width;

		if (x + 1 < width)
			offer(nearest, canvas, i, i + 1);
		for (size_t at = x > 0 ? x - 1 : 0; i + width < n && at <= x + 1 && at < width; at++)
			offer(nearest, canvas, i, i + width - x + at);
	}
}

/* Filled pixels look like the nearest sample, but darker. */
static int paint_all_samples(const struct canvas *canvas, painter *paint)
{
	const struct psr_frame *picture = canvas->picture;
	size_t n = (size_t)picture->width * picture->height;
	uint32_t *nearest = malloc(n * sizeof *nearest);

	if (nearest == NULL)
		return PSR_ERR_MEMORY;
	find_nearest(nearest, canvas);
	for (size_t i = 0; i < n; i++) {
		uint8_t *rgb = canvas->rgb + 3 * i;

		if (nearest[i] == i) {
			paint(rgb, canvas, i);
		} else if (picture->depth[i] < INFINITY && nearest[i] != NONE) {
			paint(rgb, canvas, nearest[i]);
			set(rgb, 0.6 * rgb[0], 0.6 * rgb[1], 0.6 * rgb[2]);
		} else {
			memcpy(rgb, BACKGROUND, 3);
		}
	}
	free(nearest);
	return PSR_OK;
}

/* ---- painters of all other pixels ---- */

static int is_hole(uint8_t rgb[3], const struct canvas *canvas, size_t i)
{
	if (canvas->picture->weight[i] != 0)
		return 0;
	if (canvas->picture->words[i] == EMPTY_WORD)
		set(rgb, 240, 30, 30);
	else
		set(rgb, 250, 210, 40);
	return 1;
}

static void paint_weights(uint8_t rgb[3], const struct canvas *canvas, size_t i)
{
	double weight = canvas->picture->weight[i];

	if (is_hole(rgb, canvas, i))
		return;
	if (canvas->picture->words[i] != EMPTY_WORD)
		set(rgb, weight, weight, weight);
	else
		set(rgb, 0, (255 - weight) * 0.5, 255 - weight);
}

static void paint_holes(uint8_t rgb[3], const struct canvas *canvas, size_t i)
{
	double grey = grey_of(canvas, i), light = 0.4 + 0.6 * grey;

	if (is_hole(rgb, canvas, i))
		set(rgb, light * rgb[0], light * rgb[1], light * rgb[2]);
	else
		set(rgb, 90 * grey, 90 * grey, 90 * grey);
}

/* Spreads greys evenly over 1 / z of a perspective camera, as its pixels are. */
static void paint_depth(uint8_t rgb[3], const struct canvas *canvas, size_t i)
{
	double z = (double)canvas->picture->depth[i], near = canvas->end->depth_min, far = canvas->end->depth_max, part;

	if (!(z < INFINITY)) {
		memcpy(rgb, BACKGROUND, 3);
		return;
	}
	if (canvas->begin->camera.kind == PSR_CAMERA_PERSPECTIVE) {
		z = 1 / z;
		near = 1 / near;
		far = 1 / far;
	}
	part = far == near ? 0 : fmin(fmax((z - near) / (far - near), 0), 1);
	set(rgb, 255 - 215 * part, 255 - 215 * part, 255 - 215 * part);
}

static const struct show shows[] = {
	{ "blocks", OF_SAMPLES, paint_blocks },
	{ "samples", OF_SAMPLES, paint_samples },
	{ "cull", OF_SAMPLES, paint_cull },
	{ "levels", OF_SAMPLES, paint_levels },
	{ "normals", OF_SAMPLES, paint_normals },
	{ "weights", PLANE(WEIGHT) | PLANE(WORDS), paint_weights },
	{ "holes", PLANE(COLOR) | PLANE(WEIGHT) | PLANE(WORDS), paint_holes },
	{ "depth", PLANE(DEPTH), paint_depth },
};

const char *show_name(unsigned i)
{
	return i < sizeof shows / sizeof shows[0] ? shows[i].name : NULL;
}

const struct show *show_find(const char *name, struct psr_error *err)
{
	for (size_t i = 0; i < sizeof shows / sizeof shows[0]; i++)
		if (strcmp(name, shows[i].name) == 0)
			return &shows[i];
	psr_fail(err, PSR_ERR_ARG,
	         "--show takes blocks, samples, cull, levels, normals, weights, holes or depth, not '%.40s'", name);
	return NULL;
}

uint32_t show_planes(const struct show *show)
{
	return show->planes;
}

int show_paint(const struct show *show, const struct psr_frame *picture, const struct psr_msg_frame_begin *begin,
               const struct psr_msg_frame_end *end, uint8_t *rgb)
{
	const struct psr_camera *camera = &begin->camera;
	size_t n = (size_t)picture->width * picture->height;
	struct canvas canvas = { .picture = picture, .begin = begin, .end = end, .rgb = rgb };
	double length = 0;

	for (int a = 0; a < 3; a++)
		length = hypot(length, camera->target[a] - camera->eye[a]);
	for (int a = 0; a < 3; a++)
		canvas.forward[a] = (camera->target[a] - camera->eye[a]) / length;
	if (show->planes == OF_SAMPLES)
		return paint_all_samples(&canvas, show->paint);
	for (size_t i = 0; i < n; i++)
		show->paint(rgb + 3 * i, &canvas, i);
	return PSR_OK;
}

int show_write(const struct show *show, const struct psr_event *event, const char *path, struct psr_error *err)
{
	const struct psr_frame *picture = event->picture;
	struct psr_frame painted = { .width = picture->width, .height = picture->height };
	int code = PSR_ERR_MEMORY;

	painted.rgb = malloc(3 * (size_t)picture->width * picture->height);
	if (painted.rgb != NULL)
		code = show_paint(show, picture, event->begin, event->end, painted.rgb);
	code = code != PSR_OK ? psr_fail(err, code, "no memory to paint %ux%u pixels", picture->width, picture->height)
	                      : psr_picture_write_color(&painted, path, err);
	free(painted.rgb);
	return code;
}
