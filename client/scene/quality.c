#include "quality.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "client/lib/camera.h"
#include "psr/render.h"

#define LEAST_MS 0.001
#define MOST_MS 3.6e6
#define LEAST_PX 1e-6
#define MOST_PX 1e6
#define LEAST_DB 1.0
#define MOST_DB 99.0

static const struct {
	const char *name;
	double spacing;
	enum psr_smooth smooth;
	int passes;
} qualities[] = {
	{ "draft", 2, PSR_SMOOTH_NONE, 0 },
	{ "good", 1, PSR_SMOOTH_EDGES, 0 },
	{ "fine", 1, PSR_SMOOTH_FINE, 0 },
	{ "best", 1, PSR_SMOOTH_EDGES, 3 },
};

void quality_wish_init(struct quality_wish *wish, uint32_t width, uint32_t height, const char *name, const char *codec)
{
	memset(wish, 0, sizeof *wish);
	wish->size[0] = width;
	wish->size[1] = height;
	wish->name = name;
	wish->spacing = 1;
	wish->codec = codec;
}

void quality_add_options(struct optlist *list, struct quality_wish *wish)
{
	const struct psr_opt opts[] = {
		{ .name = "size", .type = PSR_OPT_SIZE, .value = wish->size, .arg = "WxH", .seen = &wish->n_said,
		  .help = "Width and height of the picture in pixels." },
		{ .name = "quality", .letter = 'q', .type = PSR_OPT_STRING, .value = &wish->name, .arg = "NAME",
		  .seen = &wish->has_name,
		  .words = "draft good fine best",
		  .help = "draft: coarse and fastest, for finding a view. good: full detail and smooth edges, for pictures that "
		          "move. fine: four points a pixel, five times as long. best: as smooth as print, for a picture to "
		          "keep; it takes about sixty times as long." },
		{ .name = "spacing", .type = PSR_OPT_REAL, .value = &wish->spacing, .arg = "PX", .seen = &wish->has_spacing,
		  .help = "Detail, instead of the quality's: 1 normal, 0.5 finer and slower, 2 coarser and faster." },
		{ .name = "smooth", .type = PSR_OPT_FLAG, .value = &wish->is_smooth, .seen = &wish->n_said,
		  .help = "Quick smoothing for moving pictures, also with --quality draft; --passes for final ones." },
		{ .name = "no-smooth", .type = PSR_OPT_FLAG, .value = &wish->is_plain, .seen = &wish->n_said,
		  .help = "No smoothing: edges of pixel steps, a quarter less time." },
		{ .name = "passes", .type = PSR_OPT_INT, .value = &wish->passes, .arg = "N", .max = PSR_MAX_PASS,
		  .seen = &wish->has_passes,
		  .help = "Final smoothing, instead of the quality's: 1 draws 4 points a pixel and takes about ten times "
		          "as long; 2 draws 16, 3 draws 64, 4 draws 256, and each takes two to three times as long as the one "
		          "before." },
	};

	OPTLIST_ADD(list, opts);
}

void quality_add_splats_option(struct optlist *list, struct quality_wish *wish)
{
	const struct psr_opt opts[] = {
		{ .name = "splats", .type = PSR_OPT_FLAG, .value = &wish->with_splats, .seen = &wish->n_said,
		  .help = "Octrees as splats, which mix the leaves of a surface, instead of points: smoother and some "
		          "four times slower. Not with --passes, nor --quality best." },
	};

	OPTLIST_ADD(list, opts);
}

void quality_add_budget_option(struct optlist *list, struct quality_wish *wish)
{
	const struct psr_opt opts[] = {
		{ .name = "budget", .type = PSR_OPT_STRING, .value = &wish->budget, .arg = "BUDGET",
		  .words = "12ms 1px 30dB",
		  .help = "Instead of a quality what a picture may cost: 12ms, the best that psrd foresees to draw in that time; "
		          "1px, the quickest whose surfaces it foresees to lie within so many pixels of their places; or 30dB, "
		          "the quickest that it foresees to be so like the source, of models that psr-model build --calibrate "
		          "made." },
	};

	OPTLIST_ADD(list, opts);
}

void quality_add_codec_option(struct optlist *list, struct quality_wish *wish)
{
	const struct psr_opt opts[] = {
		{ .name = "codec", .type = PSR_OPT_STRING, .value = &wish->codec, .arg = "CODEC", .seen = &wish->n_said,
		  .words = "lossless jpeg:85 jpeg:95 raw",
		  .help = "How colour travels from the server: lossless; jpeg:Q, Q of 1 to 100, for slow networks; or raw." },
	};

	OPTLIST_ADD(list, opts);
}

int quality_is_said(const struct quality_wish *wish)
{
	return wish->n_said || wish->has_name || wish->has_spacing || wish->has_passes || wish->budget != NULL;
}

static int check_size(uint32_t w, uint32_t h, struct psr_error *err)
{
	if (w == 0 || h == 0)
		return psr_fail(err, PSR_ERR_ARG, "--size: a picture of %ux%u has no pixels", w, h);
	if (w > PSR_WIRE_MAX_SIDE || h > PSR_WIRE_MAX_SIDE || (uint64_t)w * h > PSR_WIRE_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "--size: %ux%u is too large; a side has at most %d pixels, a picture %u", w,
		                h, PSR_WIRE_MAX_SIDE, PSR_WIRE_MAX_PIXELS);
	return PSR_OK;
}

static double rmse_of(double db)
{
	return 255 * pow(10, -db / 20);
}

