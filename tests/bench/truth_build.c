#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <xxhash.h>
#include "base/maths.h"
#include "base/netpbm.h"
#include "base/srgb.h"
#include "child.h"
#include "report.h"
#include "truth.h"

#define WORD 160
#define MOST_WORDS 48

static void path_of(char path[PATH_MAX], const char *folder, const char *name)
{
	if (snprintf(path, PATH_MAX, "%s/%s", folder, name) >= PATH_MAX)
		report_die(folder, "is too long a path");
}

static struct timespec changed(const char *folder, const char *name)
{
	char path[PATH_MAX];
	struct stat info;

	path_of(path, folder, name);
	return stat(path, &info) == 0 ? info.st_mtim : (struct timespec){ 0 };
}

void truth_build_init(struct truth_build *build, const char *programs, const char *work)
{
	static const char *const part[] = { "psr", "psrd", "psr-model" };
	struct timespec time[3];
	char whole[PATH_MAX], name[32];

	*build = (struct truth_build){ .programs = programs };
	if (realpath(programs, whole) == NULL)
		report_die(programs, strerror(errno));
	for (int i = 0; i < 3; i++) {
		time[i] = changed(whole, part[i]);
		if (time[i].tv_sec == 0)
			report_die(programs, "has no psr, psrd or psr-model");
	}
	const uint64_t place = XXH64(whole, strlen(whole), 0);
	build->key = XXH64(time, sizeof time, place);
	snprintf(name, sizeof name, "%016llx", (unsigned long long)place);
	path_of(build->folder, work, name);
	if (mkdir(build->folder, 0777) != 0 && access(build->folder, W_OK) != 0)
		report_die(build->folder, strerror(errno));
}

void truth_build_model(const struct truth_build *build, const char *name, const char *source, uint32_t resolution,
                       int is_calibrated)
{
	char file[128], path[PATH_MAX], program[PATH_MAX], pixels[16];
	struct child_use use;

	snprintf(file, sizeof file, "%s-%u.psr", name, resolution);
	snprintf(pixels, sizeof pixels, "%u", resolution);
	path_of(path, build->folder, file);
	path_of(program, build->programs, "psr-model");
	/* The library is older than the program where only other parts were linked anew. */
	struct timespec modeller = changed(build->programs, "../lib/libpsr-build.a");
	if (modeller.tv_sec == 0)
		modeller = changed(build->programs, "psr-model");
	const struct timespec made = changed(build->folder, file);
	if (made.tv_sec > modeller.tv_sec)
		return;
	const char *const argv[] = { program, "build",  source, "-o", path,
		                         "-r",    pixels, "-q",   is_calibrated ? "--calibrate" : NULL, NULL };
	if (child_run(&use, argv) != 0)
		report_die(source, "cannot be built");
}

void truth_build_start(struct truth_build *build)
{
	static unsigned n_started;
	char program[PATH_MAX], listen[sizeof build->socket + 8], line[256];
	int pipes[2];
	FILE *out;

	path_of(program, build->programs, "psrd");
	snprintf(build->socket, sizeof build->socket, "/tmp/psr-truth-%d-%u", (int)getpid(), n_started++);
	snprintf(listen, sizeof listen, "unix:%s", build->socket);
	if (pipe2(pipes, O_CLOEXEC) != 0)
		report_die("pipe", strerror(errno));
	build->daemon = fork();
	if (build->daemon < 0)
		report_die("fork", strerror(errno));
	if (build->daemon == 0) {
		dup2(pipes[1], STDOUT_FILENO);
		execl(program, program, "--models", build->folder, "--listen", listen, "--frame-timeout", "600", (char *)NULL);
		_exit(127);
	}
	close(pipes[1]);
	out = fdopen(pipes[0], "r");
	if (out == NULL || fgets(line, sizeof line, out) == NULL || strncmp(line, "READY ", 6) != 0)
		report_die(program, "does not start");
	fclose(out);
}

void truth_build_stop(struct truth_build *build)
{
	if (build->daemon <= 0)
		return;
	kill(build->daemon, SIGTERM);
	waitpid(build->daemon, NULL, 0);
	unlink(build->socket);
	build->daemon = 0;
}

