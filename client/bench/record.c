#include "record.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/infile.h"
#include "base/json.h"
#include "base/outfile.h"
#include "base/view.h"
#include "client/cli/cli.h"
#include "client/replay/replay.h"

#define MAX_BYTES (UINT64_C(2) << 30)

static void write_line(struct outfile *file, cJSON *json)
{
	char *text = cJSON_PrintUnformatted(json);

	cJSON_Delete(json);
	if (text != NULL) {
		outfile_write(file, text, strlen(text));
		outfile_write(file, "\n", 1);
	}
	cJSON_free(text);
}

static cJSON *kinds_json(const struct bench_plan *plan, const struct bench_result *result)
{
	cJSON *json = cJSON_CreateObject(), *kinds;

	cJSON_AddNumberToObject(json, "psr-bench", 1);
	cJSON_AddNumberToObject(json, "clients", (double)result->load.n_clients);
	kinds = cJSON_AddArrayToObject(json, "kinds");
	for (uint32_t i = 0; i < plan->n_kinds; i++) {
		struct psr_msg_frame frame = plan->kind[i].frame;
		cJSON *kind = cJSON_CreateObject();

		bench_plan_camera(&frame.camera, plan, 0, 1, 0); /* each request has its own */
		replay_add(kind, plan->kind[i].scene, &frame);
		cJSON_AddItemToArray(kinds, kind);
	}
	return json;
}

static cJSON *kept_json(const struct bench_plan *plan, const struct bench_result *result, const struct bench_kept *kept)
{
	cJSON *json = cJSON_CreateObject();
	struct psr_camera camera;
	char hash[17];

	bench_plan_camera(&camera, plan, kept->client, (uint32_t)result->load.n_clients, kept->k);
	snprintf(hash, sizeof hash, "%016" PRIx64, kept->hash);
	json_add_number(json, "at", (double)kept->due_ns / 1e9);
	cJSON_AddNumberToObject(json, "client", kept->client);
	cJSON_AddNumberToObject(json, "kind", kept->kind);
	cJSON_AddStringToObject(json, "camera", view_camera_kinds[camera.kind]);
	json_add_numbers(json, "eye", camera.eye, 3);
	json_add_numbers(json, "target", camera.target, 3);
	json_add_numbers(json, "up", camera.up, 3);
	json_add_number(json, "extent", camera.kind == PSR_CAMERA_PERSPECTIVE ? camera.fov_y : camera.ortho_height);
	json_add_number(json, "near", camera.near_z);
	cJSON_AddStringToObject(json, "outcome", kept->outcome == CONN_DRAWN        ? "drawn"
	                                         : kept->outcome == CONN_SUPERSEDED ? "superseded"
	                                                                            : psr_strerror(kept->code));
	if (kept->has_hash)
		cJSON_AddStringToObject(json, "hash", hash);
	cJSON_AddNumberToObject(json, "latency_ms", (double)kept->latency_ns / 1e6);
	cJSON_AddNumberToObject(json, "bytes", (double)kept->bytes);
	return json;
}

int record_write(const char *path, const struct bench_plan *plan, const struct bench_result *result,
                 struct psr_error *err)
{
	struct outfile file;
	int code = outfile_open(&file, path, OUTFILE_PLAIN, err);

	if (code != PSR_OK)
		return code;
	write_line(&file, kinds_json(plan, result));
	for (size_t i = 0; i < result->n_kept; i++)
		write_line(&file, kept_json(plan, result, &result->kept[i]));
	return outfile_close(&file, PSR_OK, err);
}

/* ---- reading ---- */

/* A number of an object, or NAN where it is none within the range. */
static double number(const cJSON *from, const char *name, double least, double most)
{
	const cJSON *item = cJSON_GetObjectItemCaseSensitive(from, name);

	return cJSON_IsNumber(item) && item->valuedouble >= least && item->valuedouble <= most ? item->valuedouble : NAN;
}

static int vector(double to[3], const cJSON *from, const char *name)
{
	const cJSON *array = cJSON_GetObjectItemCaseSensitive(from, name);

	for (int i = 0; i < 3; i++) {
		const cJSON *item = cJSON_GetArrayItem(array, i);

		if (!cJSON_IsNumber(item))
			return 0;
		to[i] = item->valuedouble;
	}
	return 1;
}

/* Returns what is missing or wrong, or NULL. */
static const char *read_request(struct bench_request *to, const struct bench_plan *plan, const cJSON *json)
{
	const char *kind = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(json, "camera"));
	const char *hash = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(json, "hash"));
	const double at = number(json, "at", 0, 1e6), client = number(json, "client", 0, (double)plan->n_clients - 1);
	const double of_kind = number(json, "kind", 0, (double)plan->n_kinds - 1);
	const double extent = number(json, "extent", 1 / PSR_WIRE_MAX_LENGTH, PSR_WIRE_MAX_LENGTH);
	const double near_z = number(json, "near", 0, PSR_WIRE_MAX_LENGTH);

	memset(to, 0, sizeof *to);
	if (isnan(at) || isnan(client) || isnan(of_kind))
		return isnan(at) ? "at" : isnan(client) ? "client" : "kind";
	to->due_ns = (uint64_t)(at * 1e9 + 0.5);
	to->client = (uint32_t)client;
	to->kind = (uint32_t)of_kind;
	if (hash != NULL)
		to->hash = strtoull(hash, NULL, 16);
	to->camera.kind = kind != NULL && strcmp(kind, view_camera_kinds[PSR_CAMERA_ORTHOGRAPHIC]) == 0
	                      ? PSR_CAMERA_ORTHOGRAPHIC : PSR_CAMERA_PERSPECTIVE;
	*(to->camera.kind == PSR_CAMERA_PERSPECTIVE ? &to->camera.fov_y : &to->camera.ortho_height) = extent;
	to->camera.near_z = near_z;
	if (!vector(to->camera.eye, json, "eye") || !vector(to->camera.target, json, "target")
	    || !vector(to->camera.up, json, "up") || isnan(extent) || isnan(near_z)
	    || view_check_camera(&to->camera, NULL) != PSR_OK)
		return "camera";
	return NULL;
}

