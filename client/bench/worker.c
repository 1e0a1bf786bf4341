#include <stdlib.h>
#include "base/clock.h"
#include "bench.h"
#include "client/cli/cli.h"
#include "client/lib/camera.h"

#define FRAMES_A_TURN 120

static void turn_camera(struct bench_worker *worker)
{
	double part = (double)(worker->n_asked % FRAMES_A_TURN) / FRAMES_A_TURN
	              + (double)worker->index / (double)worker->options->n_clients;

	worker->frame.camera = worker->start;
	psr_camera_turn(&worker->frame.camera, worker->up, 360 * part, worker->scene->box_min, worker->scene->box_max);
	worker->n_asked++;
}

static int prepare(struct bench_worker *worker, struct psr_error *err)
{
	const struct bench_options *options = worker->options;
	double aspect = (double)options->frame.width / options->frame.height;
	int code = scene_open(&worker->scene, &options->scene, worker->client, (int)options->timeout * 1000, err);

	worker->frame = options->frame;
	if (code == PSR_OK)
		code = view_place(&worker->start, &options->view, worker->scene, aspect, FRAMES_A_TURN, err);
	if (code != PSR_OK)
		return code;
	view_up(worker->up, &options->view, worker->scene);
	scene_light(worker->scene, &worker->start);
	return PSR_OK;
}

static int wait_for_frame(struct bench_worker *worker, struct psr_event *event, struct psr_error *err)
{
	int got;

	do
		got = psr_client_wait(worker->client, (int)worker->options->timeout * 1000, event, err);
	while (got > 0 && event->type == PSR_EVENT_FRAME && !event->end->is_final);
	return got;
}

/* Connects, opens, and draws one frame, which does not count. */
static int warm_up(struct bench_worker *worker, struct psr_error *err)
{
	const struct bench_options *options = worker->options;
	int timeout_ms = (int)options->timeout * 1000, code;
	struct psr_event event;
	uint32_t id;

	code = psr_client_connect(&worker->client, options->server, PSR_PROGRAM, options->scene.instance[0].model,
	                          timeout_ms, err);
	if (code == PSR_OK && options->n_inflight > psr_client_welcome(worker->client)->max_open)
		code = psr_fail(err, PSR_ERR_LIMIT, "--inflight: %s takes %u requests at a time", options->server,
		                psr_client_welcome(worker->client)->max_open);
	if (code == PSR_OK)
		code = prepare(worker, err);
	if (code == PSR_OK)
		code = psr_client_scene(worker->client, &worker->scene->msg, NULL, err);
	if (code == PSR_OK) {
		turn_camera(worker);
		code = psr_client_frame(worker->client, &worker->frame, &id, err);
	}
	if (code != PSR_OK)
		return code;
	code = wait_for_frame(worker, &event, err);
	if (code == 0)
		return psr_fail(err, PSR_ERR_CONNECTION, "%s: no frame within %d s", options->server, timeout_ms / 1000);
	if (code > 0 && event.type == PSR_EVENT_FAILED)
		return psr_fail(err, event.error.code, "%s", event.error.text);
	return code > 0 ? PSR_OK : code;
}

static int pass_gate(struct bench_gate *gate)
{
	int state;

	pthread_mutex_lock(&gate->lock);
	gate->n_ready++;
	pthread_cond_broadcast(&gate->changed);
	while (gate->state == 0)
		pthread_cond_wait(&gate->changed, &gate->lock);
	state = gate->state;
	pthread_mutex_unlock(&gate->lock);
	return state > 0;
}

static void note_error(struct bench_worker *worker, uint64_t n_failed, const struct psr_error *why)
{
	worker->n_failed += n_failed;
	if (worker->first_error.code == PSR_OK)
		worker->first_error = *why;
}

/* Returns 0 if its share of the samples is full. */
static int add_sample(struct bench_worker *worker, uint64_t latency_ns)
{
	size_t share = BENCH_MAX_SAMPLES / (size_t)worker->options->n_clients;
	uint64_t us = latency_ns / 1000;

	if (worker->n_samples == worker->samples_capacity) {
		size_t capacity = worker->samples_capacity == 0 ? 4096 : 2 * worker->samples_capacity;
		uint32_t *grown = worker->n_samples < share ? realloc(worker->sample_us, capacity * sizeof *grown) : NULL;

		if (grown == NULL)
			return 0;
		worker->sample_us = grown;
		worker->samples_capacity = capacity;
	}
	worker->sample_us[worker->n_samples++] = us < UINT32_MAX ? (uint32_t)us : UINT32_MAX;
	return worker->n_samples < share;
}

static void measure(struct bench_worker *worker)
{
	const struct bench_options *options = worker->options;
	uint64_t start_ns = clock_ns(), length_ns = (uint64_t)options->seconds * 1000000000u;
	int64_t n_open = 0;
	int is_over = 0;

	for (;;) {
		struct psr_event event;
		struct psr_error why;
		uint64_t since_ns;
		uint32_t id;
		int got = 1;

		while (!is_over && n_open < options->n_inflight && got > 0) {
			turn_camera(worker);
			if (psr_client_frame(worker->client, &worker->frame, &id, &why) == PSR_OK)
				n_open++;
			else
				got = -1;
		}
		if (n_open == 0 && got > 0)
			break;
		if (got > 0)
			got = wait_for_frame(worker, &event, &why);
		since_ns = clock_ns() - start_ns;
		if (got == 0)
			psr_fail(&why, PSR_ERR_CONNECTION, "%s: no frame within %d s", options->server, (int)options->timeout);
		if (got <= 0) {
			note_error(worker, n_open > 0 ? (uint64_t)n_open : 1, &why);
			break;
		}
		n_open--;
		if (!is_over)
			is_over = since_ns >= length_ns;
		if (event.type == PSR_EVENT_FAILED) {
			note_error(worker, 1, &event.error);
			continue;
		}
		if (!is_over) {
			worker->n_frames++;
			worker->n_bytes += event.bytes;
		}
		if (!add_sample(worker, event.latency_ns) && !is_over) {
			length_ns = since_ns;
			is_over = 1;
		}
	}
	worker->elapsed_ns = length_ns;
}

void *bench_worker_run(void *userdata)
{
	struct bench_worker *worker = userdata;
	struct psr_error err;

	worker->setup_code = warm_up(worker, &err);
	if (worker->setup_code != PSR_OK)
		worker->first_error = err;
	if (pass_gate(worker->gate))
		measure(worker);
	psr_client_close(worker->client);
	worker->client = NULL;
	scene_close(worker->scene);
	return NULL;
}
