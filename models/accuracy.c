#include "commands.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include "accuracy_passes.h"
#include "json.h"
#include "pfm.h"
#include "ppm.h"
#include "psr/build.h"
#include "psr/cli.h"
#include "psr/measure.h"
#include "psr/mesh.h"
#include "psr/render.h"

#define PROGRAM "psr-model accuracy"
#define RADIANS (3.14159265358979323846 / 180)

struct bounds {
	double holes, distance;
	int64_t outside;
	int has_holes, has_distance, has_outside;
};

static double fraction(uint64_t part, uint64_t whole)
{
	return whole == 0 ? 0 : (double)part / (double)whole;
}

static void print_text(const struct psr_accuracy *a)
{
	printf("pixels that show the object          %" PRIu64 "\n", a->n_truth);
	printf("  inside of the silhouette           %" PRIu64 "\n", a->n_inside);
	printf("  inside and empty                   %" PRIu64 "\n", a->n_inside_empty);
	printf("  holes                              %" PRIu64 " (%.4f %% of those inside)\n", a->n_holes,
	       100 * fraction(a->n_holes, a->n_inside));
	printf("drawn over a pixel outside           %" PRIu64 "\n", a->n_outside_drawn);
	printf("distance to the truth, in spacings   p50 %.4f, p99 %.4f, p99.9 %.4f, max %.4f of %" PRIu64 " pixels\n",
	       a->distance_p50, a->distance_p99, a->distance_p999, a->distance_max, a->n_compared);
}

static void print_color_text(const struct psr_color_accuracy *c)
{
	printf("colour: more than %d codes off          %" PRIu64 " (%.4f %%) of %" PRIu64 " pixels; mean %.3f codes\n",
	       PSR_COLOR_WRONG, c->n_wrong, 100 * fraction(c->n_wrong, c->n_compared), c->n_compared, c->mean);
}

static void print_shadow_text(const struct psr_shadow_accuracy *s)
{
	printf("shadow: light more than %.0f %% off       %" PRIu64 " (%.4f %%) of %" PRIu64 " pixels, %" PRIu64 " of them in shadow; mean %.4f\n",
	       100 * PSR_SHADOW_WRONG, s->n_wrong, 100 * fraction(s->n_wrong, s->n_compared), s->n_compared, s->n_shadow, s->mean);
	printf("  on the wrong side of an edge       %" PRIu64 ", by p99 %.2f, max %.2f pixels\n", s->n_misplaced, s->seam_p99,
	       s->seam_max);
}

/* color and shadow may be NULL. */
static int print_json(const struct psr_accuracy *a, const struct psr_color_accuracy *color, const struct psr_shadow_accuracy *shadow,
                      struct psr_error *err)
{
	cJSON *root = cJSON_CreateObject();

	cJSON_AddNumberToObject(root, "truth", (double)a->n_truth);
	cJSON_AddNumberToObject(root, "inside", (double)a->n_inside);
	cJSON_AddNumberToObject(root, "inside_empty", (double)a->n_inside_empty);
	cJSON_AddNumberToObject(root, "holes", (double)a->n_holes);
	cJSON_AddNumberToObject(root, "holes_fraction", fraction(a->n_holes, a->n_inside));
	cJSON_AddNumberToObject(root, "outside_drawn", (double)a->n_outside_drawn);
	cJSON_AddNumberToObject(root, "compared", (double)a->n_compared);
	cJSON_AddNumberToObject(root, "distance_p50", a->distance_p50);
	cJSON_AddNumberToObject(root, "distance_p99", a->distance_p99);
	cJSON_AddNumberToObject(root, "distance_p999", a->distance_p999);
	cJSON_AddNumberToObject(root, "distance_max", a->distance_max);
	if (color != NULL) {
		cJSON_AddNumberToObject(root, "color_compared", (double)color->n_compared);
		cJSON_AddNumberToObject(root, "color_wrong", (double)color->n_wrong);
		cJSON_AddNumberToObject(root, "color_mean", color->mean);
	}
	if (shadow != NULL) {
		cJSON_AddNumberToObject(root, "shadow_compared", (double)shadow->n_compared);
		cJSON_AddNumberToObject(root, "shadow_in_shadow", (double)shadow->n_shadow);
		cJSON_AddNumberToObject(root, "shadow_wrong", (double)shadow->n_wrong);
		cJSON_AddNumberToObject(root, "shadow_misplaced", (double)shadow->n_misplaced);
		cJSON_AddNumberToObject(root, "shadow_mean", shadow->mean);
		cJSON_AddNumberToObject(root, "shadow_seam_p99", shadow->seam_p99);
		cJSON_AddNumberToObject(root, "shadow_seam_max", shadow->seam_max);
	}
	return json_print(root, err);
}

