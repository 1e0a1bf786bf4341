/* For tests of the daemon: a folder with a small model, a running psrd, and a peer that speaks raw bytes to it. */
#ifndef SERVER_FIXTURE_H
#define SERVER_FIXTURE_H

#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <arpa/inet.h>
#include <limits.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>
#include "base/clock.h"
#include "model/blocks.h"
#include "proto/proto.h"

/* For what must happen; nothing that passes waits so long. Refinement waits for whatever else the machine does. */
#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
#define PATIENCE_MS 240000
#else
#define PATIENCE_MS 60000
#endif

/* ---- files ---- */

static inline void folder_make(char path[PATH_MAX])
{
	const char *base = getenv("TMPDIR");

	snprintf(path, PATH_MAX, "%.200s/psrd-test-XXXXXX", base != NULL ? base : "/tmp");
	assert_non_null(mkdtemp(path));
}

static inline void folder_remove(const char *path)
{
	char command[PATH_MAX + 16];

	snprintf(command, sizeof command, "rm -rf '%s'", path);
	assert_int_equal(system(command), 0);
}

static inline void file_write(const char *folder, const char *name, const void *bytes, size_t n)
{
	char path[2 * PATH_MAX];
	FILE *file;

	snprintf(path, sizeof path, "%s/%s", folder, name);
	file = fopen(path, "wb");
	assert_non_null(file);
	assert_int_equal(fwrite(bytes, 1, n, file), n);
	assert_int_equal(fclose(file), 0);
}

#define PLATE_BLOCKS 64
#define PLATE_SAMPLES (64 * PLATE_BLOCKS)

/* A plate in the plane z = 0, 8x8 full blocks, x from -0.5 to 0.5, of one color and opacity, facing +z. It comes with a
 * camera, 'front', and lights 'lamp', 'dim' (too narrow a spot for the wire) and 'sun'. */
static inline struct psr_model *pane_create(uint32_t rgb, uint8_t opacity)
{
	static struct psr_projection projection = { .axis = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } },
		                                        .spacing = 1.0f / 64 };
	static struct psr_cluster cluster = { .radius = 1, .n_blocks = PLATE_BLOCKS };
	static int16_t x[PLATE_BLOCKS], y[PLATE_BLOCKS], z[PLATE_BLOCKS];
	static const struct psr_run run;
	static uint16_t depth[PLATE_SAMPLES], offset[PLATE_BLOCKS], r[PLATE_BLOCKS];
	static uint8_t number[PLATE_BLOCKS], flags[PLATE_BLOCKS], cone_sine[PLATE_BLOCKS], traits[PLATE_BLOCKS];
	static uint8_t opacities[PLATE_SAMPLES];
	static int8_t cone_x[PLATE_BLOCKS], cone_y[PLATE_BLOCKS], cone_z[PLATE_BLOCKS];
	static uint64_t mask[PLATE_BLOCKS], attr[PLATE_SAMPLES];
	struct psr_model_info info = {
		.scale = 1, .box_min = { -0.5, -0.5, 0 }, .box_max = { 0.5, 0.5, 0 }, .spacing = 1.0 / 64, .tolerance = 0.4,
		.resolution = 128, .builder = "test", .up = { 0, 0, 1 },
	};
	struct psr_blocks blocks = {
		.n_blocks = PLATE_BLOCKS, .n_projections = 1, .n_clusters = 1, .n_levels = 1, .n_samples = PLATE_SAMPLES,
		.projection = &projection, .cluster = &cluster, .run = &run, .sphere_x = x, .sphere_y = y, .sphere_z = z,
		.sphere_r = r, .block_projection = number, .flags = flags, .mask = mask, .attr_offset = offset, .depth = depth, .attr = attr,
	};
	static const struct psr_preset_camera camera = { "front", { { 0, 0, 3 }, { 0, 0, 0 }, { 0, 1, 0 },
		                                                        PSR_CAMERA_PERSPECTIVE, 0.5, 0, 0.25 } };
	static const struct psr_preset_light light[3] = {
		{ "lamp", { .kind = PSR_LIGHT_POINT, .position = { 1, 2, 3 }, .color = { 2e6, 1e6, 0 }, .reference = 1 } },
		{ "dim", { .kind = PSR_LIGHT_SPOT, .position = { 1, 2, 3 }, .direction = { 0, 0, -1 }, .outer = 1e-7 } },
		{ "sun", { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0, 0, -1 }, .color = { 3, 3, 3 } } },
	};
	const struct psr_presets presets = { .n_cameras = 1, .n_lights = 3, .camera = &camera, .light = light };
	struct psr_model *model = NULL;
	struct psr_error error = { 0 };
	const float side = 8.0f / 64, height = side * 0.8660254f;

	for (int i = 0; i < PLATE_BLOCKS; i++) {
		x[i] = (int16_t)(((float)(i % 8) - 3.5f) * side * 0x1p14f);
		y[i] = (int16_t)(((float)(i / 8) - 3.5f) * height * 0x1p14f);
		r[i] = (uint16_t)(side * 0x1p15f);
		mask[i] = UINT64_MAX;
		offset[i] = (uint16_t)(64 * i);
		flags[i] = PSR_BLOCK_TWO_SIDED | 6 << 3;
	}
	for (int i = 0; i < PLATE_SAMPLES; i++) {
		depth[i] = 32768;                                  /* that of the sphere's center */
		attr[i] = (uint64_t)1 << 15 | (uint64_t)rgb << 16; /* unlit */
		opacities[i] = opacity;
	}
	memset(cone_sine, PSR_CONE_ANY, sizeof cone_sine);
	memset(cone_z, 127, sizeof cone_z);
	memset(traits, PSR_BLOCK_SHEER, sizeof traits);
	if (opacity < PSR_OPAQUE) {
		blocks.cone_x = cone_x;
		blocks.cone_y = cone_y;
		blocks.cone_z = cone_z;
		blocks.cone_sine = cone_sine;
		blocks.traits = traits;
		blocks.opacity = opacities;
	}
	assert_int_equal(psr_model_create(&model, &info, &blocks, &presets, &error), PSR_OK);
	return model;
}

