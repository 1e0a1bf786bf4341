/* view PSR-MODEL FOLDER FETCHED PSRD RELAY: what a viewer's link (client/view/link) makes of a network, beside targets.
 * A camera turns about the dragon for some seconds and stops. */
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/stats.h"
#include "client/view/link.h"
#include "report.h"
#include "scene.h"
#include "view_reading.h"

#define RESOLUTION 768
#define TURN_S 1.5
#define STOPS 3
#define MOST 4096
#define SHARP_MS 1000.0
#define PATIENCE_S 20.0

struct program {
	pid_t pid;
	char address[128];
};

static void start(struct program *program, const char *const *argv)
{
	int pipes[2];
	char line[256] = "";
	FILE *out;

	if (pipe(pipes) != 0)
		report_die("pipe", "no descriptors");
	program->pid = fork();
	if (program->pid == 0) {
		prctl(PR_SET_PDEATHSIG, SIGKILL);
		dup2(pipes[1], STDOUT_FILENO);
		execv(argv[0], (char *const *)argv);
		_exit(127);
	}
	close(pipes[1]);
	out = fdopen(pipes[0], "r");
	if (program->pid < 0 || out == NULL || fgets(line, sizeof line, out) == NULL
	    || sscanf(line, "READY %127s", program->address) != 1)
		report_die(argv[0], "does not start");
	/* `out` stays open: the relay prints what it saw when it ends. */
}

static void stop(struct program *program)
{
	kill(program->pid, SIGTERM);
	waitpid(program->pid, NULL, 0);
}

struct found {
	double ms[MOST], bytes[MOST], scale[MOST];
	size_t n;
	double sharp_ms[STOPS];
	double seconds;
};
static struct found found;

static struct link_wish wish;
static struct link_instance instance;
static double angle;

static void turn_to(struct link *link, double to, int is_rest)
{
	const double distance = 0.45;

	angle = to;
	wish.camera.eye[0] = wish.camera.target[0] + distance * sin(angle);
	wish.camera.eye[1] = wish.camera.target[1] + 0.1;
	wish.camera.eye[2] = wish.camera.target[2] + distance * cos(angle);
	wish.is_rest = is_rest;
	if (link_wish(link, &wish) == 0)
		report_die("link", "takes no wish");
}

static struct link_picture *next(struct link *link, int ms)
{
	struct pollfd waits = { .fd = link_fd(link), .events = POLLIN };

	poll(&waits, 1, ms);
	link_heard(link);
	return link_take(link);
}

static void note(const struct link_picture *picture)
{
	if (found.n == MOST || picture->is_sharp)
		return;
	found.ms[found.n] = (double)(picture->came_ns - picture->asked_ns) * 1e-6;
	found.bytes[found.n] = (double)picture->bytes;
	found.scale[found.n++] = picture->begin.settings.scale;
}

/* Turns by 30 degrees a second, at 60 wishes a second, then waits for the sharp picture. */
static double turn_and_stop(struct link *link)
{
	const double begin = clock_seconds();
	uint64_t last;

	for (double t; (t = clock_seconds() - begin) < TURN_S;) {
		struct link_picture *picture = next(link, 16);

		if (picture != NULL)
			note(picture);
		link_release(picture);
		turn_to(link, angle + 0.5 / 60, 0);
		usleep(2000);
	}
	found.seconds += TURN_S;
	wish.is_rest = 1;
	last = link_wish(link, &wish);
	for (const double stop_s = clock_seconds(); clock_seconds() - stop_s < PATIENCE_S;) {
		struct link_picture *picture = next(link, 100);
		const int is_it = picture != NULL && picture->wish == last && picture->is_sharp;

		link_release(picture);
		if (is_it)
			return 1e3 * (clock_seconds() - stop_s);
	}
	return INFINITY;
}

