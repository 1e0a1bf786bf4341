#include <inttypes.h>
#include "check.h"
#include "schedule.h"
#include "psr/render.h"

int frame_check(const struct psr_msg_frame *frame, uint32_t id, uint16_t view, int64_t max_pixels,
                struct psr_error *err)
{
	const int is_chosen = frame->budget == PSR_WIRE_BUDGET_TIME || frame->budget == PSR_WIRE_BUDGET_ERROR
	                      || frame->settings.pass > 0;
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
	if (frame->settings.pass > 0 && frame->planes & ~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH))
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "this server refines colour and depth; other planes take settings of pass 0, not %u",
		                frame->settings.pass);
	if (is_chosen && (frame->pass_limit > 0 || frame->flags & PSR_WIRE_FRAME_SHARP))
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "a budget of time or error, and settings of a pass, say how the only picture is drawn: they go "
		                "with pass_limit 0 and without sharp (flag 2)");
	return PSR_OK;
}
