#include "viewer.h"
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/clock.h"
#include "gui.h"

#define SECOND UINT64_C(1000000000)
#define NOTE_NS (6 * SECOND)

void viewer_note(struct viewer *viewer, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	vsnprintf(viewer->note, sizeof viewer->note, format, args);
	va_end(args);
	viewer->note_ns = clock_ns() + NOTE_NS;
	viewer->frames_due = VIEWER_SETTLE;
}

int viewer_is_sharp(const struct viewer *viewer)
{
	const struct link_picture *picture = view_show_picture(viewer->show);

	return picture != NULL && picture->wish == viewer->wish && picture->is_final && viewer->shown.is_exact
	       && (!picture->is_coarse || viewer->state.error.code != PSR_OK)
	       && !viewer->is_playing && !hand_is_moving(&viewer->hand) && viewer->state.phase == LINK_LIVE
	       && viewer->model_pixels == news_greater_side(viewer);
}

/* ---- the screen ---- */

static void count(struct viewer_rate *rate, uint64_t now_ns, uint32_t n)
{
	rate->n += n;
	if (now_ns - rate->since_ns < SECOND)
		return;
	rate->per_second = (double)rate->n * 1e9 / (double)(now_ns - rate->since_ns);
	rate->since_ns = now_ns;
	rate->n = 0;
}

static void count_all(struct viewer *viewer)
{
	const uint64_t now_ns = clock_ns(), since_ns = viewer->received.since_ns;

	count(&viewer->drawn, now_ns, 1);
	count(&viewer->received, now_ns, (uint32_t)(viewer->state.n_pictures - viewer->seen_pictures));
	viewer->seen_pictures = viewer->state.n_pictures;
	if (viewer->received.since_ns == since_ns)
		return;
	viewer->bytes_per_second = (double)(viewer->state.n_bytes - viewer->bytes_since) * 1e9 / (double)(now_ns - since_ns);
	viewer->bytes_since = viewer->state.n_bytes;
}

static int upload(struct viewer *viewer, const struct psr_frame *frame)
{
	if (viewer->texture == NULL || viewer->texture_size[0] != frame->width
	    || viewer->texture_size[1] != frame->height) {
		if (viewer->texture != NULL)
			SDL_DestroyTexture(viewer->texture);
		viewer->texture = SDL_CreateTexture(viewer->renderer, SDL_PIXELFORMAT_RGB24, SDL_TEXTUREACCESS_STREAMING,
		                                    (int)frame->width, (int)frame->height);
		viewer->texture_size[0] = frame->width;
		viewer->texture_size[1] = frame->height;
	}
	return viewer->texture != NULL
	       && SDL_UpdateTexture(viewer->texture, NULL, frame->rgb, (int)(3 * frame->width)) == 0;
}

static void draw(struct viewer *viewer)
{
	const uint8_t *background = viewer->subject.background;
	struct psr_error err = { .code = PSR_OK };

	SDL_SetRenderDrawColor(viewer->renderer, background[0], background[1], background[2], 255);
	SDL_RenderClear(viewer->renderer);
	viewer->pixels = NULL;
	if (viewer->has_hand)
		viewer->pixels = view_show_draw(viewer->show, &viewer->hand.camera, viewer->hand.width, viewer->hand.height,
		                                &viewer->shown, &err);
	if (viewer->pixels != NULL)
		view_show_legend(viewer->show, viewer->scene);
	if (viewer->pixels != NULL && upload(viewer, viewer->pixels))
		SDL_RenderCopy(viewer->renderer, viewer->texture, NULL, NULL);
	else if (err.code != PSR_OK)
		viewer_note(viewer, "%s", err.text);
	count_all(viewer);
	gui_draw(viewer->gui, viewer);
	SDL_RenderPresent(viewer->renderer);
	if (viewer->wants_shot && viewer_is_sharp(viewer))
		save_shot(viewer);
}

static void resize(struct viewer *viewer)
{
	int w = 1, h = 1, points = 1;

	SDL_GetRendererOutputSize(viewer->renderer, &w, &h);
	SDL_GetWindowSize(viewer->window, &points, NULL);
	viewer->scale = points > 0 ? (double)w / points : 1;
	viewer->resized_ns = clock_ns();
	if (viewer->has_hand && w > 0 && h > 0)
		hand_set_size(&viewer->hand, (uint32_t)w, (uint32_t)h);
}

