#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include "base/srgb.h"
#include "budget.h"
#include "report.h"

#define TIMEOUT_MS 600000 /* of a picture */

const struct psr_msg_settings budget_rungs[BUDGET_RUNGS] = {
	{ .scale = 4, .spacing_px = 1 }, { .scale = 2, .spacing_px = 1 },
	{ .scale = 1, .spacing_px = 2 }, { .scale = 1, .spacing_px = 1.5 }, { .scale = 1, .spacing_px = 1 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1 }, { .scale = 1, .spacing_px = 1, .smooth = 2 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 1 }, { .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 2 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 3 }, { .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 4 },
};

static void must(int code, const char *what, const struct psr_error *err)
{
	if (code < 0)
		report_die(what, err->text);
}

static void send_scene(struct budget_link *link, uint32_t handle, uint32_t slot)
{
	struct psr_msg_scene *scene = report_alloc(1, sizeof *scene);
	const struct psr_light *light = &link->view[slot].light;
	struct psr_scene is;
	struct psr_error err;

	ladder_scene(&is, &link->view[slot], NULL);
	scene->slot = (uint16_t)slot;
	scene->ambient = is.ambient[0];
	for (int c = 0; c < 3; c++)
		scene->background[c] = psr_linear_to_srgb((float)is.background[c]);
	scene->n_instances = scene->n_lights = 1;
	scene->instance[0] = (struct psr_msg_instance){ .handle = handle, .representation = PSR_WIRE_REP_BLOCKS,
		                                            .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	scene->light[0] = (struct psr_msg_light){
		.kind = PSR_WIRE_LIGHT_DIRECTIONAL, .flags = light->casts_shadow ? PSR_WIRE_LIGHT_SHADOW : 0,
		.color = { 255, 255, 255 }, .intensity = light->color[0],
		.direction = { light->direction[0], light->direction[1], light->direction[2] },
	};
	must(psr_client_scene(link->client, scene, NULL, &err), "a scene", &err);
	free(scene);
}

void budget_link_open(struct budget_link *link, const char *address, const char *model, const struct ladder_view *view)
{
	struct psr_msg_opened opened;
	struct psr_error err;

	*link = (struct budget_link){ .view = view };
	must(psr_client_connect(&link->client, address, "bench-budget", NULL, TIMEOUT_MS, &err), address, &err);
	must(psr_client_open(link->client, model, TIMEOUT_MS, &opened, &err), model, &err);
	for (uint32_t i = 0; i < BUDGET_VIEWS; i++)
		send_scene(link, opened.handle, i);
}

void budget_link_close(struct budget_link *link)
{
	psr_client_close(link->client);
}

void budget_link_request(struct psr_msg_frame *frame, const struct budget_link *link, uint32_t view)
{
	*frame = (struct psr_msg_frame){
		.slot = (uint16_t)view, .width = BUDGET_SIDE, .height = BUDGET_SIDE, .planes = 1u << PSR_PLANE_COLOR,
		.color_codec = PSR_CODEC_RAW, .camera = link->view[view].camera,
	};
}

void budget_link_draw(struct psr_event *event, struct budget_link *link, const struct psr_msg_frame *frame)
{
	struct psr_error err;
	uint32_t id;

	must(psr_client_frame(link->client, frame, &id, &err), "a frame", &err);
	must(psr_client_wait(link->client, TIMEOUT_MS, event, &err) == 1 ? PSR_OK : PSR_ERR_CONNECTION, "a picture", &err);
	if (event->type != PSR_EVENT_FRAME)
		report_die("a picture", event->error.text);
}

double budget_rmse_of(const struct psr_frame *picture, const struct ladder_view *view)
{
	const size_t n = (size_t)view->width * view->height * 3;
	uint64_t sum = 0;

	for (size_t i = 0; i < n; i++) {
		const int d = picture->rgb[i] - view->truth[i];

		sum += (uint64_t)(d * d);
	}
	return sqrt((double)sum / (3.0 * (double)(view->n_covered > 0 ? view->n_covered : 1)));
}

double budget_entry_ms(const struct psr_msg_frame_end *end, unsigned id)
{
	for (unsigned i = 0; i < end->n_entries; i++)
		if (end->entry[i].id == id)
			return (double)end->entry[i].ns * 1e-6;
	return 0;
}

/* ---- another client ---- */

struct budget_other {
	struct budget_link link;
	pthread_t thread;
	atomic_int is_over;
};

static void *draw_on(void *userdata)
{
	struct budget_other *other = userdata;
	struct psr_msg_frame frame;
	struct psr_event event;

	budget_link_request(&frame, &other->link, 0);
	while (!atomic_load(&other->is_over))
		budget_link_draw(&event, &other->link, &frame);
	return NULL;
}

struct budget_other *budget_other_start(const char *address, const char *model, const struct ladder_view *view)
{
	struct budget_other *other = report_alloc(1, sizeof *other);

	budget_link_open(&other->link, address, model, view);
	if (pthread_create(&other->thread, NULL, draw_on, other) != 0)
		report_die("another client", "cannot have a thread");
	return other;
}

void budget_other_stop(struct budget_other *other)
{
	if (other == NULL)
		return;
	atomic_store(&other->is_over, 1);
	pthread_join(other->thread, NULL);
	budget_link_close(&other->link);
	free(other);
}
