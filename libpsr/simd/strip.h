/* Strips, as plain loops, which the compiler turns into vectors; compiled once for each ISA. */
#include <string.h>
#include "base/maths.h"
#include "base/srgb.h"
#include "simd/block.h"
#include "simd/instance.h"

/* Of functions whose flags are constants where they are called, so that each case is a loop of its own. */
#define CONSTANT_FLAGS inline __attribute__((always_inline))

static inline void strip_list(struct strip_pixels *p, const uint64_t *word, const uint16_t *weight, uint32_t n_pixels)
{
	uint32_t n = 0;
	memset(p->covered, 0, sizeof p->covered);
	for (uint32_t x = 0; x < n_pixels; x++) {
		const uint32_t is_covered = word[x] != PSR_WORD_EMPTY && (!weight || weight[x]);
		p->x[n] = (uint16_t)x;
		p->id[n] = (uint32_t)word[x];
		p->covered[x / 32] |= is_covered << x % 32;
		n += is_covered;
	}
	p->n = n;
}

static inline void strip_find(struct strip_pixels *p, const struct strip_view *view)
{
	for (uint32_t i = 0, end; i < p->n;) {
		const struct warp_instance *in = instance_run(&end, p, view, i);
		const struct psr_blocks *b = in->blocks;
		for (; i < end; i++) {
			const uint32_t block = p->id[i] / PSR_BLOCK_SAMPLES - in->first_slot, sample = p->id[i] % PSR_BLOCK_SAMPLES;
			const uint64_t below = b->mask[block] & ((UINT64_C(1) << sample) - 1);
			p->at[i] = b->attr + psr_blocks_attr_first(b, block) + __builtin_popcountll(below);
			p->two_sided[i] = view->needs & STRIP_TWO_SIDED ? b->flags[block] & PSR_BLOCK_TWO_SIDED : 0;
			__builtin_prefetch(p->at[i]);
		}
	}
}

/* Where samples are, from their lattices, as the warp computes it: in the picture. Pixels side by side are often of one block. */
static void locate(struct strip *strip, const struct warp_instance *in, uint32_t first, uint32_t end)
{
	float *const to[3] = { strip->px, strip->py, strip->pz };
	const uint32_t *id = strip->pixels->id;
	struct warp_block b;
	warp_block_make(&b, in, id[first] / PSR_BLOCK_SAMPLES);
	for (uint32_t i = first; i < end; i++) {
		const uint32_t sample = id[i] % PSR_BLOCK_SAMPLES, r = sample >> 3, c = sample & 7;
		if (id[i] - sample != b.id)
			warp_block_make(&b, in, id[i] / PSR_BLOCK_SAMPLES);
		const uint64_t below = b.mask & ((UINT64_C(1) << sample) - 1);
		const float depth = (float)b.depth[__builtin_popcountll(below)], scale = (float)b.scale;
		for (int a = 0; a < 3; a++)
			to[a][i] = ((float)(b.origin[a] + b.scale * b.lattice->row[a][r]) + scale * b.lattice->col[a][c]) + depth * b.unit[a];
	}
}

/* Brings them back from the picture to the camera's axes. */
static void bring_back(struct strip *strip, const struct strip_view *view)
{
	const float half_width = view->half_width, half_height = view->half_height, focal = view->focal;
	const int perspective = view->perspective;
	for (uint32_t i = 0; i < strip->n; i++) {
		const float w = psr_choose(perspective, strip->pz[i], 1);
		strip->px[i] = (strip->px[i] - half_width * w) / focal;
		strip->py[i] = (strip->py[i] - half_height * w) / focal;
	}
}

