#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/mem.h"
#include "base/vec.h"
#include "placed.h"
#include "shadow.h"
#include "sheer.h"

#define MOST_MAPS (PSR_MAX_LIGHTS * SHADOW_CASTERS * SHADOW_FACES)

struct shadow {
	struct shadow_drawer drawer;
	struct placed placed; /* in the kept maps */
	int has_shares;
	float share[SHADOW_CASTERS]; /* of the light that casters keep back; 0: there is none of the class */
	struct shadow_kept kept[MOST_MAPS]; /* by light, caster and face */
	uint32_t n_maps[PSR_MAX_LIGHTS]; /* of each caster */
	struct shadow_light light[PSR_MAX_LIGHTS][SHADOW_CASTERS]; /* of the picture in progress, in its plan's order */
};

static void drop(struct shadow_kept *kept)
{
	psr_free_huge(kept->cells, kept->cells_size);
	memset(kept, 0, sizeof *kept);
}

void shadow_destroy(struct shadow *shadow)
{
	if (shadow == NULL)
		return;
	for (int i = 0; i < MOST_MAPS; i++)
		drop(&shadow->kept[i]);
	plan_clear(&shadow->drawer.plan);
	psr_free_huge(shadow->drawer.word, shadow->drawer.word_size);
	psr_free_huge(shadow->drawer.cells, shadow->drawer.cells_size);
	placed_clear(&shadow->placed);
	free(shadow);
}

uint64_t shadow_bytes(const struct shadow *shadow)
{
	if (shadow == NULL)
		return 0;
	const struct shadow_drawer *drawer = &shadow->drawer;
	uint64_t n = sizeof *shadow + drawer->plan.storage_size + drawer->word_size + drawer->cells_size;
	for (int i = 0; i < MOST_MAPS; i++)
		n += shadow->kept[i].cells_size;
	return n + placed_bytes(&shadow->placed);
}

static struct shadow_kept *kept_of(struct shadow *shadow, uint32_t light, int caster, uint32_t face)
{
	return &shadow->kept[(light * SHADOW_CASTERS + (uint32_t)caster) * SHADOW_FACES + face];
}

static int has_color(const struct psr_light *light)
{
	return light->color[0] > 0 || light->color[1] > 0 || light->color[2] > 0;
}

static int can_cast(const struct psr_light *light)
{
	return light->casts_shadow && has_color(light);
}

/* Whether a sphere of camera space may be in the picture. */
static int in_view(const struct plan *plan, const float c[3], float r)
{
	const float half[2] = { (float)plan->window.picture_width / 2, (float)plan->window.picture_height / 2 };

	if (!(c[2] + r > plan->near_z))
		return 0;
	for (int a = 0; a < 2; a++) {
		const float along = plan->perspective ? c[2] : 1, f = plan->focal;
		const float reach = r * (plan->perspective ? sqrtf(f * f + half[a] * half[a]) : f);

		if (fabsf(c[a]) * f - half[a] * along > reach)
			return 0;
	}
	return 1;
}

/* Compares with the signed distance from the cone's side, at most the distance from the cone. */
static int in_cone(const struct strip_light *light, double outer, const float c[3], float r)
{
	double to[3], axis[3], s, cosine;

	v3d_set(to, (double)c[0] - (double)light->position[0], (double)c[1] - (double)light->position[1],
	        (double)c[2] - (double)light->position[2]);
	v3d_set(axis, (double)light->axis[0], (double)light->axis[1], (double)light->axis[2]);
	const double along = v3d_dot(to, axis), across2 = v3d_dot(to, to) - along * along;
	psr_sincos(outer, &s, &cosine);
	return sqrt(fmax(across2, 0)) * cosine - along * s <= (double)r;
}

/* p: the plan's number of the light. Instances fit the unit sphere of their inner coordinates; 1 % covers rounding. */
static int reaches_view(const struct plan *plan, const struct psr_light *light, uint32_t p)
{
	for (uint32_t i = 0; i < plan->n_instances; i++) {
		const struct cull_view *v = &plan->instance[i].cull;
		const float c[3] = { v->center_m[0][3], v->center_m[1][3], v->center_m[2][3] }, r = v->scale * 1.01f;

		if (in_view(plan, c, r) && (light->kind != PSR_LIGHT_SPOT || in_cone(&plan->light[p], light->outer, c, r)))
			return 1;
	}
	return 0;
}

