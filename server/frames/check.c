#include <inttypes.h>
#include "check.h"
#include "psr/render.h"

int frame_check(const struct psr_msg_frame *frame, uint16_t view, int64_t max_pixels, struct psr_error *err)
{
	uint64_t n_pixels = (uint64_t)frame->width * frame->height;

	if (view != 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server has no views: FRAME takes view 0, not %u", view);
	if (n_pixels > (uint64_t)max_pixels)
		return psr_fail(err, PSR_ERR_LIMIT,
		                "a frame of %" PRIu32 "x%" PRIu32 " has %" PRIu64 " pixels; this server draws "
		                "%" PRId64 " at most (--max-pixels)",
		                frame->width, frame->height, n_pixels, max_pixels);
	if (frame->color_codec == PSR_CODEC_PNG)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server does not send PNG; ask for raw, JPEG or zstd");
	if (frame->planes & 1u << PSR_PLANE_DEPTH && frame->depth_format != PSR_WIRE_DEPTH_F32)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server sends depth as f32 only (format 1), not as format %u",
		                frame->depth_format);
	if (frame->pass_limit > 0 && frame->planes & ~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH))
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "this server refines colour and depth; other planes take pass_limit 0, not %u",
		                frame->pass_limit);
	if (frame->pass_limit > PSR_MAX_PASS)
		return psr_fail(err, PSR_ERR_LIMIT, "this server refines a picture in %d passes at most, not in %u", PSR_MAX_PASS,
		                frame->pass_limit);
	if (frame->budget == PSR_WIRE_BUDGET_TIME || frame->budget == PSR_WIRE_BUDGET_ERROR)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server keeps no %s; ask with budget 0",
		                frame->budget == PSR_WIRE_BUDGET_TIME ? "time budgets" : "error bounds");
	if (frame->budget == PSR_WIRE_BUDGET_SETTINGS && frame->settings.scale != 1)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server draws with scale 1 only, not %u", frame->settings.scale);
	if (frame->base != 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server sends no changes to a base: base takes 0, not %" PRIu32,
		                frame->base);
	return PSR_OK;
}
