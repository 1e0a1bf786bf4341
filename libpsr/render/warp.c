#include <math.h>
#include "base/maths.h"
#include "render/block.h"

/* One tile of the picture, and for each level the cells that belong to it: those of its pixels, and at the picture's
 * border the guard band. Pixels count from the picture's corner, cells from the guard band's. */
struct target {
	uint64_t *word;
	uint32_t stride;
	int32_t x0, y0, x1, y1;
	struct cells {
		float *z;
		uint32_t stride;
		int32_t x0, y0, x1, y1; /* pixels whose cells belong to the tile */
	} cells[PSR_MAX_DEPTH_LEVEL + 1];
};

static void target_make(struct target *t, const struct plan *plan, const struct psr_zstack *stack, uint32_t tile)
{
	uint32_t tx = tile % plan->tiles_x, ty = tile / plan->tiles_x;
	t->word = stack->word;
	t->stride = stack->width;
	t->x0 = (int32_t)(tx * TILE_WIDTH);
	t->y0 = (int32_t)(ty * TILE_HEIGHT);
	int last_x = tx + 1 == plan->tiles_x, last_y = ty + 1 == plan->tiles_y;
	t->x1 = last_x ? (int32_t)plan->width : t->x0 + TILE_WIDTH;
	t->y1 = last_y ? (int32_t)plan->height : t->y0 + TILE_HEIGHT;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		if (!(stack->levels >> k & 1))
			continue;
		struct cells *c = &t->cells[k];
		c->z = stack->level[k].z;
		c->stride = stack->level[k].width;
		c->x0 = tx ? t->x0 : -(1 << k);
		c->y0 = ty ? t->y0 : -(1 << k);
		c->x1 = last_x ? (int32_t)(stack->level[k].width - 1) << k : t->x1;
		c->y1 = last_y ? (int32_t)(stack->level[k].height - 1) << k : t->y1;
	}
}

static void target_clear(const struct target *t, uint32_t levels)
{
	for (int32_t y = t->y0; y < t->y1; y++)
		for (int32_t x = t->x0; x < t->x1; x++)
			t->word[(size_t)y * t->stride + (size_t)x] = PSR_WORD_EMPTY;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		if (!(levels >> k & 1))
			continue;
		const struct cells *c = &t->cells[k];
		for (int32_t y = (c->y0 >> k) + 1; y <= c->y1 >> k; y++)
			for (int32_t x = (c->x0 >> k) + 1; x <= c->x1 >> k; x++)
				c->z[(size_t)y * c->stride + (size_t)x] = INFINITY;
	}
}

/* Far enough outside of every picture to be clipped, and small enough to be an int. */
static inline float clamp_pixel(float u)
{
	const float far = 2.0f * PSR_MAX_SIDE;
	u = u > -far ? u : -far;
	return u < far ? u : far;
}

/* Pixels and depths of one row of a block: [G] (7.3) with the terms of lattice position apart (7.1.1), not
 * accumulated, so that no rounding adds up along the row. */
static inline void warp_row(const float base[3], const float step[3], const float along_z[3], float shift,
                            const float depth[8], int perspective, int32_t u[8], int32_t v[8], float z[8])
{
	for (int c = 0; c < 8; c++) {
		float i = (float)c + shift;
		float x1 = base[0] + i * step[0] + depth[c] * along_z[0];
		float y1 = base[1] + i * step[1] + depth[c] * along_z[1];
		float z1 = base[2] + i * step[2] + depth[c] * along_z[2];
		float w = perspective ? z1 : 1.0f;
		u[c] = psr_floor_int(clamp_pixel(x1 / w));
		v[c] = psr_floor_int(clamp_pixel(y1 / w));
		z[c] = z1;
	}
}

/* The samples of a block that do not face away. */
static uint64_t facing_samples(const struct plan *plan, const struct plan_instance *in, uint32_t block)
{
	const float(*direction)[3] = psr_direction_table();
	const struct psr_blocks *b = in->blocks;
	uint64_t mask = b->mask[block], kept = 0;
	for (uint64_t left = mask; left; left &= left - 1) {
		const uint32_t sample = (uint32_t)__builtin_ctzll(left);
		const float *n = direction[PSR_ATTR_NORMAL(block_attr(b, block, sample))];
		float p[3], eye[3];
		block_position(b, block, sample, p);
		to_eye(plan, in, p, eye);
		const float g = n[0] * eye[0] + n[1] * eye[1] + n[2] * eye[2];
		kept |= (uint64_t)!faces_away(g, eye) << sample;
	}
	return kept;
}

