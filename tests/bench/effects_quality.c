/* What accuracy costs: frames by the distance of samples that is good enough, and gaps found in two ways, beside the truth. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "effects.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "price.h"
#include "measure/measure.h"
#include "report.h"
#include "scene.h"

#define SIDE 512
#define RAYS 4 /* a side of a pixel */
#define N_FRAMES 48

struct truth {
	struct psr_mesh *mesh;
	struct psr_truth *rays;
	struct scene_film film;
	float (*light)[3];  /* of each pixel, linear: the mean of RAYS x RAYS rays; all of which meet the object, else NAN */
	int n_threads;
};

static void scene(struct psr_scene *out, int frame, const void *userdata)
{
	scene_film_frame(out, userdata, frame);
}

/* Diffuse light of the film's scene. */
static float lit_by(const struct scene_film *film, const float normal[3])
{
	double to_light[3];

	v3d_normalize(to_light, film->light.direction);
	const double dot = -(to_light[0] * normal[0] + to_light[1] * normal[1] + to_light[2] * normal[2]);
	return (float)(SCENE_AMBIENT + film->light.color[0] * fmax(dot, 0));
}

/* Frame 0 of the film. */
static void truth_make(struct truth *truth, const char *source, int n_threads)
{
	const size_t n = (size_t)SIDE * SIDE * RAYS * RAYS;
	float *depth = report_alloc(n, sizeof *depth), (*normal)[3] = report_alloc(n, sizeof *normal);
	uint8_t (*color)[4] = report_alloc(n, sizeof *color);
	struct psr_scene drawn;
	struct psr_error err;

	scene(&drawn, 0, &truth->film);
	truth->n_threads = n_threads;
	if (psr_mesh_import(&truth->mesh, source, NULL, &err) != PSR_OK || psr_truth_create(&truth->rays, truth->mesh, &err) != PSR_OK
	    || psr_truth_draw(&(struct psr_truth_shot){ truth->rays, &drawn.camera, SIDE, SIDE, n_threads }, RAYS, depth,
	                      normal, color, &err) != PSR_OK)
		report_die(source, err.text);
	truth->light = report_alloc((size_t)SIDE * SIDE, sizeof *truth->light);
	for (size_t i = 0; i < n; i++) {
		const size_t x = i % (SIDE * RAYS) / RAYS, y = i / (SIDE * RAYS) / RAYS;
		float *pixel = truth->light[y * SIDE + x], lit = isinf(depth[i]) ? NAN : lit_by(&truth->film, normal[i]);

		for (int c = 0; c < 3; c++)
			pixel[c] += fminf(lit * psr_srgb_to_linear[color[i][c]], 1) / (RAYS * RAYS) + 0 * lit;
	}
	free(depth);
	free(normal);
	free(color);
}

static void truth_free(struct truth *truth)
{
	psr_truth_destroy(truth->rays);
	psr_mesh_destroy(truth->mesh);
	free(truth->light);
}

/* Of codes, over the pixels that the object fills. */
static double psnr(const struct truth *truth, const uint8_t *rgb, const uint8_t *other)
{
	double sum = 0;
	uint64_t n = 0;

	for (size_t i = 0; i < (size_t)SIDE * SIDE; i++)
		for (int c = 0; c < 3; c++) {
			if (isnan(truth->light[i][0]))
				continue;
			const int code = other != NULL ? other[3 * i + c] : psr_linear_to_srgb(truth->light[i][c]);
			const double difference = code - rgb[3 * i + c];

			sum += difference * difference;
			n++;
		}
	return sum == 0 ? INFINITY : 10 * log10(255.0 * 255 * (double)n / sum);
}

struct drawn {
	uint8_t *rgb;
	float *depth;
	struct psr_report report;
};

static void draw(struct drawn *out, const struct truth *truth, const struct render_settings *settings)
{
	struct psr_frame frame = { .width = SIDE, .height = SIDE };
	struct psr_renderer *renderer;
	struct psr_scene drawn;
	struct psr_error err;

	out->rgb = frame.rgb = report_alloc((size_t)SIDE * SIDE, 3);
	out->depth = frame.depth = report_alloc((size_t)SIDE * SIDE, sizeof(float));
	scene(&drawn, 0, &truth->film);
	if (psr_renderer_create(&renderer, NULL) != PSR_OK || renderer_draw(renderer, &drawn, settings, NULL, &frame, &err) != PSR_OK)
		report_die("psr_render", "fails");
	out->report = frame.report;
	psr_renderer_destroy(renderer);
}

static void release(struct drawn *drawn)
{
	free(drawn->rgb);
	free(drawn->depth);
}

/* The finest level, `magnification` pixels apart. */
static void film_make(struct scene_film *film, struct psr_model *model, double magnification)
{
	static const struct scene_picture picture = { "", SIDE, SIDE, 0 };
	static const double aim[3];

	scene_film_init(film, &picture, model, aim);
	scene_film_magnify(film, magnification);
}

