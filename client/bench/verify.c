#include "verify.h"
#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/outfile.h"
#include "base/srgb.h"
#include "psr/render.h"

static void judge(struct verify_result *out, const struct bench_kept *kept, uint64_t wanted, const char *source)
{
	if (kept->hash == wanted) {
		out->n_right++;
		return;
	}
	if (out->n_wrong++ == 0)
		fprintf(stderr, "psr bench: request %" PRIu64 " of client %" PRIu32 ": the picture has the hash %016" PRIx64
		        ", %s %016" PRIx64 "\n", kept->k, kept->client, kept->hash, source, wanted);
}

void verify_with_recording(struct verify_result *out, const struct bench_plan *plan, const struct bench_result *result)
{
	for (size_t i = 0; i < result->n_kept; i++) {
		const struct bench_kept *kept = &result->kept[i];

		if (kept->has_hash && plan->request[kept->k].hash != 0)
			judge(out, kept, plan->request[kept->k].hash, "the recorded one");
	}
}

/* ---- models ---- */

static int is_all(struct psr_model *const *model, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++)
		if (model[i] == NULL)
			return 0;
	return 1;
}

/* Takes the model in this file for all places of the plan that it fits. */
static void try_file(struct psr_model **model, const struct bench_plan *plan, const char *path)
{
	struct psr_model *found;
	uint8_t id[16];

	if (psr_model_map(&found, path, NULL) != PSR_OK)
		return;
	psr_model_content_id(found, id);
	for (uint32_t i = 0; i < plan->n_models; i++)
		if (model[i] == NULL && memcmp(plan->model[i].content_id, id, sizeof id) == 0)
			model[i] = psr_model_ref(found);
	psr_model_unref(found);
}

static int find_models(struct psr_model **model, const struct bench_plan *plan, const char *folder,
                       struct psr_error *err)
{
	DIR *dir = opendir(folder);
	const struct dirent *entry;
	char path[PATH_MAX];

	if (dir == NULL)
		return psr_fail(err, PSR_ERR_NOT_FOUND, "--verify-models: cannot read the folder %.300s: %s", folder,
		                strerror(errno));
	while (!is_all(model, plan->n_models) && (entry = readdir(dir)) != NULL)
		if (strcmp(outfile_ending(entry->d_name), "psr") == 0
		    && snprintf(path, sizeof path, "%s/%s", folder, entry->d_name) < (int)sizeof path)
			try_file(model, plan, path);
	closedir(dir);
	for (uint32_t i = 0; i < plan->n_models; i++)
		if (model[i] == NULL)
			return psr_fail(err, PSR_ERR_NOT_FOUND, "--verify-models: no .psr file in %.200s is the server's %.200s: "
			                "name its --models folder, or its --cache", folder, plan->model[i].name);
	return PSR_OK;
}

/* ---- drawing ---- */

struct artist {
	const struct bench_plan *plan;
	struct psr_model **model;
	struct psr_renderer *renderer;
	struct psr_pool *pool;
	struct psr_instance instance[PSR_WIRE_MAX_INSTANCES];
	struct psr_light light[PSR_WIRE_MAX_LIGHTS];
};

/* As PROTOCOL.md says of SCENE. */
static void make_scene(struct psr_scene *scene, struct artist *artist, const struct bench_kind *kind)
{
	const struct psr_msg_scene *msg = &kind->scene->msg;

	*scene = (struct psr_scene){ .instance = artist->instance, .n_instances = msg->n_instances, .light = artist->light,
		                         .n_lights = msg->n_lights };
	for (uint32_t i = 0; i < msg->n_instances; i++) {
		const struct psr_msg_instance *from = &msg->instance[i];
		struct psr_instance *to = &artist->instance[i];
		double norm = 0;

		for (int k = 0; k < 4; k++)
			norm += from->rotation[k] * from->rotation[k];
		for (int k = 0; k < 4; k++)
			to->rotation[k] = from->rotation[k] / sqrt(norm);
		memcpy(to->translation, from->translation, sizeof to->translation);
		to->scale = from->scale;
		to->model = artist->model[kind->model[i]];
		to->representation = (enum psr_representation)from->representation; /* both enums have the wire's order */
		to->color_by = (enum psr_color_by)from->color_by;
	}
	for (uint32_t i = 0; i < msg->n_lights; i++)
		psr_msg_light_get(&artist->light[i], &msg->light[i]);
	for (int k = 0; k < 3; k++) {
		scene->ambient[k] = msg->ambient;
		scene->background[k] = (double)psr_srgb_to_linear[msg->background[k]];
	}
}

