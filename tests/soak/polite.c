/* Clients that keep to the protocol: psrd must serve each of them, whatever the others do. */
#include <stdlib.h>
#include <string.h>
#include "psr/client.h"
#include "soak.h"

#define MOST_REQUESTS 256 /* that are unanswered */
#define MOVING_VIEW 3

struct request {
	uint32_t id; /* 0: none, or ended */
	uint16_t view;
	unsigned next_pass;
	int has_begun; /* a frame: its end has not come */
	int is_cancelled;
	struct psr_msg_frame asked;
};

struct viewer {
	struct client *client;
	struct psr_client *connection;
	struct psr_msg_opened opened;
	struct request request[MOST_REQUESTS];
	unsigned n_open;
	unsigned n_unacknowledged[16];
	struct { uint32_t id; uint16_t pass, view; } held; /* shown, and not yet acknowledged; id 0: none */
	uint32_t drawn; /* the last id of which a frame came, or that was told to try again */
	uint64_t heard_ns;
	double angle;
};

static unsigned below(struct viewer *v, unsigned n)
{
	return random_below(&v->client->random, n);
}

/* ---- events ---- */

static struct request *find(struct viewer *v, uint32_t id)
{
	for (unsigned i = 0; i < MOST_REQUESTS; i++)
		if (v->request[i].id == id)
			return &v->request[i];
	return NULL;
}

static void end(struct viewer *v, struct request *request)
{
	if (request->has_begun) /* nothing is to be acknowledged any more */
		v->n_unacknowledged[request->view]--;
	request->id = 0;
	v->n_open--;
	v->client->n_ends++;
}

static void acknowledge_held(struct viewer *v)
{
	if (v->held.id == 0)
		return;
	if (psr_client_ack(v->connection, v->held.id, v->held.pass, NULL) == PSR_OK)
		v->n_unacknowledged[v->held.view]--;
	v->held.id = 0;
}

/* Planes whose pixels must have a hash of FRAME_END. */
static unsigned lossless(const struct psr_msg_frame_begin *begin)
{
	unsigned planes = begin->planes;

	if (begin->color_codec == PSR_CODEC_JPEG)
		planes &= ~(1u << PSR_PLANE_COLOR);
	if (begin->depth_format > PSR_WIRE_DEPTH_F32)
		planes &= ~(1u << PSR_PLANE_DEPTH);
	return planes;
}

static int is_same_camera(const struct psr_camera *a, const struct psr_camera *b)
{
	return memcmp(a->eye, b->eye, sizeof a->eye) == 0 && memcmp(a->target, b->target, sizeof a->target) == 0
	       && memcmp(a->up, b->up, sizeof a->up) == 0 && a->fov_y == b->fov_y && a->near_z == b->near_z;
}

static void take_frame(struct viewer *v, struct request *request, const struct psr_event *event)
{
	const struct psr_msg_frame_begin *begin = event->begin;

	v->client->n_frames++;
	v->client->n_on_base += begin->base != 0;
	v->client->n_sharp += begin->pass > 0;
	request->has_begun = 0;
	if (!is_same_camera(&begin->camera, &request->asked.camera))
		soak_fail("client %u: frame %u has another camera than its request", v->client->number, event->id);
	if (begin->pass != request->next_pass++)
		soak_fail("client %u: pass %u of frame %u comes as number %u", v->client->number, begin->pass, event->id,
		          request->next_pass - 1);
	if (!(request->asked.flags & PSR_WIRE_FRAME_NO_HASHES) && (lossless(begin) & ~event->checked) != 0)
		soak_fail("client %u: planes %x of frame %u have their hashes, and not all of %x", v->client->number,
		          event->checked, event->id, lossless(begin));
	if (request->view > 0) { /* at most one picture waits while the next one comes */
		const uint16_t view = request->view;

		acknowledge_held(v);
		v->held.id = event->id;
		v->held.pass = begin->pass;
		v->held.view = view;
		if (event->end->is_final || below(v, 2))
			acknowledge_held(v);
	}
	v->drawn = event->id;
	if (event->end->is_final)
		end(v, request);
}

