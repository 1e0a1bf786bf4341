#include "commands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "accuracy/passes.h"
#include "accuracy/print.h"
#include "accuracy/report.h"
#include "price/price.h"
#include "base/maths.h"
#include "base/netpbm.h"
#include "base/outfile.h"
#include "psr/build.h"
#include "base/cli.h"
#include "measure/measure.h"
#include "psr/mesh.h"
#include "psr/render.h"

#define PROGRAM "psr-model accuracy"

/* The frame and how it was drawn. `given` tells which of it options gave; they win over a report. */
struct frame {
	const char *depth, *color, *report;
	struct psr_camera camera;
	double fov, spacing, spacing_px;
	int is_fine;
	uint32_t width, height; /* 0: as the depth has it */
	struct {
		int eye, target, up, fov, ortho, spacing;
	} given;
};

/* The size is the file's. */
static int measure_color(struct psr_color_accuracy *out, struct psr_truth_shot shot, const char *path,
                         struct psr_error *err)
{
	uint8_t *rgb = NULL;
	int code = ppm_read(&rgb, &shot.width, &shot.height, path, err);

	if (code == PSR_OK)
		code = psr_accuracy_measure_color(out, &shot, rgb, err);
	free(rgb);
	return code;
}

struct shadow_frames {
	const char *shadowed, *lit; /* NULL: none */
	struct psr_light light;
};

/* The size is the files'. */
static int measure_shadow(struct psr_shadow_accuracy *out, struct psr_truth_shot shot,
                          const struct shadow_frames *frames, struct psr_error *err)
{
	uint32_t lit_width, lit_height;
	uint8_t *shadowed = NULL, *lit = NULL;
	int code = ppm_read(&shadowed, &shot.width, &shot.height, frames->shadowed, err);

	if (code == PSR_OK)
		code = ppm_read(&lit, &lit_width, &lit_height, frames->lit, err);
	if (code == PSR_OK && (shot.width != lit_width || shot.height != lit_height))
		code = psr_fail(err, PSR_ERR_ARG, "%s and %s are of different sizes", frames->shadowed, frames->lit);
	if (code == PSR_OK)
		code = psr_accuracy_measure_shadow(out, &shot, &frames->light, shadowed, lit, err);
	free(shadowed);
	free(lit);
	return code;
}

static int measure(struct accuracy_result *result, const char *source, const struct frame *frame,
                   const struct shadow_frames *shadow, const struct accuracy_bounds *bounds, struct psr_error *err)
{
	const struct psr_camera *camera = &frame->camera;
	struct psr_build_options options;
	struct psr_mesh *mesh = NULL;
	struct psr_truth_shot shot = { .camera = camera };
	float *depth = NULL;
	int code = pfm_read(&depth, &shot.width, &shot.height, frame->depth, err);

	psr_build_options_default(&options);
	shot.n_threads = options.n_threads;
	result->has_color = frame->color != NULL;
	result->has_shadow = shadow->shadowed != NULL;
	if (code == PSR_OK && frame->width > 0 && (frame->width != shot.width || frame->height != shot.height))
		code = psr_fail(err, PSR_ERR_ARG, "%s has %ux%u pixels, and %s is of a frame of %ux%u: they belong to different frames",
		                frame->depth, shot.width, shot.height, frame->report, frame->width, frame->height);
	if (code == PSR_OK)
		code = psr_mesh_import(&mesh, source, NULL, err);
	if (code == PSR_OK)
		code = psr_truth_create(&shot.truth, mesh, err);
	if (code == PSR_OK)
		code = psr_accuracy_measure(&result->depth, &shot, depth, frame->spacing, err);
	if (code == PSR_OK && shadow->shadowed != NULL)
		code = measure_shadow(&result->shadow, shot, shadow, err);
	if (code == PSR_OK) /* depths and shadow maps know glass as there or not; colours know how much it lets through */
		psr_truth_stipple(shot.truth, frame->spacing);
	if (code == PSR_OK && frame->color != NULL)
		code = measure_color(&result->color, shot, frame->color, err);
	if (code == PSR_OK)
		result->verdict = accuracy_judge(result->text, &result->depth, bounds,
		                                 &(struct accuracy_frame){ camera, shot.width, shot.height, depth,
		                                                           frame->spacing, frame->spacing_px, frame->is_fine });
	psr_truth_destroy(shot.truth);
	psr_mesh_destroy(mesh);
	free(depth);
	return code;
}

