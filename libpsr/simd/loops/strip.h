/* Samples of strips and their pixels. */
#include <string.h>
#include "base/maths.h"
#include "base/root.h"
#include "base/srgb.h"
#include "points_shade.h"
#include "strip_parts.h"
#include "strip_write.h"

static inline void strip_list(struct strip_pixels *p, const uint64_t *word, const uint16_t *weight, uint32_t n_pixels,
                              unsigned place_bits)
{
	uint32_t n = 0;

	memset(p->has_sample, 0, sizeof p->has_sample);
	for (uint32_t x = 0; x < n_pixels; x++) {
		const uint32_t has_sample = word[x] != PSR_WORD_EMPTY && (!weight || weight[x]);

		p->x[n] = (uint16_t)x;
		p->id[n] = (uint32_t)word[x] >> place_bits;
		p->has_sample[x / 32] |= has_sample << x % 32;
		n += has_sample;
	}
	p->n = n;
	p->word = word;
}

static inline uint32_t cone_of(const struct psr_blocks *b, uint32_t block)
{
	if (!(psr_blocks_traits(b, block) & PSR_BLOCK_BENT))
		return STRIP_NO_CONE;
	return (uint32_t)(uint8_t)b->cone_x[block] | (uint32_t)(uint8_t)b->cone_y[block] << 8 |
	       (uint32_t)(uint8_t)b->cone_z[block] << 16 | (uint32_t)b->cone_sine[block] << 24;
}

static void find_cones(struct strip_pixels *p, const struct strip_view *view)
{
	for (uint32_t i = 0, end; i < p->n;) {
		const struct warp_instance *in = instance_run(&end, p, view, i, p->n);
		const struct psr_blocks b = *in->blocks;

		for (; i < end; i++) {
			p->cone[i] = cone_of(&b, p->id[i] / PSR_BLOCK_SAMPLES - in->first_slot);
			p->has_cones |= p->cone[i] != STRIP_NO_CONE;
		}
	}
}

/* Step by step, so that each step's reads of memory overlap. */
static void find_leaves(struct strip_pixels *p, const struct warp_instance *in, uint32_t first, uint32_t end)
{
	const struct psr_cubes *cubes = in->cubes->model;
	uint32_t code[STRIP];

	p->has_leaves = 1;
	for (uint32_t i = first; i < end; i++)
		__builtin_prefetch(&cubes->cube[p->id[i] / PSR_BLOCK_SAMPLES - in->first_slot]);
	for (uint32_t i = first; i < end; i++) {
		const uint32_t cube = p->id[i] / PSR_BLOCK_SAMPLES - in->first_slot;
		const struct psr_cube_level *level = psr_cubes_level(cubes, cube);

		p->at[i] = NULL;
		p->tree[i] = level->tree;
		code[i] = psr_cubes_code(cubes, level, cube);
		p->leaf[i] = psr_cubes_leaf(cubes, level, cube);
		__builtin_prefetch(level->tree->code + code[i]);
		p->two_sided[i] = cubes->groups.flags[cube] & PSR_BLOCK_TWO_SIDED;
	}
	for (uint32_t i = first; i < end; i++) {
		const struct octree *tree = p->tree[i];
		const uint32_t leaf = p->leaf[i] + psr_cubes_rank(tree, code[i], p->id[i] % PSR_BLOCK_SAMPLES);

		p->leaf[i] = leaf;
		if (tree->normal != NULL)
			__builtin_prefetch(tree->normal + leaf);
		if (tree->color != NULL)
			__builtin_prefetch(tree->color + leaf);
		if (tree->material != NULL)
			__builtin_prefetch(tree->material + leaf);
	}
}

static void find_points(struct strip_pixels *p, const struct warp_instance *in, uint32_t first, uint32_t end,
                        int has_sides)
{
	const struct psr_points *points = in->points->model;
	const struct dpoint_group *group = points->set->group;
	const struct dpoint_word *word = points->set->word;
	const uint32_t first_slot = in->first_slot;

	for (uint32_t i = first; i < end; i++) {
		const uint32_t id = p->id[i];

		p->at[i] = &word[group[id / PSR_BLOCK_SAMPLES - first_slot].first + id % PSR_BLOCK_SAMPLES].attr;
		__builtin_prefetch(p->at[i]);
	}
	for (uint32_t i = first; i < end && has_sides; i++)
		p->two_sided[i] = points->groups.flags[p->id[i] / PSR_BLOCK_SAMPLES - first_slot] & PSR_BLOCK_TWO_SIDED;
}