static void take_failure(struct viewer *v, struct request *request, const struct psr_event *event)
{
	if (event->error.code == PSR_ERR_BUSY) { /* models came and went for too long: it may try again */
		v->client->n_busy++;
		v->drawn = event->id;
	} else if (!(event->error.code == PSR_ERR_CANCELLED && (request->is_cancelled || soak.is_ending))) {
		soak_fail("client %u: frame %u of %ux%u failed: %s", v->client->number, event->id, request->asked.width,
		          request->asked.height, event->error.text);
	}
	end(v, request);
}

static void take(struct viewer *v, const struct psr_event *event)
{
	struct request *request = find(v, event->id);

	if (request == NULL) {
		soak_fail("client %u: an event of id %u, which is not open (%s)", v->client->number, event->id,
		          event->type == PSR_EVENT_FAILED ? event->error.text : "no error");
		return;
	}
	switch (event->type) {
	case PSR_EVENT_BEGIN:
		request->has_begun = 1;
		if (++v->n_unacknowledged[request->view] > 2)
			soak_fail("client %u: a third frame begins in view %u", v->client->number, request->view);
		break;
	case PSR_EVENT_FRAME:
		take_frame(v, request, event);
		break;
	case PSR_EVENT_SUPERSEDED:
		v->client->n_superseded++;
		end(v, request);
		break;
	case PSR_EVENT_FAILED:
		take_failure(v, request, event);
	}
}

/* Takes events for so long. 0: the connection is lost, or was silent for too long. */
static int attend(struct viewer *v, unsigned ms)
{
	const uint64_t end_ns = clock_ns() + ms * UINT64_C(1000000);
	struct psr_event event;
	struct psr_error err;
	int code;

	do {
		const uint64_t now_ns = clock_ns();
		const int wait_ms = now_ns < end_ns ? (int)((end_ns - now_ns) / 1000000) : 0;

		code = psr_client_wait(v->connection, wait_ms, &event, &err);
		if (code > 0) {
			v->heard_ns = clock_ns();
			take(v, &event);
		}
	} while (code > 0 && clock_ns() < end_ns);
	if (code < 0 && !soak.is_ending)
		soak_fail("client %u: dropped: %s", v->client->number, err.text);
	if (v->n_open > 0 && clock_ns() - v->heard_ns > (uint64_t)soak.patience_ms * 1000000) {
		soak_fail("client %u: no event for %d ms, %u requests are open", v->client->number, (int)soak.patience_ms,
		          v->n_open);
		return 0;
	}
	return code >= 0;
}

static void cancel(struct viewer *v, struct request *request)
{
	if (psr_client_cancel(v->connection, request->id, NULL) == PSR_OK)
		request->is_cancelled = 1;
}

/* Refinement comes when nobody else wants anything: who waits for nothing else may give it up. */
static int finish(struct viewer *v, unsigned rest_ms)
{
	const uint64_t rest_ns = clock_ns() + rest_ms * UINT64_C(1000000);

	while (v->n_open > 0) {
		for (unsigned i = 0; i < MOST_REQUESTS && clock_ns() > rest_ns; i++)
			if (v->request[i].id != 0 && v->request[i].next_pass > 0 && !v->request[i].is_cancelled)
				cancel(v, &v->request[i]);
		acknowledge_held(v);
		if (!attend(v, 5))
			return 0;
	}
	acknowledge_held(v);
	return 1;
}

/* ---- requests ---- */

static int send_scene(struct viewer *v)
{
	struct psr_msg_scene *scene = calloc(1, sizeof *scene);
	struct psr_error err;
	int code;

	if (scene == NULL)
		return 0;
	scene->ambient = 0.2;
	scene->n_instances = (uint16_t)(1 + below(v, 3));
	for (unsigned i = 0; i < scene->n_instances; i++)
		scene->instance[i] = (struct psr_msg_instance){ .handle = v->opened.handle, .rotation = { 0, 0, 0, 1 },
			.scale = 1, .translation = { 0.4 * i, 0, 0 } };
	scene->n_lights = 1;
	scene->light[0] = (struct psr_msg_light){ .kind = PSR_WIRE_LIGHT_DIRECTIONAL, .color = { 255, 240, 220 },
		.flags = below(v, 4) == 0 ? PSR_WIRE_LIGHT_SHADOW : 0, .intensity = 1,
		.direction = { random_in(&v->client->random, -1, 1), -1, -1 } };
	code = psr_client_scene(v->connection, scene, NULL, &err);
	if (code != PSR_OK && !soak.is_ending)
		soak_fail("client %u: no scene: %s", v->client->number, err.text);
	free(scene);
	return code == PSR_OK;
}

