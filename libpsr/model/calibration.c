#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include "file.h"
#include "psr/render.h"

_Static_assert(sizeof(struct psr_calibrated) == CALIBRATED_BYTES && offsetof(struct psr_calibrated, rmse) == 16
               && offsetof(struct psr_calibrated, ms) == 56, "section CALB");
_Static_assert(sizeof(struct psr_calibrated_fine) == 8 && offsetof(struct psr_calibrated_fine, ms) == 4, "section CALF");

#define MOST 1e9f /* of any value */

/* Views differ by as much: */
#define ALIKE_APART 0.5   /* base 2 logarithm of the distance of samples, */
#define ALIKE_LAYERS 0.5  /* natural logarithm of the number of layers, */
#define UNLIKE_LIGHT 0.2  /* and what a view counts with shadows in place of none */
#define LEAST_ALIKE 1e-3
#define UPPER 0.98 /* of views that were measured, some ten of them like a view: so nine of ten others keep it */

const struct psr_rung psr_ladder[PSR_RUNGS] = {
	{ .scale = 4, .spacing_px = 1 },
	{ .scale = 2, .spacing_px = 1 },
	{ .scale = 1, .spacing_px = 2 },
	{ .scale = 1, .spacing_px = 1.5 },
	{ .scale = 1, .spacing_px = 1 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1 },
	[PSR_RUNG_FINE] = { .scale = 1, .spacing_px = 1, .smooth = PSR_SMOOTH_FINE },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 1 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 2 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 3 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 4 },
};

static int validate_fine(const struct psr_calibration *calibration, struct psr_error *err)
{
	for (uint32_t i = 0; calibration->fine != NULL && i < calibration->n; i++) {
		const struct psr_calibrated_fine *f = &calibration->fine[i];

		if (!(f->rmse >= 0 && f->rmse <= MOST && f->ms >= 0 && f->ms <= MOST))
			return psr_fail(err, PSR_ERR_FORMAT, "view %" PRIu32 ", fine: an error of %g in %g ms", i, (double)f->rmse,
			                (double)f->ms);
	}
	return PSR_OK;
}

int calibration_validate(const struct psr_calibration *calibration, struct psr_error *err)
{
	for (uint32_t i = 0; i < calibration->n; i++) {
		const struct psr_calibrated *v = &calibration->view[i];

		if (!(v->apart > 0 && v->apart <= MOST && v->layers >= 0 && v->layers <= MOST))
			return psr_fail(err, PSR_ERR_FORMAT, "view %" PRIu32 " has samples %g pixels apart in %g layers", i,
			                (double)v->apart, (double)v->layers);
		if (v->zero != 0)
			return psr_fail(err, PSR_ERR_FORMAT, "view %" PRIu32 ": unused bytes are not zero", i);
		for (int r = 0; r < PSR_RUNGS_CALB; r++)
			if (!(v->rmse[r] >= 0 && v->rmse[r] <= MOST && v->ms[r] > 0 && v->ms[r] <= MOST))
				return psr_fail(err, PSR_ERR_FORMAT, "view %" PRIu32 ", rung %d: an error of %g in %g ms", i, r,
				                (double)v->rmse[r], (double)v->ms[r]);
	}
	return validate_fine(calibration, err);
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

struct psr_measured psr_calibration_at(const struct psr_calibration *calibration, uint32_t view, int rung)
{
	const int in_calb = rung < PSR_RUNG_FINE ? rung : rung - 1;

	if (rung != PSR_RUNG_FINE)
		return (struct psr_measured){ (double)calibration->view[view].rmse[in_calb],
			                          (double)calibration->view[view].ms[in_calb] };
	if (calibration->fine == NULL)
		return (struct psr_measured){ 0, 0 };
	return (struct psr_measured){ (double)calibration->fine[view].rmse, (double)calibration->fine[view].ms };
}

/* Of all views that were measured with the rung. Returns how many. */
static uint32_t list_measured(struct weighed rmse[PSR_MAX_CALIBRATED], struct weighed ms[PSR_MAX_CALIBRATED],
                              const struct psr_calibration *calibration, const struct psr_calibrated *like, int rung)
{
	uint32_t n = 0;

	for (uint32_t i = 0; i < calibration->n; i++) {
		const struct psr_measured at = psr_calibration_at(calibration, i, rung);
		const double weight = weight_of(&calibration->view[i], like);

		if (!(at.ms > 0))
			continue;
		rmse[n] = (struct weighed){ at.rmse, weight };
		ms[n++] = (struct weighed){ at.ms, weight };
	}
	return n;
}

double psr_calibration_rmse(const struct psr_calibration *calibration, const struct psr_calibrated *like, int rung)
{
	struct weighed rmse[PSR_MAX_CALIBRATED], ms[PSR_MAX_CALIBRATED];
	const uint32_t n = list_measured(rmse, ms, calibration, like, rung);

	return n > 0 ? quantile(rmse, n, UPPER) : INFINITY;
}

double psr_calibration_ms(const struct psr_calibration *calibration, const struct psr_calibrated *like, int rung)
{
	struct weighed rmse[PSR_MAX_CALIBRATED], ms[PSR_MAX_CALIBRATED];
	const uint32_t n = list_measured(rmse, ms, calibration, like, rung);

	return n > 0 ? quantile(ms, n, 0.5) : 0;
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