static void strip_find(struct strip_pixels *p, const struct strip_view *view)
{
	const uint32_t n = p->n;

	p->has_leaves = 0;
	p->only_points = 1;
	for (uint32_t i = 0, end; i < n;) {
		const struct warp_instance *in = instance_run(&end, p, view, i, n);
		const struct psr_blocks b = *in->blocks;

		if (in->cubes || in->points) {
			if (in->cubes)
				find_leaves(p, in, i, end);
			else
				find_points(p, in, i, end, view->needs & STRIP_TWO_SIDED);
			p->only_points &= in->points != NULL;
			i = end;
			continue;
		}
		p->only_points = 0;
		for (; i < end; i++) {
			const uint32_t block = p->id[i] / PSR_BLOCK_SAMPLES - in->first_slot, sample = p->id[i] % PSR_BLOCK_SAMPLES;
			const uint64_t below = b.mask[block] & ((UINT64_C(1) << sample) - 1);

			p->at[i] = b.attr + psr_blocks_attr_first(&b, block) + __builtin_popcountll(below);
			p->two_sided[i] = view->needs & STRIP_TWO_SIDED ? b.flags[block] & PSR_BLOCK_TWO_SIDED : 0;
			__builtin_prefetch(p->at[i]);
		}
	}
	p->has_cones = 0;
	if (view->needs & STRIP_BENT && view->needs & (STRIP_POSITION | STRIP_TWO_SIDED))
		find_cones(p, view);
	repeat_last(p);
}

static inline void strip_read(struct strip *strip, const struct strip_view *view)
{
	uint64_t all, common;

	read_attributes(&all, &common, strip, view);
	if (PSR_ATTR_BASE(all) == PSR_ATTR_BASE(common))
		read_base(strip, 1);
	else
		read_base(strip, 0);
}

/* Positions are those of pixel centres, less than a pixel from the samples: where a ray would meet the surface. */
static void locate(struct strip *strip, const struct strip_view *view)
{
	const struct strip_pixels *p = strip->pixels;
	const float y = ((float)p->y + 0.5f - view->half_height) / view->focal;

	for (uint32_t i = 0; i < strip->n; i++)
		strip->pz[i] = psr_word_z(p->word[p->x[i]]);
	for (uint32_t i = 0; i < strip->n; i++) {
		const float x = ((float)(int32_t)(p->x0 + p->x[i]) + 0.5f - view->half_width) / view->focal;
		const float w = psr_choose(view->perspective, strip->pz[i], 1);

		strip->px[i] = x * w;
		strip->py[i] = y * w;
	}
}

static void look(struct strip *strip, const struct strip_view *view)
{
	const float scale = view->perspective ? 1 / view->focal : 0;
	const struct strip_pixels *p = strip->pixels;
	const float y = ((float)p->y + 0.5f - view->half_height) * scale;

	for (uint32_t i = 0; i < strip->n; i++) {
		const float x = ((float)(int32_t)(p->x0 + p->x[i]) + 0.5f - view->half_width) * scale;
		const float unit = -1 / __builtin_sqrtf((x * x + y * y) + 1);

		strip->vx[i] = x * unit;
		strip->vy[i] = y * unit;
		strip->vz[i] = unit;
	}
}

/* Surface normals: moves a normal outside of its cone straight to the rim. */
static void straighten(struct strip *strip, const float m[3][3], uint32_t first, uint32_t end)
{
	const struct strip_pixels *p = strip->pixels;

	for (uint32_t i = first; i < end; i++) {
		const uint32_t cone = p->cone[i], code = cone >> 24;
		const float x = (float)(int8_t)cone, y = (float)(int8_t)(cone >> 8), z = (float)(int8_t)(cone >> 16);
		const float unit = 1 / __builtin_sqrtf((x * x + y * y) + z * z);
		const float ax = ((m[0][0] * x + m[0][1] * y) + m[0][2] * z) * unit;
		const float ay = ((m[1][0] * x + m[1][1] * y) + m[1][2] * z) * unit;
		const float az = ((m[2][0] * x + m[2][1] * y) + m[2][2] * z) * unit;
		const float nx = strip->nx[i], ny = strip->ny[i], nz = strip->nz[i];
		const float sine = (float)(int32_t)code * (1.0f / 255), rim = __builtin_sqrtf(1 - sine * sine);
		const float c = (nx * ax + ny * ay) + nz * az, square = 1 - c * c, least = 1e-12f;
		const float across = sine / __builtin_sqrtf(psr_choose(square > least, square, least));
		const float along = rim - c * across;
		const int is_outside = (code != PSR_CONE_ANY) & (c < rim);

		strip->gx[i] = psr_choose(is_outside, ax * along + nx * across, nx);
		strip->gy[i] = psr_choose(is_outside, ay * along + ny * across, ny);
		strip->gz[i] = psr_choose(is_outside, az * along + nz * across, nz);
	}
}

/* A shading normal may face away from the eye; its highlights are those of one that is seen at this cosine. */
#define LEAST_NV 1e-3f
/* The least roughness^4: stored normals are half a degree off, and floats would not tell sharper lobes' places. */
#define LEAST_WIDTH2 4e-6f

