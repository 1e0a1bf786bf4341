#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "link_inside.h"

void link_wish_default(struct link_wish *wish)
{
	static const uint8_t background[3] = { 0x20, 0x24, 0x28 };

	*wish = (struct link_wish){
		.overscan = 1, .n_lights = 1, .has_key_light = 1, .ambient = 0.15, .spacing_px = 1, .is_smooth = 1,
		.planes = 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH, .fps = 30, .least_quality = 30, .most_quality = 92,
		.most_scale = 4,
	};
	memcpy(wish->background, background, sizeof background);
}

static int is_in(double value, double low, double high)
{
	return value >= low && value <= high;
}

/* Cameras, lights and places are the server's to check: it says what is wrong with them. */
int link_wish_check(const struct link_wish *wish)
{
	const int is_none = wish->width == 0 && wish->height == 0;
	const int is_sized = wish->width > 0 && wish->height > 0 && wish->width <= PSR_WIRE_MAX_SIDE
	                     && wish->height <= PSR_WIRE_MAX_SIDE;

	if (wish->n_instances > PSR_WIRE_MAX_INSTANCES || wish->n_lights > PSR_WIRE_MAX_LIGHTS
	    || (wish->has_key_light && wish->n_lights == 0) || (!is_none && !is_sized) || wish->planes == 0)
		return PSR_ERR_ARG;
	for (uint32_t i = 0; i < wish->n_instances; i++)
		if (wish->instance[i].model[0] == '\0' || memchr(wish->instance[i].model, 0, PSR_WIRE_MAX_NAME + 1) == NULL)
			return PSR_ERR_ARG;
	for (uint32_t i = 0; i < wish->n_instances; i++)
		if (wish->instance[i].representation > PSR_WIRE_REP_DPOINT
		    || wish->instance[i].color_by > PSR_WIRE_COLOR_RETURN)
			return PSR_ERR_ARG;
	if (!is_in(wish->overscan, 1, 2) || !is_in(wish->spacing_px, 0x1p-6, 0x1p6) || !is_in(wish->fps, 1, 1000)
	    || !is_in(wish->ambient, 0, PSR_WIRE_MAX_INTENSITY))
		return PSR_ERR_ARG;
	if (wish->least_quality < 1 || wish->least_quality > wish->most_quality || wish->most_quality > 100)
		return PSR_ERR_ARG;
	return wish->most_scale == 1 || wish->most_scale == 2 || wish->most_scale == 4 ? PSR_OK : PSR_ERR_ARG;
}

/* Fields one by one: structs have bytes that are nobody's. */
static int is_same_camera(const struct psr_camera *a, const struct psr_camera *b)
{
	return memcmp(a->eye, b->eye, sizeof a->eye) == 0 && memcmp(a->target, b->target, sizeof a->target) == 0
	       && memcmp(a->up, b->up, sizeof a->up) == 0 && a->kind == b->kind && a->fov_y == b->fov_y
	       && a->ortho_height == b->ortho_height && a->near_z == b->near_z;
}

static int is_same_light(const struct psr_msg_light *a, const struct psr_msg_light *b)
{
	return a->kind == b->kind && a->flags == b->flags && memcmp(a->color, b->color, sizeof a->color) == 0
	       && a->intensity == b->intensity && memcmp(a->position, b->position, sizeof a->position) == 0
	       && memcmp(a->direction, b->direction, sizeof a->direction) == 0 && a->inner == b->inner
	       && a->outer == b->outer && a->reference == b->reference;
}

static int is_same_place(const struct link_instance *a, const struct link_instance *b)
{
	return strcmp(a->model, b->model) == 0 && memcmp(a->rotation, b->rotation, sizeof a->rotation) == 0
	       && memcmp(a->translation, b->translation, sizeof a->translation) == 0 && a->scale == b->scale
	       && a->representation == b->representation && a->color_by == b->color_by;
}

int link_wish_is_same(const struct link_wish *a, const struct link_wish *b)
{
	int is_same = a->n_instances == b->n_instances && a->n_lights == b->n_lights && a->pixels == b->pixels
	              && a->coarse_pixels == b->coarse_pixels && is_same_camera(&a->camera, &b->camera)
	              && a->width == b->width && a->height == b->height && a->overscan == b->overscan
	              && a->has_key_light == b->has_key_light && a->ambient == b->ambient
	              && memcmp(a->background, b->background, sizeof a->background) == 0 && a->spacing_px == b->spacing_px
	              && a->is_smooth == b->is_smooth && a->with_splats == b->with_splats
	              && a->pass_limit == b->pass_limit && a->planes == b->planes
	              && a->fps == b->fps && a->least_quality == b->least_quality && a->most_quality == b->most_quality
	              && a->most_scale == b->most_scale && a->is_rest == b->is_rest;

	for (uint32_t i = 0; is_same && i < a->n_lights; i++)
		is_same = is_same_light(&a->light[i], &b->light[i]);
	for (uint32_t i = 0; is_same && i < a->n_instances; i++)
		is_same = is_same_place(&a->instance[i], &b->instance[i]);
	return is_same;
}

int link_wish_has_same_models(const struct link_wish *a, const struct link_wish *b)
{
	if (a->n_instances != b->n_instances || a->pixels != b->pixels || a->coarse_pixels != b->coarse_pixels)
		return 0;
	for (uint32_t i = 0; i < a->n_instances; i++)
		if (strcmp(a->instance[i].model, b->instance[i].model) != 0)
			return 0;
	return 1;
}

int link_box_set(struct link_box *box, const struct link_wish *wish, uint64_t number)
{
	if (wish->n_instances > box->capacity) {
		struct link_instance *grown = realloc(box->instance, wish->n_instances * sizeof *grown);

		if (grown == NULL)
			return PSR_ERR_MEMORY;
		box->instance = grown;
		box->capacity = wish->n_instances;
	}
	if (wish->n_instances > 0)
		memcpy(box->instance, wish->instance, wish->n_instances * sizeof *box->instance);
	box->wish = *wish;
	box->wish.instance = box->instance;
	box->number = number;
	return PSR_OK;
}

void link_box_fini(struct link_box *box)
{
	free(box->instance);
	memset(box, 0, sizeof *box);
}
