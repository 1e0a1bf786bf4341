/* What a client alone takes from a frame's first byte to the buffer that the window uploads: psrd's answer is recorded,
 * and psrd stopped. The answer lies in the socket whole before the clock starts, so nobody works beside the client. */
#define _GNU_SOURCE
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/stats.h"
#include "proto/proto.h"
#include "psr/client.h"
#include "report.h"
#include "view_reading.h"

#define REPEATS 200
#define WARM_UP 20
#define MOST_BYTES (4u << 20)
#define SHOW_MS 5.0

/* ---- between client and psrd ---- */

static struct {
	int client_fd, psrd_fd;
	uint8_t *bytes; /* of the answer to the last FRAME */
	size_t n;
	int is_recording;
} between;

static int listen_at(const char *path)
{
	struct sockaddr_un at = { .sun_family = AF_UNIX };
	const int fd = socket(AF_UNIX, SOCK_STREAM, 0);

	snprintf(at.sun_path, sizeof at.sun_path, "%s", path);
	if (fd < 0 || bind(fd, (struct sockaddr *)&at, sizeof at) != 0 || listen(fd, 1) != 0)
		report_die(path, "cannot listen");
	return fd;
}

static int connect_psrd(const char *address)
{
	struct sockaddr_un at = { .sun_family = AF_UNIX };
	const int fd = socket(AF_UNIX, SOCK_STREAM, 0);

	snprintf(at.sun_path, sizeof at.sun_path, "%s", address + strlen("unix:"));
	if (fd < 0 || connect(fd, (struct sockaddr *)&at, sizeof at) != 0)
		report_die(address, "cannot connect");
	return fd;
}

static void write_all(int fd, const uint8_t *bytes, size_t n)
{
	for (size_t done = 0; done < n;) {
		const ssize_t now = write(fd, bytes + done, n - done);

		if (now <= 0)
			report_die("socket", "takes no more");
		done += (size_t)now;
	}
}

static ssize_t pass_on(int from, int to)
{
	static uint8_t bytes[1 << 16];
	const ssize_t n = read(from, bytes, sizeof bytes);

	if (n <= 0)
		return n;
	if (from == between.psrd_fd && __atomic_load_n(&between.is_recording, __ATOMIC_ACQUIRE)) {
		if (between.n + (size_t)n > MOST_BYTES)
			report_die("record", "the answer is too long");
		memcpy(between.bytes + between.n, bytes, (size_t)n);
		between.n += (size_t)n;
	}
	write_all(to, bytes, (size_t)n);
	return n;
}

/* Passes everything on, until the stop pipe is closed. */
static void *relay(void *stop)
{
	struct pollfd waits[3] = { { .fd = between.client_fd, .events = POLLIN },
		                       { .fd = between.psrd_fd, .events = POLLIN }, { .fd = *(int *)stop, .events = POLLIN } };

	while (poll(waits, 3, -1) > 0 && waits[2].revents == 0) {
		if (waits[0].revents != 0 && pass_on(between.client_fd, between.psrd_fd) <= 0)
			break;
		if (waits[1].revents != 0 && pass_on(between.psrd_fd, between.client_fd) <= 0)
			break;
	}
	return NULL;
}

/* psr_client_connect() waits for WELCOME, so accepting and passing on begin in a thread of their own. */
struct door { int listen_fd, stop_fd; const char *psrd; };

static void *accept_and_relay(void *userdata)
{
	struct door *door = userdata;

	between.psrd_fd = connect_psrd(door->psrd);
	between.client_fd = accept(door->listen_fd, NULL, NULL);
	return relay(&door->stop_fd);
}

/* ---- the client ---- */

struct reading {
	struct psr_client *client;
	struct psr_msg_frame frame;
	uint8_t *copy[3]; /* the link's picture, the screen's, and what the renderer takes */
};

static void wait_frame(struct reading *reading, struct psr_event *event)
{
	struct psr_error err;

	if (psr_client_wait(reading->client, 10000, event, &err) != 1 || event->type != PSR_EVENT_FRAME)
		report_die("reading", event->type == PSR_EVENT_FAILED ? event->error.text : "no frame comes");
}

static uint32_t ask(struct reading *reading)
{
	struct psr_error err;
	uint32_t id;

	if (psr_client_frame(reading->client, &reading->frame, &id, &err) != PSR_OK)
		report_die("reading", err.text);
	return id;
}

static void open_model(struct reading *reading, const char *model, const struct psr_camera *camera)
{
	struct psr_msg_scene *scene = report_alloc(1, sizeof *scene);
	struct psr_msg_opened opened;
	struct psr_error err;

	if (psr_client_open(reading->client, model, -1, &opened, &err) != PSR_OK)
		report_die(model, err.text);
	scene->ambient = 0.15;
	scene->n_instances = 1;
	scene->instance[0].handle = opened.handle;
	scene->instance[0].rotation[3] = scene->instance[0].scale = 1;
	scene->n_lights = 1;
	scene->light[0] = (struct psr_msg_light){ .kind = PSR_WIRE_LIGHT_DIRECTIONAL, .color = { 255, 255, 255 },
		                                      .intensity = 1, .direction = { 0.5, -0.6, -0.8 } };
	if (psr_client_scene(reading->client, scene, NULL, &err) != PSR_OK)
		report_die("scene", err.text);
	free(scene);
	reading->frame.camera = *camera;
	for (int a = 0; a < 3; a++)
		reading->frame.camera.target[a] = (opened.box_min[a] + opened.box_max[a]) / 2;
	memcpy(reading->frame.camera.eye, reading->frame.camera.target, sizeof camera->eye);
	reading->frame.camera.eye[2] += 0.3;
}