static int arrive(struct viewer *v, struct client *client, const char *address)
{
	const char *model = soak_model[random_below(&client->random, SOAK_MODELS)];
	struct psr_error err = { 0 };
	int code;

	memset(v, 0, sizeof *v);
	v->client = client;
	v->heard_ns = clock_ns();
	client->n_runs++;
	code = psr_client_connect(&v->connection, address, "soak", NULL, (int)soak.patience_ms, &err);
	if (code == PSR_OK)
		code = psr_client_open(v->connection, model, (int)soak.patience_ms, &v->opened, &err);
	if (code == PSR_OK)
		return send_scene(v);
	if (!soak.is_ending)
		soak_fail("client %u: cannot come in: %s", client->number, err.text);
	return 0;
}

static struct psr_msg_frame make_frame(struct viewer *v, unsigned width, unsigned height)
{
	struct psr_msg_frame frame = { .width = width, .height = height, .planes = 1u << PSR_PLANE_COLOR,
		.color_codec = PSR_CODEC_ZSTD };

	psr_camera_frame(&frame.camera, v->opened.box_min, v->opened.box_max, v->opened.up, 0.6, (double)width / height);
	v->angle += 0.05;
	frame.camera.eye[0] += v->angle * (v->opened.box_max[0] - v->opened.box_min[0]) * 0.05;
	if (below(v, 2)) {
		frame.color_codec = PSR_CODEC_JPEG;
		frame.color_quality = (uint8_t)(20 + below(v, 80));
	}
	if (below(v, 3) == 0) {
		frame.planes |= 1u << PSR_PLANE_DEPTH;
		frame.depth_format = (uint8_t)(PSR_WIRE_DEPTH_F32 + below(v, 3));
		frame.depth_codec = below(v, 2) ? PSR_CODEC_ZSTD : PSR_CODEC_RAW;
		if (frame.depth_format != PSR_WIRE_DEPTH_F32) {
			frame.depth_min = 0.5;
			frame.depth_max = 50;
		}
	}
	if (below(v, 4) == 0) {
		frame.planes |= 1u << PSR_PLANE_ID | 1u << PSR_PLANE_NORMAL;
		frame.data_codec = PSR_CODEC_ZSTD;
	}
	if (below(v, 5) == 0)
		frame.flags = PSR_WIRE_FRAME_NO_HASHES;
	return frame;
}

/* 1: asked, or the connection has room for no more; 0: it is lost. */
static int ask(struct viewer *v, uint16_t view, const struct psr_msg_frame *frame, uint32_t *id)
{
	struct request *request = find(v, 0);
	struct psr_error err;
	int code;

	*id = 0;
	if (request == NULL)
		return 1;
	code = view > 0 ? psr_client_frame_in(v->connection, view, frame, id, &err)
	                : psr_client_frame(v->connection, frame, id, &err);
	if (code == PSR_ERR_BUSY)
		return 1;
	if (code != PSR_OK) {
		if (!soak.is_ending)
			soak_fail("client %u: cannot ask: %s", v->client->number, err.text);
		return 0;
	}
	if (v->n_open++ == 0)
		v->heard_ns = clock_ns();
	*request = (struct request){ .id = *id, .view = view, .asked = *frame };
	return 1;
}

static void leave(struct viewer *v)
{
	psr_client_close(v->connection);
	v->connection = NULL;
}

/* ---- lives ---- */

