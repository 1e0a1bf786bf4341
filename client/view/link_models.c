#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "client/scene/instance.h"
#include "link_inside.h"

#define TIMEOUT_MS 10000
#define FIRST_LEVELS 7 /* of an octree: 128 leaves along the cube, and some ten thousand in all */

void link_models_fini(struct link_models *models)
{
	for (uint32_t i = 0; i < models->n; i++)
		free(models->model[i].preset);
	free(models->model);
	models->model = NULL;
	models->n = models->capacity = 0;
}

static struct link_open_model *find(const struct link_models *models, const char *name)
{
	for (uint32_t i = 0; i < models->n; i++)
		if (strcmp(models->model[i].name, name) == 0)
			return &models->model[i];
	return NULL;
}

struct link_open_model *link_models_find(const struct link_models *models, const char *name)
{
	struct link_open_model *model = find(models, name);

	return model != NULL && model->opened.handle != 0 ? model : NULL;
}

static int is_fine_model(const struct link_open_model *model, const struct link_wish *wish)
{
	return model->pixels == wish->pixels && (model->opened.octree_levels == 0 || model->is_all);
}

static int is_listed(const struct link_errand_model *list, uint32_t n, const char *name)
{
	for (uint32_t i = 0; i < n; i++)
		if (strcmp(list[i].name, name) == 0)
			return 1;
	return 0;
}

int link_models_lack(struct link_errand_model **out, uint32_t *n, const struct link_models *models,
                     const struct link_wish *wish, int is_fine)
{
	struct link_errand_model *list = NULL;

	*n = 0;
	*out = NULL;
	for (uint32_t i = 0; i < wish->n_instances; i++) {
		const char *name = wish->instance[i].model;
		const struct link_open_model *model = link_models_find(models, name);
		const int is_lacking = is_fine ? model != NULL && !is_fine_model(model, wish) : model == NULL;

		if (!is_lacking || is_listed(list, *n, name))
			continue;
		if (list == NULL) {
			list = calloc(wish->n_instances, sizeof *list);
			if (list == NULL)
				return PSR_ERR_MEMORY;
		}
		strcpy(list[*n].name, name);
		list[*n].pixels = !is_fine && wish->coarse_pixels != 0 ? wish->coarse_pixels : wish->pixels;
		if (!is_fine)
			list[*n].levels = FIRST_LEVELS;
		else if (model->opened.octree_levels > 0)
			list[*n].levels = model->opened.octree_levels + 1;
		(*n)++;
	}
	*out = list;
	return PSR_OK;
}

int link_models_are_fine(const struct link_models *models, const struct link_wish *wish)
{
	for (uint32_t i = 0; i < wish->n_instances; i++) {
		const struct link_open_model *model = link_models_find(models, wish->instance[i].model);

		if (model == NULL || !is_fine_model(model, wish))
			return 0;
	}
	return 1;
}

/* A place for a model of this name. NULL: no memory. */
static struct link_open_model *add(struct link_models *models, const char *name)
{
	struct link_open_model *model = find(models, name);

	if (model != NULL)
		return model;
	if (models->n == models->capacity) {
		const uint32_t capacity = models->capacity == 0 ? 8 : 2 * models->capacity;
		struct link_open_model *grown = realloc(models->model, capacity * sizeof *grown);

		if (grown == NULL)
			return NULL;
		models->model = grown;
		models->capacity = capacity;
	}
	model = &models->model[models->n++];
	memset(model, 0, sizeof *model);
	strcpy(model->name, name);
	return model;
}

struct opening {
	struct link *link;
	const char *name;
};

static void on_progress(const struct psr_msg_progress *progress, void *userdata)
{
	const struct opening *opening = userdata;

	link_set_progress(opening->link, opening->name, progress);
}

