#include "render.h"

int settings_validate(const struct render_settings *settings, struct psr_error *err)
{
	uint32_t w = settings->width, h = settings->height;

	if (w < 1 || h < 1)
		return psr_fail(err, PSR_ERR_ARG, "a picture of %ux%u has no pixels", w, h);
	if (w > PSR_MAX_SIDE || h > PSR_MAX_SIDE || (uint64_t)w * h > PSR_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "a picture of %ux%u is too large: at most %d a side and %u pixels", w, h,
		                PSR_MAX_SIDE, PSR_MAX_PIXELS);
	const struct psr_window *window = &settings->window;
	if (window->picture_width > PSR_MAX_PICTURE_SIDE || window->picture_height > PSR_MAX_PICTURE_SIDE
	    || !window->picture_width != !window->picture_height || window->left < -PSR_MAX_SIDE
	    || window->top < -PSR_MAX_SIDE || window->left > PSR_MAX_PICTURE_SIDE || window->top > PSR_MAX_PICTURE_SIDE)
		return psr_fail(err, PSR_ERR_ARG, "a window at (%d, %d) of a picture of %ux%u is not possible",
		                (int)window->left, (int)window->top, window->picture_width, window->picture_height);
	if (settings->cull_tests & ~(unsigned)PSR_CULL_ALL)
		return psr_fail(err, PSR_ERR_ARG, "unknown cull tests %#x", settings->cull_tests);
	if (!(settings->gap_threshold >= 0 && settings->gap_threshold <= 64))
		return psr_fail(err, PSR_ERR_ARG, "a gap threshold of %g pixels is not within 0..64", settings->gap_threshold);
	if (settings->with_splats && settings->with_ewa)
		return psr_fail(err, PSR_ERR_ARG, "leaves cannot be discs and EWA splats at the same time");
	if ((unsigned)settings->gap_method > PSR_GAPS_CLOSED)
		return psr_fail(err, PSR_ERR_ARG, "unknown gap method %d", (int)settings->gap_method);
	if (!(settings->spacing_px >= PSR_LEAST_SPACING && settings->spacing_px <= 64))
		return psr_fail(err, PSR_ERR_ARG, "a spacing of %g is not within 1/64..64 pixels", settings->spacing_px);
	if ((unsigned)settings->smooth > PSR_SMOOTH_FINE)
		return psr_fail(err, PSR_ERR_ARG, "unknown smoothing %d", (int)settings->smooth);
	if (settings->cell_bias < -4 || settings->cell_bias > 4)
		return psr_fail(err, PSR_ERR_ARG, "a bias of cells of %d is not within -4..4", settings->cell_bias);
	if (settings->shadow_side < 64 || settings->shadow_side > PSR_MAX_SHADOW_SIDE)
		return psr_fail(err, PSR_ERR_ARG, "shadow maps of %u texels a side are not within 64..%d", settings->shadow_side,
		                PSR_MAX_SHADOW_SIDE);
	return PSR_OK;
}