static void turn_normals(struct strip *strip, const float m[3][3], uint32_t first, uint32_t end)
{
	for (uint32_t i = first; i < end; i++) {
		const uint64_t word = strip->normal_word[i];
		const float x = (float)(int16_t)word, y = (float)(int16_t)(word >> 16), z = (float)(int16_t)(word >> 32);
		strip->nx[i] = ((m[0][0] * x + m[0][1] * y) + m[0][2] * z) * (1 / 32767.0f);
		strip->ny[i] = ((m[1][0] * x + m[1][1] * y) + m[1][2] * z) * (1 / 32767.0f);
		strip->nz[i] = ((m[2][0] * x + m[2][1] * y) + m[2][2] * z) * (1 / 32767.0f);
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

/* 2^(e / 16), the Phong exponents ([G] table 5.1: 8 bits). */
static const float exponent_root[16] = {
	1.0f,        1.04427378f, 1.09050773f, 1.13878863f, 1.18920712f, 1.24185781f, 1.29683955f, 1.35425555f,
	1.41421356f, 1.47682615f, 1.54221083f, 1.61049033f, 1.68179283f, 1.75625216f, 1.83400809f, 1.91520656f,
};

/* Colours, from the attributes: often the same in the whole strip. */
static CONSTANT_FLAGS void read_diffuse(struct strip *strip, int is_one)
{
	const uint64_t first = strip->attr[0];
	for (uint32_t i = 0; i < strip->n; i++) {
		const uint32_t diffuse = PSR_ATTR_DIFFUSE(is_one ? first : strip->attr[i]);
		strip->dr[i] = psr_srgb_to_linear[diffuse & 0xff];
		strip->dg[i] = psr_srgb_to_linear[diffuse >> 8 & 0xff];
		strip->db[i] = psr_srgb_to_linear[diffuse >> 16];
	}
}

static CONSTANT_FLAGS void read_specular(struct strip *strip, int is_one)
{
	const uint64_t first = strip->attr[0];
	for (uint32_t i = 0; i < strip->n; i++) {
		const uint64_t attr = is_one ? first : strip->attr[i];
		const uint32_t specular = PSR_ATTR_SPECULAR(attr), e = PSR_ATTR_EXPONENT(attr);
		strip->sr[i] = psr_srgb_to_linear[((specular & 31) * 255 + 15) / 31];
		strip->sg[i] = psr_srgb_to_linear[((specular >> 5 & 63) * 255 + 31) / 63];
		strip->sb[i] = psr_srgb_to_linear[((specular >> 11) * 255 + 15) / 31];
		strip->exponent[i] = exponent_root[e & 15] * (float)(1u << (e >> 4));
		strip->hr[i] = strip->hg[i] = strip->hb[i] = 0;
	}
}

static void strip_resolve(struct strip *strip, const struct strip_view *view, const float ambient[3])
{
	const struct strip_pixels *p = strip->pixels;
	const uint32_t n = p->n;
	uint64_t all = 0, common = ~UINT64_C(0);
	for (uint32_t i = 0; i < n; i++) {
		const uint64_t attr = *p->at[i];
		strip->attr[i] = attr;
		strip->normal_word[i] = view->direction_word[PSR_ATTR_NORMAL(attr)];
		all |= attr;
		common &= attr;
	}
	strip->n = n;
	strip->is_specular = (PSR_ATTR_SPECULAR(all) && view->needs & STRIP_LIGHTS) || view->needs & STRIP_SPECULAR;
	if (PSR_ATTR_DIFFUSE(all) == PSR_ATTR_DIFFUSE(common))
		read_diffuse(strip, 1);
	else
		read_diffuse(strip, 0);
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
		const struct warp_instance *in = instance_run(&end, p, view, first);
		turn_normals(strip, in->turn, first, end);
		if (view->needs & STRIP_POSITION)
			locate(strip, in, first, end);
	}
	if (view->needs & STRIP_POSITION)
		bring_back(strip, view);
	for (uint32_t i = 0; i < n; i++) {
		strip->lr[i] = ambient[0];
		strip->lg[i] = ambient[1];
		strip->lb[i] = ambient[2];
	}
	if (strip->is_specular || view->needs & STRIP_TWO_SIDED)
		look(strip, view);
	if (view->needs & STRIP_TWO_SIDED)
		for (uint32_t i = 0; i < n; i++) {
			const float g = (strip->nx[i] * strip->vx[i] + strip->ny[i] * strip->vy[i]) + strip->nz[i] * strip->vz[i];
			const float turn = psr_choose((p->two_sided[i] != 0) & (g < 0), -1, 1);
			strip->nx[i] *= turn;
			strip->ny[i] *= turn;
			strip->nz[i] *= turn;
		}
	if (strip->is_specular && all >> 40 == common >> 40)
		read_specular(strip, 1);
	else if (strip->is_specular)
		read_specular(strip, 0);
}

/* What arrives of a light is times N.L, where that is above 0; the highlight is (R.V)^n with R = 2 (N.L) N - L. */
static CONSTANT_FLAGS void reflect(struct strip *s, uint32_t i, int is_specular, const float color[3], float amount, float x, float y, float z)
{
	const float facing = (s->nx[i] * x + s->ny[i] * y) + s->nz[i] * z;
	const float diffuse = psr_where(facing > 0, facing) * amount;
	s->lr[i] += color[0] * diffuse;
	s->lg[i] += color[1] * diffuse;
	s->lb[i] += color[2] * diffuse;
	if (is_specular) {
		const float normal_view = (s->nx[i] * s->vx[i] + s->ny[i] * s->vy[i]) + s->nz[i] * s->vz[i];
		const float light_view = (x * s->vx[i] + y * s->vy[i]) + z * s->vz[i];
		const float mirror = 2 * facing * normal_view - light_view;
		const float least = psr_where(mirror > 0, mirror), clamped = psr_choose(least < 1, least, 1);
		const float power = psr_power(clamped, s->exponent[i]);
		const float highlight = psr_where(facing > 0, power) * amount;
		s->hr[i] += color[0] * highlight;
		s->hg[i] += color[1] * highlight;
		s->hb[i] += color[2] * highlight;
	}
}

static CONSTANT_FLAGS void light_directional(struct strip *s, const struct strip_light *light, const float *reaches, int is_partial,
                                     int is_specular)
{
	const struct strip_light l = *light;
	for (uint32_t i = 0; i < s->n; i++)
		reflect(s, i, is_specular, l.color, is_partial ? reaches[i] : 1, l.to_light[0], l.to_light[1], l.to_light[2]);
}

static CONSTANT_FLAGS void light_near(struct strip *s, const struct strip_light *light, const float *reaches, int is_partial,
                              int is_specular, int is_spot)
{
	const struct strip_light l = *light;
	for (uint32_t i = 0; i < s->n; i++) {
		const float dx = l.position[0] - s->px[i], dy = l.position[1] - s->py[i], dz = l.position[2] - s->pz[i];
		const float distance2 = (dx * dx + dy * dy) + dz * dz, distance = __builtin_sqrtf(distance2);
		const float x = dx / distance, y = dy / distance, z = dz / distance;
		const float falling = l.reference2 / distance2; /* a light in a sample itself is not to be infinite */
		float amount = psr_choose(l.reference2 > 0, psr_choose(falling < 0x1p60f, falling, 0x1p60f), 1);
		if (is_spot) { /* a smooth edge: 3 t^2 - 2 t^3 */
			const float c = -((x * l.axis[0] + y * l.axis[1]) + z * l.axis[2]);
			const float t = (c - l.cos_outer) / (l.cos_inner - l.cos_outer);
			const float edge = psr_choose(c < l.cos_inner, t * t * (3 - 2 * t), 1);
			amount = psr_where(c > l.cos_outer, amount * edge);
		}
		amount = psr_where(distance2 > 0, amount) * (is_partial ? reaches[i] : 1);
		reflect(s, i, is_specular, l.color, amount, x, y, z);
	}
}

static CONSTANT_FLAGS void light_by(struct strip *strip, const struct strip_light *light, const float *reaches, int is_partial,
                            int is_specular)
{
	if (light->kind == PSR_LIGHT_DIRECTIONAL)
		light_directional(strip, light, reaches, is_partial, is_specular);
	else if (light->kind == PSR_LIGHT_SPOT)
		light_near(strip, light, reaches, is_partial, is_specular, 1);
	else
		light_near(strip, light, reaches, is_partial, is_specular, 0);
}

static void strip_light(struct strip *strip, const struct strip_light *light, const float *reaches)
{
	if (strip->is_specular && reaches)
		light_by(strip, light, reaches, 1, 1);
	else if (strip->is_specular)
		light_by(strip, light, NULL, 0, 1);
	else if (reaches)
		light_by(strip, light, reaches, 1, 0);
	else
		light_by(strip, light, NULL, 0, 0);
}

static void strip_lit(float (*lit)[4], const struct strip_view *view, const struct strip_light *light, uint32_t n_lights,
                      const float ambient[3], uint32_t first, uint32_t n)
{
	struct strip strip;
	strip.n = n;
	strip.is_specular = 0;
	for (uint32_t i = 0; i < n; i++) {
		strip.normal_word[i] = view->direction_word[first + i];
		strip.lr[i] = ambient[0];
		strip.lg[i] = ambient[1];
		strip.lb[i] = ambient[2];
	}
	turn_normals(&strip, view->instance->turn, 0, n);
	for (uint32_t l = 0; l < n_lights; l++)
		strip_light(&strip, &light[l], NULL);
	for (uint32_t i = 0; i < n; i++) {
		lit[first + i][0] = strip.lr[i];
		lit[first + i][1] = strip.lg[i];
		lit[first + i][2] = strip.lb[i];
		lit[first + i][3] = 0;
	}
}

static inline uint16_t light16(float linear)
{
	linear = linear > 0 ? linear : 0;
	linear = linear < 1 ? linear : 1;
	return (uint16_t)(int32_t)(linear * 65535.0f + 0.5f);
}

static CONSTANT_FLAGS void strip_color_by(struct strip *s, int is_specular)
{
	for (uint32_t i = 0; i < s->n; i++) {
		const int is_unlit = PSR_ATTR_UNLIT(s->attr[i]) != 0;
		float r = s->dr[i] * s->lr[i], g = s->dg[i] * s->lg[i], b = s->db[i] * s->lb[i];
		if (is_specular) {
			r += s->sr[i] * s->hr[i];
			g += s->sg[i] * s->hg[i];
			b += s->sb[i] * s->hb[i];
		}
		s->r[i] = light16(is_unlit ? s->dr[i] : r);
		s->g[i] = light16(is_unlit ? s->dg[i] : g);
		s->b[i] = light16(is_unlit ? s->db[i] : b);
	}
}

static void strip_color(struct strip *strip)
{
	if (strip->is_specular)
		strip_color_by(strip, 1);
	else
		strip_color_by(strip, 0);
}

static inline uint32_t pixel_of(const uint8_t *srgb, uint16_t r, uint16_t g, uint16_t b)
{
	return (uint32_t)srgb[r] | (uint32_t)srgb[g] << 8 | (uint32_t)srgb[b] << 16;
}

static inline void write_linear(const struct strip *strip, const struct strip_target *target, uint32_t n)
{
	const uint16_t *const from[3] = { strip->r, strip->g, strip->b };
	uint16_t *const to[3] = { target->r, target->g, target->b };
	const struct strip_pixels *p = strip->pixels;
	const size_t first = (size_t)p->y * target->width + p->x0;
	for (int c = 0; c < 3; c++) {
		uint16_t row[STRIP];
		for (uint32_t x = 0; x < n; x++)
			row[x] = target->background[c];
		for (uint32_t i = 0; i < p->n; i++)
			row[p->x[i]] = from[c][i];
		for (uint32_t x = 0; x < n; x += STRIP_BRICK)
			if (target->wants[x / STRIP_BRICK])
				memcpy(to[c] + first + x, row + x, 2 * (n - x < STRIP_BRICK ? n - x : STRIP_BRICK));
	}
}

static inline void strip_write(const struct strip *strip, const struct strip_target *target, uint32_t n)
{
	const struct strip_pixels *p = strip->pixels;
	if (target->rgb) {
		const uint16_t *empty = target->background;
		uint8_t *to = target->rgb + 3 * ((size_t)p->y * target->width + p->x0);
		uint32_t pixel[STRIP];
		for (uint32_t x = 0; x < n; x++)
			pixel[x] = pixel_of(target->srgb, empty[0], empty[1], empty[2]);
		for (uint32_t i = 0; i < p->n; i++)
			pixel[p->x[i]] = pixel_of(target->srgb, strip->r[i], strip->g[i], strip->b[i]);
		for (uint32_t x = 0; x + 1 < n; x++) /* the fourth byte is the next pixel's */
			memcpy(to + 3 * (size_t)x, &pixel[x], 4);
		memcpy(to + 3 * (size_t)(n - 1), &pixel[n - 1], 3);
	}
	if (target->wants)
		write_linear(strip, target, n);
}

/* By two factors, since one of them may be beyond a float: exact unless the result is. */
static void depth_row(float *depth, const uint64_t *word, uint32_t n, int exponent)
{
	const int clamped = exponent < -252 ? -252 : exponent > 254 ? 254 : exponent, half = clamped / 2;
	const float first = psr_float_from_bits((uint32_t)(127 + half) << 23);
	const float second = psr_float_from_bits((uint32_t)(127 + clamped - half) << 23);
	for (uint32_t i = 0; i < n; i++)
		depth[i] = psr_float_from_bits((uint32_t)(word[i] >> 32)) * first * second;
}