static inline struct psr_model *plate_create(uint32_t rgb)
{
	return pane_create(rgb, PSR_OPAQUE);
}

static inline void pane_write(const char *folder, const char *name, uint32_t rgb, uint8_t opacity)
{
	struct psr_model *model = pane_create(rgb, opacity);
	char path[2 * PATH_MAX];

	snprintf(path, sizeof path, "%s/%s", folder, name);
	assert_int_equal(psr_model_write(model, path, NULL), PSR_OK);
	psr_model_unref(model);
}

static inline void plate_write(const char *folder, const char *name, uint32_t rgb)
{
	pane_write(folder, name, rgb, PSR_OPAQUE);
}

static inline void teapot_write(const char *folder)
{
	struct psr_model *teapot = NULL;
	char path[2 * PATH_MAX];

	assert_int_equal(psr_model_map(&teapot, "tests/golden/teapot.psr", NULL), PSR_OK);
	snprintf(path, sizeof path, "%s/teapot.psr", folder);
	assert_int_equal(psr_model_write(teapot, path, NULL), PSR_OK);
	psr_model_unref(teapot);
}

/* ---- the daemon ---- */

struct daemon {
	pid_t pid;
	int output, errors;
	char ready[512]; /* its first READY line, without the word */
	uint16_t port;   /* 0 for a Unix socket */
	char log[16384];
	size_t n_log;
};

static inline void daemon_path(char path[PATH_MAX], const char *program)
{
	const char *build = getenv("BUILD");
	char own[PATH_MAX] = "";

	if (build != NULL) {
		snprintf(path, PATH_MAX, "%.3000s/bin/%s", build, program);
	} else { /* .../tests/unit/NAME -> .../bin/psrd */
		assert_true(readlink("/proc/self/exe", own, sizeof own - 1) > 0);
		for (int i = 0; i < 3; i++)
			*strrchr(own, '/') = '\0';
		snprintf(path, PATH_MAX, "%.3000s/bin/%s", own, program);
	}
}

/* A folder with psrd, beside it a psr-model of the test's own, a script, and a plate that the script can copy:
 * ready.psr. */
static inline void builder_make(char bin[PATH_MAX], const char *script)
{
	char path[PATH_MAX], command[3 * PATH_MAX];

	folder_make(bin);
	daemon_path(path, "psrd");
	snprintf(command, sizeof command, "cp '%s' '%s/psrd'", path, bin);
	assert_int_equal(system(command), 0);
	file_write(bin, "psr-model", script, strlen(script));
	snprintf(path, sizeof path, "%.200s/psr-model", bin);
	assert_int_equal(chmod(path, 0700), 0);
	plate_write(bin, "ready.psr", 0x2040c0);
}

static inline int64_t clock_ms(void)
{
	return (int64_t)(clock_ns() / 1000000);
}

