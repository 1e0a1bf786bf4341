#include "subject.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/vec.h"
#include "client/lib/camera.h"
#include "client/scene/preset.h"

static void set_instance(struct subject_instance *to, const struct instance_wish *wish)
{
	memcpy(to->link.model, wish->model, sizeof to->link.model);
	memcpy(to->link.rotation, wish->place.rotation, sizeof to->link.rotation);
	memcpy(to->link.translation, wish->place.translation, sizeof to->link.translation);
	to->link.scale = wish->place.scale;
	to->link.representation = wish->place.representation;
	to->is_plain = wish->text == NULL;
	snprintf(to->text, sizeof to->text, "%s", wish->text != NULL ? wish->text : wish->model);
}

static int add_instance(struct subject *subject, const struct instance_wish *wish, struct psr_error *err)
{
	if (subject->n_instances == SUBJECT_INSTANCES)
		return psr_fail(err, PSR_ERR_LIMIT, "a viewer shows at most %d models and instances", SUBJECT_INSTANCES);
	if (wish->text != NULL && strlen(wish->text) >= SUBJECT_TEXT)
		return psr_fail(err, PSR_ERR_LIMIT, "--instance has at most %d bytes", SUBJECT_TEXT - 1);
	set_instance(&subject->instance[subject->n_instances++], wish);
	return PSR_OK;
}

int subject_init(struct subject *subject, const struct scene_wish *scene, const struct psr_msg_frame *quality,
                 struct psr_error *err)
{
	int code = PSR_OK;

	memset(subject, 0, sizeof *subject);
	for (uint32_t i = 0; i < scene->n_instances && code == PSR_OK; i++)
		code = add_instance(subject, &scene->instance[i], err);
	for (uint32_t i = 0; i < scene->n_lights && code == PSR_OK; i++) {
		if (strlen(scene->light_text[i]) >= SUBJECT_TEXT)
			return psr_fail(err, PSR_ERR_LIMIT, "--light has at most %d bytes", SUBJECT_TEXT - 1);
		snprintf(subject->light[i].text, SUBJECT_TEXT, "%s", scene->light_text[i]);
		subject->light[i].light = scene->light[i];
	}
	subject->n_lights = scene->n_lights;
	subject->wants_lights = scene->lights_of != NULL;
	subject->has_key_light = scene->n_lights == 0 && scene->lights_of == NULL && !scene->has_ambient;
	subject->is_shadowed = scene->is_shadowed;
	subject->ambient = scene->ambient;
	memcpy(subject->background, scene->background, sizeof subject->background);
	subject->spacing = quality->settings.spacing_px;
	subject->is_smooth = quality->settings.smooth != 0;
	subject->passes = quality->pass_limit;
	subject->with_splats = quality->settings.splats;
	return code;
}

static int instance_of(struct instance_wish *wish, const char *name, struct psr_error *err)
{
	*wish = (struct instance_wish){ .place = { .rotation = { 0, 0, 0, 1 }, .scale = 1 } };
	if (name[0] == '\0' || strlen(name) > PSR_WIRE_MAX_NAME)
		return psr_fail(err, PSR_ERR_ARG, "a model's name has 1 to %d bytes", PSR_WIRE_MAX_NAME);
	strcpy(wish->model, name);
	return PSR_OK;
}

int subject_add_model(struct subject *subject, const char *name, struct psr_error *err)
{
	struct instance_wish wish;
	int code = instance_of(&wish, name, err);

	return code == PSR_OK ? add_instance(subject, &wish, err) : code;
}

int subject_set_model(struct subject *subject, const char *name, struct psr_error *err)
{
	struct instance_wish wish;
	uint32_t n = 0;
	int code = instance_of(&wish, name, err);

	if (code != PSR_OK)
		return code;
	subject->n_instances = 0;
	for (uint32_t i = 0; i < subject->n_lights; i++)
		if (preset_of_light(subject->light[i].text) == NULL)
			subject->light[n++] = subject->light[i];
	subject->has_key_light |= subject->n_lights > 0 && n == 0;
	subject->n_lights = n;
	return add_instance(subject, &wish, err);
}