/* Milliseconds to wait for an event: until the next frame while something moves; long while a text goes out of date. */
static int patience(const struct viewer *viewer, uint64_t due_ns)
{
	const int is_live = viewer->state.phase == LINK_LIVE || viewer->state.phase == LINK_REFUSED;
	const uint64_t now_ns = clock_ns();

	if (viewer->frames_due > 0 || hand_is_moving(&viewer->hand) || viewer->is_playing || viewer->is_recording)
		return now_ns >= due_ns ? 0 : (int)((due_ns - now_ns) / 1000000 + 1);
	if (viewer->has_hand && viewer->model_pixels != news_greater_side(viewer))
		return 100;
	return !is_live || viewer->has_overlay || viewer->note_ns > now_ns ? 500 : -1;
}

static void drop(struct viewer *viewer, const char *path)
{
	struct psr_error err;

	if (connect_file(viewer, path, &err) != PSR_OK)
		viewer_note(viewer, "%s", err.text);
}

static void take_events(struct viewer *viewer, int timeout_ms)
{
	SDL_Event event;
	int got = timeout_ms < 0 ? SDL_WaitEvent(&event) : SDL_WaitEventTimeout(&event, timeout_ms);

	for (; got; got = SDL_PollEvent(&event)) {
		if (event.type == viewer->bell_event) {
			news_hear(viewer);
			continue;
		}
		viewer->frames_due = VIEWER_SETTLE;
		if (event.type == SDL_QUIT)
			viewer->is_over = 1;
		else if (event.type == SDL_WINDOWEVENT && event.window.event == SDL_WINDOWEVENT_SIZE_CHANGED)
			resize(viewer);
		else if (event.type == SDL_DROPFILE)
			drop(viewer, event.drop.file);
		else if (!gui_event(viewer->gui, &event))
			input_event(viewer, &event);
		if (event.type == SDL_DROPFILE)
			SDL_free(event.drop.file);
	}
	if (timeout_ms > 100 && viewer->frames_due == 0)
		viewer->frames_due = 1;
}

static void loop(struct viewer *viewer)
{
	SDL_DisplayMode mode = { .refresh_rate = 0 };
	uint64_t due_ns = 0, frame_ns;

	SDL_GetWindowDisplayMode(viewer->window, &mode);
	frame_ns = SECOND / (uint64_t)(mode.refresh_rate > 0 ? mode.refresh_rate : 60);
	while (!viewer->is_over) {
		uint64_t now_ns;
		int has_moved;

		take_events(viewer, patience(viewer, due_ns));
		now_ns = clock_ns();
		if (now_ns < due_ns)
			continue;
		has_moved = viewer->has_hand && hand_tick(&viewer->hand, now_ns);
		save_step(viewer, now_ns);
		news_wish(viewer);
		if (viewer->frames_due == 0 && !has_moved && !viewer->is_playing)
			continue;
		due_ns = now_ns < due_ns + frame_ns ? due_ns + frame_ns : now_ns + frame_ns; /* a late one delays no others */
		if (viewer->frames_due > 0)
			viewer->frames_due--;
		draw(viewer);
	}
}

/* ---- begin and end ---- */

/* Where there is no display SDL may draw for nobody, which is an answer only to those who asked for it. */
static int has_display(void)
{
	const char *driver = SDL_GetCurrentVideoDriver();

	return SDL_getenv("SDL_VIDEODRIVER") != NULL
	       || (strcmp(driver, "offscreen") != 0 && strcmp(driver, "dummy") != 0 && strcmp(driver, "evdev") != 0);
}

static struct viewer *open_viewer;
static SDL_threadID loop_thread;

/* Where the display goes Xlib calls exit() in each thread that notices, and SDL's wake-ups of other threads have a
   connection of their own. One thread may end the program, and frees nothing below the others: the loop's. */
static int lose_display(void *display)
{
	(void)display;
	while (SDL_ThreadID() != loop_thread)
		pause();
	if (open_viewer->is_recording)
		save_toggle_record(open_viewer);
	fprintf(stderr, VIEWER_NAME ": the display is gone\n");
	_exit(3);
}

