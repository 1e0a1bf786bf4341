#include <inttypes.h>
#include "budget.h"
#include "check.h"
#include "scene.h"
#include "schedule.h"
#include "psr/render.h"

int frame_check(const struct psr_msg_frame *frame, uint32_t id, uint16_t view, int64_t max_pixels,
                struct psr_error *err)
{
	const int is_refined = frame->settings.pass > 0 || frame->settings.smooth == PSR_SMOOTH_FINE;
	const int is_chosen = budget_is_asked(frame) || is_refined;
	uint64_t n_pixels = (uint64_t)frame->width * frame->height;

	if (view >= SCHEDULE_VIEWS)
		return psr_fail(err, PSR_ERR_LIMIT, "this server has views 0 to %d, not %u", SCHEDULE_VIEWS - 1, view);
	if (view == 0 && frame->flags & PSR_WIRE_FRAME_SHARP)
		return psr_fail(err, PSR_ERR_ARG, "a sharp frame (flag 2) belongs to a view above 0");
	if (frame->base != 0 && (view == 0 || frame->base >= id))
		return psr_fail(err, PSR_ERR_ARG, "base %" PRIu32 " of request %" PRIu32 " in view %u: a base is an older request"
		                " of a view above 0", frame->base, id, view);
	if (n_pixels > (uint64_t)max_pixels)
		return psr_fail(err, PSR_ERR_LIMIT,
		                "a frame of %" PRIu32 "x%" PRIu32 " has %" PRIu64 " pixels; this server draws "
		                "%" PRId64 " at most (--max-pixels)",
		                frame->width, frame->height, n_pixels, max_pixels);
	if (frame->color_codec == PSR_CODEC_PNG)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server does not send PNG; ask for raw, JPEG or zstd");
	if (frame->pass_limit > 0 && frame->planes & ~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH))
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "this server refines colour and depth; other planes take pass_limit 0, not %u",
		                frame->pass_limit);
	if (frame->pass_limit > PSR_MAX_PASS)
		return psr_fail(err, PSR_ERR_LIMIT, "this server refines a picture in %d passes at most, not in %u", PSR_MAX_PASS,
		                frame->pass_limit);
	if (is_refined && frame->planes & ~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH))
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "this server refines colour and depth; other planes take settings of pass 0, not %u, and smooth 0 "
		                "or 1, not %u", frame->settings.pass, frame->settings.smooth);
	if (frame->budget == PSR_WIRE_BUDGET_RMSE && !(frame->planes & 1u << PSR_PLANE_COLOR))
		return psr_fail(err, PSR_ERR_ARG, "a budget of RMSE (4) is one of colour; ask for that plane");
	if (is_chosen && (frame->pass_limit > 0 || frame->flags & PSR_WIRE_FRAME_SHARP))
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "a budget of time, error or RMSE, and settings of a pass or a fine picture, say how the only picture "
		                "is drawn: they go with pass_limit 0 and without sharp (flag 2)");
	return PSR_OK;
}

int frame_check_scene(const struct psr_msg_frame *frame, const struct scene *scene, struct psr_error *err)
{
	if (scene == NULL)
		return psr_fail(err, PSR_ERR_NOT_FOUND, "slot %u holds no scene: send SCENE first", frame->slot);
	return frame->budget == PSR_WIRE_BUDGET_RMSE ? scene_check_calibrated(scene, err) : PSR_OK;
}