int link_models_open(struct link_models *models, const struct link_errand_model *wanted, struct psr_error *err)
{
	struct psr_client *client = models->client;
	struct opening opening = { models->link, wanted->name };
	struct link_open_model *model = add(models, wanted->name);
	struct psr_msg_preset *preset = NULL;
	struct psr_msg_opened opened;
	uint32_t n_presets = 0;
	int code;

	if (model == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a model");
	psr_client_set_resolution(client, wanted->pixels);
	psr_client_set_levels(client, wanted->levels);
	psr_client_on_progress(client, on_progress, &opening);
	code = psr_client_open(client, wanted->name, TIMEOUT_MS, &opened, err);
	psr_client_on_progress(client, NULL, NULL);
	if (code == PSR_OK && psr_client_welcome(client)->capabilities & PSR_CAP_PRESETS)
		code = psr_client_presets(client, opened.handle, &preset, &n_presets, TIMEOUT_MS, err);
	if (code != PSR_OK)
		return code;
	if (model->opened.handle != 0) /* scenes that name it keep it until the next one */
		psr_client_close_model(client, model->opened.handle, NULL);
	free(model->preset);
	model->opened = opened;
	model->preset = preset;
	model->n_presets = n_presets;
	model->pixels = wanted->pixels;
	model->is_all = wanted->levels == 0 || wanted->levels > opened.octree_levels;
	return PSR_OK;
}

struct link_place *link_models_place(const struct link_models *models, const struct link_wish *wish, uint32_t *n)
{
	struct link_place *place = NULL;

	*n = 0;
	if (wish->n_instances > 0)
		place = calloc(wish->n_instances, sizeof *place);
	for (uint32_t i = 0; place != NULL && i < wish->n_instances; i++) {
		const struct link_open_model *model = link_models_find(models, wish->instance[i].model);

		if (model != NULL)
			place[(*n)++] = (struct link_place){ model->opened.handle, i };
	}
	if (*n > 0)
		return place;
	free(place);
	return NULL;
}

static int copy_model(struct link_model *to, const struct link_open_model *from)
{
	strcpy(to->name, from->name);
	to->opened = from->opened;
	if (from->n_presets == 0)
		return PSR_OK;
	to->preset = calloc(from->n_presets, sizeof *to->preset);
	if (to->preset == NULL)
		return PSR_ERR_MEMORY;
	memcpy(to->preset, from->preset, from->n_presets * sizeof *to->preset);
	to->n_presets = from->n_presets;
	return PSR_OK;
}

static int has_model(const struct link_scene *scene, const char *name)
{
	for (uint32_t i = 0; i < scene->n_models; i++)
		if (strcmp(scene->model[i].name, name) == 0)
			return 1;
	return 0;
}

struct link_scene *link_models_scene(const struct link_models *models, const struct link_wish *wish,
                                     const struct link_place *place, uint32_t n)
{
	struct link_scene *scene = calloc(1, sizeof *scene);

	if (scene == NULL)
		return NULL;
	scene->model = calloc(n, sizeof *scene->model);
	for (int a = 0; a < 3; a++) {
		scene->box_min[a] = INFINITY;
		scene->box_max[a] = -INFINITY;
	}
	for (uint32_t i = 0; scene->model != NULL && i < n; i++) {
		const struct link_instance *instance = &wish->instance[place[i].index];
		const struct link_open_model *model = find(models, instance->model);
		struct psr_msg_instance at = { .scale = instance->scale };

		memcpy(at.rotation, instance->rotation, sizeof at.rotation);
		memcpy(at.translation, instance->translation, sizeof at.translation);
		instance_add_box(scene->box_min, scene->box_max, &at, model->opened.box_min, model->opened.box_max);
		if (i == 0)
			instance_rotate(scene->up, &at, model->opened.up);
		if (!has_model(scene, model->name) && copy_model(&scene->model[scene->n_models++], model) != PSR_OK)
			break;
		if (i + 1 == n)
			return scene;
	}
	link_scene_free(scene);
	return NULL;
}