/* Takes from the report everything that no option gave. */
static int take_report(struct frame *frame, struct psr_error *err)
{
	struct accuracy_report report;
	struct psr_camera *camera = &frame->camera;
	int code = accuracy_report_read(&report, frame->report, err);

	if (code != PSR_OK)
		return code;
	if (report.is_smooth && frame->color != NULL)
		return psr_fail(err, PSR_ERR_ARG, "--color: %s says that the frame was smoothed, which blends colours; draw it with "
		                "psr shot --no-smooth", frame->report);
	if (!frame->given.eye)
		memcpy(camera->eye, report.camera.eye, sizeof camera->eye);
	if (!frame->given.target)
		memcpy(camera->target, report.camera.target, sizeof camera->target);
	if (!frame->given.up)
		memcpy(camera->up, report.camera.up, sizeof camera->up);
	if (!frame->given.fov && !frame->given.ortho) {
		camera->kind = report.camera.kind;
		camera->fov_y = report.camera.fov_y;
		camera->ortho_height = report.camera.ortho_height;
	}
	camera->near_z = report.camera.near_z;
	if (!frame->given.spacing)
		frame->spacing = report.spacing;
	frame->spacing_px = report.spacing_px;
	frame->is_fine = report.is_fine;
	frame->width = report.width;
	frame->height = report.height;
	return PSR_OK;
}

