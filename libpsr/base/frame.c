#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include "hash.h"
#include "psr/frame.h"

static const struct {
	const char *name;
	size_t offset, bytes; /* offset in struct psr_frame; bytes of a pixel */
} planes_of[PSR_N_PLANES] = {
	[PSR_PLANE_COLOR] = { "color", offsetof(struct psr_frame, rgb), 3 },
	[PSR_PLANE_DEPTH] = { "depth", offsetof(struct psr_frame, depth), 4 },
	[PSR_PLANE_NORMAL] = { "normal", offsetof(struct psr_frame, normal), 6 },
	[PSR_PLANE_ID] = { "id", offsetof(struct psr_frame, id), 4 },
	[PSR_PLANE_WEIGHT] = { "weight", offsetof(struct psr_frame, weight), 1 },
	[PSR_PLANE_WORDS] = { "words", offsetof(struct psr_frame, words), 8 },
	[PSR_PLANE_BLOCK] = { "block", offsetof(struct psr_frame, block), 3 },
	[PSR_PLANE_BOUND] = { "bound", offsetof(struct psr_frame, bound), 2 },
};

const char *psr_plane_name(unsigned plane)
{
	return planes_of[plane].name;
}

size_t psr_plane_bytes(unsigned plane)
{
	return planes_of[plane].bytes;
}

void *psr_frame_plane(const struct psr_frame *frame, unsigned plane)
{
	void *pixels;

	assert(plane < PSR_N_PLANES);
	memcpy(&pixels, (const char *)frame + planes_of[plane].offset, sizeof pixels);
	return pixels;
}

void psr_frame_free(struct psr_frame *frame)
{
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		free(psr_frame_plane(frame, plane));
	memset(frame, 0, sizeof *frame);
}

int psr_frame_alloc(struct psr_frame *frame, uint32_t width, uint32_t height, unsigned planes, struct psr_error *err)
{
	memset(frame, 0, sizeof *frame);
	if (planes == 0 || planes >> PSR_N_PLANES)
		return psr_fail(err, PSR_ERR_ARG, "the planes of a frame are %#x: bits 0 to %d are known, and one is needed",
		                planes, PSR_N_PLANES - 1);
	if (width == 0 || height == 0)
		return psr_fail(err, PSR_ERR_ARG, "a frame of %ux%u pixels: both sides need at least 1", width, height);
	if (width > PSR_MAX_SIDE || height > PSR_MAX_SIDE || (uint64_t)width * height > PSR_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "a frame of %ux%u pixels: a side has at most %d, all of it %u", width, height,
		                PSR_MAX_SIDE, PSR_MAX_PIXELS);
	frame->width = width;
	frame->height = height;
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
		void *pixels = planes >> plane & 1 ? malloc((size_t)width * height * psr_plane_bytes(plane)) : NULL;

		if (pixels == NULL && planes >> plane & 1) {
			psr_frame_free(frame);
			return psr_fail(err, PSR_ERR_MEMORY, "no memory for a frame of %ux%u pixels", width, height);
		}
		memcpy((char *)frame + planes_of[plane].offset, &pixels, sizeof pixels);
	}
	return PSR_OK;
}

uint64_t psr_frame_hash(const struct psr_frame *frame, unsigned plane)
{
	return hash_plane(psr_frame_plane(frame, plane), frame->width * psr_plane_bytes(plane), frame->height);
}
