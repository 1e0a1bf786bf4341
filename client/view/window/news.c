/* Wishes to the link, and what comes of them: models, states, pictures. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "viewer.h"

#define SETTLE_NS 300000000 /* a window that has kept its size for so long gets models for it */

#define OVERSCAN 1.15 /* of the picture while it moves: a quick turn shows what was not in it before */

/* ---- what is shown ---- */

void viewer_show_model(struct viewer *viewer, const char *name)
{
	struct psr_error err;

	if (subject_set_model(&viewer->subject, name, &err) != PSR_OK)
		viewer_note(viewer, "%s", err.text);
	viewer->has_hand = 0;
	viewer->picked = -1;
	viewer->has_camera = 1; /* the command line's was for another model */
	viewer->frames_due = VIEWER_SETTLE;
}

void viewer_add_model(struct viewer *viewer, const char *name)
{
	struct psr_error err;

	if (subject_add_model(&viewer->subject, name, &err) != PSR_OK)
		viewer_note(viewer, "%s", err.text);
}

void viewer_set_stage(struct viewer *viewer, const char *name)
{
	struct psr_error err;

	viewer->subject.stage = name != NULL ? show_find(name, &err) : NULL;
	viewer->subject.stage_name = name;
	viewer->frames_due = VIEWER_SETTLE;
}

/* The camera of the command line, in the box that is known now. */
static void place_camera(struct viewer *viewer)
{
	const double aspect = (double)viewer->hand.width / viewer->hand.height;
	struct psr_camera camera;
	struct psr_error err;

	viewer->has_camera = 1;
	if (subject_camera(&camera, &viewer->subject, viewer->scene, &viewer->options.camera, aspect, &err) == PSR_OK)
		hand_set_camera(&viewer->hand, &camera);
	else
		viewer_note(viewer, "%s", err.text);
}

static void take_scene(struct viewer *viewer)
{
	struct link_scene *scene = link_scene_take(viewer->link);
	const int has_inertia = viewer->hand.has_inertia;
	const struct view_wish *camera = &viewer->options.camera;
	const double *up = camera->camera.has_up && !viewer->has_camera ? camera->camera.up : NULL;
	struct psr_error err;
	int w, h;

	if (scene == NULL)
		return;
	if (scene->n_models == 0 || viewer->subject.n_instances == 0
	    || strcmp(scene->model[0].name, viewer->subject.instance[0].link.model) != 0) {
		link_scene_free(scene); /* of a wish before this one */
		return;
	}
	link_scene_free(viewer->scene);
	viewer->scene = scene;
	if (viewer->has_hand) {
		hand_set_box(&viewer->hand, scene->box_min, scene->box_max, viewer->hand.up);
	} else if (hand_init(&viewer->hand, scene->box_min, scene->box_max, up != NULL ? up : scene->up, 35, &err) == PSR_OK) {
		SDL_GetRendererOutputSize(viewer->renderer, &w, &h);
		viewer->hand.has_inertia = has_inertia;
		hand_set_size(&viewer->hand, (uint32_t)w, (uint32_t)h);
		hand_home(&viewer->hand);
		viewer->has_hand = 1;
		if (!viewer->has_camera)
			place_camera(viewer);
	} else {
		viewer_note(viewer, "%s", err.text);
	}
	if (subject_resolve(&viewer->subject, scene, &err) != PSR_OK)
		viewer_note(viewer, "%s", err.text);
	if (subject_check_color(&viewer->subject, scene, &err) != PSR_OK)
		viewer_note(viewer, "%s", err.text);
}

uint32_t news_greater_side(const struct viewer *viewer)
{
	return viewer->hand.width > viewer->hand.height ? viewer->hand.width : viewer->hand.height;
}

void news_wish(struct viewer *viewer)
{
	struct link_instance instance[SUBJECT_INSTANCES];
	struct link_wish wish;
	uint64_t number;

	link_wish_default(&wish);
	subject_wish(&viewer->subject, &wish, instance);
	if (viewer->has_hand && clock_ns() > viewer->resized_ns + SETTLE_NS)
		viewer->model_pixels = news_greater_side(viewer);
	wish.pixels = viewer->model_pixels;
	wish.coarse_pixels = viewer->home != NULL ? HOME_COARSE_PIXELS : 0;
	wish.fps = viewer->options.fps;
	wish.overscan = OVERSCAN;
	if (viewer->has_hand) {
		wish.camera = viewer->hand.camera;
		wish.width = viewer->hand.width;
		wish.height = viewer->hand.height;
		wish.is_rest = !hand_is_moving(&viewer->hand) && viewer->drag == DRAG_NONE && !viewer->is_playing;
	}
	number = link_wish(viewer->link, &wish);
	if (number != 0)
		viewer->wish = number;
}

/* ---- news ---- */

static void say_phase(struct viewer *viewer)
{
	static const char *const stages[] = { "waiting", "reading", "sampling", "choosing", "writing", "loading" };
	const struct link_state *state = &viewer->state;
	const char *model = viewer->subject.n_instances > 0 ? viewer->subject.instance[0].link.model : "no model";
	const char *stage = stages[state->progress.stage < 6 ? state->progress.stage : 5];
	char title[2 * PSR_WIRE_MAX_NAME + 100] = "";

	if (state->phase == LINK_CONNECTING)
		snprintf(title, sizeof title, "connecting - ");
	else if (state->phase == LINK_OPENING && state->progress.total > 0)
		snprintf(title, sizeof title, "%s %.0f %% - ", stage,
		         100 * (double)state->progress.done / (double)state->progress.total);
	else if (state->phase == LINK_OPENING)
		snprintf(title, sizeof title, "%s - ", stage);
	else if (state->phase == LINK_REFUSED || state->phase == LINK_LOST)
		snprintf(title, sizeof title, "%s - ", state->phase == LINK_LOST ? "connection lost" : "refused");
	snprintf(title + strlen(title), sizeof title - strlen(title), "%s - " VIEWER_NAME, model);
	SDL_SetWindowTitle(viewer->window, title);
}

static void take_picture(struct viewer *viewer)
{
	struct link_picture *picture = link_take(viewer->link);
	struct psr_error err;

	if (picture != NULL && view_show_take(viewer->show, picture, viewer->subject.stage, &err) != PSR_OK)
		viewer_note(viewer, "%s", err.text);
}

void news_hear(struct viewer *viewer)
{
	const unsigned news = link_heard(viewer->link);
	struct psr_msg_list_entry *list;
	uint32_t n;

	bell_heard(viewer->bell);
	link_state(viewer->link, &viewer->state);
	if (news & LINK_NEWS_STATE)
		say_phase(viewer);
	if (news & LINK_NEWS_SCENE)
		take_scene(viewer);
	if (news & LINK_NEWS_PICTURE)
		take_picture(viewer);
	if (news & LINK_NEWS_LIST && (list = link_list_take(viewer->link, &n)) != NULL) {
		free(viewer->list);
		viewer->list = list;
		viewer->n_list = n;
	}
	if (news & LINK_NEWS_PROBE)
		input_surface(viewer);
	if (viewer->frames_due == 0)
		viewer->frames_due = 1;
}