/* The library stays loaded to the end: it calls back until then. xcb writes to a display that is gone as to a pipe. */
static void watch_display(struct viewer *viewer)
{
	void *library = strcmp(SDL_GetCurrentVideoDriver(), "x11") == 0 ? SDL_LoadObject("libX11.so.6") : NULL;
	int (*(*set_handler)(int (*)(void *)))(void *);

	if (library == NULL)
		return;
	signal(SIGPIPE, SIG_IGN);
	open_viewer = viewer;
	loop_thread = SDL_ThreadID();
	set_handler = (int (*(*)(int (*)(void *)))(void *))SDL_LoadFunction(library, "XSetIOErrorHandler");
	if (set_handler != NULL)
		set_handler(lose_display);
}

static int open_window(struct viewer *viewer, struct psr_error *err)
{
	const struct viewer_options *options = &viewer->options;
	int w, h;

	SDL_SetHint(SDL_HINT_VIDEO_ALLOW_SCREENSAVER, "1");
	SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "nearest");
	if (SDL_Init(SDL_INIT_VIDEO) != 0 || !has_display())
		return psr_fail(err, PSR_ERR_IO, "there is no display to open a window on: run it on a desktop or set $DISPLAY, "
		                "or say `psr view --term`, which draws in a terminal");
	watch_display(viewer);
	viewer->window = SDL_CreateWindow(VIEWER_NAME, SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED,
	                                  (int)options->size[0], (int)options->size[1],
	                                  SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI);
	if (viewer->window != NULL)
		viewer->renderer = SDL_CreateRenderer(viewer->window, -1, SDL_RENDERER_PRESENTVSYNC);
	if (viewer->renderer == NULL)
		return psr_fail(err, PSR_ERR_IO, "no window can be opened: %.300s", SDL_GetError());
	resize(viewer);
	viewer->resized_ns = 0;
	SDL_GetRendererOutputSize(viewer->renderer, &w, &h);
	viewer->model_pixels = (uint32_t)(w > h ? w : h);
	viewer->gui = gui_create(viewer->window, viewer->renderer, viewer->scale);
	if (viewer->gui == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the panel");
	viewer->bell_event = SDL_RegisterEvents(1);
	return PSR_OK;
}

static int open_all(struct viewer *viewer, struct psr_error *err)
{
	int code = PSR_OK;

	if (viewer->options.play != NULL)
		code = path_read(&viewer->path, viewer->options.play, err);
	if (code == PSR_OK)
		code = open_window(viewer, err);
	if (code == PSR_OK)
		code = view_show_create(&viewer->show, 0, err);
	if (code != PSR_OK)
		return code;
	if (viewer->options.file == NULL)
		return connect_to(viewer, viewer->options.address, err);
	code = connect_file(viewer, viewer->options.file, err);
	viewer->has_camera = 0; /* the command line's is for this file */
	return code;
}

static void close_all(struct viewer *viewer)
{
	connect_end(viewer);
	view_show_destroy(viewer->show);
	path_fini(&viewer->path);
	gui_destroy(viewer->gui);
	if (viewer->texture != NULL)
		SDL_DestroyTexture(viewer->texture);
	if (viewer->renderer != NULL)
		SDL_DestroyRenderer(viewer->renderer);
	if (viewer->window != NULL)
		SDL_DestroyWindow(viewer->window);
	SDL_Quit();
}

int viewer_run(const struct viewer_options *options, struct psr_error *err)
{
	struct viewer *viewer = calloc(1, sizeof *viewer);
	int code;

	if (viewer == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a viewer");
	viewer->options = *options;
	viewer->subject = options->subject;
	viewer->hand.has_inertia = options->has_inertia;
	viewer->picked = -1;
	viewer->has_overlay = !options->is_bare;
	/* Without a model the panel's list is where to choose one. */
	viewer->has_panel = !options->is_bare && options->subject.n_instances == 0 && options->file == NULL;
	code = open_all(viewer, err);
	if (code == PSR_OK) {
		if (options->play != NULL)
			save_toggle_play(viewer);
		else if (options->record != NULL)
			save_toggle_record(viewer);
		loop(viewer);
		if (viewer->is_recording)
			save_toggle_record(viewer);
	}
	close_all(viewer);
	free(viewer);
	return code;
}