/* A movement, and what follows at rest: the last camera is drawn, and all that came before has ended. */
static int move(struct viewer *v, unsigned width, unsigned height)
{
	const unsigned n = 10 + below(v, 40), scale = 1u << below(v, 3), passes = below(v, 3) == 0;
	struct psr_msg_frame frame;
	uint32_t last = 0, id;

	for (unsigned i = 0; i < n; i++) {
		frame = make_frame(v, width, height);
		frame.budget = PSR_WIRE_BUDGET_SETTINGS;
		frame.settings = (struct psr_msg_settings){ .scale = (uint8_t)scale, .spacing_px = 1 };
		if (frame.planes == 1u << PSR_PLANE_COLOR)
			frame.pass_limit = (uint16_t)passes;
		frame.flags |= below(v, 2) ? PSR_WIRE_FRAME_SHARP : 0;
		frame.base = below(v, 8) ? psr_client_base(v->connection, MOVING_VIEW) : 0;
		if (!ask(v, MOVING_VIEW, &frame, &id))
			return 0;
		last = id != 0 ? id : last;
		if (below(v, 30) == 0)
			send_scene(v);
		if (below(v, 30) == 0 && i + 1 < n && id != 0)
			cancel(v, find(v, id));
		if (below(v, 60) == 0 && (psr_client_pause(v->connection, MOVING_VIEW, 1, NULL) != PSR_OK || !attend(v, 30)
		                          || psr_client_pause(v->connection, MOVING_VIEW, 0, NULL) != PSR_OK))
			return 0;
		if (!attend(v, 1 + below(v, 25)))
			return 0;
	}
	if (!finish(v, 200 + below(v, 800)))
		return 0;
	if (last != 0 && v->drawn != last && !soak.is_ending)
		soak_fail("client %u: frame %u was drawn, and %u, the last of the movement, was not", v->client->number, v->drawn,
		          last);
	return 1;
}

static void move_over(struct client *client, const char *address, unsigned width, unsigned height)
{
	struct viewer *v = malloc(sizeof *v);

	while (v != NULL && !soak.is_over) {
		int goes_on = arrive(v, client, address);

		for (unsigned n = 3 + random_below(&client->random, 6); goes_on && n > 0 && !soak.is_over; n--)
			goes_on = move(v, width, height);
		leave(v);
		if (!goes_on)
			break;
	}
	free(v);
}

void polite_move(struct client *client)
{
	static const unsigned size[4][2] = { { 128, 128 }, { 320, 240 }, { 64, 48 }, { 400, 300 } };
	const unsigned *s = size[client->number % 4 < 2 ? 0 : client->number / 4 % 4];

	move_over(client, soak.address, s[0], s[1]);
}

void polite_slowly(struct client *client)
{
	move_over(client, soak.relay_address, 160, 120);
}

void polite_stay(struct client *client)
{
	struct viewer *v = malloc(sizeof *v);
	int goes_on = v != NULL && arrive(v, client, soak.address);

	while (goes_on && !soak.is_over) {
		const unsigned n = client->number % 5 == 0 ? 64 : 1 + below(v, 6);

		for (unsigned i = 0; i < n && goes_on; i++) {
			struct psr_msg_frame frame = make_frame(v, 16 + below(v, 300), 16 + below(v, 200));
			uint32_t id;

			if (frame.planes == 1u << PSR_PLANE_COLOR)
				frame.pass_limit = below(v, 4) == 0;
			goes_on = ask(v, 0, &frame, &id);
			if (below(v, 10) == 0 && goes_on && id != 0)
				cancel(v, find(v, id));
		}
		goes_on = goes_on && finish(v, 1000) && (below(v, 10) || send_scene(v));
	}
	if (v != NULL)
		leave(v);
	free(v);
}

void polite_visit(struct client *client)
{
	struct viewer *v = malloc(sizeof *v);

	while (v != NULL && !soak.is_over) {
		struct psr_msg_list_entry *entries = NULL;
		struct psr_msg_preset *presets = NULL;
		struct psr_msg_frame frame;
		struct psr_error err;
		uint32_t n, id;
		int code, goes_on = arrive(v, client, soak.address);

		code = !goes_on ? PSR_ERR_CONNECTION : psr_client_list(v->connection, &entries, &n, (int)soak.patience_ms, &err);
		if (code == PSR_OK && n != SOAK_MODELS)
			soak_fail("client %u: the list has %u models", client->number, n);
		if (code == PSR_OK)
			code = psr_client_presets(v->connection, v->opened.handle, &presets, &n, (int)soak.patience_ms, &err);
		if (goes_on && code != PSR_OK && !soak.is_ending)
			soak_fail("client %u: no list, or presets: %s", client->number, err.text);
		free(entries);
		free(presets);
		if (code == PSR_OK) {
			frame = make_frame(v, 100, 80);
			goes_on = ask(v, 0, &frame, &id) && finish(v, 1000);
		}
		leave(v);
		if (!goes_on || code != PSR_OK)
			break;
		soak_sleep_ms(random_below(&client->random, 50));
	}
	free(v);
}