/* Keeps the instances. If they differ from those before, no map is drawn any more. */
static int note_instances(struct shadow *shadow, const struct psr_scene *scene)
{
	int has_changed;
	const int rc = placed_note(&shadow->placed, scene, &has_changed);

	for (int i = 0; has_changed && i < MOST_MAPS; i++)
		shadow->kept[i].is_drawn = 0;
	shadow->has_shares &= !has_changed;
	return rc;
}

/* Finds the mean opacity of each class of glass. */
static int find_shares(struct shadow *shadow, const struct plan *plan)
{
	double sum[SHADOW_CASTERS] = { 0 };
	uint64_t n[SHADOW_CASTERS] = { 0 };

	for (uint32_t i = 0; i < plan->n_instances; i++) {
		const struct psr_blocks *b = plan->instance[i].cull.blocks;
		uint32_t first = 0;

		while (plan->instance[first].cull.blocks != b)
			first++;
		for (uint32_t k = 0; b->opacity != NULL && first == i && k < b->n_blocks; k++) {
			float opacity = 0;

			if (plan_is_cancelled_at(plan, k))
				return PSR_ERR_CANCELLED;
			if (!psr_blocks_is_sheer(b, k))
				continue;
			const int caster = sheer_caster(&opacity, b, k);
			sum[caster] += (double)opacity;
			n[caster]++;
		}
	}
	shadow->share[SHADOW_OPAQUE] = 1;
	for (int c = SHADOW_OPAQUE + 1; c < SHADOW_CASTERS; c++)
		shadow->share[c] = n[c] ? (float)(sum[c] / (double)n[c]) : 0;
	shadow->has_shares = 1;
	return PSR_OK;
}

static int same_fit(const struct shadow_fit *a, const struct shadow_fit *b)
{
	return a->width == b->width && a->height == b->height && placed_same_camera(&a->camera, &b->camera);
}

/* Texels a side: as many as the picture's greater side has pixels, at most as many as the settings say, and at most
 * SHADOW_TEXELS in the n_maps of the whole scene, in view or not. */
static uint32_t side_of(const struct plan *plan, uint32_t n_maps)
{
	const uint32_t w = plan->window.picture_width, h = plan->window.picture_height;
	uint32_t side = w > h ? w : h;

	side = side < 64 ? 64 : side > plan->shadow_side ? plan->shadow_side : side;
	while ((uint64_t)n_maps * side * side > SHADOW_TEXELS)
		side -= 16;
	return side;
}

/* Fits the maps of a light and a caster, which stay drawn if they fit as before; drops those that there are no more. */
static void fit_maps(struct shadow *shadow, uint32_t light, int caster, const struct shadow_fit *fit)
{
	const uint32_t n = shadow->share[caster] > 0 ? shadow->n_maps[light] : 0;

	for (uint32_t f = 0; f < SHADOW_FACES; f++) {
		struct shadow_kept *kept = kept_of(shadow, light, caster, f);

		if (kept->cells != NULL && (f >= n || kept->fit.width != fit[f].width || kept->fit.height != fit[f].height))
			drop(kept);
		kept->caster = caster;
		if (f < n && !same_fit(&kept->fit, &fit[f])) {
			kept->is_drawn = 0;
			kept->fit = fit[f];
		}
	}
}

/* Fits the maps of all lights that can cast, in view or not, and drops other maps. */
static int fit_lights(struct shadow *shadow, const struct psr_scene *scene, const struct plan *plan,
                      struct psr_error *err)
{
	struct shadow_bounds bounds;
	struct shadow_fit fit[SHADOW_FACES];
	uint32_t n_maps = 0, n_casters = 0;

