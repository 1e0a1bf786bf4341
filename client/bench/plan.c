#include "plan.h"
#include <stdlib.h>
#include <string.h>
#include "base/random.h"
#include "client/cli/cli.h"

/* Finds the model, or adds it. */
static int find_model(uint32_t *at, struct bench_plan *plan, const struct scene_model *model, uint32_t pixels,
                      struct psr_error *err)
{
	struct bench_model *grown;

	for (*at = 0; *at < plan->n_models; ++*at)
		if (strcmp(plan->model[*at].name, model->name) == 0 && plan->model[*at].pixels == pixels
		    && plan->model[*at].levels == model->opened.octree_levels)
			return PSR_OK;
	grown = realloc(plan->model, (plan->n_models + 1) * sizeof *grown);
	if (grown == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u models", plan->n_models + 1);
	plan->model = grown;
	memset(&grown[*at], 0, sizeof *grown);
	strcpy(grown[*at].name, model->name);
	grown[*at].pixels = pixels;
	grown[*at].levels = model->opened.octree_levels;
	memcpy(grown[*at].content_id, model->opened.content_id, sizeof grown->content_id);
	plan->n_models++;
	return PSR_OK;
}

int bench_plan_add_models(struct bench_plan *plan, struct bench_kind *kind, const uint32_t *pixels,
                          struct psr_error *err)
{
	const struct scene *scene = kind->scene;
	int code = PSR_OK;

	kind->model = calloc(scene->msg.n_instances, sizeof *kind->model);
	if (kind->model == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u instances", scene->msg.n_instances);
	for (uint32_t i = 0; code == PSR_OK && i < scene->msg.n_instances; i++)
		code = find_model(&kind->model[i], plan, &scene->model[scene->model_of[i]], pixels[i], err);
	return code;
}

static int add_kind(struct bench_plan *plan, const struct mix_line *line, struct psr_client *client, int timeout_ms,
                    struct psr_error *err)
{
	struct bench_kind *kind = &plan->kind[plan->n_kinds];
	const double aspect = (double)line->frame.width / line->frame.height;
	uint32_t *pixels;
	int code = scene_open(&kind->scene, &line->scene, client, timeout_ms, err);

	if (code != PSR_OK)
		return code;
	kind->frame = line->frame;
	kind->frame.slot = kind->scene->msg.slot = (uint16_t)plan->n_kinds++;
	code = flight_make(&kind->flight, line->path, &line->view, kind->scene, aspect, err);
	scene_light(kind->scene, &kind->flight.start);
	pixels = calloc(line->scene.n_instances, sizeof *pixels);
	if (code == PSR_OK && pixels == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for %u instances", line->scene.n_instances);
	for (uint32_t i = 0; code == PSR_OK && i < line->scene.n_instances; i++)
		pixels[i] = line->scene.pixels;
	if (code == PSR_OK)
		code = bench_plan_add_models(plan, kind, pixels, err);
	free(pixels);
	return code;
}

int bench_plan_make(struct bench_plan *plan, const struct mix *mix, const char *server, int timeout_ms,
                    struct psr_error *err)
{
	struct psr_client *client = NULL;
	double total = 0, sum = 0;
	int code = psr_client_connect(&client, server, PSR_PROGRAM, mix->line[0].scene.instance[0].model, timeout_ms, err);

	if (code == PSR_OK && mix->n > psr_client_welcome(client)->max_scenes)
		code = psr_fail(err, PSR_ERR_LIMIT, "--mix has %u lines; %s holds %u scenes a client", mix->n, server,
		                psr_client_welcome(client)->max_scenes);
	for (uint32_t i = 0; i < mix->n; i++)
		total += mix->line[i].weight;
	for (uint32_t i = 0; code == PSR_OK && i < mix->n; i++) {
		sum += mix->line[i].weight;
		plan->kind[i].up_to = sum / total;
		code = add_kind(plan, &mix->line[i], client, timeout_ms, err);
	}
	psr_client_close(client);
	return code;
}

void bench_plan_fini(struct bench_plan *plan)
{
	for (uint32_t i = 0; i < plan->n_kinds; i++) {
		scene_close(plan->kind[i].scene);
		flight_fini(&plan->kind[i].flight);
		free(plan->kind[i].model);
	}
	free(plan->model);
	free(plan->request);
	memset(plan, 0, sizeof *plan);
}

/* A number of its own for each client. */
static uint64_t random_of(const struct bench_plan *plan, uint32_t client)
{
	uint64_t random = plan->seed ^ ((uint64_t)client + 1) << 32;

	return random_next(&random);
}

uint32_t bench_kind_of(const struct bench_plan *plan, uint32_t client, uint64_t k)
{
	uint64_t random = random_of(plan, client) + k;
	double at;
	uint32_t kind = 0;

	if (plan->request != NULL)
		return plan->request[k].kind;
	for (at = random_in(&random, 0, 1); kind + 1 < plan->n_kinds && at >= plan->kind[kind].up_to;)
		kind++;
	return kind;
}

void bench_plan_camera(struct psr_camera *camera, const struct bench_plan *plan, uint32_t client, uint32_t n_clients,
                       uint64_t k)
{
	if (plan->request != NULL)
		*camera = plan->request[k].camera;
	else
		flight_at(camera, &plan->kind[bench_kind_of(plan, client, k)].flight, k, (double)client / n_clients,
		          random_of(plan, client));
}