int subject_place(struct subject *subject, uint32_t k, const char *text, struct psr_error *err)
{
	struct instance_wish wish;
	int code;

	if (strlen(text) >= SUBJECT_TEXT)
		return psr_fail(err, PSR_ERR_LIMIT, "an instance has at most %d bytes", SUBJECT_TEXT - 1);
	code = instance_parse(&wish, text, err);
	if (code != PSR_OK)
		return code;
	wish.text = text;
	set_instance(&subject->instance[k], &wish);
	return PSR_OK;
}

/* ---- lights ---- */

static size_t write_vector(char *to, size_t size, const double v[3])
{
	return (size_t)snprintf(to, size, "%.17g,%.17g,%.17g", v[0], v[1], v[2]);
}

static void write_light(char text[SUBJECT_TEXT], const struct psr_msg_light *light)
{
	static const char *const kinds[] = { [PSR_WIRE_LIGHT_DIRECTIONAL] = "dir:", [PSR_WIRE_LIGHT_POINT] = "point:",
		                                 [PSR_WIRE_LIGHT_SPOT] = "spot:" };
	const int is_spot = light->kind == PSR_WIRE_LIGHT_SPOT;
	size_t n = (size_t)snprintf(text, SUBJECT_TEXT, "%s", kinds[light->kind]);
	double target[3];

	n += write_vector(text + n, SUBJECT_TEXT - n,
	                  light->kind == PSR_WIRE_LIGHT_DIRECTIONAL ? light->direction : light->position);
	if (is_spot) {
		v3d_add_scaled(target, light->position, 1, light->direction);
		n += (size_t)snprintf(text + n, SUBJECT_TEXT - n, ":");
		n += write_vector(text + n, SUBJECT_TEXT - n, target);
		n += (size_t)snprintf(text + n, SUBJECT_TEXT - n, ":%.17g", fmin(light->outer / PSR_DEGREE, 90));
	}
	n += (size_t)snprintf(text + n, SUBJECT_TEXT - n, ",color=#%02x%02x%02x,intensity=%.17g", light->color[0],
	                      light->color[1], light->color[2], light->intensity);
	if (light->reference > 0)
		n += (size_t)snprintf(text + n, SUBJECT_TEXT - n, ",ref=%.17g", light->reference);
	if (light->flags & PSR_WIRE_LIGHT_SHADOW)
		snprintf(text + n, SUBJECT_TEXT - n, ",shadow");
}

int subject_read_light(struct subject *subject, uint32_t k, const char *text, struct psr_error *err)
{
	struct subject_light *to = &subject->light[k];
	struct psr_msg_light light;
	int code;

	if (strlen(text) >= SUBJECT_TEXT)
		return psr_fail(err, PSR_ERR_LIMIT, "a light has at most %d bytes", SUBJECT_TEXT - 1);
	code = psr_light_parse(&light, text, err);
	if (code != PSR_OK)
		return code;
	to->light = light;
	snprintf(to->text, sizeof to->text, "%s", text);
	return PSR_OK;
}

/* What is beyond the range of a light, such as a place too far away, changes nothing. */
void subject_set_light(struct subject *subject, uint32_t k, const struct psr_msg_light *light)
{
	char text[SUBJECT_TEXT];

	write_light(text, light);
	subject_read_light(subject, k, text, NULL);
}

void subject_fix_light(struct subject *subject, const struct psr_camera *camera)
{
	struct psr_msg_light key;

	if (!subject->has_key_light)
		return;
	client_light_key(&key, camera);
	subject->has_key_light = 0;
	subject->n_lights = 1;
	subject_set_light(subject, 0, &key);
}

int subject_preset(const struct subject *subject, const struct link_scene *scene, uint32_t k,
                   struct psr_msg_preset *preset)
{
	const struct link_instance *at = &subject->instance[0].link;
	struct psr_msg_instance place = { .scale = at->scale };