double quality_db(double rmse)
{
	return 20 * log10(255 / rmse);
}

int quality_parse_budget(struct psr_msg_frame *frame, const char *text, struct psr_error *err)
{
	char *unit;
	const double value = strtod(text, &unit);

	if (unit != text && strcmp(unit, "ms") == 0 && value >= LEAST_MS && value <= MOST_MS) {
		frame->budget = PSR_WIRE_BUDGET_TIME;
		frame->time_budget_us = (uint64_t)llround(value * 1e3);
		return PSR_OK;
	}
	if (unit != text && strcmp(unit, "px") == 0 && value >= LEAST_PX && value <= MOST_PX) {
		frame->budget = PSR_WIRE_BUDGET_ERROR;
		frame->error_bound = value;
		return PSR_OK;
	}
	if (unit != text && strcmp(unit, "dB") == 0 && value >= LEAST_DB && value <= MOST_DB) {
		frame->budget = PSR_WIRE_BUDGET_RMSE;
		frame->error_bound = rmse_of(value);
		return PSR_OK;
	}
	return psr_fail(err, PSR_ERR_ARG, "--budget takes a time such as 12ms, %g to %g, an error such as 1px, %g to %g, or"
	                " a likeness such as 30dB, %g to %g; not '%.40s'", LEAST_MS, MOST_MS, LEAST_PX, MOST_PX, LEAST_DB,
	                MOST_DB, text);
}

const char *quality_budget_text(char text[QUALITY_BUDGET_TEXT], const struct psr_msg_frame *frame)
{
	if (frame->budget == PSR_WIRE_BUDGET_TIME)
		snprintf(text, QUALITY_BUDGET_TEXT, "%.10gms", (double)frame->time_budget_us / 1e3);
	else if (frame->budget == PSR_WIRE_BUDGET_RMSE)
		snprintf(text, QUALITY_BUDGET_TEXT, "%.10gdB", quality_db(frame->error_bound));
	else
		snprintf(text, QUALITY_BUDGET_TEXT, "%.15gpx", frame->error_bound);
	return text;
}

static int apply_budget(struct psr_msg_frame *frame, const struct quality_wish *wish, struct psr_error *err)
{
	if (wish->has_name || wish->has_spacing || wish->has_passes || wish->is_smooth || wish->is_plain || wish->with_splats)
		return psr_fail(err, PSR_ERR_ARG, "--budget chooses the detail; it excludes --quality, --spacing, --smooth, "
		                "--no-smooth, --passes and --splats");
	return quality_parse_budget(frame, wish->budget, err);
}

static uint8_t smoothing(const struct quality_wish *wish, enum psr_smooth of_quality)
{
	if (wish->is_smooth || wish->is_plain)
		return wish->is_smooth ? PSR_SMOOTH_EDGES : PSR_SMOOTH_NONE;
	return of_quality == PSR_SMOOTH_FINE && wish->has_passes ? PSR_SMOOTH_EDGES : (uint8_t)of_quality;
}

int quality_apply(struct psr_msg_frame *frame, const struct quality_wish *wish, struct psr_error *err)
{
	size_t i = 0, n = sizeof qualities / sizeof qualities[0];
	int code = check_size(wish->size[0], wish->size[1], err);

	if (code != PSR_OK)
		return code;
	while (i < n && strcmp(qualities[i].name, wish->name) != 0)
		i++;
	if (i == n)
		return psr_fail(err, PSR_ERR_ARG, "--quality takes draft, good, fine or best, not '%.40s'", wish->name);
	if (wish->is_smooth && wish->is_plain)
		return psr_fail(err, PSR_ERR_ARG, "--smooth and --no-smooth exclude each other");
	if (!(wish->spacing >= 1.0 / 64 && wish->spacing <= 64))
		return psr_fail(err, PSR_ERR_ARG, "--spacing: %g is out of range; it takes 1/64 to 64", wish->spacing);
	frame->width = wish->size[0];
	frame->height = wish->size[1];
	if (wish->budget != NULL) {
		code = apply_budget(frame, wish, err);
	} else {
		frame->budget = PSR_WIRE_BUDGET_SETTINGS;
		frame->settings.scale = 1;
		frame->settings.spacing_px = wish->has_spacing ? wish->spacing : qualities[i].spacing;
		frame->pass_limit = (uint16_t)(wish->has_passes ? wish->passes : qualities[i].passes);
		frame->settings.smooth = smoothing(wish, qualities[i].smooth);
		frame->settings.splats = wish->with_splats != 0;
	}
	if (code != PSR_OK)
		return code;
	return psr_codec_parse(&frame->color_codec, &frame->color_quality, wish->codec, err);
}

void quality_settle(struct psr_msg_frame *frame, const struct quality_wish *wish, uint64_t capabilities)
{
	const int can_be_fine = capabilities & PSR_CAP_FINE
	                        && !(frame->planes & ~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH));

	if (frame->settings.smooth == PSR_SMOOTH_FINE && !wish->has_name && !can_be_fine)
		frame->settings.smooth = PSR_SMOOTH_EDGES;
}

void quality_choose_codecs(struct psr_msg_frame *frame)
{
	if (!(frame->planes & 1 << PSR_PLANE_COLOR))
		frame->color_codec = frame->color_quality = 0;
	if (frame->planes & 1 << PSR_PLANE_DEPTH) {
		frame->depth_format = PSR_WIRE_DEPTH_F32;
		frame->depth_codec = PSR_CODEC_ZSTD;
	}
	if (frame->planes & ~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH))
		frame->data_codec = PSR_CODEC_ZSTD;
}