/* Says which bounds are broken; 1 if any is. */
static int check_bounds(const struct psr_accuracy *a, const struct bounds *bounds)
{
	double holes = fraction(a->n_holes, a->n_inside);
	int broken = 0;

	if (bounds->has_holes && holes > bounds->holes)
		broken = fprintf(stderr, PROGRAM ": %.6f of the pixels inside are holes, %.6f are allowed\n", holes,
		                 bounds->holes);
	if (bounds->has_distance && a->distance_p999 > bounds->distance)
		broken = fprintf(stderr, PROGRAM ": the distance is %.4f spacings at the 99.9th percentile, %.4f is allowed\n",
		                 a->distance_p999, bounds->distance);
	if (bounds->has_outside && a->n_outside_drawn > (uint64_t)bounds->outside)
		broken = fprintf(stderr, PROGRAM ": %" PRIu64 " pixels are drawn outside, %" PRId64 " are allowed\n",
		                 a->n_outside_drawn, bounds->outside);
	if (a->n_truth == 0)
		broken = fprintf(stderr, PROGRAM ": the camera does not see the object\n");
	return broken != 0;
}

static int measure_color(struct psr_color_accuracy *out, struct psr_truth *truth, const struct psr_camera *camera,
                         const char *path, int n_threads, struct psr_error *err)
{
	uint32_t width, height;
	uint8_t *rgb = NULL;
	int code = ppm_read(&rgb, &width, &height, path, err);

	if (code == PSR_OK)
		code = psr_accuracy_measure_color(out, truth, camera, width, height, rgb, n_threads, err);
	free(rgb);
	return code;
}

/* The frames with and without shadows, and their light. */
struct shadow_frames {
	const char *shadowed, *lit; /* NULL: none */
	struct psr_light light;
};

static int measure_shadow(struct psr_shadow_accuracy *out, struct psr_truth *truth, const struct psr_camera *camera,
                          const struct shadow_frames *frames, int n_threads, struct psr_error *err)
{
	uint32_t width, height, lit_width, lit_height;
	uint8_t *shadowed = NULL, *lit = NULL;
	int code = ppm_read(&shadowed, &width, &height, frames->shadowed, err);

	if (code == PSR_OK)
		code = ppm_read(&lit, &lit_width, &lit_height, frames->lit, err);
	if (code == PSR_OK && (width != lit_width || height != lit_height))
		code = psr_fail(err, PSR_ERR_ARG, "%s and %s are of different sizes", frames->shadowed, frames->lit);
	if (code == PSR_OK)
		code = psr_accuracy_measure_shadow(out, truth, camera, &frames->light, width, height, shadowed, lit, n_threads, err);
	free(shadowed);
	free(lit);
	return code;
}

/* color_path may be NULL. */
static int measure(struct psr_accuracy *a, struct psr_color_accuracy *color, struct psr_shadow_accuracy *shadow, const char *source,
                   const char *frame, const char *color_path, const struct shadow_frames *shadow_frames,
                   const struct psr_camera *camera, double spacing, struct psr_error *err)
{
	struct psr_build_options options;
	struct psr_mesh *mesh = NULL;
	struct psr_truth *truth = NULL;
	uint32_t width, height;
	float *depth = NULL;
	int code = pfm_read(&depth, &width, &height, frame, err);

	psr_build_options_default(&options);
	if (code == PSR_OK)
		code = psr_mesh_import(&mesh, source, err);
	if (code == PSR_OK)
		code = psr_truth_create(&truth, mesh, err);
	if (code == PSR_OK)
		psr_truth_stipple(truth, spacing);
	if (code == PSR_OK)
		code = psr_accuracy_measure(a, truth, camera, width, height, depth, spacing, options.n_threads, err);
	if (code == PSR_OK && color_path != NULL)
		code = measure_color(color, truth, camera, color_path, options.n_threads, err);
	if (code == PSR_OK && shadow_frames->shadowed != NULL)
		code = measure_shadow(shadow, truth, camera, shadow_frames, options.n_threads, err);
	psr_truth_destroy(truth);
	psr_mesh_destroy(mesh);
	free(depth);
	return code;
}