/* Splits base colours into what is scattered and what is mirrored, and prepares what the highlights of all lights have
 * in common: lobe_colors() and lobe_ambient() of surface/lobe.h, which has the formulas. */
static void prepare_highlights(struct strip *s, const float ambient[3])
{
	const float ambient_r = ambient[0], ambient_g = ambient[1], ambient_b = ambient[2];

	for (uint32_t i = 0; i < s->n; i++) {
		const int32_t gloss = (int32_t)(s->attr[i] >> 40);
		const float metallic = (float)(gloss & 31) * (1 / 31.0f), rest = 1 - metallic;
		const float root = (float)(gloss >> 5 & 31) * (1 / 30.0f), square = root * root;
		const float dielectric = psr_choose(square < 1, square, 1), f0 = dielectric * rest;
		const float scatter = rest * (1 - dielectric), open = 1 - (float)(gloss >> 10 & 63) * (1 / 63.0f);
		const float roughness = (float)(gloss >> 16) * (1 / 255.0f), a = roughness * roughness, wide = a * a;
		const float width2 = psr_choose(wide > LEAST_WIDTH2, wide, LEAST_WIDTH2);
		const float shine = psr_where((gloss & 0x3ff) != 0, 1);
		const float x = s->nx[i], y = s->ny[i], z = s->nz[i];
		const float facing = (x * s->vx[i] + y * s->vy[i]) + z * s->vz[i];
		const float nv = psr_choose(facing > LEAST_NV, facing, LEAST_NV);
		const float aside = 1 - nv, aside2 = aside * aside, smooth = 1 - roughness;
		const float grazing = shine * (smooth * (aside2 * aside) * (0.27f + 0.8f * (smooth * smooth * aside2)));
		const float loss = (0.42f + nv * (1.05f - 1.87f * nv)) + a * ((1.83f * nv - 0.45f) + 1.17f * (nv * nv));
		const float mirrored = 1 / (1 + a * loss) - grazing;
		const float r = s->dr[i], g = s->dg[i], b = s->db[i];
		const float sr = f0 + r * metallic, sg = f0 + g * metallic, sb = f0 + b * metallic;
		const float dr = r * scatter, dg = g * scatter, db = b * scatter;

		s->dr[i] = dr;
		s->dg[i] = dg;
		s->db[i] = db;
		s->sr[i] = sr;
		s->sg[i] = sg;
		s->sb[i] = sb;
		s->shine[i] = shine;
		s->width2[i] = width2;
		s->nv[i] = nv;
		s->n2[i] = (x * x + y * y) + z * z;
		s->seen[i] = __builtin_sqrtf(nv * nv * (1 - width2) + width2);
		s->hr[i] = (dr + (sr * mirrored + grazing)) * open * ambient_r;
		s->hg[i] = (dg + (sg * mirrored + grazing)) * open * ambient_g;
		s->hb[i] = (db + (sb * mirrored + grazing)) * open * ambient_b;
	}
}

/* Mixed normals shorter than this, of faces 28 degrees apart, are of an edge. */
#define EWA_EDGE 0.97f

/* Widens a lobe whose highlight may be brighter than white (of_mesh.c) by the spread of the normals around an edge, as
 * octree_mean_material() does: a mirror with the mean normal of two faces would show what neither of them does. */
static uint64_t ewa_widen(uint64_t attr, float length)
{
	const float metallic = (float)(int32_t)(attr >> 40 & 31) * (1 / 31.0f);
	const float root = (float)(int32_t)(attr >> 45 & 31) * (1 / 30.0f);
	const float roughness = (float)(int32_t)(attr >> 56) * (1 / 255.0f), a = roughness * roughness;
	const float wide = a * a + 2 * (EWA_EDGE - length) / length, most = psr_choose(wide < 1, wide, 1);

	if (!(metallic + (1 - metallic) * (root * root) > 4 * (a * a)))
		return attr;
	return (attr & 0xffffffffffffff) | (uint64_t)(int32_t)(__builtin_sqrtf(__builtin_sqrtf(most)) * 255 + 0.5f) << 56;
}

