#include "series.h"
#include <string.h>

#define MAX_UNDER_WAY 4 /* keeps the server busy while this program writes pictures */

struct open_frame {
	uint32_t id, k;
};

static int send_frame(const struct series *series, uint32_t k, uint32_t *id, struct psr_error *err)
{
	struct psr_msg_frame frame = *series->frame;
	int code = PSR_OK;

	frame.camera = series->camera[k];
	if (scene_light(series->scene, &frame.camera) || k == 0)
		code = psr_client_scene(series->client, &series->scene->msg, NULL, err);
	return code == PSR_OK ? psr_client_frame(series->client, &frame, id, err) : code;
}

static int wait_for_one(const struct series *series, struct open_frame *open, unsigned *n_open, struct psr_error *err)
{
	struct psr_event event;
	int code;

	do
		code = psr_client_wait(series->client, series->timeout_ms, &event, err);
	while (code > 0 && event.type == PSR_EVENT_FRAME && !event.end->is_final);
	if (code < 0)
		return code;
	if (code == 0)
		return psr_fail(err, PSR_ERR_CONNECTION, "%s: no frame within %d s; --timeout waits longer", series->server,
		                series->timeout_ms / 1000);
	if (event.type == PSR_EVENT_FAILED)
		return psr_fail(err, event.error.code, "%s", event.error.text);
	for (unsigned i = 0; i < *n_open; i++) {
		struct open_frame found = open[i];

		if (found.id != event.id)
			continue;
		open[i] = open[--*n_open];
		return series->on_frame(found.k, &event, series->userdata, err);
	}
	return psr_fail(err, PSR_ERR_INTERNAL, "a frame came that this program did not request");
}

int series_run(struct series *series, struct psr_error *err)
{
	unsigned most = psr_client_welcome(series->client)->max_open, n_open = 0;
	struct open_frame open[MAX_UNDER_WAY];
	int code = PSR_OK;

	if (most > MAX_UNDER_WAY)
		most = MAX_UNDER_WAY;
	for (uint32_t k = 0; code == PSR_OK && (k < series->n || n_open > 0);) {
		while (code == PSR_OK && k < series->n && n_open < most) {
			code = send_frame(series, k, &open[n_open].id, err);
			if (code == PSR_ERR_BUSY && n_open > 0) { /* read the frames under way first */
				code = PSR_OK;
				break;
			}
			if (code == PSR_OK)
				open[n_open++].k = k++;
		}
		if (code == PSR_OK)
			code = wait_for_one(series, open, &n_open, err);
	}
	return code;
}