/* argv[0] is the program's path; the list ends with NULL. */
static inline void daemon_spawn(struct daemon *d, const char *const *argv)
{
	int out[2], err[2];

	memset(d, 0, sizeof *d);
	assert_int_equal(pipe2(out, O_CLOEXEC), 0);
	assert_int_equal(pipe2(err, O_CLOEXEC), 0);
	d->pid = fork();
	assert_true(d->pid >= 0);
	if (d->pid == 0) {
		dup2(out[1], 1);
		dup2(err[1], 2);
		execv(argv[0], (char *const *)argv);
		_exit(127);
	}
	close(out[1]);
	close(err[1]);
	d->output = out[0];
	d->errors = err[0];
	fcntl(d->errors, F_SETFL, O_NONBLOCK);
}

static inline void daemon_read_log(struct daemon *d)
{
	ssize_t n;

	while (d->n_log < sizeof d->log - 1 && (n = read(d->errors, d->log + d->n_log, sizeof d->log - 1 - d->n_log)) > 0)
		d->n_log += (size_t)n;
}

/* One READY line; fails the test if the daemon ends instead. */
static inline void daemon_wait_ready(struct daemon *d)
{
	char line[600];
	size_t n = 0;

	while (n < sizeof line - 1 && read(d->output, line + n, 1) == 1 && line[n] != '\n')
		n++;
	line[n] = '\0';
	if (strncmp(line, "READY ", 6) != 0) {
		daemon_read_log(d);
		fail_msg("no READY but '%s': %s", line, d->log);
	}
	snprintf(d->ready, sizeof d->ready, "%.500s", line + 6);
	if (strncmp(d->ready, "unix:", 5) != 0)
		d->port = (uint16_t)atoi(strrchr(d->ready, ':') + 1);
}

/* psrd --listen 127.0.0.1:0 --models FOLDER --cache FOLDER/cache, and up to 12 more arguments, NULL at the end. */
static inline void daemon_start(struct daemon *d, const char *folder, const char *const *more)
{
	char path[PATH_MAX], cache[PATH_MAX + 16];
	/* The defaults are for a machine of one's own. Under a sanitizer, beside other tests, a frame takes longer, and
	 * connections that a test leaves silent are to stay until it closes them. */
	const char *argv[32] = { path, "--listen", "127.0.0.1:0", "--models", folder, "--cache", cache,
		                     "--frame-timeout", "100", "--handshake-timeout", "600" };

	daemon_path(path, "psrd");
	snprintf(cache, sizeof cache, "%s/.cache", folder);
	for (int i = 0; more != NULL && more[i] != NULL; i++)
		argv[11 + i] = more[i];
	daemon_spawn(d, argv);
	daemon_wait_ready(d);
}