static void run(const char *address, uint32_t width, uint32_t height)
{
	struct psr_error err;
	struct link *link;
	struct link_scene *scene = NULL;

	memset(&found, 0, sizeof found);
	if (link_open(&link, address, "bench", &err) != PSR_OK)
		report_die("link", err.text);
	wish.width = wish.height = 0;
	turn_to(link, 0, 1);
	while (scene == NULL) {
		link_release(next(link, 100));
		scene = link_scene_take(link);
	}
	for (int a = 0; a < 3; a++)
		wish.camera.target[a] = (scene->box_min[a] + scene->box_max[a]) / 2;
	link_scene_free(scene);
	wish.width = width;
	wish.height = height;
	turn_and_stop(link);
	memset(&found, 0, sizeof found);
	for (int i = 0; i < STOPS; i++)
		found.sharp_ms[i] = turn_and_stop(link);
	link_close(link);
}

static double median(double *x, size_t n)
{
	stats_sort(x, n);
	return n > 0 ? stats_percentile(x, n, 0.5) : 0;
}

static double p99(double *x, size_t n)
{
	stats_sort(x, n);
	return n > 0 ? stats_percentile(x, n, 0.99) : 0;
}

static void begin_wish(double overscan)
{
	link_wish_default(&wish);
	snprintf(instance.model, sizeof instance.model, "dragon-%d", RESOLUTION);
	instance.rotation[3] = instance.scale = 1;
	wish.instance = &instance;
	wish.n_instances = 1;
	wish.overscan = overscan;
	wish.camera = (struct psr_camera){ .up = { 0, 1, 0 }, .fov_y = 0.45, .near_z = 0.01 };
}

static void networks(const char *relay, const struct program *psrd)
{
	static const struct { const char *delay, *rate; } way[] = { { "0", "0" }, { "25", "1000" }, { "25", "50" },
		                                                        { "50", "50" }, { "50", "10" }, { "100", "10" } };

	printf("dragon at 1280x720, overscan 1.15, turning by 30 degrees a second; then sharp: full size, smooth, without "
	       "loss\n");
	printf("%8s %7s | %9s %7s %7s %5s %7s | %8s %8s\n", "round ms", "Mbit/s", "frames/s", "p50 ms", "p99 ms", "scale",
	       "kB", "sharp ms", "worst");
	for (unsigned i = 0; i < sizeof way / sizeof way[0]; i++) {
		const char *argv[] = { relay, "--to", psrd->address, "--delay", way[i].delay, "--rate-down", way[i].rate,
			                   NULL };
		struct program between;
		double worst, middle;

		start(&between, argv);
		begin_wish(1.15);
		run(between.address, 1280, 720);
		stop(&between);
		middle = median(found.sharp_ms, STOPS);
		worst = found.sharp_ms[STOPS - 1];
		printf("%8.0f %7s | %9.1f %7.1f %7.1f %5.2f %7.1f | %8.0f %8.0f", 2 * strtod(way[i].delay, NULL),
		       strcmp(way[i].rate, "0") == 0 ? "-" : way[i].rate, (double)found.n / found.seconds,
		       median(found.ms, found.n), p99(found.ms, found.n), median(found.scale, found.n),
		       1e-3 * median(found.bytes, found.n), middle, worst);
		if (strcmp(way[i].delay, "25") == 0 && strcmp(way[i].rate, "50") == 0)
			printf("  target %.0f%s", SHARP_MS, worst <= SHARP_MS ? "" : " MISSED");
		printf("\n");
		fflush(stdout);
	}
}

int main(int argc, char **argv)
{
	struct program psrd;
	char path[4096], folder[] = "/tmp/psr-view-bench-XXXXXX", address[64];

	if (argc != 6)
		report_die("usage", "view PSR-MODEL FOLDER FETCHED PSRD RELAY");
	snprintf(path, sizeof path, "%s/dragon.ply", argv[3]);
	if (access(path, R_OK) != 0)
		report_die(path, "is not there; make models fetches it");
	psr_model_unref(scene_model(argv[1], argv[2], "dragon", path, RESOLUTION));
	if (mkdtemp(folder) == NULL)
		report_die(folder, "cannot be made");
	snprintf(address, sizeof address, "unix:%s/socket", folder);
	start(&psrd, (const char *const[]){ argv[4], "--models", argv[2], "--listen", address, "--threads", "2", NULL });
	networks(argv[5], &psrd);
	view_reading(psrd.address, psrd.pid, instance.model, &wish.camera);
	stop(&psrd);
	rmdir(folder);
	return 0;
}