	shadow_bounds_make(&bounds, scene);
	for (uint32_t l = 0; l < scene->n_lights && !plan_is_cancelled(plan); l++)
		if (can_cast(&scene->light[l]))
			n_maps += shadow_fit_light(fit, &scene->light[l], scene, &bounds, plan->shadow_side);
	for (int c = SHADOW_OPAQUE; c < SHADOW_CASTERS; c++)
		n_casters += shadow->share[c] > 0;
	const uint32_t side = side_of(plan, n_maps * n_casters);
	for (uint32_t l = 0; l < PSR_MAX_LIGHTS; l++) {
		if (plan_is_cancelled(plan))
			return render_cancelled(err);
		const int can = l < scene->n_lights && can_cast(&scene->light[l]);

		shadow->n_maps[l] = can ? shadow_fit_light(fit, &scene->light[l], scene, &bounds, side) : 0;
		for (int c = SHADOW_OPAQUE; c < SHADOW_CASTERS; c++)
			fit_maps(shadow, l, c, fit);
	}
	return PSR_OK;
}

/* Whether the plan has the light; plans keep the scene's order. */
static int is_planned(const struct plan *plan, const struct psr_light *light)
{
	return plan->is_full || has_color(light);
}

/* The maps of a caster for light l of the scene: draws those that are missing. */
static int prepare_maps(struct shadow *shadow, struct shadow_light *light, uint32_t l, int caster,
                        const struct plan *plan, const struct shadow_call *call)
{
	for (uint32_t f = 0; f < light->n_maps; f++) {
		struct shadow_kept *kept = kept_of(shadow, l, caster, f);

		if (!kept->is_drawn) {
			int rc = shadow_map_draw(kept, &shadow->drawer, call);

			if (rc)
				return rc;
			call->report->n_shadow_maps_drawn++;
		}
		shadow_map_bind(&light->map[f], kept, plan);
		call->report->n_shadow_maps++;
	}
	return PSR_OK;
}

/* Light l of the scene, p of the plan. */
static int prepare_light(struct shadow *shadow, uint32_t l, uint32_t p, const struct plan *plan,
                         const struct shadow_call *call)
{
	const int is_needed = plan->is_full || reaches_view(plan, &call->scene->light[l], p);
	int rc = PSR_OK;

	for (int c = SHADOW_OPAQUE; c < SHADOW_CASTERS && rc == PSR_OK; c++) {
		struct shadow_light *light = &shadow->light[p][c];

		light->n_maps = is_needed && shadow->share[c] > 0 ? shadow->n_maps[l] : 0;
		rc = prepare_maps(shadow, light, l, c, plan, call);
	}
	return rc;
}

int shadow_prepare(struct shadow **out, struct plan *plan, const struct shadow_call *call)
{
	const struct psr_scene *scene = call->scene;
	struct psr_report *report = call->report;
	int n_casting = 0;

	for (uint32_t l = 0; l < scene->n_lights; l++)
		n_casting += can_cast(&scene->light[l]);
	if (!n_casting || !scene->n_instances) {
		shadow_destroy(*out);
		*out = NULL;
		effect_note(report, PSR_EFFECT_SHADOWS, PSR_WHY_NOTHING, 0);
		return PSR_OK;
	}
	if (*out == NULL)
		*out = calloc(1, sizeof **out);
	struct shadow *shadow = *out;
	if (shadow == NULL || note_instances(shadow, scene))
		return psr_fail(call->err, PSR_ERR_MEMORY, "no memory for shadow maps");
	if (!shadow->has_shares && find_shares(shadow, plan))
		return render_cancelled(call->err);
	int rc = fit_lights(shadow, scene, plan, call->err);
	for (uint32_t l = 0, p = 0; rc == PSR_OK && l < scene->n_lights; l++)
		if (is_planned(plan, &scene->light[l]))
			rc = prepare_light(shadow, l, p++, plan, call);
	if (rc)
		return rc;
	effect_note(report, PSR_EFFECT_SHADOWS, report->n_shadow_maps ? PSR_WHY_RAN : PSR_WHY_NOTHING,
	            report->n_shadow_maps);
	if (report->n_shadow_maps) {
		plan->shadow = shadow->light[0];
		plan->shadow_share = shadow->share;
		plan->view.needs |= STRIP_POSITION;
	}
	return PSR_OK;
}