/* Exit status, or -signal; kills it if it takes too long, which fails the test. */
static inline int daemon_wait(struct daemon *d)
{
	int64_t end = clock_ms() + PATIENCE_MS;
	int status;

	while (waitpid(d->pid, &status, WNOHANG) == 0) {
		if (clock_ms() > end) {
			kill(d->pid, SIGKILL);
			waitpid(d->pid, &status, 0);
			fail_msg("psrd did not end");
		}
		usleep(2000);
	}
	daemon_read_log(d);
	close(d->output);
	close(d->errors);
	return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

static inline void daemon_stop(struct daemon *d)
{
	int status;

	kill(d->pid, SIGTERM);
	status = daemon_wait(d);
	if (status != 0)
		fail_msg("psrd ended with %d: %s", status, d->log);
}

/* VmRSS: memory in use; VmHWM: the most of it so far. */
static inline long daemon_memory_kb(const struct daemon *d, const char *which)
{
	const size_t n = strlen(which);
	char path[64], line[256];
	long kb = 0;
	FILE *file;

	snprintf(path, sizeof path, "/proc/%d/status", (int)d->pid);
	file = fopen(path, "r");
	assert_non_null(file);
	while (fgets(line, sizeof line, file) != NULL)
		if (strncmp(line, which, n) == 0 && line[n] == ':')
			kb = atol(line + n + 1);
	fclose(file);
	return kb;
}

static inline long daemon_resident_kb(const struct daemon *d)
{
	return daemon_memory_kb(d, "VmRSS");
}

/* ---- a peer ---- */

struct peer {
	int fd;
	uint32_t id;
	struct psr_framer framer;
	uint8_t storage[2 * PSR_WIRE_MAX_MESSAGE];
	uint8_t bytes[PSR_WIRE_MAX_MESSAGE];
	struct psr_buf buf;
};

static inline void peer_connect(struct peer *p, const struct daemon *d)
{
	struct sockaddr_in in = { .sin_family = AF_INET, .sin_port = htons(d->port),
		                      .sin_addr.s_addr = htonl(INADDR_LOOPBACK) };
	struct sockaddr_un un = { .sun_family = AF_UNIX };
	const int on = 1;

	memset(p, 0, sizeof *p);
	psr_framer_init(&p->framer, PSR_SERVER, p->storage, sizeof p->storage);
	p->buf = (struct psr_buf){ .data = p->bytes, .capacity = sizeof p->bytes };
	if (d->port != 0) {
		p->fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
		assert_int_equal(connect(p->fd, (struct sockaddr *)&in, sizeof in), 0);
		setsockopt(p->fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on); /* or a small message waits for a delayed ACK */
	} else {
		p->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
		snprintf(un.sun_path, sizeof un.sun_path, "%.100s", d->ready + 5);
		assert_int_equal(connect(p->fd, (struct sockaddr *)&un, sizeof un), 0);
	}
}

static inline void peer_write(struct peer *p, const void *bytes, size_t n)
{
	const uint8_t *at = bytes;

	while (n > 0) {
		ssize_t written = send(p->fd, at, n, MSG_NOSIGNAL);

		assert_true(written > 0);
		at += written;
		n -= (size_t)written;
	}
}

static inline void peer_send(struct peer *p)
{
	peer_write(p, p->buf.data, p->buf.size);
	p->buf.size = 0;
}

/* 1: a message; 0: the server has closed. Fails the test on silence or on bytes that are no messages. */
static inline int peer_next(struct peer *p, struct psr_message *message)
{
	struct psr_error error = { 0 };
	int code;

	while ((code = psr_framer_next(&p->framer, message, &error)) == 0) {
		struct pollfd waits = { .fd = p->fd, .events = POLLIN };
		size_t room;
		uint8_t *space = psr_framer_space(&p->framer, &room);
		ssize_t n;

		if (poll(&waits, 1, PATIENCE_MS) != 1)
			fail_msg("the server says nothing");
		n = recv(p->fd, space, room, 0);
		if (n <= 0)
			return 0;
		psr_framer_filled(&p->framer, (size_t)n);
	}
	if (code < 0)
		fail_msg("the server's bytes are no messages: %s", error.text);
	return 1;
}

static inline void peer_expect(struct peer *p, struct psr_message *message, unsigned type, uint32_t id)
{
	struct psr_msg_error error;

	if (!peer_next(p, message))
		fail_msg("the server closed instead of sending %s", psr_msg_name(type));
	if (message->type != type && message->type == PSR_MSG_ERROR
	    && psr_msg_error_decode(&error, message->payload, message->n, NULL) == PSR_OK)
		fail_msg("ERROR %u instead of %s: %s", error.code, psr_msg_name(type), error.text);
	assert_string_equal(psr_msg_name(message->type), psr_msg_name(type));
	assert_int_equal(message->id, id);
}

/* ERROR with this id and code; its text is put into text, if not NULL. */
static inline void peer_expect_error(struct peer *p, uint32_t id, unsigned code, char text[PSR_ERROR_TEXT])
{
	struct psr_message message;
	struct psr_msg_error error;

	peer_expect(p, &message, PSR_MSG_ERROR, id);
	assert_int_equal(psr_msg_error_decode(&error, message.payload, message.n, NULL), PSR_OK);
	if (error.code != code)
		fail_msg("ERROR %u instead of %u: %s", error.code, code, error.text);
	assert_true(strlen(error.text) > 10);
	if (text != NULL)
		memcpy(text, error.text, PSR_ERROR_TEXT);
}

static inline void peer_expect_end(struct peer *p)
{
	struct psr_message message;

	if (peer_next(p, &message))
		fail_msg("%s instead of the end", psr_msg_name(message.type));
}

static inline void peer_close(struct peer *p)
{
	close(p->fd);
}

static inline void peer_hello(struct peer *p, const struct daemon *d, struct psr_msg_welcome *welcome)
{
	struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "test" };
	struct psr_message message;
	struct psr_msg_welcome ignored;

	peer_connect(p, d);
	assert_int_equal(psr_msg_hello_encode(&p->buf, &hello, NULL), PSR_OK);
	peer_send(p);
	peer_expect(p, &message, PSR_MSG_WELCOME, 0);
	assert_int_equal(psr_msg_welcome_decode(welcome != NULL ? welcome : &ignored, message.payload, message.n, NULL),
	                 PSR_OK);
}

