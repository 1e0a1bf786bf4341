#include "judge.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/netpbm.h"
#include "base/png.h"
#include "client/output/output.h"
#include "figure.h"

static void check_hashes(struct result *result, const struct judge *judge, const struct psr_event *event)
{
	const struct psr_msg_frame_end *end = event->end;

	result->has_hashes = end->has_hashes;
	memcpy(result->hash, end->hash, sizeof result->hash);
	for (unsigned i = 0; i < PSR_N_PLANES; i++) {
		const struct expect_hash *hash = &judge->test->expect.hash[i];

		if (hash->text == NULL)
			continue;
		if (!end->has_hashes)
			result_fail(result, "the server tells no hashes");
		else if (hash->value == NULL)
			result_fail(result, "%s has the hash %016" PRIx64 ", and the suite knows none yet", psr_plane_name(i),
			            end->hash[i]);
		else if (hash->value[judge->k] != end->hash[i])
			result_fail(result, "%s has the hash %016" PRIx64 " instead of %016" PRIx64, psr_plane_name(i),
			            end->hash[i], hash->value[judge->k]);
	}
}

/* Lateness depends on the machine: it is for `time` to judge. */
static void check_budget(struct result *result, const struct psr_msg_frame *asked, const struct psr_event *event)
{
	if (event->end->status != PSR_WIRE_FRAME_COARSE)
		return;
	if (asked->budget == PSR_WIRE_BUDGET_RMSE)
		result_fail(result, "no settings are foreseen to be as like the source as --budget says");
	else
		result_fail(result, "the error bound is %.4g px, over the budget",
		            event->end->error_px * event->begin->settings.scale);
}

static void check_bound(struct result *result, const char *metric, double value, double bound, int is_least,
                        const char *unit)
{
	if (is_least ? value >= bound : value <= bound)
		return;
	result_fail(result, "%s is %.4g%s, at %s %.4g%s is needed", metric, value, unit, is_least ? "least" : "most", bound,
	            unit);
}

static int check_color(struct result *result, const struct expect *e, const struct psr_frame *picture,
                       const struct psr_frame *reference, struct psr_error *err)
{
	const uint32_t size[2] = { picture->width, picture->height };
	const uint64_t n = (uint64_t)size[0] * size[1];
	double value;
	int code = PSR_OK;

	if (e->is_exact) {
		value = compare_off(picture->rgb, reference->rgb, n, 0);
		if (value > 0)
			result_fail(result, "%.0f of %" PRIu64 " pixels differ", value * (double)n, n);
	}
	if (!isnan(e->bound[EXPECT_PSNR]))
		check_bound(result, "psnr", compare_psnr(picture->rgb, reference->rgb, NULL, n), e->bound[EXPECT_PSNR], 1,
		            " dB");
	if (!isnan(e->bound[EXPECT_OFF])) {
		char metric[64];

		snprintf(metric, sizeof metric, "the share of pixels off by more than %u codes", e->off_codes);
		check_bound(result, metric, 100 * compare_off(picture->rgb, reference->rgb, n, e->off_codes),
		            100 * e->bound[EXPECT_OFF], 0, " %");
	}
	if (!isnan(e->bound[EXPECT_SSIM])) {
		code = compare_ssim(&value, picture->rgb, reference->rgb, size, err);
		if (code == PSR_OK)
			check_bound(result, "ssim", value, e->bound[EXPECT_SSIM], 1, "");
	}
	if (code == PSR_OK && !isnan(e->bound[EXPECT_FLIP])) {
		code = compare_flip(&value, picture->rgb, reference->rgb, size, err);
		if (code == PSR_OK)
			check_bound(result, "flip", value, e->bound[EXPECT_FLIP], 0, "");
	}
	return code;
}

/* ---- files of references ---- */

/* A reference was not read: the result says why. MEMORY is the run's error. */
static int tell_unread(struct result *result, const char *path, int code, const struct psr_error *why,
                       struct psr_error *err)
{
	if (code == PSR_ERR_MEMORY)
		return psr_fail(err, code, "%s", why->text);
	if (code == PSR_ERR_NOT_FOUND)
		result_fail(result, "the reference %.200s is not there yet", path);
	else
		result_fail(result, "the reference cannot be read: %.300s", why->text);
	return PSR_OK;
}

/* A reference that is missing or unreadable has no pixels; the result says why. MEMORY. */
static int read_color(struct psr_frame *reference, struct result *result, const char *path,
                      const struct psr_frame *picture, struct psr_error *err)
{
	struct psr_error why;
	int code = png_read_frame(reference, path, &why);

	if (code != PSR_OK)
		return tell_unread(result, path, code, &why, err);
	if (reference->width == picture->width && reference->height == picture->height)
		return PSR_OK;
	result_fail(result, "the picture has %ux%u pixels, the reference %ux%u", picture->width, picture->height,
	            reference->width, reference->height);
	psr_frame_free(reference);
	return PSR_OK;
}

static int read_depth(float **depth, struct result *result, const char *path, const struct psr_frame *picture,
                      struct psr_error *err)
{
	uint32_t width, height;
	struct psr_error why;
	int code = pfm_read(depth, &width, &height, path, &why);