static int complete(struct frame *frame, int n_operands, struct psr_error *err)
{
	if (n_operands != 1)
		return psr_fail(err, PSR_ERR_ARG, "one source file is needed");
	if (frame->depth == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--depth FRAME.pfm is needed");
	if (frame->given.fov && frame->given.ortho)
		return psr_fail(err, PSR_ERR_ARG, "--fov and --ortho exclude each other");
	frame->camera.kind = frame->given.ortho ? PSR_CAMERA_ORTHOGRAPHIC : PSR_CAMERA_PERSPECTIVE;
	frame->camera.fov_y = frame->fov * PSR_DEGREE;
	frame->spacing_px = 1;
	if (frame->report != NULL)
		return take_report(frame, err);
	if (!frame->given.eye || !frame->given.target || !frame->given.up)
		return psr_fail(err, PSR_ERR_ARG, "--report FRAME.json is needed, or --eye, --target and --up of the frame");
	if (!frame->given.fov && !frame->given.ortho)
		return psr_fail(err, PSR_ERR_ARG, "--report FRAME.json is needed, or --fov or --ortho of the frame");
	if (!frame->given.spacing)
		return psr_fail(err, PSR_ERR_ARG, "--report FRAME.json is needed, or --spacing; psr-model info prints it");
	return PSR_OK;
}

int cmd_accuracy(int argc, char **argv)
{
	/* NAN: not given, which --help shows as no default. */
	struct frame frame = { .camera = { .eye = { NAN }, .target = { NAN }, .up = { NAN }, .ortho_height = NAN },
		                   .fov = NAN, .spacing = NAN };
	struct accuracy_bounds bounds = { .holes = NAN, .distance = NAN, .outside = NAN };
	struct accuracy_result result;
	struct psr_error err;
	struct shadow_frames shadow = { .light = { .position = { NAN }, .direction = { NAN } } };
	const char *model = NULL;
	double magnification = 1;
	int64_t n_passes = 0;
	struct price_options price = { .size = { 256, 256 }, .resolution = 512, .n_rounds = 9, .seed = 1 };
	int64_t n_views = 8, resolution = price.resolution, n_rounds = price.n_rounds, seed = (int64_t)price.seed;
	int seen_views = 0, seen_passes = 0, sun = 0, lamp = 0, json = 0, n_operands, code;
	const struct psr_opt opts[] = {
		{ .name = "The frame", .type = PSR_OPT_HEADING },
		{ .name = "depth", .type = PSR_OPT_STRING, .value = &frame.depth, .arg = "FRAME.pfm",
		  .help = "The frame's depth: the file that psr shot --depth wrote." },
		{ .name = "report", .type = PSR_OPT_STRING, .value = &frame.report, .arg = "FRAME.json",
		  .help = "Its report: the file that psr shot --report wrote. Camera and spacing are taken from it." },
		{ .name = "color", .type = PSR_OPT_STRING, .value = &frame.color, .arg = "FRAME.ppm",
		  .help = "Compares its colours as well; the frame has to be drawn with --ambient 1 and no light." },
		{ .name = "Without a report, or to override it", .type = PSR_OPT_HEADING,
		  .help = "Lengths are in the units of the source file." },
		{ .name = "eye", .type = PSR_OPT_VEC3, .value = frame.camera.eye, .arg = "X,Y,Z", .help = "Where the camera was.",
		  .seen = &frame.given.eye },
		{ .name = "target", .type = PSR_OPT_VEC3, .value = frame.camera.target, .arg = "X,Y,Z",
		  .help = "What it looked at.", .seen = &frame.given.target },
		{ .name = "up", .type = PSR_OPT_VEC3, .value = frame.camera.up, .arg = "X,Y,Z",
		  .help = "What was up in the picture.", .seen = &frame.given.up },
		{ .name = "fov", .type = PSR_OPT_REAL, .value = &frame.fov, .arg = "DEG",
		  .help = "Its vertical angle of view, if it was a perspective one.", .min = 1e-4, .max = 179.9,
		  .seen = &frame.given.fov },
		{ .name = "ortho", .type = PSR_OPT_REAL, .value = &frame.camera.ortho_height, .arg = "HEIGHT",
		  .help = "The height of its picture, if it was orthographic.", .min = 1e-30, .max = 1e30,
		  .seen = &frame.given.ortho },
		{ .name = "spacing", .type = PSR_OPT_REAL, .value = &frame.spacing, .arg = "S",
		  .help = "The distance between the model's samples, as psr-model info prints it; distances are counted in it.",
		  .min = 1e-30, .max = 1e30, .seen = &frame.given.spacing },
		{ .name = "The verdict", .type = PSR_OPT_HEADING },
		{ .name = "max-holes", .type = PSR_OPT_REAL, .value = &bounds.holes, .arg = "F",
		  .help = "FAIL if a larger fraction of the pixels inside of the silhouette are holes; 0.001 if not given.", .min = 0,
		  .max = 1, .seen = &bounds.has_holes },
		{ .name = "max-distance", .type = PSR_OPT_REAL, .value = &bounds.distance, .arg = "D",
		  .help = "FAIL if more than 1 pixel in 1,000 is further than D spacings from the surface; if not given, one spacing, or"
		          " one pixel where pixels are wider.", .min = 0, .max = 1e30, .seen = &bounds.has_distance },
		{ .name = "max-outside", .type = PSR_OPT_REAL, .value = &bounds.outside, .arg = "N",
		  .help = "FAIL if more than N pixels are drawn more than a pixel outside of the silhouette; 1 in 1,000 of the object's"
		          " if not given.", .min = 0, .max = 1 << 26, .seen = &bounds.has_outside },
		{ .name = "json", .type = PSR_OPT_FLAG, .value = &json,
		  .help = "Prints all figures as a JSON object, with `verdict`: pass, fail or camera." },
		{ .name = "What accuracy costs", .type = PSR_OPT_HEADING,
		  .help = "Builds models of SOURCE, draws views of them with each of many settings in turn, and tells time and error"
		          " of each: which settings no other beats, the best within a time, the cheapest within an error." },
		{ .name = "views", .type = PSR_OPT_INT, .value = &n_views, .arg = "N",
		  .help = "Measures on so many views: the first is from around, the second close, the third grazing, the fourth from"
		          " far, and so on.", .min = 1, .max = PRICE_MOST_VIEWS, .seen = &seen_views },
		{ .name = "out", .type = PSR_OPT_STRING, .value = &price.out, .arg = "DIR",
		  .help = "Writes index.html, which holds all of it, plot.svg, plot.png, strip.png, prices.csv and prices.json into"
		          " this folder.", .seen = &seen_views },
		{ .name = "size", .type = PSR_OPT_SIZE, .value = price.size, .arg = "WxH", .help = "Pixels of a view.",
		  .min = 32, .max = 4096, .seen = &seen_views },
		{ .name = "resolution", .letter = 'r', .type = PSR_OPT_INT, .value = &resolution, .arg = "PIXELS",
		  .help = "Of the usual model; others have a quarter, half and twice of it.", .min = 32, .max = 4096,
		  .seen = &seen_views },
		{ .name = "rounds", .type = PSR_OPT_INT, .value = &n_rounds, .arg = "N",
		  .help = "Frames of each setting and view that are timed.", .min = 1, .max = 1000, .seen = &seen_views },
		{ .name = "seed", .type = PSR_OPT_INT, .value = &seed, .arg = "N", .help = "Other seeds give other views.",
		  .min = 0, .max = 1e15, .seen = &seen_views },
		{ .name = "For developers: shadows", .type = PSR_OPT_HEADING },
		{ .name = "shadow", .type = PSR_OPT_STRING, .value = &shadow.shadowed, .arg = "FRAME.ppm",
		  .help = "Compares shadows as well: a frame drawn with --ambient 0 and one light, which casts them." },
		{ .name = "lit", .type = PSR_OPT_STRING, .value = &shadow.lit, .arg = "FRAME.ppm",
		  .help = "The same frame without shadows." },
		{ .name = "sun", .type = PSR_OPT_VEC3, .value = shadow.light.direction, .arg = "X,Y,Z",
		  .help = "The direction of that light, if it is a dir: light.", .seen = &sun },
		{ .name = "lamp", .type = PSR_OPT_VEC3, .value = shadow.light.position, .arg = "X,Y,Z",
		  .help = "Its position, if it is a point: or spot: light.", .seen = &lamp },
		{ .name = "For developers: refined stills, drawn here", .type = PSR_OPT_HEADING },
		{ .name = "passes", .type = PSR_OPT_INT, .value = &n_passes, .arg = "N",
		  .help = "Draws a still of the model in passes 0 to N, and prints how far each is from the truth, in dB, and its time.",
		  .min = 0, .max = PSR_MAX_PASS, .seen = &seen_passes },
		{ .name = "model", .type = PSR_OPT_STRING, .value = &model, .arg = "FILE.psr",
		  .help = "The model that --passes draws." },
		{ .name = "magnification", .type = PSR_OPT_REAL, .value = &magnification, .arg = "M",
		  .help = "Pixels between its samples: above 1 the still is larger than the model was made for.", .min = 0.01,
		  .max = 64 },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr-model accuracy SOURCE --depth FRAME.pfm --report FRAME.json [options]\n"
		         "       psr-model accuracy SOURCE --depth FRAME.pfm --eye X,Y,Z --target X,Y,Z --up X,Y,Z\n"
		         "                 (--fov DEG | --ortho HEIGHT) --spacing S [options]\n"
		         "       psr-model accuracy SOURCE --views N [--out DIR] [options]\n"
		         "       psr-model accuracy SOURCE --model FILE.psr --passes N [--magnification M]",
		.summary = "Checks a frame: compares its depth (and colours) with the same view of SOURCE,"
		           " the mesh that its model was built from, ray-traced. The last line is the verdict.",
		.opts = opts,
		.footer = "example:\n"
		          "  psr shot --model dragon --size 512x512 -o frame.png --depth frame.pfm --report frame.json\n"
		          "  psr-model accuracy dragon.ply --depth frame.pfm --report frame.json\n"
		          "\n"
		          "Exit codes: 0 PASS, 1 FAIL, 2 usage, 3 file or system, 4 bad data, or the camera seems wrong (the frame\n"
		          "is of another view or another object), 5 over a limit.",
	};

	code = psr_cli_parse(&cli, argc, argv, &n_operands, &err);
	if (code > 0)
		return 0;
	if (code == PSR_OK && seen_views) {
		price.n_views = (uint32_t)n_views;
		price.resolution = (uint32_t)resolution;
		price.n_rounds = (uint32_t)n_rounds;
		price.seed = (uint64_t)seed;
		price.source = argv[1];
		if (n_operands != 1)
			code = psr_fail(&err, PSR_ERR_ARG, "--views needs one source file");
		else if (seen_passes || frame.depth != NULL)
			code = psr_fail(&err, PSR_ERR_ARG, "--views measures settings, %s; use one of them",
			                seen_passes ? "--passes a still" : "--depth a frame");
		else
			code = price_run(&price, &err);
		return code == PSR_OK ? 0 : psr_cli_fail(PROGRAM, &err);
	}
	if (code == PSR_OK && seen_passes) {
		if (n_operands != 1 || model == NULL)
			code = psr_fail(&err, PSR_ERR_ARG, "--passes needs one source file, and --model FILE.psr made from it");
		else
			code = accuracy_passes(argv[1], model, magnification, (unsigned)n_passes, &err);
		return code == PSR_OK ? 0 : psr_cli_fail(PROGRAM, &err);
	}
	if (code == PSR_OK)
		code = complete(&frame, n_operands, &err);
	if (code == PSR_OK && (!shadow.shadowed != !shadow.lit || (shadow.shadowed != NULL && !sun == !lamp)))
		code = psr_fail(&err, PSR_ERR_ARG, "--shadow, --lit and one of --sun and --lamp belong together");
	shadow.light.kind = lamp ? PSR_LIGHT_POINT : PSR_LIGHT_DIRECTIONAL;
	if (code == PSR_OK)
		code = measure(&result, argv[1], &frame, &shadow, &bounds, &err);
	if (code == PSR_OK)
		code = accuracy_print(&result, json, &err);
	if (code != PSR_OK)
		return psr_cli_fail(PROGRAM, &err);
	return result.verdict == ACCURACY_PASS ? 0 : result.verdict == ACCURACY_FAIL ? 1 : psr_exit_status(PSR_ERR_FORMAT);
}