static inline uint32_t peer_ask_open_as(struct peer *p, const char *name, struct psr_msg_open open)
{
	snprintf(open.name, sizeof open.name, "%s", name);
	assert_int_equal(psr_msg_open_encode(&p->buf, ++p->id, &open, NULL), PSR_OK);
	peer_send(p);
	return p->id;
}

static inline uint32_t peer_ask_open_for(struct peer *p, const char *name, uint32_t resolution)
{
	return peer_ask_open_as(p, name, (struct psr_msg_open){ .resolution = (uint16_t)resolution });
}

static inline uint32_t peer_ask_open(struct peer *p, const char *name)
{
	return peer_ask_open_for(p, name, 0);
}

/* Progress is passed over. */
static inline void peer_expect_opened(struct peer *p, uint32_t id, struct psr_msg_opened *opened)
{
	struct psr_message message;
	struct psr_msg_error error;

	do
		assert_true(peer_next(p, &message));
	while (message.type == PSR_MSG_PROGRESS);
	if (message.type == PSR_MSG_ERROR && psr_msg_error_decode(&error, message.payload, message.n, NULL) == PSR_OK)
		fail_msg("ERROR %u: %s", error.code, error.text);
	assert_int_equal(message.type, PSR_MSG_OPENED);
	assert_int_equal(message.id, id);
	assert_int_equal(psr_msg_opened_decode(opened, message.payload, message.n, NULL), PSR_OK);
}

static inline void peer_expect_open_error(struct peer *p, uint32_t id, unsigned code, char text[PSR_ERROR_TEXT])
{
	struct psr_message message;
	struct psr_msg_error error;

	do
		assert_true(peer_next(p, &message));
	while (message.type == PSR_MSG_PROGRESS);
	assert_int_equal(message.type, PSR_MSG_ERROR);
	assert_int_equal(message.id, id);
	assert_int_equal(psr_msg_error_decode(&error, message.payload, message.n, NULL), PSR_OK);
	if (error.code != code)
		fail_msg("ERROR %u instead of %u: %s", error.code, code, error.text);
	if (text != NULL)
		memcpy(text, error.text, PSR_ERROR_TEXT);
}

