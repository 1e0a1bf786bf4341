#include "viewer.h"
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/clock.h"
#include "client/cli/cli.h"

#define OVERSCAN 1.15
#define FRAME_NS UINT64_C(33000000) /* terminals show no more */
#define CHECK_MS 200                /* a signal that another thread got is seen after so long */
#define ESCAPE_MS 30                /* a lone ESC is a key after so long */

/* ---- wishes and news ---- */

/* The camera of the command line, in the box of the scene. */
static int place_camera(struct viewer *viewer, struct psr_error *err)
{
	const double aspect = (double)viewer->canvas.width / viewer->canvas.height;
	struct psr_camera camera;
	const int code = subject_camera(&camera, &viewer->subject, viewer->scene, &viewer->options->camera, aspect, err);

	if (code == PSR_OK)
		hand_set_camera(&viewer->hand, &camera);
	return code;
}

static int take_scene(struct viewer *viewer, struct psr_error *err)
{
	struct link_scene *scene = link_scene_take(viewer->link);
	const struct view_wish *wish = &viewer->options->camera;
	struct psr_error why;
	int code = PSR_OK;

	if (scene == NULL)
		return PSR_OK;
	link_scene_free(viewer->scene);
	viewer->scene = scene;
	if (viewer->has_hand) {
		hand_set_box(&viewer->hand, scene->box_min, scene->box_max, viewer->hand.up);
		return PSR_OK;
	}
	code = hand_init(&viewer->hand, scene->box_min, scene->box_max,
	                 wish->camera.has_up ? wish->camera.up : scene->up, 35, err);
	if (code != PSR_OK)
		return code;
	hand_set_size(&viewer->hand, viewer->canvas.width, viewer->canvas.height);
	hand_home(&viewer->hand);
	viewer->has_hand = 1;
	code = place_camera(viewer, err);
	if (code == PSR_OK)
		code = subject_resolve(&viewer->subject, scene, err);
	if (code == PSR_OK && subject_check_color(&viewer->subject, scene, &why) != PSR_OK)
		snprintf(viewer->note, sizeof viewer->note, "%.250s", why.text);
	return code;
}

static void say_wish(struct viewer *viewer)
{
	static struct link_instance instance[SUBJECT_INSTANCES]; /* large */
	const struct canvas *canvas = &viewer->canvas;
	struct link_wish wish;
	uint64_t number;

	link_wish_default(&wish);
	subject_wish(&viewer->subject, &wish, instance);
	wish.pixels = canvas->width > canvas->height ? canvas->width : canvas->height;
	wish.coarse_pixels = viewer->options->coarse_pixels;
	wish.fps = viewer->options->fps;
	wish.overscan = OVERSCAN;
	if (viewer->has_hand) {
		wish.camera = viewer->hand.camera;
		wish.width = canvas->width;
		wish.height = canvas->height;
		wish.is_rest = !hand_is_moving(&viewer->hand);
	}
	number = link_wish(viewer->link, &wish);
	if (number != 0)
		viewer->wish = number;
}

static int hear(struct viewer *viewer, struct psr_error *err)
{
	const unsigned news = link_heard(viewer->link);
	struct link_picture *picture = link_take(viewer->link);
	int code = PSR_OK;

	link_state(viewer->link, &viewer->state);
	if (news & LINK_NEWS_SCENE)
		code = take_scene(viewer, err);
	if (code == PSR_OK && picture != NULL)
		code = view_show_take(viewer->show, picture, viewer->subject.stage, err);
	else
		link_release(picture);
	viewer->must_draw |= news != 0;
	return code;
}

/* ---- the screen ---- */

/* What stands in the last row. It says `sharp` once the picture is the wished one to the bit. */
static void say_status(const struct viewer *viewer, char *text, size_t n)
{
	static const char *const stages[] = { "waiting", "reading", "sampling", "choosing", "writing", "loading" };
	const struct link_state *state = &viewer->state;
	const struct psr_msg_progress *progress = &state->progress;
	const struct link_picture *picture = view_show_picture(viewer->show);
	const char *model = viewer->subject.n_instances > 0 ? viewer->subject.instance[0].link.model : "";
	const int is_newest = picture != NULL && picture->wish == viewer->wish;
	const int is_sharp = is_newest && picture->is_sharp && viewer->shown.is_exact;
	char part[64] = "";

	if (progress->total > 0)
		snprintf(part, sizeof part, " %.0f %%", 100 * (double)progress->done / (double)progress->total);
	if (state->phase == LINK_CONNECTING)
		snprintf(text, n, "connecting to %s", viewer->options->address);
	else if (state->phase == LINK_OPENING)
		snprintf(text, n, "%s: %s%s", state->model, stages[progress->stage % 6], part);
	else if (state->phase == LINK_LOST)
		snprintf(text, n, "connection lost, trying again: %s", state->error.text);
	else if (state->phase == LINK_REFUSED || state->error.code != PSR_OK)
		snprintf(text, n, "%s", state->error.text);
	else if (viewer->note[0] != '\0')
		snprintf(text, n, "%s", viewer->note);
	else if (state->is_refining)
		snprintf(text, n, "%s: a finer model is being built: %s%s", model, stages[progress->stage % 6], part);
	else
		snprintf(text, n, "%s  %s  (? help, q quit)", model, is_sharp ? "sharp" : "moving");
}

