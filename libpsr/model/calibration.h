/* What settings cost on a model, and what their pictures are worth: measured when the model was built (sections CALB
 * and CALF), and what follows for other views. */
#ifndef PSR_MODEL_CALIBRATION_H
#define PSR_MODEL_CALIBRATION_H

#include "psr/model.h"

#define PSR_RUNGS 11
#define PSR_RUNG_FINE 6 /* of psr_ladder */
#define PSR_RUNGS_CALB (PSR_RUNGS - 1)
#define PSR_MAX_CALIBRATED 256

/* Settings from the cheapest to the best, of psr_settings and of a scale: the picture is drawn at 1/scale of its size.
 * docs/format.md lists them; other ones would need other sections. Spacings are multiples of 2^-16. */
struct psr_rung {
	uint8_t scale, smooth, pass;
	double spacing_px;
};
extern const struct psr_rung psr_ladder[PSR_RUNGS];

/* A view that was measured: what a survey (render/survey.h) sees in it, and each rung but PSR_RUNG_FINE. As in the
 * file. */
struct psr_calibrated {
	float apart;             /* pixels between samples of level 0, > 0 */
	float layers;            /* how many times samples cover what they cover; >= 0 */
	uint32_t n_shadow_lights;
	uint32_t zero;
	float rmse[PSR_RUNGS_CALB]; /* codes of sRGB: root of the sum of squares over the picture, by the pixels that the
	                             * object covers in the truth */
	float ms[PSR_RUNGS_CALB];   /* > 0; of some machine: to be compared with each other */
};

/* The same of PSR_RUNG_FINE. ms 0: nothing is known, since a fine picture of this view is the smooth one. */
struct psr_calibrated_fine {
	float rmse, ms;
};

struct psr_calibration {
	uint32_t n; /* at most PSR_MAX_CALIBRATED; 0: the model is not calibrated */
	const struct psr_calibrated *view;
	const struct psr_calibrated_fine *fine; /* of the same views; NULL in older files */
};

const struct psr_calibration *psr_model_calibration(const struct psr_model *model); /* never NULL */

/* Makes a copy of a model with this calibration in the place of its own. FORMAT, LIMIT, MEMORY. */
int psr_model_calibrate(struct psr_model **out, const struct psr_model *model,
                        const struct psr_calibration *calibration, struct psr_error *err);

/* What was measured; 0 ms: nothing. */
struct psr_measured {
	double rmse, ms;
};
struct psr_measured psr_calibration_at(const struct psr_calibration *calibration, uint32_t view, int rung);

/* Foresees for a view, of which `like` has what is seen and no results, from similar views: the error that 9 of 10
 * views do not exceed, and the median time. like NULL: from all views alike. n > 0. Where no view was measured with the
 * rung, INFINITY and 0. */
double psr_calibration_rmse(const struct psr_calibration *calibration, const struct psr_calibrated *like, int rung);
double psr_calibration_ms(const struct psr_calibration *calibration, const struct psr_calibrated *like, int rung);

#endif