	if (scene == NULL || scene->n_models == 0 || subject->n_instances == 0 || k >= scene->model[0].n_presets)
		return 0;
	memcpy(place.rotation, at->rotation, sizeof place.rotation);
	memcpy(place.translation, at->translation, sizeof place.translation);
	*preset = scene->model[0].preset[k];
	preset_place(preset, &place);
	return 1;
}

static int find_preset(struct psr_msg_preset *preset, const struct subject *subject, const struct link_scene *scene,
                       int kind, const char *name)
{
	for (uint32_t k = 0; subject_preset(subject, scene, k, preset); k++)
		if (preset->kind == kind && strcmp(preset->name, name) == 0)
			return 1;
	return 0;
}

int subject_camera(struct psr_camera *camera, const struct subject *subject, const struct link_scene *scene,
                   const struct view_wish *wish, double aspect, struct psr_error *err)
{
	struct scene placed = { .client = NULL };
	struct psr_msg_preset preset;

	if (wish->preset == NULL) {
		memcpy(placed.box_min, scene->box_min, sizeof placed.box_min);
		memcpy(placed.box_max, scene->box_max, sizeof placed.box_max);
		memcpy(placed.up, scene->up, sizeof placed.up);
		return view_place(camera, wish, &placed, aspect, 0, err);
	}
	if (!find_preset(&preset, subject, scene, PSR_WIRE_PRESET_CAMERA, wish->preset))
		return psr_fail(err, PSR_ERR_NOT_FOUND, "%s has no camera '%.80s'", scene->model[0].name, wish->preset);
	*camera = preset.camera;
	return PSR_OK;
}

static void add_all_lights(struct subject *subject, const struct link_model *model)
{
	for (uint32_t i = 0; i < model->n_presets && subject->n_lights < PSR_WIRE_MAX_LIGHTS; i++)
		if (model->preset[i].kind == PSR_WIRE_PRESET_LIGHT)
			snprintf(subject->light[subject->n_lights++].text, SUBJECT_TEXT, "preset:%s", model->preset[i].name);
}

int subject_resolve(struct subject *subject, const struct link_scene *scene, struct psr_error *err)
{
	uint32_t n = 0;
	int code = PSR_OK;

	if (scene->n_models == 0 || subject->n_instances == 0)
		return PSR_OK;
	if (subject->wants_lights)
		add_all_lights(subject, &scene->model[0]);
	subject->wants_lights = 0;
	for (uint32_t i = 0; i < subject->n_lights; i++) {
		struct subject_light *light = &subject->light[i];
		const char *name = preset_of_light(light->text);
		struct psr_msg_preset preset;

		if (name != NULL && find_preset(&preset, subject, scene, PSR_WIRE_PRESET_LIGHT, name)) {
			light->light = preset.light;
		} else if (name != NULL) {
			code = psr_fail(err, PSR_ERR_NOT_FOUND, "%s has no light '%.80s'; `psr list --presets %s` shows its lights",
			                scene->model[0].name, name, scene->model[0].name);
			continue;
		}
		subject->light[n++] = *light;
	}
	subject->n_lights = n;
	return code;
}

/* ---- to the link, and to people ---- */