static void draw_status(struct viewer *viewer)
{
	char text[sizeof viewer->status], line[sizeof text + 64];

	say_status(viewer, text, sizeof text);
	if (strcmp(text, viewer->status) == 0)
		return;
	strcpy(viewer->status, text);
	text[viewer->tty.cols < (int)sizeof text ? (size_t)viewer->tty.cols - 1 : sizeof text - 1] = '\0';
	for (char *at = text; *at != '\0'; at++) /* names come from a server */
		if ((unsigned char)*at < ' ' || *at == 127)
			*at = '?';
	snprintf(line, sizeof line, "\033[%d;1H\033[0m%s\033[K", viewer->tty.rows, text);
	tty_write(line, strlen(line));
}

static int draw(struct viewer *viewer, struct psr_error *err)
{
	const struct canvas *canvas = &viewer->canvas;
	const struct psr_frame *frame = NULL;
	struct psr_error why = { .code = PSR_OK };

	if (viewer->has_hand)
		frame = view_show_draw(viewer->show, &viewer->hand.camera, canvas->width, canvas->height, &viewer->shown, &why);
	if (why.code != PSR_OK)
		return psr_fail(err, why.code, "%s", why.text);
	if (frame != NULL) {
		view_show_legend(viewer->show, viewer->scene);
		canvas_draw(&viewer->canvas, frame);
		viewer->status[0] = '\0'; /* a terminal may have scrolled */
	}
	draw_status(viewer);
	viewer->must_draw = 0;
	return PSR_OK;
}

/* Another size of the terminal is another picture. */
static int resize(struct viewer *viewer, struct psr_error *err)
{
	const int cols = viewer->tty.cols, rows = viewer->tty.rows;
	int code;

	tty_measure(&viewer->tty);
	if (cols == viewer->tty.cols && rows == viewer->tty.rows)
		return PSR_OK;
	canvas_close(&viewer->canvas);
	code = canvas_open(&viewer->canvas, &viewer->tty, viewer->options->way, err);
	if (code != PSR_OK)
		return code;
	if (viewer->has_hand)
		hand_set_size(&viewer->hand, viewer->canvas.width, viewer->canvas.height);
	tty_write("\033[2J", 4);
	viewer->must_draw = 1;
	return PSR_OK;
}

/* ---- the loop ---- */

static void take_input(struct viewer *viewer, int is_late)
{
	struct input_event event;

	while (tty_next(&viewer->tty, &event, is_late))
		keys_event(viewer, &event);
}

static int patience_ms(const struct viewer *viewer, uint64_t drawn_ns)
{
	const uint64_t now_ns = clock_ns();

	if (viewer->tty.n_in > 0)
		return ESCAPE_MS;
	if (!viewer->must_draw && !(viewer->has_hand && hand_is_moving(&viewer->hand)))
		return CHECK_MS;
	return now_ns >= drawn_ns + FRAME_NS ? 0 : (int)((drawn_ns + FRAME_NS - now_ns) / 1000000 + 1);
}

static int loop(struct viewer *viewer, struct psr_error *err)
{
	struct pollfd fds[2] = { { .fd = STDIN_FILENO, .events = POLLIN },
		                     { .fd = link_fd(viewer->link), .events = POLLIN } };
	uint64_t drawn_ns = 0;
	int code = PSR_OK;

	while (code == PSR_OK && !viewer->is_over && !tty_is_ended()) {
		const int n = poll(fds, 2, patience_ms(viewer, drawn_ns));

		if (n > 0 && fds[0].revents != 0 && !tty_read(&viewer->tty))
			break;
		take_input(viewer, n == 0);
		code = resize(viewer, err);
		if (code == PSR_OK && n > 0 && fds[1].revents != 0)
			code = hear(viewer, err);
		if (viewer->has_hand && hand_tick(&viewer->hand, clock_ns()))
			viewer->must_draw = 1;
		say_wish(viewer);
		if (code != PSR_OK || !viewer->must_draw || clock_ns() < drawn_ns + FRAME_NS)
			continue;
		code = draw(viewer, err);
		drawn_ns = clock_ns();
	}
	return code;
}

static int open_all(struct viewer *viewer, struct psr_error *err)
{
	int code = tty_open(&viewer->tty, err);

	if (code == PSR_OK)
		code = canvas_open(&viewer->canvas, &viewer->tty, viewer->options->way, err);
	if (code == PSR_OK)
		code = view_show_create(&viewer->show, 0, err);
	if (code == PSR_OK)
		code = link_open(&viewer->link, viewer->options->address, VIEWER_NAME " " PSR_VERSION, err);
	return code;
}

int viewer_run(const struct viewer_options *options, struct psr_error *err)
{
	struct viewer *viewer = calloc(1, sizeof *viewer);
	int code;

	if (viewer == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a viewer");
	viewer->options = options;
	viewer->subject = options->subject;
	viewer->hand.has_inertia = 1;
	viewer->must_draw = 1;
	code = open_all(viewer, err);
	if (code == PSR_OK)
		code = loop(viewer, err);
	tty_close();
	link_close(viewer->link);
	link_scene_free(viewer->scene);
	view_show_destroy(viewer->show);
	canvas_close(&viewer->canvas);
	free(viewer);
	return code;
}