/* In place: the whole picture's pixels follow in the order of memory, so it begins at the last one. */
static void enlarge(struct psr_frame *frame, uint32_t scale)
{
	const uint32_t width = frame->width * scale;

	for (uint32_t y = frame->height * scale; y-- > 0;)
		for (uint32_t x = width; x-- > 0;)
			memmove(frame->rgb + 3 * ((size_t)y * width + x),
			        frame->rgb + 3 * ((size_t)(y / scale) * frame->width + x / scale), 3);
	frame->width *= scale;
	frame->height *= scale;
}

static int draw(uint64_t *hash, struct artist *artist, const struct bench_kept *kept, uint32_t n_clients,
                struct psr_error *err)
{
	const struct bench_kind *kind = &artist->plan->kind[kept->kind];
	const struct psr_msg_settings *drawn = &kept->settings;
	struct psr_settings settings;
	struct psr_scene scene;
	struct psr_frame frame;
	int code;

	make_scene(&scene, artist, kind);
	bench_plan_camera(&scene.camera, artist->plan, kept->client, n_clients, kept->k);
	psr_settings_default(&settings, kind->frame.width / drawn->scale, kind->frame.height / drawn->scale);
	settings.spacing_px = drawn->spacing_px;
	settings.smooth = drawn->smooth;
	settings.with_splats = drawn->splats;
	settings.pass = drawn->pass > 0 ? drawn->pass : kept->pass;
	code = psr_frame_alloc(&frame, kind->frame.width, kind->frame.height, 1 << PSR_PLANE_COLOR, err);
	if (code != PSR_OK)
		return code;
	frame.width = settings.width;
	frame.height = settings.height;
	code = psr_render(artist->renderer, &scene, &settings, artist->pool, &frame, err);
	enlarge(&frame, drawn->scale);
	if (code == PSR_OK)
		*hash = psr_frame_hash(&frame, PSR_PLANE_COLOR);
	psr_frame_free(&frame);
	return code;
}

int verify_by_drawing(struct verify_result *out, const struct bench_plan *plan, const struct bench_result *result,
                      const char *folder, struct psr_error *err)
{
	struct artist *artist = calloc(1, sizeof *artist);
	int code;

	if (artist == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to verify");
	artist->plan = plan;
	artist->model = calloc(plan->n_models, sizeof *artist->model);
	code = artist->model == NULL ? psr_fail(err, PSR_ERR_MEMORY, "no memory to verify")
	                             : find_models(artist->model, plan, folder, err);
	if (code == PSR_OK)
		code = psr_renderer_create(&artist->renderer, err);
	if (code == PSR_OK)
		code = psr_pool_create(&artist->pool, 0, err);
	for (size_t i = 0; code == PSR_OK && i < result->n_kept; i++) {
		uint64_t hash;

		if (!result->kept[i].has_hash)
			continue;
		code = draw(&hash, artist, &result->kept[i], (uint32_t)result->load.n_clients, err);
		if (code == PSR_OK)
			judge(out, &result->kept[i], hash, "drawn here");
	}
	psr_pool_destroy(artist->pool);
	psr_renderer_destroy(artist->renderer);
	for (uint32_t i = 0; artist->model != NULL && i < plan->n_models; i++)
		psr_model_unref(artist->model[i]);
	free(artist->model);
	free(artist);
	return code;
}