void subject_wish(const struct subject *subject, struct link_wish *wish, struct link_instance *instance)
{
	const uint16_t shadow = subject->is_shadowed ? PSR_WIRE_LIGHT_SHADOW : 0;

	for (uint32_t i = 0; i < subject->n_instances; i++) {
		instance[i] = subject->instance[i].link;
		instance[i].color_by = subject->color_by;
	}
	wish->instance = instance;
	wish->n_instances = subject->n_instances;
	wish->has_key_light = subject->has_key_light;
	wish->n_lights = 0;
	memset(wish->light, 0, sizeof wish->light);
	if (subject->has_key_light)
		wish->light[wish->n_lights++].flags = (uint8_t)shadow;
	for (uint32_t i = 0; i < subject->n_lights && !subject->has_key_light; i++) {
		if (subject->light[i].light.kind == 0)
			continue;
		wish->light[wish->n_lights] = subject->light[i].light;
		wish->light[wish->n_lights++].flags |= (uint8_t)shadow;
	}
	wish->ambient = subject->ambient;
	memcpy(wish->background, subject->background, sizeof wish->background);
	wish->spacing_px = subject->spacing;
	wish->is_smooth = subject->is_smooth;
	wish->with_splats = subject->with_splats;
	wish->planes = 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH;
	if (subject->stage != NULL)
		wish->planes |= show_planes(subject->stage);
	wish->pass_limit = subject->stage != NULL ? 0 : subject->passes;
}

/* A word for a shell. */
static void put_word(FILE *to, const char *word)
{
	static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_=+:,./@";

	if (word[0] != '\0' && word[strspn(word, plain)] == '\0') {
		fprintf(to, " %s", word);
		return;
	}
	fprintf(to, " '");
	for (; *word != '\0'; word++)
		if (*word == '\'')
			fprintf(to, "'\\''");
		else
			fputc(*word, to);
	fprintf(to, "'");
}

static void put_option(FILE *to, const char *name, const char *value)
{
	fprintf(to, " --%s", name);
	put_word(to, value);
}

static void put_vector(FILE *to, const char *name, const double v[3])
{
	char text[100];

	write_vector(text, sizeof text, v);
	put_option(to, name, text);
}

/* --ambient alone takes the key light away. */
static void put_lights(FILE *to, const struct subject *subject, const struct psr_camera *camera)
{
	const int is_usual = subject->has_key_light && subject->ambient == SCENE_AMBIENT;
	char key_text[SUBJECT_TEXT];
	struct psr_msg_light key;

	client_light_key(&key, camera);
	write_light(key_text, &key);
	if (subject->has_key_light && !is_usual)
		put_option(to, "light", key_text);
	for (uint32_t i = 0; i < subject->n_lights && !subject->has_key_light; i++)
		put_option(to, "light", subject->light[i].text);
	if (!is_usual)
		fprintf(to, " --ambient %.17g", subject->ambient);
	if (subject->is_shadowed)
		fprintf(to, " --shadows");
}

char *subject_command(const struct subject *subject, const struct hand *hand, const char *server, const char *file)
{
	const struct hand_pose *pose = &hand->pose;
	char *text = NULL;
	size_t n;
	FILE *to = open_memstream(&text, &n);

	if (to == NULL)
		return NULL;
	fprintf(to, "psr shot");
	if (server != NULL)
		put_option(to, "server", server);
	if (file != NULL)
		put_word(to, file);
	for (uint32_t i = 0; i < subject->n_instances; i++)
		put_option(to, subject->instance[i].is_plain ? "model" : "instance", subject->instance[i].text);
	if (subject->color_by != PSR_WIRE_COLOR_OWN)
		put_option(to, "color-by", scene_colors[subject->color_by]);
	fprintf(to, " --size %ux%u", hand->width, hand->height);
	put_vector(to, "eye", pose->eye);
	put_vector(to, "target", pose->target);
	put_vector(to, "up", pose->up);
	fprintf(to, pose->fov > 0 ? " --fov %.17g" : " --ortho %.17g", pose->fov > 0 ? pose->fov : pose->ortho_height);
	put_lights(to, subject, &hand->camera);
	fprintf(to, " --background '#%02x%02x%02x' --spacing %.17g --passes %u%s%s", subject->background[0],
	        subject->background[1], subject->background[2], subject->spacing, subject->passes,
	        subject->is_smooth ? " --smooth" : " --no-smooth", subject->with_splats ? " --splats" : "");
	if (subject->stage != NULL)
		put_option(to, "show", subject->stage_name);
	if (fclose(to) == 0)
		return text;
	free(text);
	return NULL;
}