static inline void scene_default(struct psr_msg_scene *scene, uint32_t handle)
{
	memset(scene, 0, sizeof *scene);
	scene->ambient = 1;
	scene->n_instances = 1;
	scene->instance[0] = (struct psr_msg_instance){ .handle = handle, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
}

/* 800 instances in the shadows of 32 lights, six maps each: seconds of work for a core. */
static inline void scene_make_heavy(struct psr_msg_scene *scene)
{
	scene->n_instances = 800;
	for (int i = 1; i < 800; i++) {
		scene->instance[i] = scene->instance[0];
		scene->instance[i].translation[0] = (i % 20 - 10) * 0.1;
		scene->instance[i].translation[1] = (i / 20 % 20 - 10) * 0.1;
		scene->instance[i].translation[2] = i * -0.01;
	}
	scene->n_lights = 32;
	for (int i = 0; i < 32; i++)
		scene->light[i] = (struct psr_msg_light){ .kind = PSR_WIRE_LIGHT_POINT, .flags = PSR_WIRE_LIGHT_SHADOW,
			                                      .color = { 9, 9, 9 }, .intensity = 1, .reference = 1,
			                                      .position = { i * 0.1 - 1.6, 0.5, 0.3 - i * 0.1 } };
}

static inline uint32_t peer_ask_stats(struct peer *p)
{
	assert_int_equal(psr_msg_stats_encode(&p->buf, ++p->id, NULL), PSR_OK);
	peer_send(p);
	return p->id;
}

static inline uint64_t peer_stat(struct peer *p, unsigned id)
{
	struct psr_message message;
	struct psr_msg_stats_reply reply;

	peer_expect(p, &message, PSR_MSG_STATS_REPLY, peer_ask_stats(p));
	assert_int_equal(psr_msg_stats_reply_decode(&reply, message.payload, message.n, NULL), PSR_OK);
	for (int i = 0; i < reply.n_stats; i++)
		if (reply.stat[i].id == id)
			return reply.stat[i].value;
	fail();
	return 0;
}

/* By a client of its own. */
static inline uint64_t stat_of(const struct daemon *d, unsigned id)
{
	static struct peer asker;
	uint64_t value;

	peer_hello(&asker, d, NULL);
	value = peer_stat(&asker, id);
	peer_close(&asker);
	return value;
}

static inline void peer_send_scene(struct peer *p, const struct psr_msg_scene *scene)
{
	assert_int_equal(psr_msg_scene_encode(&p->buf, ++p->id, scene, NULL), PSR_OK);
	peer_send(p);
}

static inline struct psr_msg_frame frame_default(uint32_t width, uint32_t height)
{
	return (struct psr_msg_frame){
		.width = width, .height = height, .planes = 1, .color_codec = PSR_CODEC_ZSTD,
		.camera = { .kind = PSR_CAMERA_PERSPECTIVE, .eye = { 0, 0, 2 }, .up = { 0, 1, 0 }, .fov_y = 0.6,
		            .near_z = 0.01 },
	};
}

static inline uint32_t peer_ask_frame(struct peer *p, const struct psr_msg_frame *frame)
{
	assert_int_equal(psr_msg_frame_encode(&p->buf, ++p->id, 0, frame, NULL), PSR_OK);
	peer_send(p);
	return p->id;
}

/* FRAME_BEGIN, RECTs, FRAME_END of one id, nothing else between; returns the bytes of RECT data. */
static inline uint64_t peer_expect_frame(struct peer *p, uint32_t id, struct psr_msg_frame_end *end)
{
	struct psr_message message;
	struct psr_msg_rect rect;
	uint64_t n = 0;

	peer_expect(p, &message, PSR_MSG_FRAME_BEGIN, id);
	for (;;) {
		assert_true(peer_next(p, &message));
		assert_int_equal(message.id, id);
		if (message.type != PSR_MSG_RECT)
			break;
		assert_int_equal(psr_msg_rect_decode(&rect, message.payload, message.n, NULL), PSR_OK);
		n += rect.bytes;
	}
	assert_int_equal(message.type, PSR_MSG_FRAME_END);
	assert_int_equal(psr_msg_frame_end_decode(end, message.payload, message.n, NULL), PSR_OK);
	return n;
}

/* A frame of 64x64. */
static inline void peer_draw(struct peer *p)
{
	struct psr_msg_frame frame = frame_default(64, 64);
	struct psr_msg_frame_end end;

	assert_true(peer_expect_frame(p, peer_ask_frame(p, &frame), &end) > 0);
}

/* HELLO, OPEN `name`, a scene of it in slot 0. */
/* As peer_hello(), but tries again while the server is full, since it sees a moment later that somebody has left, or while
 * a crowd takes the place of this connection before its HELLO is read. */
static inline void peer_hello_in_turn(struct peer *p, const struct daemon *d)
{
	struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "test" };
	const int64_t end = clock_ms() + PATIENCE_MS;
	struct psr_message message;
	struct psr_msg_error error;

	for (;;) {
		peer_connect(p, d);
		assert_int_equal(psr_msg_hello_encode(&p->buf, &hello, NULL), PSR_OK);
		(void)!send(p->fd, p->bytes, p->buf.size, MSG_NOSIGNAL); /* -1 where psrd has closed it */
		p->buf.size = 0;
		if (peer_next(p, &message)) {
			if (message.type == PSR_MSG_WELCOME)
				return;
			assert_int_equal(psr_msg_error_decode(&error, message.payload, message.n, NULL), PSR_OK);
			assert_int_equal(error.code, PSR_WIRE_BUSY);
		}
		assert_true(clock_ms() < end);
		peer_close(p);
		usleep(2000);
	}
}

/* The peer has said HELLO: opens the model, and a scene of it. */
static inline void peer_set_scene(struct peer *p, const char *name)
{
	struct psr_msg_opened opened;
	struct psr_msg_scene *scene = malloc(sizeof *scene);

	assert_non_null(scene);
	peer_expect_opened(p, peer_ask_open(p, name), &opened);
	scene_default(scene, opened.handle);
	peer_send_scene(p, scene);
	free(scene);
}

static inline void peer_begin(struct peer *p, const struct daemon *d, const char *name)
{
	peer_hello(p, d, NULL);
	peer_set_scene(p, name);
}

/* The daemon still serves: a new client draws a frame and finds the plate in it. */
static inline void expect_serves(const struct daemon *d, const char *name)
{
	struct peer *p = malloc(sizeof *p);

	assert_non_null(p);
	peer_hello_in_turn(p, d);
	peer_set_scene(p, name);
	peer_draw(p);
	peer_close(p);
	free(p);
}

#endif
