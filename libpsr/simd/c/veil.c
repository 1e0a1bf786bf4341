#include "simd/block.h"
#include "simd/kernels.h"

static void veil_block(const struct warp_target *t, const struct veil_layer *layer, const struct veil_entry *entry)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const int32_t side = entry->side;
	/* Of the square's corner from its sample, and of the tile's pixels from the corners that reach it. */
	const float half = 0.5f * (float)(side - 1);
	const float x0 = (float)(t->x0 - side + 1), x1 = (float)t->x1, y0 = (float)(t->y0 - side + 1), y1 = (float)t->y1;
	struct warp_terms terms;
	struct warp_block b;

	warp_block_make(&b, in, entry->slot);
	warp_terms_make(&terms, &b);
	const uint8_t *opacity = in->blocks->opacity + (b.attr - in->blocks->attr);
	for (uint64_t left = b.mask; left; left &= left - 1, b.depth++, opacity++) {
		const uint32_t sample = (uint32_t)__builtin_ctzll(left), r = sample >> 3, c = sample & 7;
		const float depth = (float)*b.depth, z = warp_axis(&terms, &b, 2, r, c, depth);
		const float inverse = t->perspective ? 1 / z : 1;
		const float x = warp_axis(&terms, &b, 0, r, c, depth) * inverse - half;
		const float y = warp_axis(&terms, &b, 1, r, c, depth) * inverse - half;

		if (!(z > t->near_z && x >= x0 && x < x1 && y >= y0 && y < y1))
			continue;
		const uint64_t word = (uint64_t)psr_bits_from_float(z) << 32 | (b.id + sample);
		const uint32_t veil = (uint32_t)(layer->bits[*opacity] * entry->area);
		veil_add_square(layer, t, psr_floor_int(x) - t->x0, psr_floor_int(y) - t->y0, side, word, veil);
	}
}

void veil_c(const struct warp_target *target, const struct veil_layer *layer, const struct veil_entry *entry,
            uint32_t n)
{
	for (uint32_t e = 0; e < n; e++)
		veil_block(target, layer, &entry[e]);
}