/* Takes the looks of samples from the sums of their pixels. */
static void ewa_resolve(struct strip *strip, const struct strip_view *view, uint32_t first, uint32_t end)
{
	const struct strip_pixels *p = strip->pixels;
	const struct ewa_sum *row = view->sum + (size_t)p->y * view->sum_stride + p->x0;

	for (uint32_t i = first; i < end; i++) {
		const uint32_t *lane = row[p->x[i]].lane, weight = lane[EWA_WEIGHT];
		float n[3];

		if (weight == 0 || weight >= EWA_MOST_WEIGHT)
			continue;
		const float share = 1 / ((float)(int32_t)weight * EWA_COLOR_ONE);
		strip->dr[i] = (float)lane[EWA_COLOR] * share;
		strip->dg[i] = (float)lane[EWA_COLOR + 1] * share;
		strip->db[i] = (float)lane[EWA_COLOR + 2] * share;
		for (int k = 0; k < 3; k++)
			n[k] = (float)(int32_t)lane[EWA_NORMAL + k];
		const float length2 = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
		if (!(length2 > 0))
			continue;
		const float unit = 1 / __builtin_sqrtf(length2);
		strip->nx[i] = n[0] * unit;
		strip->ny[i] = n[1] * unit;
		strip->nz[i] = n[2] * unit;
		const float whole = (float)(int32_t)weight * 511, length = __builtin_sqrtf(length2) / whole;
		if (length < EWA_EDGE)
			strip->attr[i] = ewa_widen(strip->attr[i], length);
	}
}

static void strip_resolve(struct strip *strip, const struct strip_view *view, const float ambient[3])
{
	const struct strip_pixels *p = strip->pixels;
	const uint32_t n = strip->n;

	if (view->lit && !strip->is_specular) {
		for (uint32_t i = 0; i < n; i++) {
			const float *lit = view->lit[PSR_ATTR_NORMAL(strip->attr[i])];

			strip->lr[i] = lit[0];
			strip->lg[i] = lit[1];
			strip->lb[i] = lit[2];
		}
		return;
	}
	for (uint32_t first = 0, end; first < n; first = end) {
		const struct warp_instance *in = instance_run(&end, p, view, first, n);

		if (in->points) {
			points_resolve(strip, view, in, first, end);
			continue;
		}
		turn_normals(strip, in->turn, first, end);
		if (in->cubes && view->sum)
			ewa_resolve(strip, view, first, end);
		if (p->has_cones)
			straighten(strip, in->turn, first, end);
		else
			strip_copy_normals(strip, view, first, end);
	}
	for (uint32_t i = 0; i < n; i++)
		strip->lr[i] = strip->lg[i] = strip->lb[i] = 0;
	if (view->needs & STRIP_POSITION)
		locate(strip, view);
	if (strip->is_specular || view->needs & STRIP_TWO_SIDED)
		look(strip, view);
	if (view->needs & STRIP_TWO_SIDED)
		for (uint32_t i = 0; i < n; i++) {
			const float g = (strip->gx[i] * strip->vx[i] + strip->gy[i] * strip->vy[i]) + strip->gz[i] * strip->vz[i];
			const float turn = psr_choose((p->two_sided[i] != 0) & (g < 0), -1, 1);

			strip->nx[i] *= turn;
			strip->ny[i] *= turn;
			strip->nz[i] *= turn;
			strip->gx[i] *= turn;
			strip->gy[i] *= turn;
			strip->gz[i] *= turn;
		}
	if (strip->is_specular)
		prepare_highlights(strip, ambient);
}

static inline uint16_t light16(float linear)
{
	linear = linear > 0 ? linear : 0;
	linear = linear < 1 ? linear : 1;
	return (uint16_t)(int32_t)(linear * 65535.0f + 0.5f);
}

static CONSTANT_FLAGS uint16_t code16(float linear, int is_wide)
{
	return is_wide ? psr_root_of_light(linear) : light16(linear);
}

static CONSTANT_FLAGS void strip_color_by(struct strip *s, const float ambient[3], int is_specular, int is_wide)
{
	const float ambient_r = ambient[0], ambient_g = ambient[1], ambient_b = ambient[2];

	for (uint32_t i = 0; i < s->n; i++) {
		const int is_unlit = PSR_ATTR_UNLIT(s->attr[i]) != 0;
		float r = s->dr[i] * s->lr[i], g = s->dg[i] * s->lg[i], b = s->db[i] * s->lb[i];

		r += is_specular ? s->hr[i] : s->dr[i] * ambient_r;
		g += is_specular ? s->hg[i] : s->dg[i] * ambient_g;
		b += is_specular ? s->hb[i] : s->db[i] * ambient_b;
		s->r[i] = code16(is_unlit ? s->dr[i] : r, is_wide);
		s->g[i] = code16(is_unlit ? s->dg[i] : g, is_wide);
		s->b[i] = code16(is_unlit ? s->db[i] : b, is_wide);
	}
}

static void strip_color(struct strip *strip, const float ambient[3], int is_wide)
{
	if (strip->is_specular && is_wide)
		strip_color_by(strip, ambient, 1, 1);
	else if (strip->is_specular)
		strip_color_by(strip, ambient, 1, 0);
	else if (is_wide)
		strip_color_by(strip, ambient, 0, 1);
	else
		strip_color_by(strip, ambient, 0, 0);
}
