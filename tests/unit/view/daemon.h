/* For tests of what a viewer stands on: a psrd on a Unix socket, a link to it, and waiting for what comes. */
#ifndef TESTS_UNIT_VIEW_DAEMON_H
#define TESTS_UNIT_VIEW_DAEMON_H

#include "client/view/link.h"
#include "tests/unit/server/fixture.h"
#include "psr/shot.h"

static char folder[PATH_MAX], address[PATH_MAX];
static struct daemon psrd;
static struct link *link_;
static uint64_t last_wish;

/* Further options, NULL at the end. */
static inline void start_psrd(const char *const *more)
{
	const char *argv[32] = { NULL, "--listen", address, "--models", folder, "--cache", NULL, "--threads", "2" };
	char path[PATH_MAX], cache[PATH_MAX + 16];

	daemon_path(path, "psrd");
	snprintf(cache, sizeof cache, "%s/.cache", folder);
	argv[0] = path;
	argv[6] = cache;
	for (int i = 0; more != NULL && more[i] != NULL; i++)
		argv[9 + i] = more[i];
	daemon_spawn(&psrd, argv);
	daemon_wait_ready(&psrd);
}

static inline void kill_psrd(void)
{
	kill(psrd.pid, SIGKILL);
	daemon_wait(&psrd);
}

static inline int set_up(void **state)
{
	(void)state;
	folder_make(folder);
	snprintf(address, sizeof address, "unix:%.200s/socket", folder);
	plate_write(folder, "plate.psr", 0x2040c0);
	teapot_write(folder);
	start_psrd(NULL);
	return 0;
}

static inline int tear_down(void **state)
{
	(void)state;
	daemon_stop(&psrd);
	folder_remove(folder);
	return 0;
}

static inline void open_link(const char *to)
{
	struct psr_error err;

	if (link_open(&link_, to, "test", &err) != PSR_OK)
		fail_msg("%s", err.text);
}

/* Of one model where it stands, seen from a place that `angle` (radians) and `zoom` choose. */
static inline void wish_default(struct link_wish *wish, struct link_instance *instance, const char *model)
{
	link_wish_default(wish);
	memset(instance, 0, sizeof *instance);
	strcpy(instance->model, model);
	instance->rotation[3] = instance->scale = 1;
	wish->instance = instance;
	wish->n_instances = 1;
	wish->width = 320;
	wish->height = 240;
	wish->camera = (struct psr_camera){ .eye = { 0, 3, 12 }, .target = { 0, 1, 0 }, .up = { 0, 1, 0 },
		                                .kind = PSR_CAMERA_PERSPECTIVE, .fov_y = 0.6, .near_z = 0.1 };
}

static inline void turn_camera(struct link_wish *wish, double angle, double distance)
{
	wish->camera.eye[0] = distance * sin(angle);
	wish->camera.eye[2] = distance * cos(angle);
}

static inline void say_wish(const struct link_wish *wish)
{
	last_wish = link_wish(link_, wish);
	assert_true(last_wish > 0);
}

static inline void wait_news(int ms)
{
	struct pollfd waits = { .fd = link_fd(link_), .events = POLLIN };

	poll(&waits, 1, ms);
	link_heard(link_);
}

static inline void wait_phase(enum link_phase phase, struct link_state *state)
{
	const int64_t end = clock_ms() + PATIENCE_MS;

	for (;;) {
		link_state(link_, state);
		if (state->phase == phase)
			return;
		if (clock_ms() > end)
			fail_msg("the link is in phase %d and not %d: %s", state->phase, phase, state->error.text);
		wait_news(20);
	}
}

/* The sharp picture of the last wish; pictures before it are of ever later wishes. */
static inline struct link_picture *wait_sharp(void)
{
	const int64_t end = clock_ms() + PATIENCE_MS;
	uint64_t wish = 0;
	int was_sharp = 0;

	for (;;) {
		struct link_picture *picture = link_take(link_);
		struct link_state state;

		if (picture != NULL) {
			assert_true(picture->wish >= wish && picture->wish <= last_wish);
			if (picture->wish > wish)
				was_sharp = 0;
			assert_true(picture->is_sharp >= was_sharp);
			was_sharp = picture->is_sharp;
			wish = picture->wish;
			if (wish == last_wish && picture->is_sharp)
				return picture;
			link_release(picture);
			continue;
		}
		if (clock_ms() > end) {
			link_state(link_, &state);
			fail_msg("no sharp picture of wish %lu: the last one was of %lu; phase %d, %s", (unsigned long)last_wish,
			         (unsigned long)wish, state.phase, state.error.text);
		}
		wait_news(20);
	}
}

/* The picture that libpsr draws here. */
static inline void draw_here(struct psr_frame *frame, const struct link_wish *wish)
{
	struct psr_model *model;
	struct psr_shot shot;
	struct psr_error err;
	char path[2 * PATH_MAX];

	snprintf(path, sizeof path, "%s/%s.psr", folder, wish->instance[0].model);
	assert_int_equal(psr_model_map(&model, path, NULL), PSR_OK);
	psr_shot_default(&shot, wish->width, wish->height);
	shot.settings.smooth = wish->is_smooth;
	shot.settings.with_splats = wish->with_splats;
	shot.settings.spacing_px = wish->spacing_px;
	shot.planes = wish->planes;
	shot.camera = &wish->camera;
	shot.ambient = wish->ambient;
	memcpy(shot.background, wish->background, sizeof shot.background);
	if (psr_shot_draw(&shot, model, frame, &err) != PSR_OK)
		fail_msg("%s", err.text);
	psr_model_unref(model);
}

static inline void assert_drawn_as_wished(const struct link_picture *picture, const struct link_wish *wish)
{
	const size_t n = (size_t)wish->width * wish->height;
	struct psr_frame here;

	draw_here(&here, wish);
	assert_int_equal(picture->frame.width, wish->width);
	assert_int_equal(picture->frame.height, wish->height);
	assert_memory_equal(picture->frame.rgb, here.rgb, 3 * n);
	assert_memory_equal(picture->frame.depth, here.depth, n * sizeof *here.depth);
	psr_frame_free(&here);
}

static inline void assert_last_is_shown(const struct link_wish *wish)
{
	struct link_picture *picture = wait_sharp();

	assert_drawn_as_wished(picture, wish);
	link_release(picture);
}

#endif