static inline int inside(int32_t u, int32_t v, int32_t x0, int32_t y0, int32_t x1, int32_t y1)
{
	return u >= x0 && u < x1 && v >= y0 && v < y1;
}

static uint32_t warp_block(const struct plan *plan, const struct plan_instance *in, const struct bin_entry *entry,
                           const struct target *t)
{
	const struct psr_blocks *b = in->blocks;
	const uint32_t block = entry->slot - in->first_slot;
	const struct view_matrix *view = &in->projection[b->block_projection[block]];
	const struct cells *cells = entry->level ? &t->cells[entry->level] : NULL;
	const double dx = (double)b->projection[b->block_projection[block]].spacing * (double)(1u << psr_blocks_level(b, block));
	const double dy = dx * 0.86602540378443864676;
	const double x = 8.0 * b->col[block] * dx, y = 8.0 * b->row[block] * dy;
	const uint64_t id = (uint64_t)entry->slot * PSR_BLOCK_SAMPLES;
	const uint16_t *next_depth = b->depth + psr_blocks_attr_first(b, block);
	uint64_t valid = b->mask[block], mask = entry->is_mixed ? facing_samples(plan, in, block) : valid;
	uint32_t n_inside = 0;
	double origin[3], down[3];
	float step[3], along_z[3], bias, depth_step;

	psr_blocks_depth(b, block, &bias, &depth_step);
	for (int a = 0; a < 3; a++) {
		const double *m = view->m[a];
		origin[a] = m[0] * x + m[1] * y + m[3];
		down[a] = m[1] * dy;
		step[a] = (float)(m[0] * dx);
		along_z[a] = (float)m[2];
	}
	for (int r = 0; r < 8; r++, mask >>= 8, valid >>= 8) {
		const uint16_t *row_depth = next_depth;
		next_depth += __builtin_popcountll(valid & 0xff);
		if (!(mask & 0xff))
			continue;
		float base[3], depth[8], z[8];
		int32_t u[8], v[8];
		for (int a = 0; a < 3; a++)
			base[a] = (float)(origin[a] + r * down[a]);
		for (int c = 0; c < 8; c++)
			depth[c] = valid >> c & 1 ? bias + depth_step * (float)*row_depth++ : bias;
		warp_row(base, step, along_z, (float)(r & 1) * 0.5f, depth, plan->perspective, u, v, z);
		for (int c = 0; c < 8; c++) {
			if (!(mask >> c & 1) || !(z[c] > plan->near_z))
				continue;
			if (inside(u[c], v[c], t->x0, t->y0, t->x1, t->y1)) {
				uint64_t word = (uint64_t)psr_bits_from_float(z[c]) << 32 | (id + (uint64_t)(8 * r + c));
				uint64_t *at = &t->word[(size_t)v[c] * t->stride + (size_t)u[c]];
				*at = word < *at ? word : *at;
				n_inside++;
			}
			if (cells && inside(u[c], v[c], cells->x0, cells->y0, cells->x1, cells->y1)) {
				size_t cx = (size_t)((u[c] >> entry->level) + 1), cy = (size_t)((v[c] >> entry->level) + 1);
				float *at = &cells->z[cy * cells->stride + cx];
				*at = z[c] < *at ? z[c] : *at;
			}
		}
	}
	return n_inside;
}

void warp_tile(const struct plan *plan, const struct bins *bins, struct psr_zstack *stack, uint32_t tile, uint64_t *n_inside)
{
	struct target target;
	target_make(&target, plan, stack, tile);
	target_clear(&target, stack->levels);
	*n_inside = 0;
	for (uint32_t e = bins->tile_begin[tile]; e < bins->tile_begin[tile + 1]; e++) {
		const struct bin_entry *entry = &bins->entry[e];
		*n_inside += warp_block(plan, &plan->instance[entry->instance], entry, &target);
	}
}