static int check_arguments(const char *frame, int n_operands, int seen_camera, int seen_fov, int seen_ortho,
                           int seen_spacing, struct psr_error *err)
{
	if (n_operands != 1)
		return psr_fail(err, PSR_ERR_ARG, "one source file is needed");
	if (frame == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--depth FRAME.pfm is needed");
	if (seen_camera != 7)
		return psr_fail(err, PSR_ERR_ARG, "--eye, --target and --up are needed: those of the frame");
	if (!seen_fov == !seen_ortho)
		return psr_fail(err, PSR_ERR_ARG, "either --fov or --ortho is needed: that of the frame");
	if (!seen_spacing)
		return psr_fail(err, PSR_ERR_ARG, "--spacing is needed; psr-model info prints it");
	return PSR_OK;
}

int cmd_accuracy(int argc, char **argv)
{
	struct psr_camera camera = { .kind = PSR_CAMERA_PERSPECTIVE };
	struct bounds bounds = { 0 };
	struct psr_accuracy accuracy;
	struct psr_error err;
	struct psr_color_accuracy color_accuracy;
	struct psr_shadow_accuracy shadow_accuracy;
	struct shadow_frames shadow = { .light = { .kind = PSR_LIGHT_DIRECTIONAL } };
	const char *frame = NULL, *color = NULL, *model = NULL;
	double magnification = 1;
	int64_t n_passes = 0;
	int seen_passes = 0;
	double fov = 0, spacing = 0;
	int sun = 0, lamp = 0, eye = 0, target = 0, up = 0, seen_fov = 0, seen_spacing = 0, seen_ortho = 0, json = 0, n_operands, code;
	const struct psr_opt opts[] = {
		{ .name = "depth", .type = PSR_OPT_STRING, .value = &frame, .arg = "FRAME.pfm",
		  .help = "the frame's depth, as psr shot --depth writes it" },
		{ .name = "color", .type = PSR_OPT_STRING, .value = &color, .arg = "FRAME.ppm",
		  .help = "its colours as well, drawn with --ambient 1 and no light" },
		{ .name = "shadow", .type = PSR_OPT_STRING, .value = &shadow.shadowed, .arg = "FRAME.ppm",
		  .help = "shadows as well: drawn with --ambient 0 and one light, which casts them" },
		{ .name = "lit", .type = PSR_OPT_STRING, .value = &shadow.lit, .arg = "FRAME.ppm", .help = "the same without `shadow`" },
		{ .name = "sun", .type = PSR_OPT_VEC3, .value = shadow.light.direction, .arg = "X,Y,Z",
		  .help = "where that light goes, if it is directional", .seen = &sun },
		{ .name = "lamp", .type = PSR_OPT_VEC3, .value = shadow.light.position, .arg = "X,Y,Z",
		  .help = "or where it is, if it is a point or a spot", .seen = &lamp },
		{ .name = "eye", .type = PSR_OPT_VEC3, .value = camera.eye, .arg = "X,Y,Z", .help = "the frame's camera",
		  .seen = &eye },
		{ .name = "target", .type = PSR_OPT_VEC3, .value = camera.target, .arg = "X,Y,Z", .help = "where it looks",
		  .seen = &target },
		{ .name = "up", .type = PSR_OPT_VEC3, .value = camera.up, .arg = "X,Y,Z", .help = "what is up in the picture",
		  .seen = &up },
		{ .name = "fov", .type = PSR_OPT_REAL, .value = &fov, .arg = "DEG", .help = "its vertical angle", .min = 1e-4,
		  .max = 179.9, .seen = &seen_fov },
		{ .name = "ortho", .type = PSR_OPT_REAL, .value = &camera.ortho_height, .arg = "HEIGHT",
		  .help = "or its height, if it is orthographic", .min = 1e-30, .max = 1e30, .seen = &seen_ortho },
		{ .name = "spacing", .type = PSR_OPT_REAL, .value = &spacing, .arg = "S",
		  .help = "distance of the model's samples, which distances are counted in", .min = 1e-30, .max = 1e30,
		  .seen = &seen_spacing },
		{ .name = "max-holes", .type = PSR_OPT_REAL, .value = &bounds.holes, .arg = "F",
		  .help = "fail if a larger fraction of the pixels inside are holes", .min = 0, .max = 1,
		  .seen = &bounds.has_holes },
		{ .name = "max-distance", .type = PSR_OPT_REAL, .value = &bounds.distance, .arg = "D",
		  .help = "fail if the 99.9th percentile is over D spacings", .min = 0, .max = 1e30,
		  .seen = &bounds.has_distance },
		{ .name = "max-outside", .type = PSR_OPT_INT, .value = &bounds.outside, .arg = "N",
		  .help = "fail if more pixels are drawn over a pixel outside of the silhouette", .min = 0, .max = 1 << 26,
		  .seen = &bounds.has_outside },
		{ .name = "passes", .type = PSR_OPT_INT, .value = &n_passes, .arg = "N",
		  .help = "instead of a frame: draw a still of the model in passes 0 to N, and compare each with the truth", .min = 0,
		  .max = PSR_MAX_PASS, .seen = &seen_passes },
		{ .name = "model", .type = PSR_OPT_STRING, .value = &model, .arg = "FILE.psr", .help = "the model, for --passes" },
		{ .name = "magnification", .type = PSR_OPT_REAL, .value = &magnification, .arg = "M",
		  .help = "pixels between its samples, for --passes", .min = 0.01, .max = 64 },
		{ .name = "json", .type = PSR_OPT_FLAG, .value = &json, .help = "print a JSON object" },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr-model accuracy SOURCE --depth FRAME.pfm --eye X,Y,Z --target X,Y,Z --up X,Y,Z\n"
		         "                 (--fov DEG | --ortho HEIGHT) --spacing S [options]\n"
		         "       psr-model accuracy SOURCE --model FILE.psr --passes N [--magnification M]",
		.summary = "Compares the depth (and the colours) of a frame with the ray-traced mesh that its model was built from.",
		.opts = opts,
		.footer = "Exit codes: 0 ok, 1 a bound is broken, 2 usage, 3 file or system, 4 bad data, 5 over a limit.",
	};

	code = psr_cli_parse(&cli, argc, argv, &n_operands, &err);
	if (code > 0)
		return 0;
	if (code == PSR_OK && seen_passes) {
		if (n_operands != 1 || model == NULL)
			code = psr_fail(&err, PSR_ERR_ARG, "--passes needs one source file, and --model FILE.psr made from it");
		else
			code = accuracy_passes(argv[1], model, magnification, (unsigned)n_passes, &err);
		return code == PSR_OK ? 0 : psr_cli_fail(PROGRAM, &err);
	}
	if (code == PSR_OK)
		code = check_arguments(frame, n_operands, (eye != 0) | (target != 0) << 1 | (up != 0) << 2, seen_fov,
		                       seen_ortho, seen_spacing, &err);
	if (code == PSR_OK && (!shadow.shadowed != !shadow.lit || (shadow.shadowed != NULL && !sun == !lamp)))
		code = psr_fail(&err, PSR_ERR_ARG, "--shadow, --lit and one of --sun and --lamp belong together");
	if (code == PSR_OK) {
		shadow.light.kind = lamp ? PSR_LIGHT_POINT : PSR_LIGHT_DIRECTIONAL;
		camera.kind = seen_ortho ? PSR_CAMERA_ORTHOGRAPHIC : PSR_CAMERA_PERSPECTIVE;
		camera.fov_y = fov * RADIANS;
		code = measure(&accuracy, &color_accuracy, &shadow_accuracy, argv[1], frame, color, &shadow, &camera, spacing, &err);
	}
	if (code == PSR_OK && json)
		code = print_json(&accuracy, color ? &color_accuracy : NULL, shadow.shadowed ? &shadow_accuracy : NULL, &err);
	else if (code == PSR_OK)
		print_text(&accuracy);
	if (code == PSR_OK && !json && color)
		print_color_text(&color_accuracy);
	if (code == PSR_OK && !json && shadow.shadowed)
		print_shadow_text(&shadow_accuracy);
	if (code == PSR_OK && fflush(stdout) != 0)
		code = psr_fail(&err, PSR_ERR_IO, "standard output cannot be written");
	return code == PSR_OK ? check_bounds(&accuracy, &bounds) : psr_cli_fail(PROGRAM, &err);
}
