#include <stdlib.h>
#include <string.h>
#include "preset.h"
#include "client/lib/camera.h"
#include "client/psr.h"
#include "scene.h"

void scene_wish_init(struct scene_wish *wish)
{
	memset(wish, 0, sizeof *wish);
	wish->ambient = SCENE_AMBIENT;
	memcpy(wish->background, "\x20\x24\x28", 3);
}

void scene_wish_fini(struct scene_wish *wish)
{
	free(wish->instance);
	free(wish->file_text);
}

static int add_instance(struct scene_wish *wish, const struct instance_wish *instance, struct psr_error *err)
{
	struct instance_wish *grown;

	if (wish->n_instances == PSR_WIRE_MAX_INSTANCES)
		return psr_fail(err, PSR_ERR_LIMIT, "a picture has at most %d models and instances", PSR_WIRE_MAX_INSTANCES);
	grown = realloc(wish->instance, (wish->n_instances + 1) * sizeof *grown);
	if (grown == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u instances", wish->n_instances + 1);
	wish->instance = grown;
	grown[wish->n_instances++] = *instance;
	return PSR_OK;
}

static int on_model(const char *text, void *userdata, struct psr_error *err)
{
	struct instance_wish instance = { .place = { .rotation = { 0, 0, 0, 1 }, .scale = 1 } };

	if (text[0] == '\0' || strlen(text) > PSR_WIRE_MAX_NAME)
		return psr_fail(err, PSR_ERR_ARG, "a model's name has 1 to %d bytes", PSR_WIRE_MAX_NAME);
	strcpy(instance.model, text);
	return add_instance(userdata, &instance, err);
}

static int on_instance(const char *text, void *userdata, struct psr_error *err)
{
	struct instance_wish instance;
	int code = instance_parse(&instance, text, err);

	return code == PSR_OK ? add_instance(userdata, &instance, err) : code;
}

static int on_light(const char *text, void *userdata, struct psr_error *err)
{
	struct scene_wish *wish = userdata;

	if (wish->n_lights == PSR_WIRE_MAX_LIGHTS)
		return psr_fail(err, PSR_ERR_LIMIT, "there are %d lights at most", PSR_WIRE_MAX_LIGHTS);
	wish->preset_light[wish->n_lights] = preset_of_light(text);
	if (wish->preset_light[wish->n_lights] == NULL
	    && psr_light_parse(&wish->light[wish->n_lights], text, err) != PSR_OK)
		return PSR_ERR_ARG;
	wish->n_lights++;
	return PSR_OK;
}

static void add_instances(struct optlist *list, struct scene_wish *wish)
{
	const struct psr_opt opts[] = {
		{ "model", 'm', PSR_OPT_CALL, wish, "NAME",
		  "A model, by its name in `psr list`, where its file puts it. "
		  "Repeat it to see several models in one picture.",
		  0, 0, on_model, &wish->n_said },
		{ "instance", 0, PSR_OPT_CALL, wish, "NAME[,at=X,Y,Z][,rotate=AXIS:DEG][,scale=S]",
		  "A model somewhere else: turned by DEG degrees about an axis (X, Y, Z or x,y,z) through the 0,0,0 of its "
		  "file, S times as large, its 0,0,0 put at X,Y,Z. Repeat it, and rotate= within it.",
		  0, 0, on_instance, &wish->n_said },
	};

	OPTLIST_ADD(list, opts);
}

void scene_add_model_options(struct optlist *list, struct scene_wish *wish)
{
	const struct psr_opt opts[] = {
		{ "scene", 0, PSR_OPT_STRING, &wish->file, "FILE",
		  "Models and lights from a text file of words such as instance=teapot,at=1,0,0 light=dir:-1,-2,-1 shadows: "
		  "the options of this command without dashes. # begins a comment.",
		  0, 0, NULL, &wish->n_said },
	};

	add_instances(list, wish);
	OPTLIST_ADD(list, opts);
}

void scene_add_light_options(struct optlist *list, struct scene_wish *wish)
{
	const struct psr_opt opts[] = {
		{ "light", 'l', PSR_OPT_CALL, wish, "LIGHT", "A light, see below. Repeat it for more.", 0, 0, on_light,
		  &wish->n_said },
		{ "lights", 0, PSR_OPT_STRING, &wish->lights_of, "model", "All lights that came with the first model.", 0, 0,
		  NULL, &wish->n_said },
		{ "shadows", 0, PSR_OPT_FLAG, &wish->is_shadowed, NULL,
		  "Every light casts shadows, also the one that is there without --light.", 0, 0, NULL, &wish->n_said },
		{ "ambient", 0, PSR_OPT_REAL, &wish->ambient, "A",
		  "Brightness of the light from everywhere: more lifts dark sides; 1 without a --light shows colours without "
		  "any shading.",
		  0, PSR_WIRE_MAX_INTENSITY, NULL, &wish->has_ambient },
		{ "background", 0, PSR_OPT_COLOR, wish->background, "#rrggbb", "The colour where nothing is.", 0, 0, NULL,
		  &wish->n_said },
	};

	OPTLIST_ADD(list, opts);
}

static int read_file(struct scene_wish *wish, struct psr_error *err)
{
	struct optlist list = { .n = 0 };
	const struct psr_cli cli = { "", "", list.opt, NULL };

	add_instances(&list, wish);
	scene_add_light_options(&list, wish);
	return wordfile_read(&wish->file_text, wish->file, &cli, NULL, NULL, err);
}

int scene_check(struct scene_wish *wish, struct psr_error *err)
{
	int code = wish->file != NULL ? read_file(wish, err) : PSR_OK;

	if (code != PSR_OK)
		return code;
	if (wish->n_instances == 0)
		return psr_fail(err, PSR_ERR_ARG, "%s; `psr list` shows the names",
		                wish->file != NULL ? "the scene file names no model" : "--model NAME is missing");
	if (wish->lights_of != NULL && strcmp(wish->lights_of, "model") != 0)
		return psr_fail(err, PSR_ERR_ARG, "--lights takes 'model', not '%.40s'; --light is for one light",
		                wish->lights_of);
	return PSR_OK;
}