static uint32_t get_u32(const uint8_t *at)
{
	return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

/* The ids of the recorded messages become that of the request they answer now. */
static void answer(uint32_t id)
{
	uint8_t skipped[1024];

	if (read(between.client_fd, skipped, sizeof skipped) <= 0)
		report_die("reading", "no request came");
	for (size_t at = 0; at + PSR_HEADER_SIZE <= between.n; at += get_u32(between.bytes + at))
		for (int k = 0; k < 4; k++)
			between.bytes[at + 8 + k] = (uint8_t)(id >> 8 * k);
	write_all(between.client_fd, between.bytes, between.n);
}

static void measure(struct reading *reading)
{
	static double decoded_ms[REPEATS], shown_ms[REPEATS];
	const size_t n = (size_t)3 * reading->frame.width * reading->frame.height;
	double shown;

	for (int i = -WARM_UP; i < REPEATS; i++) {
		struct psr_event event;
		uint64_t start_ns, decoded_ns;

		answer(ask(reading));
		start_ns = clock_ns();
		wait_frame(reading, &event);
		decoded_ns = clock_ns();
		memcpy(reading->copy[0], event.picture->rgb, n);
		memcpy(reading->copy[1], reading->copy[0], n);
		memcpy(reading->copy[2], reading->copy[1], n);
		if (i < 0)
			continue;
		decoded_ms[i] = (double)(decoded_ns - start_ns) * 1e-6;
		shown_ms[i] = (double)(clock_ns() - start_ns) * 1e-6;
	}
	stats_sort(decoded_ms, REPEATS);
	stats_sort(shown_ms, REPEATS);
	shown = stats_percentile(shown_ms, REPEATS, 0.5);
	printf("\n1920x1080, JPEG of quality 85, %.0f kB, the client alone on two threads, from the first byte: decoded p50 "
	       "%.2f ms, p90 %.2f; in the buffer of the window p50 %.2f, p90 %.2f, target %.0f%s\n", 1e-3 * (double)between.n,
	       stats_percentile(decoded_ms, REPEATS, 0.5), stats_percentile(decoded_ms, REPEATS, 0.9), shown,
	       stats_percentile(shown_ms, REPEATS, 0.9), SHOW_MS, shown <= SHOW_MS ? "" : " MISSED");
}

void view_reading(const char *psrd, pid_t pid, const char *model, const struct psr_camera *camera)
{
	static struct reading reading = { .frame = {
		.width = 1920, .height = 1080, .planes = 1u << PSR_PLANE_COLOR, .color_codec = PSR_CODEC_JPEG,
		.color_quality = 85, .budget = PSR_WIRE_BUDGET_SETTINGS, .settings = { 1, 1, 1 },
		.flags = PSR_WIRE_FRAME_NO_HASHES } };
	char folder[] = "/tmp/psr-reading-XXXXXX", path[64], address[80];
	const int room = 8 << 20;
	struct psr_event event;
	struct psr_error err;
	struct door door = { .psrd = psrd };
	pthread_t thread;
	int stop[2];

	between.bytes = report_alloc(MOST_BYTES, 1);
	for (int k = 0; k < 3; k++)
		reading.copy[k] = report_alloc(3, (size_t)reading.frame.width * reading.frame.height);
	if (mkdtemp(folder) == NULL || pipe(stop) != 0)
		report_die("reading", "no folder or pipe");
	snprintf(path, sizeof path, "%s/socket", folder);
	snprintf(address, sizeof address, "unix:%s", path);
	door.listen_fd = listen_at(path);
	door.stop_fd = stop[0];
	if (pthread_create(&thread, NULL, accept_and_relay, &door) != 0)
		report_die("reading", "no thread");
	if (psr_client_connect(&reading.client, address, "reading", NULL, 10000, &err) != PSR_OK)
		report_die("reading", err.text);
	if (psr_client_use_threads(reading.client, 1, &err) != PSR_OK) /* as the link on two cores */
		report_die("reading", err.text);
	open_model(&reading, model, camera);
	__atomic_store_n(&between.is_recording, 1, __ATOMIC_RELEASE);
	ask(&reading);
	wait_frame(&reading, &event);
	close(stop[1]);
	pthread_join(thread, NULL);
	kill(pid, SIGSTOP);
	if (setsockopt(between.client_fd, SOL_SOCKET, SO_SNDBUFFORCE, &room, sizeof room) != 0)
		setsockopt(between.client_fd, SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
	measure(&reading);
	kill(pid, SIGCONT);
	psr_client_close(reading.client);
	close(between.client_fd);
	close(between.psrd_fd);
	close(door.listen_fd);
	close(stop[0]);
	unlink(path);
	rmdir(folder);
	free(between.bytes);
	for (int k = 0; k < 3; k++)
		free(reading.copy[k]);
}
