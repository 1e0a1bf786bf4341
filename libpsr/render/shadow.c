#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/mem.h"
#include "base/vec.h"
#include "shadow.h"

/* All of an instance that maps depend on. */
struct placed {
	uint8_t content_id[16];
	double rotation[4], translation[3], scale;
};

struct shadow {
	struct shadow_drawer drawer;
	struct placed *placed; /* instances in the kept maps */
	uint32_t n_placed;
	struct shadow_kept kept[PSR_MAX_LIGHTS][SHADOW_FACES];
	uint32_t n_maps[PSR_MAX_LIGHTS];
	struct shadow_light light[PSR_MAX_LIGHTS]; /* of the picture in progress, in its plan's order */
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
	for (int l = 0; l < PSR_MAX_LIGHTS; l++)
		for (int f = 0; f < SHADOW_FACES; f++)
			drop(&shadow->kept[l][f]);
	plan_clear(&shadow->drawer.plan);
	psr_free_huge(shadow->drawer.word, shadow->drawer.word_size);
	psr_free_huge(shadow->drawer.cells, shadow->drawer.cells_size);
	free(shadow->placed);
	free(shadow);
}

uint64_t shadow_bytes(const struct shadow *shadow)
{
	if (shadow == NULL)
		return 0;
	const struct shadow_drawer *drawer = &shadow->drawer;
	uint64_t n = sizeof *shadow + drawer->plan.storage_size + drawer->word_size + drawer->cells_size;
	for (int l = 0; l < PSR_MAX_LIGHTS; l++)
		for (int f = 0; f < SHADOW_FACES; f++)
			n += shadow->kept[l][f].cells_size;
	return n + shadow->n_placed * sizeof *shadow->placed;
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

/* Keeps the instances; *has_changed: they differ from those before. */
static int note_instances(struct shadow *shadow, const struct psr_scene *scene, int *has_changed)
{
	const uint32_t n = scene->n_instances;

	*has_changed = n != shadow->n_placed;
	if (*has_changed) {
		free(shadow->placed);
		shadow->placed = calloc(n, sizeof *shadow->placed);
		shadow->n_placed = shadow->placed != NULL ? n : 0;
		if (shadow->placed == NULL)
			return PSR_ERR_MEMORY;
	}
	for (uint32_t i = 0; i < n; i++) {
		const struct psr_instance *from = &scene->instance[i];
		struct placed to = { .scale = from->scale };

		psr_model_content_id(from->model, to.content_id);
		memcpy(to.rotation, from->rotation, sizeof to.rotation);
		memcpy(to.translation, from->translation, sizeof to.translation);
		*has_changed |= memcmp(&to, &shadow->placed[i], sizeof to) != 0;
		shadow->placed[i] = to;
	}
	return PSR_OK;
}

static int same_fit(const struct shadow_fit *a, const struct shadow_fit *b)
{
	const struct psr_camera *p = &a->camera, *q = &b->camera;

	return a->width == b->width && a->height == b->height && memcmp(p->eye, q->eye, sizeof p->eye) == 0
	       && memcmp(p->target, q->target, sizeof p->target) == 0 && memcmp(p->up, q->up, sizeof p->up) == 0
	       && p->kind == q->kind && p->fov_y == q->fov_y && p->ortho_height == q->ortho_height
	       && p->near_z == q->near_z;
}

/* Texels a side: as many as the picture's greater side has pixels, but at most SHADOW_TEXELS in the n_maps of the whole
 * scene, in view or not. */
static uint32_t side_of(const struct plan *plan, uint32_t n_maps)
{
	const uint32_t w = plan->window.picture_width, h = plan->window.picture_height;
	uint32_t side = w > h ? w : h;

	side = side < 64 ? 64 : side > SHADOW_SIDE ? SHADOW_SIDE : side;
	while ((uint64_t)n_maps * side * side > SHADOW_TEXELS)
		side -= 16;
	return side;
}

/* Fits the maps of all lights that can cast, in view or not, and drops other maps. */
static void fit_lights(struct shadow *shadow, const struct psr_scene *scene, const struct plan *plan, int has_changed)
{
	struct shadow_bounds bounds;
	struct shadow_fit fit[SHADOW_FACES];
	uint32_t n_maps = 0;

	shadow_bounds_make(&bounds, scene);
	for (uint32_t l = 0; l < scene->n_lights; l++)
		if (can_cast(&scene->light[l]))
			n_maps += shadow_fit_light(fit, &scene->light[l], scene, &bounds, SHADOW_SIDE);
	const uint32_t side = side_of(plan, n_maps);
	for (uint32_t l = 0; l < PSR_MAX_LIGHTS; l++) {
		const int can = l < scene->n_lights && can_cast(&scene->light[l]);
		const uint32_t n = can ? shadow_fit_light(fit, &scene->light[l], scene, &bounds, side) : 0;

		shadow->n_maps[l] = n;
		for (uint32_t f = 0; f < SHADOW_FACES; f++) {
			struct shadow_kept *kept = &shadow->kept[l][f];

			if (kept->cells != NULL && (f >= n || kept->fit.width != fit[f].width || kept->fit.height != fit[f].height))
				drop(kept);
			if (f < n && (has_changed || !same_fit(&kept->fit, &fit[f]))) {
				kept->is_drawn = 0;
				kept->fit = fit[f];
			}
		}
	}
}

/* Whether the plan has the light; plans keep the scene's order. */
static int is_planned(const struct plan *plan, const struct psr_light *light)
{
	return plan->is_full || has_color(light);
}

/* Light l of the scene, p of the plan: draws its missing maps. */
static int prepare_light(struct shadow *shadow, uint32_t l, uint32_t p, const struct plan *plan,
                         const struct shadow_call *call)
{
	struct shadow_light *light = &shadow->light[p];
	const int is_needed = plan->is_full || reaches_view(plan, &call->scene->light[l], p);

	light->n_maps = is_needed ? shadow->n_maps[l] : 0;
	for (uint32_t f = 0; f < light->n_maps; f++) {
		struct shadow_kept *kept = &shadow->kept[l][f];

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

int shadow_prepare(struct shadow **out, struct plan *plan, const struct shadow_call *call)
{
	const struct psr_scene *scene = call->scene;
	struct psr_report *report = call->report;
	int n_casting = 0, has_changed;

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
	if (shadow == NULL || note_instances(shadow, scene, &has_changed))
		return psr_fail(call->err, PSR_ERR_MEMORY, "no memory for shadow maps");
	fit_lights(shadow, scene, plan, has_changed);
	for (uint32_t l = 0, p = 0; l < scene->n_lights; l++) {
		if (!is_planned(plan, &scene->light[l]))
			continue;
		int rc = prepare_light(shadow, l, p++, plan, call);
		if (rc)
			return rc;
	}
	effect_note(report, PSR_EFFECT_SHADOWS, report->n_shadow_maps ? PSR_WHY_RAN : PSR_WHY_NOTHING,
	            report->n_shadow_maps);
	if (report->n_shadow_maps) {
		plan->shadow = shadow->light;
		plan->view.needs |= STRIP_POSITION;
	}
	return PSR_OK;
}
