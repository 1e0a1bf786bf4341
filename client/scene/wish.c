#include <stdlib.h>
#include <string.h>
#include "preset.h"
#include "client/cli/cli.h"
#include "scene.h"
#include "client/lib/camera.h"

void scene_wish_init(struct scene_wish *wish)
{
	memset(wish, 0, sizeof *wish);
	wish->ambient = SCENE_AMBIENT;
	memcpy(wish->background, "\x20\x24\x28", 3);
}

int scene_wish_copy(struct scene_wish *to, const struct scene_wish *from, struct psr_error *err)
{
	*to = *from;
	to->file_text = NULL;
	to->instance = malloc((from->n_instances + 1) * sizeof *to->instance);
	if (to->instance == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u instances", from->n_instances);
	if (from->n_instances > 0)
		memcpy(to->instance, from->instance, from->n_instances * sizeof *to->instance);
	return PSR_OK;
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

int scene_add_model(struct scene_wish *wish, const char *name, struct psr_error *err)
{
	struct instance_wish instance = { .place = { .rotation = { 0, 0, 0, 1 }, .scale = 1 } };

	if (name[0] == '\0' || strlen(name) > PSR_WIRE_MAX_NAME)
		return psr_fail(err, PSR_ERR_ARG, "a model's name has 1 to %d bytes", PSR_WIRE_MAX_NAME);
	strcpy(instance.model, name);
	return add_instance(wish, &instance, err);
}

static int on_model(const char *text, void *userdata, struct psr_error *err)
{
	return scene_add_model(userdata, text, err);
}

static int on_instance(const char *text, void *userdata, struct psr_error *err)
{
	struct instance_wish instance;
	int code = instance_parse(&instance, text, err);

	instance.text = text;
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
	wish->light_text[wish->n_lights] = text;
	wish->n_lights++;
	return PSR_OK;
}

static void add_instances(struct optlist *list, struct scene_wish *wish)
{
	const struct psr_opt opts[] = {
		{ .name = "model", .letter = 'm', .type = PSR_OPT_CALL, .value = wish, .arg = "NAME", .call = on_model,
		  .seen = &wish->n_said,
		  .words = "@models",
		  .help = "A model, by its name in `psr list`, where its file puts it. Repeat it to see several models in one "
		          "picture." },
		{ .name = "instance", .type = PSR_OPT_CALL, .value = wish,
		  .arg = "NAME[,at=X,Y,Z][,rotate=AXIS:DEG][,scale=S][,as=KIND]",
		  .call = on_instance, .seen = &wish->n_said,
		  .words = "@models",
		  .help = "A model somewhere else: turned by DEG degrees about an axis (X, Y, Z or x,y,z) through the 0,0,0 of "
		          "its file, S times as large, its 0,0,0 put at X,Y,Z. Repeat it, and rotate= within it. KIND: blocks, "
		          "octree or dpoints, of a model that has several; without it the first of these is drawn." },
	};

	OPTLIST_ADD(list, opts);
}

void scene_add_model_options(struct optlist *list, struct scene_wish *wish)
{
	const struct psr_opt opts[] = {
		{ .name = "scene", .type = PSR_OPT_STRING, .value = &wish->file, .arg = "FILE", .seen = &wish->n_said,
		  .help = "Models and lights from a text file of words such as instance=teapot,at=1,0,0 light=dir:-1,-2,-1 "
		          "shadows: the options of this command without dashes. # begins a comment." },
		{ .name = "level", .type = PSR_OPT_INT, .value = &wish->levels, .arg = "K", .max = PSR_WIRE_MAX_LEVELS,
		  .help = "Of packed octrees the first levels alone, at least K where the file can be cut there: a coarser "
		          "model, in no time. 0: all." },
	};

	const struct psr_opt colors[] = {
		{ .name = "color-by", .type = PSR_OPT_STRING, .value = &wish->color_by, .arg = "WHAT", .seen = &wish->n_said,
		  .words = "intensity class height return",
		  .help = "Colours that tell a number of each point, instead of the models' own: height, of any "
		          "model; intensity, class or return, of laser scans whose files tell them (LAS)." },
	};

	add_instances(list, wish);
	OPTLIST_ADD(list, opts);
	OPTLIST_ADD(list, colors);
}

void scene_add_light_options(struct optlist *list, struct scene_wish *wish)
{
	const struct psr_opt opts[] = {
		{ .name = "light", .letter = 'l', .type = PSR_OPT_CALL, .value = wish, .arg = "LIGHT", .call = on_light,
		  .seen = &wish->n_said, .help = "A light, see below. Repeat it for more." },
		{ .name = "lights", .type = PSR_OPT_STRING, .value = &wish->lights_of, .arg = "model", .seen = &wish->n_said,
		  .words = "model",
		  .help = "All lights that came with the first model." },
		{ .name = "shadows", .type = PSR_OPT_FLAG, .value = &wish->is_shadowed, .seen = &wish->n_said,
		  .help = "Every light casts shadows, also the one that is there without --light." },
		{ .name = "ambient", .type = PSR_OPT_REAL, .value = &wish->ambient, .arg = "A", .max = PSR_WIRE_MAX_INTENSITY,
		  .seen = &wish->has_ambient,
		  .help = "Brightness of the light from everywhere: more lifts dark sides; 1 without a --light shows colours "
		          "without any shading." },
		{ .name = "background", .type = PSR_OPT_COLOR, .value = wish->background, .arg = "#rrggbb",
		  .seen = &wish->n_said, .help = "The colour where nothing is." },
	};

	OPTLIST_ADD(list, opts);
}

static int read_file(struct scene_wish *wish, struct psr_error *err)
{
	struct optlist list = { .n = 0 };
	const struct psr_cli cli = { .opts = list.opt };
	struct wordfile words = { .path = wish->file, .cli = &cli };

	add_instances(&list, wish);
	scene_add_light_options(&list, wish);
	return wordfile_read(&words, &wish->file_text, err);
}

const char *const scene_colors[5] = { "", "intensity", "class", "height", "return" };

int scene_color_parse(uint8_t *by, const char *text, struct psr_error *err)
{
	*by = PSR_WIRE_COLOR_OWN;
	if (text == NULL)
		return PSR_OK;
	*by = PSR_WIRE_COLOR_RETURN;
	while (*by > PSR_WIRE_COLOR_OWN && strcmp(scene_colors[*by], text) != 0)
		--*by;
	return *by != PSR_WIRE_COLOR_OWN
	               ? PSR_OK
	               : psr_fail(err, PSR_ERR_ARG, "--color-by is intensity, class, height or return, not '%.40s'", text);
}

static int apply_colors(struct scene_wish *wish, struct psr_error *err)
{
	uint8_t by;
	const int code = scene_color_parse(&by, wish->color_by, err);

	for (uint32_t i = 0; code == PSR_OK && wish->color_by != NULL && i < wish->n_instances; i++)
		wish->instance[i].place.color_by = by;
	return code;
}

int scene_check(struct scene_wish *wish, struct psr_error *err)
{
	int code = wish->file != NULL ? read_file(wish, err) : PSR_OK;

	if (code == PSR_OK)
		code = apply_colors(wish, err);
	if (code != PSR_OK)
		return code;
	if (wish->n_instances == 0)
		return psr_fail(err, PSR_ERR_ARG, "%s; `psr list` shows the names",
		                wish->file != NULL ? "the scene file names no model" : "--model NAME is missing, or a file");
	if (wish->lights_of != NULL && strcmp(wish->lights_of, "model") != 0)
		return psr_fail(err, PSR_ERR_ARG, "--lights takes 'model', not '%.40s'; --light is for one light",
		                wish->lights_of);
	return PSR_OK;
}
