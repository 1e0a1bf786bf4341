/* Light on strips ([G] 7.3). */
#include "base/maths.h"
#include "strip_parts.h"

/* Of each sample: N.L and L.V of a light that faces it, and how much of the light arrives; else 0. */
struct highlights {
	float facing[STRIP], light_view[STRIP], amount[STRIP];
};

/* GGX with Smith's shadowing and Schlick's Fresnel (surface/lobe.h). H = L + V is not normalised, h2 = H.H = 2 + 2 L.V,
 * and one division serves distribution and shadowing: D = width2 / (1 - (1 - width2) (N.H)^2)^2 = width2 (h2 n2)^2 /
 * (h2 n2 - (1 - width2) (N.L + N.V)^2)^2, since stored normals' squares n2 are not quite 1. */
static void add_highlights(struct strip *s, const struct highlights *h, const float color[3])
{
	const float red = color[0], green = color[1], blue = color[2];

	for (uint32_t i = 0; i < s->n; i++) {
		const float width2 = s->width2[i], rest = 1 - width2, nl = h->facing[i], nv = s->nv[i], shine = s->shine[i];
		const float doubled = 2 + 2 * h->light_view[i], h2 = psr_choose(doubled > 1e-6f, doubled, 1e-6f);
		const float c = h2 * s->n2[i], sum = nl + nv, least = c * width2;
		const float wide = c - rest * (sum * sum), t = psr_choose(wide > least, wide, least);
		const float shadowed = nl * s->seen[i] + nv * __builtin_sqrtf(nl * nl * rest + width2);
		const float lobe = shine * (0.5f * width2) * (c * c) * nl / (t * t * shadowed);
		const float below = 1 - 0.5f * __builtin_sqrtf(h2), grazing = psr_where(below > 0, below);
		const float square = grazing * grazing, fresnel = square * square * grazing;
		const float specular = lobe * h->amount[i], white = specular * fresnel, mirror = specular - white;
		const float diffuse = nl * h->amount[i] * (1 - shine * fresnel);

		s->lr[i] += red * diffuse;
		s->lg[i] += green * diffuse;
		s->lb[i] += blue * diffuse;
		s->hr[i] += red * (s->sr[i] * mirror + white);
		s->hg[i] += green * (s->sg[i] * mirror + white);
		s->hb[i] += blue * (s->sb[i] * mirror + white);
	}
}

/* Light that arrives at a sample: the unit vector to the light, and how much of it. */
struct arriving {
	float x, y, z, amount;
};

static CONSTANT_FLAGS void reflect(struct strip *s, struct highlights *h, uint32_t i, int is_specular,
                                   const float color[3], struct arriving from)
{
	const float x = from.x, y = from.y, z = from.z;
	const float cosine = (s->nx[i] * x + s->ny[i] * y) + s->nz[i] * z, facing = psr_where(cosine > 0, cosine);

	if (is_specular) {
		h->facing[i] = facing;
		h->light_view[i] = (x * s->vx[i] + y * s->vy[i]) + z * s->vz[i];
		h->amount[i] = from.amount;
	} else {
		const float diffuse = facing * from.amount;

		s->lr[i] += color[0] * diffuse;
		s->lg[i] += color[1] * diffuse;
		s->lb[i] += color[2] * diffuse;
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
		strip.lr[i] = strip.lg[i] = strip.lb[i] = 0;
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
