#include "bins.h"
#include "need.h"
#include "sheer.h"
#include "stages.h"

/* Measured without splats: 20 to 35 bytes a pixel, 0.1 to 0.4 MB a shadow map with the generated models. */
#define LEAST_BYTES (UINT64_C(1) << 20)
#define PIXEL_BYTES 40
#define BLOCK_BYTES (sizeof(struct cull_hit) + sizeof(struct bin_entry) + sizeof(uint32_t)) /* in one tile */
#define RUN_BYTES sizeof(uint64_t) /* what bins->cubes adds to each of a scene with octrees */
#define SHADOW_MAP_BYTES (UINT64_C(1) << 20)

uint64_t renderer_need(const struct renderer_need *need)
{
	const uint64_t area = (uint64_t)need->width * need->height;
	const uint64_t window = need->pass > 0 ? refiner_window(need->width, need->height, need->pass) : 0;
	const uint64_t n_pixels = window > area ? window : area; /* of the largest picture that is drawn at once */
	const uint64_t n_maps = (uint64_t)need->n_shadow_lights * (need->has_sheer ? SHADOW_CASTERS : 1);
	uint64_t bytes = LEAST_BYTES + n_pixels * PIXEL_BYTES + n_maps * SHADOW_MAP_BYTES
	                 + need->n_blocks * (BLOCK_BYTES + (need->has_octrees ? RUN_BYTES : 0)) * 5 / 4; /* as of bins_room() */

	if (need->with_splats)
		bytes += n_pixels * sizeof(struct ewa_sum);
	if (need->pass > 0)
		bytes += refiner_most_bytes(area);
	if (need->has_sheer)
		bytes += sheer_most_bytes(n_pixels, need->n_threads);
	return bytes;
}