	if (code != PSR_OK)
		return tell_unread(result, path, code, &why, err);
	if (width == picture->width && height == picture->height)
		return PSR_OK;
	result_fail(result, "the picture has %ux%u pixels, the reference of depth %ux%u", picture->width, picture->height,
	            width, height);
	free(*depth);
	*depth = NULL;
	return PSR_OK;
}

static int name_file(char path[PATH_MAX], const struct judge *judge, const char *name, struct psr_error *err)
{
	if (judge->test->n_pictures > 1)
		return output_name(path, name, judge->k + 1, err);
	snprintf(path, PATH_MAX, "%s", name);
	return PSR_OK;
}

/* ---- a picture ---- */

struct compared {
	struct psr_frame reference; /* rgb NULL: none */
	float *depth;               /* of the reference; NULL: none */
	char color_path[PATH_MAX], depth_path[PATH_MAX];
};

/* The worst pixels of the colours, or where those are the same of the depths. */
static int find_worst(struct result *result, const struct psr_frame *picture, const struct compared *compared,
                      struct psr_error *err)
{
	const uint32_t size[2] = { picture->width, picture->height };
	const uint64_t n = (uint64_t)size[0] * size[1];
	float *map;
	int code = PSR_OK;

	if (compared->reference.rgb == NULL && compared->depth == NULL)
		return PSR_OK;
	map = calloc(n, sizeof *map);
	if (map == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to compare pictures of %ux%u", size[0], size[1]);
	if (compared->reference.rgb != NULL) {
		compare_map_color(map, picture->rgb, compared->reference.rgb, n);
		code = compare_worst(&result->box, map, size, err);
	}
	if (code == PSR_OK && result->box.width == 0 && compared->depth != NULL) {
		compare_map_depth(map, picture->depth, compared->depth, n);
		code = compare_worst(&result->box, map, size, err);
	}
	free(map);
	return code;
}

static int compare(struct result *result, struct compared *compared, const struct judge *judge,
                   const struct psr_frame *picture, struct psr_error *err)
{
	const struct expect *e = &judge->test->expect;
	const uint64_t n = (uint64_t)picture->width * picture->height;
	int code = PSR_OK;

	if (e->reference != NULL) {
		code = name_file(compared->color_path, judge, e->reference, err);
		if (code == PSR_OK)
			code = read_color(&compared->reference, result, compared->color_path, picture, err);
		if (code == PSR_OK && compared->reference.rgb != NULL)
			code = check_color(result, e, picture, &compared->reference, err);
	}
	if (code == PSR_OK && e->depth != NULL) {
		code = name_file(compared->depth_path, judge, e->depth, err);
		if (code == PSR_OK)
			code = read_depth(&compared->depth, result, compared->depth_path, picture, err);
		if (code == PSR_OK && compared->depth != NULL)
			check_bound(result, "depth-rmse", compare_depth_rmse(picture->depth, compared->depth, n),
			            e->bound[EXPECT_DEPTH], 0, "");
	}
	return code;
}

static int accept(const struct compared *compared, const struct psr_frame *picture, struct psr_error *err)
{
	int code = PSR_OK;

	if (compared->color_path[0] != '\0')
		code = psr_picture_write_color(picture, compared->color_path, err);
	if (code == PSR_OK && compared->depth_path[0] != '\0')
		code = psr_picture_write_depth(picture, compared->depth_path, err);
	return code;
}

/* Shows the picture, and takes it if that is wished and possible. */
static int end_failed(struct result *result, const struct judge *judge, const struct psr_frame *picture,
                      const struct compared *compared, struct psr_error *err)
{
	const struct expect *e = &judge->test->expect;
	int code = find_worst(result, picture, compared, err);

	if (code == PSR_OK && judge->wants_figure)
		code = figure_make(&result->figure, picture, compared->reference.rgb, compared->depth, &result->box, err);
	if (code != PSR_OK || !judge->is_accepted || e->error != PSR_OK
	    || (expect_wants_hash(e) && !result->has_hashes))
		return code;
	result->outcome = OUTCOME_ACCEPTED;
	return accept(compared, picture, err);
}

int judge_frame(struct result *result, const struct judge *judge, const struct psr_event *event, struct psr_error *err)
{
	struct compared *compared = calloc(1, sizeof *compared);
	int code;

	if (compared == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to compare pictures");
	result->outcome = OUTCOME_PASSED;
	if (judge->test->expect.error != PSR_OK)
		result_fail(result, "a picture came instead of the error `%s`", psr_strerror(judge->test->expect.error));
	check_hashes(result, judge, event);
	check_budget(result, &judge->test->frame, event);
	code = compare(result, compared, judge, event->picture, err);
	if (code == PSR_OK && result->outcome == OUTCOME_FAILED)
		code = end_failed(result, judge, event->picture, compared, err);
	psr_frame_free(&compared->reference);
	free(compared->depth);
	free(compared);
	return code;
}

void judge_error(struct result *result, const struct suite_test *test, const struct psr_error *error)
{
	result->outcome = OUTCOME_PASSED;
	if (test->expect.error == PSR_OK)
		result_fail(result, "%s: %.400s", psr_strerror(error->code), error->text);
	else if (test->expect.error != error->code)
		result_fail(result, "the error is `%s` instead of `%s`: %.350s", psr_strerror(error->code),
		            psr_strerror(test->expect.error), error->text);
}
