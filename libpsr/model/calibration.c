#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include "file.h"

_Static_assert(sizeof(struct psr_calibrated) == CALIBRATED_BYTES && offsetof(struct psr_calibrated, rmse) == 16
               && offsetof(struct psr_calibrated, ms) == 56, "section CALB");

#define MOST 1e9f /* of any value */

/* Views differ by as much: */
#define ALIKE_APART 0.5   /* base 2 logarithm of the distance of samples, */
#define ALIKE_LAYERS 0.5  /* natural logarithm of the number of layers, */
#define UNLIKE_LIGHT 0.2  /* and what a view counts with shadows in place of none */
#define LEAST_ALIKE 1e-3
#define UPPER 0.9

const struct psr_rung psr_ladder[PSR_RUNGS] = {
	{ .scale = 4, .spacing_px = 1 },
	{ .scale = 2, .spacing_px = 1 },
	{ .scale = 1, .spacing_px = 2 },
	{ .scale = 1, .spacing_px = 1.5 },
	{ .scale = 1, .spacing_px = 1 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 1 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 2 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 3 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 4 },
};

int calibration_validate(const struct psr_calibration *calibration, struct psr_error *err)
{
	for (uint32_t i = 0; i < calibration->n; i++) {
		const struct psr_calibrated *v = &calibration->view[i];

		if (!(v->apart > 0 && v->apart <= MOST && v->layers >= 0 && v->layers <= MOST))
			return psr_fail(err, PSR_ERR_FORMAT, "view %" PRIu32 " has samples %g pixels apart in %g layers", i,
			                (double)v->apart, (double)v->layers);
		if (v->zero != 0)
			return psr_fail(err, PSR_ERR_FORMAT, "view %" PRIu32 ": unused bytes are not zero", i);
		for (int r = 0; r < PSR_RUNGS; r++)
			if (!(v->rmse[r] >= 0 && v->rmse[r] <= MOST && v->ms[r] > 0 && v->ms[r] <= MOST))
				return psr_fail(err, PSR_ERR_FORMAT, "view %" PRIu32 ", rung %d: an error of %g in %g ms", i, r,
				                (double)v->rmse[r], (double)v->ms[r]);
	}
	return PSR_OK;
}

struct weighed {
	double value, weight;
};

static int compare_values(const void *a, const void *b)
{
	const double x = ((const struct weighed *)a)->value, y = ((const struct weighed *)b)->value;

	return (x > y) - (x < y);
}

static double weight_of(const struct psr_calibrated *view, const struct psr_calibrated *like)
{
	if (like == NULL)
		return 1;

	const double apart = log2((double)view->apart / (double)like->apart) / ALIKE_APART;
	const double layers = log(((double)view->layers + 0.1) / ((double)like->layers + 0.1)) / ALIKE_LAYERS;
	const double light = !view->n_shadow_lights == !like->n_shadow_lights ? 1 : UNLIKE_LIGHT;

	return LEAST_ALIKE + light * exp(-(apart * apart + layers * layers) / 2);
}

/* The value that views of `part` of the weight do not exceed; between two values in proportion. */
static double quantile(struct weighed *list, uint32_t n, double part)
{
	double all = 0, sum = 0;

	qsort(list, n, sizeof *list, compare_values);
	for (uint32_t i = 0; i < n; i++)
		all += list[i].weight;
	for (uint32_t i = 0; i < n; i++) {
		const double middle = sum + list[i].weight / 2;

		if (middle >= part * all) {
			const double before = i > 0 ? sum - list[i - 1].weight / 2 : middle;

			return i == 0 ? list[0].value
			              : list[i - 1].value + (list[i].value - list[i - 1].value) * (part * all - before)
			                                        / (middle - before);
		}
		sum += list[i].weight;
	}
	return list[n - 1].value;
}

static double foresee(const struct psr_calibration *calibration, const struct psr_calibrated *like, size_t values,
                      double part)
{
	struct weighed list[PSR_MAX_CALIBRATED];

	for (uint32_t i = 0; i < calibration->n; i++) {
		float value;

		memcpy(&value, (const char *)&calibration->view[i] + values, sizeof value);
		list[i] = (struct weighed){ (double)value, weight_of(&calibration->view[i], like) };
	}
	return quantile(list, calibration->n, part);
}

double psr_calibration_rmse(const struct psr_calibration *calibration, const struct psr_calibrated *like, int rung)
{
	return foresee(calibration, like, offsetof(struct psr_calibrated, rmse) + (size_t)rung * sizeof(float), UPPER);
}

double psr_calibration_ms(const struct psr_calibration *calibration, const struct psr_calibrated *like, int rung)
{
	return foresee(calibration, like, offsetof(struct psr_calibrated, ms) + (size_t)rung * sizeof(float), 0.5);
}

const struct psr_calibration *psr_model_calibration(const struct psr_model *model)
{
	return &model_content(model)->calibration;
}

int psr_model_calibrate(struct psr_model **out, const struct psr_model *model,
                        const struct psr_calibration *calibration, struct psr_error *err)
{
	struct content content = *model_content(model);
	uint64_t n_bytes;
	uint8_t *bytes;

	if (calibration->n > PSR_MAX_CALIBRATED)
		return psr_fail(err, PSR_ERR_LIMIT, "a calibration of %" PRIu32 " views; the limit is %d", calibration->n,
		                PSR_MAX_CALIBRATED);
	if (!content.has_blocks)
		return psr_fail(err, PSR_ERR_ARG, "a model without blocks cannot be calibrated");
	content.calibration = *calibration;
	bytes = file_image_make(&content, &n_bytes);
	if (bytes == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a model of %" PRIu64 " bytes", n_bytes);
	return model_adopt(out, bytes, n_bytes, 0, "the model", err);
}
