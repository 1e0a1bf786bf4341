/* Section 9.1.1: gains and costs of a model's resolution and of passes of refinement. */
#include <math.h>
#include "base/clock.h"
#include "figures.h"

#define SIDE 256
#define RAYS 16   /* along the side of a pixel */
#define TRIALS 3  /* runs; the quickest counts */
#define FINEST 1024

struct still {
	struct study *study;
	struct refiner *refiner;
	struct psr_frame frame;
	struct figure_truth truth;
	struct figure_shot shot;
};

static int show_pass(struct still *still, unsigned pass, int is_smooth)
{
	struct figure_score score = { .n_met = 0 };
	double least = INFINITY;

	still->shot.settings.smooth = is_smooth;
	still->shot.settings.pass = pass;
	for (int trial = 0; trial < TRIALS; trial++) {
		const uint64_t start = clock_ns();
		const int rc = refiner_draw(still->refiner, &still->shot.scene, &still->shot.settings, still->study->pool,
		                            &still->frame, still->study->err);

		if (rc != PSR_OK)
			return rc;
		least = fmin(least, (double)(clock_ns() - start) * 1e-6);
	}
	figure_score_colors(&score, &still->frame, &still->truth);
	printf(" %5.2f %6.1f", figure_psnr(score.square, score.n_met), least);
	return PSR_OK;
}

static int show_row(struct still *still, const char *name, uint32_t resolution)
{
	int rc;

	printf("%-6s %5u %5.2f |", name, resolution, (double)SIDE / resolution);
	rc = show_pass(still, 0, 0);
	if (rc == PSR_OK)
		rc = show_pass(still, 0, 1);
	for (unsigned pass = 1; rc == PSR_OK && pass <= PSR_MAX_PASS; pass++)
		rc = show_pass(still, pass, 0);
	puts("");
	return rc;
}

/* Models of an object, all in the same picture: samples of the first are a pixel apart. */
static int show_object(struct still *still, const char *name)
{
	int rc = PSR_OK;

	for (uint32_t resolution = SIDE; rc == PSR_OK && resolution <= FINEST; resolution *= 2) {
		struct figure_model model;

		rc = figure_model_load(&model, still->study, name, NULL, resolution);
		if (rc != PSR_OK)
			return rc;
		if (resolution == SIDE) {
			figure_shot_init(&still->shot, &model, figure_view[0], 1, SIDE);
			rc = figure_truth_draw(&still->truth, still->study, &model, &still->shot, RAYS);
		}
		still->shot.instance.model = model.model;
		if (rc == PSR_OK)
			rc = show_row(still, name, resolution);
		figure_model_fini(&model);
	}
	return rc;
}

int figure_stills(struct study *study)
{
	static const char *const name[] = { "teapot", "dragon", "wheel" };
	struct still still = { .study = study };
	int rc = psr_frame_alloc(&still.frame, SIDE, SIDE, 1u << PSR_PLANE_COLOR, study->err);

	if (rc == PSR_OK)
		rc = refiner_create(&still.refiner, study->renderer, study->err);
	printf("dB over all covered pixels, to %d rays a pixel, and ms; %dx%d, %d threads\n%-6s %5s %5s |", RAYS * RAYS,
	       SIDE, SIDE, study->n_threads, "", "model", "px");
	for (int i = 0; i < 2 + PSR_MAX_PASS; i++)
		printf(" %5s %6s", "dB", "ms");
	printf("\n%-6s %5s %5s | %12s %12s", "", "res.", "apart", "one pass", "smooth");
	for (int pass = 1; pass <= PSR_MAX_PASS; pass++)
		printf("%12s%d", "pass ", pass);
	puts("");
	for (size_t m = 0; rc == PSR_OK && m < sizeof name / sizeof *name; m++)
		rc = show_object(&still, name[m]);
	refiner_destroy(still.refiner);
	figure_truth_fini(&still.truth);
	psr_frame_free(&still.frame);
	return rc;
}
