/* Light on strips ([G] 7.3). */
#include "base/maths.h"
#include "strip_parts.h"

/* Of each sample: R.V, and how much of the light makes a highlight. */
struct highlights {
	float cosine[STRIP], amount[STRIP];
};

/* Two short loops: a core overlaps several iterations of their long dependency chains. */
static void add_highlights(struct strip *s, const struct highlights *h, const float color[3])
{
	float exponent[STRIP];

	for (uint32_t i = 0; i < s->n; i++)
		exponent[i] = psr_power_exponent(h->cosine[i], s->exponent[i]);
	for (uint32_t i = 0; i < s->n; i++) {
		const float highlight = psr_power_of_two(exponent[i]) * h->amount[i];

		s->hr[i] += color[0] * highlight;
		s->hg[i] += color[1] * highlight;
		s->hb[i] += color[2] * highlight;
	}
}

/* Light that arrives at a sample: the unit vector to the light, and how much of it. */
struct arriving {
	float x, y, z, amount;
};

/* Diffuse light is max(N.L, 0) of it, the highlight (R.V)^n with R = 2 (N.L) N - L. */
static CONSTANT_FLAGS void reflect(struct strip *s, struct highlights *h, uint32_t i, int is_specular,
                                   const float color[3], struct arriving from)
{
	const float x = from.x, y = from.y, z = from.z, amount = from.amount;
	const float facing = (s->nx[i] * x + s->ny[i] * y) + s->nz[i] * z;
	const float diffuse = psr_where(facing > 0, facing) * amount;

	s->lr[i] += color[0] * diffuse;
	s->lg[i] += color[1] * diffuse;
	s->lb[i] += color[2] * diffuse;
	if (is_specular) {
		const float normal_view = (s->nx[i] * s->vx[i] + s->ny[i] * s->vy[i]) + s->nz[i] * s->vz[i];
		const float light_view = (x * s->vx[i] + y * s->vy[i]) + z * s->vz[i];
		const float mirror = 2 * facing * normal_view - light_view;
		const float least = psr_where(mirror > 0, mirror);

		h->cosine[i] = psr_choose(least < 1, least, 1);
		h->amount[i] = psr_where(facing > 0, amount);
	}
}

static CONSTANT_FLAGS void light_directional(struct strip *s, const struct strip_light *light, const float *reaches,
                                             int is_partial, int is_specular)
{
	const struct strip_light l = *light;
	struct highlights h;

	for (uint32_t i = 0; i < s->n; i++)
		reflect(s, &h, i, is_specular, l.color,
		        (struct arriving){ l.to_light[0], l.to_light[1], l.to_light[2], is_partial ? reaches[i] : 1 });
	if (is_specular)
		add_highlights(s, &h, l.color);
}

static CONSTANT_FLAGS void light_near(struct strip *s, const struct strip_light *light, const float *reaches,
                                      int is_partial, int is_specular, int is_spot)
{
	const struct strip_light l = *light;
	struct highlights h;

	for (uint32_t i = 0; i < s->n; i++) {
		const float dx = l.position[0] - s->px[i], dy = l.position[1] - s->py[i], dz = l.position[2] - s->pz[i];
		const float distance2 = (dx * dx + dy * dy) + dz * dz, distance = __builtin_sqrtf(distance2);
		const float x = dx / distance, y = dy / distance, z = dz / distance;
		const float falling = l.reference2 / distance2; /* infinite where a light touches a sample */
		float amount = psr_choose(l.reference2 > 0, psr_choose(falling < 0x1p60f, falling, 0x1p60f), 1);

		if (is_spot) { /* a smooth edge: 3 t^2 - 2 t^3 */
			const float c = -((x * l.axis[0] + y * l.axis[1]) + z * l.axis[2]);
			const float t = (c - l.cos_outer) / (l.cos_inner - l.cos_outer);
			const float edge = psr_choose(c < l.cos_inner, t * t * (3 - 2 * t), 1);
			amount = psr_where(c > l.cos_outer, amount * edge);
		}
		amount = psr_where(distance2 > 0, amount) * (is_partial ? reaches[i] : 1);
		reflect(s, &h, i, is_specular, l.color, (struct arriving){ x, y, z, amount });
	}
	if (is_specular)
		add_highlights(s, &h, l.color);
}

static CONSTANT_FLAGS void light_by(struct strip *strip, const struct strip_light *light, const float *reaches,
                                    int is_partial, int is_specular)
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

static void strip_lit(float (*lit)[4], const struct strip_view *view, const struct strip_lights *lights,
                      uint32_t first, uint32_t n)
{
	struct strip strip;

	strip.n = n;
	strip.is_specular = 0;
	for (uint32_t i = 0; i < n; i++) {
		strip.normal_word[i] = view->direction_word[first + i];
		strip.lr[i] = lights->ambient[0];
		strip.lg[i] = lights->ambient[1];
		strip.lb[i] = lights->ambient[2];
	}
	turn_normals(&strip, view->instance->turn, 0, n);
	for (uint32_t l = 0; l < lights->n; l++)
		strip_light(&strip, &lights->light[l], NULL);
	for (uint32_t i = 0; i < n; i++) {
		lit[first + i][0] = strip.lr[i];
		lit[first + i][1] = strip.lg[i];
		lit[first + i][2] = strip.lb[i];
		lit[first + i][3] = 0;
	}
}