static int open_kind(struct bench_plan *plan, const cJSON *report, struct psr_client *client, int timeout_ms,
                     struct psr_error *err)
{
	struct bench_kind *kind = &plan->kind[plan->n_kinds];
	struct scene_wish wish;
	uint32_t *pixels = NULL;
	int code;

	scene_wish_init(&wish);
	code = replay_wish(&wish, report, err);
	if (code == PSR_OK)
		code = scene_open(&kind->scene, &wish, client, timeout_ms, err);
	if (code == PSR_OK) {
		kind->frame.slot = kind->scene->msg.slot = (uint16_t)plan->n_kinds++;
		code = replay_scene(kind->scene, report, err);
	}
	if (code == PSR_OK)
		code = replay_frame(&kind->frame, report, err);
	if (code == PSR_OK && (pixels = calloc(wish.n_instances, sizeof *pixels)) == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for %u instances", wish.n_instances);
	for (uint32_t i = 0; code == PSR_OK && i < wish.n_instances; i++)
		pixels[i] = wish.instance[i].pixels;
	if (code == PSR_OK)
		code = bench_plan_add_models(plan, kind, pixels, err);
	free(pixels);
	scene_wish_fini(&wish);
	return code;
}

static int open_kinds(struct bench_plan *plan, const cJSON *head, const char *server, int timeout_ms,
                      struct psr_error *err)
{
	const cJSON *kinds = cJSON_GetObjectItemCaseSensitive(head, "kinds"), *kind;
	const double clients = number(head, "clients", 1, BENCH_MAX_CLIENTS);
	struct psr_client *client = NULL;
	int code;

	if (isnan(clients) || cJSON_GetArraySize(kinds) < 1 || cJSON_GetArraySize(kinds) > MIX_MAX)
		return psr_fail(err, PSR_ERR_FORMAT, "--replay: its first line is none that psr bench --record wrote");
	plan->n_clients = (uint32_t)clients;
	code = psr_client_connect(&client, server, PSR_PROGRAM, NULL, timeout_ms, err);
	cJSON_ArrayForEach(kind, kinds)
		if (code == PSR_OK)
			code = open_kind(plan, kind, client, timeout_ms, err);
	psr_client_close(client);
	return code;
}

static int add_request(struct bench_plan *plan, const char *line, uint64_t number_of_line, struct psr_error *err)
{
	struct bench_request *grown = plan->request;
	const uint64_t n = plan->n_requests;
	cJSON *json = cJSON_Parse(line);
	const char *wrong;

	if ((n & (n - 1)) == 0)
		grown = realloc(grown, (n == 0 ? 1 : 2 * n) * sizeof *grown);
	if (grown == NULL) {
		cJSON_Delete(json);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %" PRIu64 " requests", n);
	}
	plan->request = grown;
	wrong = json != NULL ? read_request(&grown[n], plan, json) : "JSON";
	cJSON_Delete(json);
	if (wrong != NULL)
		return psr_fail(err, PSR_ERR_FORMAT, "--replay: line %" PRIu64 " has no usable %s", number_of_line, wrong);
	plan->n_requests++;
	return PSR_OK;
}

static int by_time(const void *a, const void *b)
{
	const uint64_t x = ((const struct bench_request *)a)->due_ns, y = ((const struct bench_request *)b)->due_ns;

	return x < y ? -1 : x > y;
}

int record_read(struct bench_plan *plan, const char *path, const char *server, int timeout_ms, struct psr_error *err)
{
	struct psr_error why;
	char *text = NULL, *rest, *line;
	uint64_t n_lines = 1;
	cJSON *head;
	int code = infile_read_text(&text, path, MAX_BYTES, &why);

	if (code != PSR_OK)
		return psr_fail(err, code, "--replay: cannot read %s", why.text);
	rest = text;
	head = cJSON_Parse(strsep(&rest, "\n"));
	code = open_kinds(plan, head, server, timeout_ms, err);
	cJSON_Delete(head);
	while (code == PSR_OK && (line = strsep(&rest, "\n")) != NULL && ++n_lines > 0)
		if (line[0] != '\0')
			code = add_request(plan, line, n_lines, err);
	free(text);
	if (code == PSR_OK && plan->n_requests == 0)
		code = psr_fail(err, PSR_ERR_FORMAT, "--replay: %.300s has no requests", path);
	if (code == PSR_OK)
		qsort(plan->request, plan->n_requests, sizeof *plan->request, by_time);
	return code;
}