/* ---- psr shot ---- */

struct words {
	const char *argv[MOST_WORDS + 1];
	char text[MOST_WORDS][WORD];
	int n;
};

static void say(struct words *words, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void say(struct words *words, const char *format, ...)
{
	va_list list;

	if (words->n == MOST_WORDS)
		report_die("psr shot", "has too many options");
	va_start(list, format);
	vsnprintf(words->text[words->n], WORD, format, list);
	va_end(list);
	words->argv[words->n] = words->text[words->n];
	words->argv[++words->n] = NULL;
}

static void say_point(struct words *words, const char *option, const double p[3])
{
	say(words, "%s=%.17g,%.17g,%.17g", option, p[0], p[1], p[2]);
}

static void say_scene(struct words *words, const struct psr_scene *scene)
{
	const uint8_t grey = psr_linear_to_srgb((float)scene->background[0]);

	say_point(words, "--eye", scene->camera.eye);
	say_point(words, "--target", scene->camera.target);
	say_point(words, "--up", scene->camera.up);
	say(words, "--fov=%.17g", scene->camera.fov_y / PSR_DEGREE);
	say(words, "--ambient=%.17g", scene->ambient[0]);
	say(words, "--background=#%02x%02x%02x", grey, grey, grey);
	for (uint32_t i = 0; i < scene->n_lights; i++) {
		const struct psr_light *l = &scene->light[i];
		const char *shadow = l->casts_shadow ? ",shadow" : "";

		if (l->kind == PSR_LIGHT_DIRECTIONAL)
			say(words, "--light=dir:%.9g,%.9g,%.9g%s", l->direction[0], l->direction[1], l->direction[2], shadow);
		else
			say(words, "--light=point:%.9g,%.9g,%.9g,intensity=%.9g,ref=%.9g%s", l->position[0], l->position[1],
			    l->position[2], l->color[0], l->reference, shadow);
	}
}

/* What the child says goes to FOLDER/log: psr shot gives advice with each picture of a small model. */
static int run_quietly(const struct truth_build *build, const char *const *argv)
{
	char path[PATH_MAX];
	struct child_use use;
	int kept = dup(STDERR_FILENO), log, status;

	path_of(path, build->folder, "log");
	log = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
	if (kept < 0 || log < 0 || fcntl(kept, F_SETFD, FD_CLOEXEC) != 0)
		report_die(path, strerror(errno));
	dup2(log, STDERR_FILENO);
	status = child_run(&use, argv);
	dup2(kept, STDERR_FILENO);
	close(kept);
	close(log);
	return status;
}

void truth_build_shot(const struct truth_build *build, const struct truth_shot *shot, struct psr_frame *frame)
{
	char program[PATH_MAX], color[PATH_MAX], depth[PATH_MAX];
	struct words words = { .n = 0 };
	struct psr_error err;
	uint32_t width, height;

	path_of(program, build->programs, "psr");
	path_of(color, build->folder, "shot.ppm");
	path_of(depth, build->folder, "shot.pfm");
	say(&words, "psr");
	words.argv[0] = program;
	say(&words, "shot");
	say(&words, "--server=unix:%s", build->socket);
	say(&words, "--model=%s-%u", shot->name, shot->resolution);
	say(&words, "--size=%ux%u", shot->side, shot->side);
	say(&words, "--timeout=600");
	say(&words, "-o");
	words.argv[words.n++] = color;
	say(&words, "--depth");
	words.argv[words.n++] = depth;
	say_scene(&words, shot->scene);
	for (const char *const *option = shot->options; *option != NULL; option++)
		say(&words, "%s", *option);
	if (run_quietly(build, words.argv) != 0)
		report_die(build->folder, "psr shot drew no picture; `log` there says why");
	memset(frame, 0, sizeof *frame);
	if (ppm_read(&frame->rgb, &frame->width, &frame->height, color, &err) != PSR_OK ||
	    pfm_read(&frame->depth, &width, &height, depth, &err) != PSR_OK)
		report_die(shot->name, err.text);
	if (frame->width != width || frame->height != height || width != shot->side || height != shot->side)
		report_die(shot->name, "the picture has another size");
}
