#include "run.h"
#include <stdlib.h>
#include "base/clock.h"
#include "judge.h"

#define MAX_UNDER_WAY 16 /* bounds the pictures that wait in memory */

int run_is_over(int code)
{
	return code == PSR_ERR_CONNECTION || code == PSR_ERR_PROTOCOL || code == PSR_ERR_VERSION || code == PSR_ERR_MEMORY;
}

int run_add_time(uint64_t *ns, const struct psr_event *event)
{
	for (uint16_t i = 0; i < event->end->n_entries; i++) {
		if (event->end->entry[i].id != PSR_WIRE_REPORT_TOTAL)
			continue;
		*ns += event->end->entry[i].ns;
		return 1;
	}
	return 0;
}

/* ---- requests ---- */

int request_open(struct request *request, const struct run *run, const struct suite_test *test, struct psr_error *err)
{
	const double aspect = (double)test->frame.width / test->frame.height;
	int code;

	*request = (struct request){ .test = test };
	code = scene_open(&request->scene, &test->scene, run->client, run->timeout_ms, err);
	if (code == PSR_OK && (request->camera = calloc(test->n_pictures, sizeof *request->camera)) == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for %u cameras", test->n_pictures);
	if (code == PSR_OK)
		code = views_place(request->camera, &test->views, request->scene, aspect, (uint32_t)test->n_turn, err);
	if (code != PSR_OK)
		request_close(request, run);
	return code;
}

/* Frames that were sent keep the models. */
void request_close(struct request *request, const struct run *run)
{
	for (uint32_t i = 0; request->scene != NULL && i < request->scene->n_models; i++)
		psr_client_close_model(run->client, request->scene->model[i].opened.handle, NULL);
	scene_close(request->scene);
	free(request->camera);
	*request = (struct request){ .test = NULL };
}

int request_send(const struct request *request, uint32_t k, struct sent *sent, struct psr_error *err)
{
	struct psr_msg_frame frame = request->test->frame;
	int code;

	frame.camera = request->camera[k];
	scene_light(request->scene, &frame.camera);
	code = psr_client_scene(request->scene->client, &request->scene->msg, &sent->scene, err);
	return code == PSR_OK ? psr_client_frame(request->scene->client, &frame, &sent->frame, err) : code;
}

/* ---- many ---- */

struct way {
	const struct run *run;
	struct open_frame {
		struct sent sent;
		uint32_t test, k;
		uint64_t start_ns;
		int is_judged; /* its scene failed */
	} open[MAX_UNDER_WAY];
	unsigned n_open;
};

static struct result *result_of(const struct run *run, uint32_t test, uint32_t k)
{
	return &run->results->of[run->results->first[test] + k];
}

static int end_frame(const struct run *run, const struct open_frame *open, const struct psr_event *event,
                     struct psr_error *err)
{
	struct results *results = run->results;
	const struct suite_test *test = &results->suite->test[open->test];
	const struct judge judge = { test, open->k, run->wants_figures, results->is_accepted[open->test] };
	struct result *result = result_of(run, open->test, open->k);
	int code = PSR_OK;

	if (event->type == PSR_EVENT_FRAME)
		code = judge_frame(result, &judge, event, err);
	else
		judge_error(result, test, &event->error);
	result->seconds = (double)(clock_ns() - open->start_ns) / 1e9;
	if (run->on_result != NULL)
		run->on_result(run->userdata);
	return code;
}

static int wait_for_one(struct way *way, struct psr_error *err)
{
	struct psr_event event;
	int code;

	do
		code = psr_client_wait(way->run->client, way->run->timeout_ms, &event, err);
	while (code > 0 && event.type == PSR_EVENT_FRAME && !event.end->is_final);
	if (code < 0)
		return code;
	if (code == 0)
		return psr_fail(err, PSR_ERR_CONNECTION, "the server says nothing for %d s; --timeout waits longer",
		                way->run->timeout_ms / 1000);
	for (unsigned i = 0; i < way->n_open; i++) {
		const struct open_frame found = way->open[i];

		if (found.sent.frame == event.id)
			way->open[i] = way->open[--way->n_open];
		else if (found.sent.scene == event.id)
			way->open[i].is_judged = 1;
		else
			continue;
		return found.is_judged ? PSR_OK : end_frame(way->run, &found, &event, err);
	}
	return psr_fail(err, PSR_ERR_INTERNAL, "a frame came that this program did not request");
}

static unsigned most_open(const struct run *run)
{
	const unsigned max_open = psr_client_welcome(run->client)->max_open;

	return max_open < MAX_UNDER_WAY ? max_open : MAX_UNDER_WAY;
}

static int send_one(struct way *way, const struct request *request, uint32_t test, uint32_t k, struct psr_error *err)
{
	const unsigned most = most_open(way->run);
	int code = PSR_ERR_BUSY;

	while (code == PSR_ERR_BUSY) {
		struct open_frame *open = &way->open[way->n_open];

		if (way->n_open < most) {
			*open = (struct open_frame){ .test = test, .k = k, .start_ns = clock_ns() };
			code = request_send(request, k, &open->sent, err);
			way->n_open += code == PSR_OK;
		}
		if (code == PSR_ERR_BUSY && way->n_open == 0)
			return code;
		if (code == PSR_ERR_BUSY && wait_for_one(way, err) != PSR_OK)
			return err->code;
	}
	return code;
}

static int start_test(struct way *way, uint32_t test, struct psr_error *err)
{
	const struct run *run = way->run;
	const struct suite_test *of = &run->results->suite->test[test];
	struct request request;
	uint32_t k = 0;
	int code = PSR_OK;

	while (way->n_open >= most_open(run)) /* opening a model is a request, too */
		if ((code = wait_for_one(way, err)) != PSR_OK)
			return code;
	code = request_open(&request, run, of, err);
	while (code == PSR_OK && k < of->n_pictures) {
		code = send_one(way, &request, test, k, err);
		k += code == PSR_OK;
	}
	if (code != PSR_OK && !run_is_over(code)) {
		for (; k < of->n_pictures; k++) {
			judge_error(result_of(run, test, k), of, err);
			if (run->on_result != NULL)
				run->on_result(run->userdata);
		}
		code = PSR_OK;
	}
	request_close(&request, run);
	return code;
}

int run_tests(const struct run *run, struct psr_error *err)
{
	struct way way = { .run = run };
	int code = PSR_OK;

	for (uint32_t i = 0; i < run->results->suite->n_tests && code == PSR_OK; i++)
		if (run->results->is_chosen[i])
			code = start_test(&way, i, err);
	while (code == PSR_OK && way.n_open > 0)
		code = wait_for_one(&way, err);
	return code == PSR_OK ? time_tests(run, err) : code;
}