void effects_spacing(const struct effects *effects)
{
	static const double spacing[] = { 0.5, 0.7, 1, 1.41, 2, 4 };
	struct truth truth;
	struct drawn finest, drawn;
	struct render_settings settings;

	film_make(&truth.film, effects->model, 0.26);
	truth_make(&truth, effects->source, effects->n_threads);
	render_settings_default(&settings, SIDE, SIDE);
	const struct price_side usual = { .settings = settings, .scene = scene, .userdata = &truth.film };
	settings.spacing_px = spacing[0];
	draw(&finest, &truth, &settings);
	printf("\nWhat accuracy costs: the %s at %dx%d, %.2f pixels between samples of the finest level; one light, 1 thread; PSNR "
	       "over the\npixels that the object fills, of sRGB codes: to the mesh by %d rays a pixel, and to spacing %g\n"
	       "%8s %9s %9s %9s %14s %10s %11s\n",
	       effects->name, SIDE, SIDE, truth.film.magnification, RAYS * RAYS, spacing[0], "spacing", "ms", "of that",
	       "samples,", "a covered", "PSNR to", "PSNR to");
	printf("%8s %9s %9s %9s %14s %10s %8s %g\n", "pixels", "", "at 1", "millions", "pixel", "the truth", "spacing", spacing[0]);
	for (size_t i = 0; i < sizeof spacing / sizeof spacing[0]; i++) {
		cJSON *item = report_add(report_array("spacing"));
		struct price_side side = usual;
		struct price price;

		side.settings.spacing_px = settings.spacing_px = spacing[i];
		price_measure(&price, &side, &usual, N_FRAMES, 1);
		draw(&drawn, &truth, &settings);
		const double samples = (double)drawn.report.n_samples_drawn;
		const double covered = (double)(drawn.report.n_covered + drawn.report.n_filled);
		const double to_truth = psnr(&truth, drawn.rgb, NULL), to_finest = psnr(&truth, drawn.rgb, finest.rgb);

		printf("%8g %9.2f %7.0f %% %9.3f %14.2f %10.2f %11.2f\n", spacing[i], price.ms, 100 * price.ms / (price.ms - price.more_ms),
		       samples * 1e-6, samples / covered, to_truth, to_finest);
		report_number(item, "spacing", spacing[i]);
		report_number(item, "ms", price.ms);
		report_number(item, "ms_at_1", price.ms - price.more_ms);
		report_number(item, "samples", samples);
		report_number(item, "pixels_covered", covered);
		report_number(item, "psnr_truth", to_truth);
		if (isfinite(to_finest))
			report_number(item, "psnr_finest", to_finest);
		release(&drawn);
	}
	release(&finest);
	truth_free(&truth);
}

static void gaps_row(const struct truth *truth, const char *name, double magnification, enum psr_gap_method method)
{
	static const char *const names[] = { "bilinear", "opaque", "closed" };
	cJSON *item = report_add(report_array("gaps"));
	struct render_settings settings;
	struct psr_accuracy accuracy;
	struct psr_scene seen;
	struct drawn drawn;
	struct psr_error err;

	render_settings_default(&settings, SIDE, SIDE);
	settings.gap_method = method;
	draw(&drawn, truth, &settings);
	scene(&seen, 0, &truth->film);
	const struct psr_truth_shot shot = { truth->rays, &seen.camera, SIDE, SIDE, truth->n_threads };

	if (psr_accuracy_measure(&accuracy, &shot, drawn.depth, psr_model_info(truth->film.model)->spacing, &err) != PSR_OK)
		report_die("the truth", err.text);
	const double db = psnr(truth, drawn.rgb, NULL);

	printf("%-8s %6.2f %-9s %9lu %8lu %9lu %9lu %10.2f\n", name, magnification, names[method],
	       (unsigned long)drawn.report.count[PSR_STAGE_GAPS], (unsigned long)drawn.report.n_filled, (unsigned long)accuracy.n_holes,
	       (unsigned long)accuracy.n_outside_drawn, db);
	report_text(item, "model", name);
	report_text(item, "method", names[method]);
	report_number(item, "magnification", magnification);
	report_number(item, "partial", (double)drawn.report.count[PSR_STAGE_GAPS]);
	report_number(item, "filled", (double)drawn.report.n_filled);
	report_number(item, "holes", (double)accuracy.n_holes);
	report_number(item, "inside", (double)accuracy.n_inside);
	report_number(item, "outside", (double)accuracy.n_outside_drawn);
	report_number(item, "psnr", db);
	release(&drawn);
}

void effects_gaps(const struct effects *effects)
{
	struct truth truth;

	printf("\nGaps by closed depths, by bilinear coverage and by opaque squares ([G] 4.6): one level of the %s at %dx%d; holes and pixels drawn "
	       "outside of the\nsilhouette against the mesh, PSNR as above\n%-8s %6s %-9s %9s %8s %9s %9s %10s\n", effects->name, SIDE, SIDE,
	       "", "magni-", "", "partial", "filled", "holes", "outside", "PSNR to");
	printf("%-8s %6s %-9s %9s %8s %9s %9s %10s\n", "model", "fied", "method", "pixels", "pixels", "", "", "the truth");
	for (unsigned level = 1; level <= 2; level++) {
		struct psr_model *model = scene_level(effects->model, level);

		film_make(&truth.film, model, 2);
		truth_make(&truth, effects->source, effects->n_threads);
		gaps_row(&truth, effects->name, truth.film.magnification, PSR_GAPS_CLOSED);
		gaps_row(&truth, effects->name, truth.film.magnification, PSR_GAPS_BILINEAR);
		gaps_row(&truth, effects->name, truth.film.magnification, PSR_GAPS_OPAQUE);
		truth_free(&truth);
		psr_model_unref(model);
	}
}
