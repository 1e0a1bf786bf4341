/* daemon [options] PSR-MODEL MODELS CACHE PSRD: psrd under many clients, beside its targets. MODELS takes models that are
 * built once; CACHE has the real meshes. */
#include "base/turns.h"
#include "daemon.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/cli.h"
#include "base/clock.h"
#include "report.h"

#define MOST_FIGURES 256

struct figure {
	int number; /* of the case */
	const char *unit;
	char name[64];
	double value[DAEMON_MOST_BUILDS];
	unsigned has_value; /* bit of each build */
	enum daemon_bound kind;
	double bound;
};

static struct figure figures[MOST_FIGURES];
static unsigned n_figures;
static int number_now;

static const struct {
	void (*run)(struct daemon_bench *bench);
	const char *what;
} cases[] = {
	{ NULL, "" },
	{ daemon_beside_stills, "256x256 beside two clients that refine 1080p stills" },
	{ daemon_beside_worst, "256x256 beside 870 instances, 32 shadow lights, spacing 1/64, 2048x2048" },
	{ daemon_equals, "64 clients of 256x256, one of which keeps 64 requests open" },
	{ daemon_mixed, "4 clients each of 64x64, 256x256, 1024x1024 and 1080p" },
	{ daemon_given_up, "1080p frames given up" },
	{ daemon_throughput, "64 clients against one with all threads" },
	{ daemon_memory, "64 clients that ask for 16 Mpixel and read nothing" },
	{ daemon_overhead, "processor time of a 64x64 frame through a socket" },
	{ daemon_at_rest, "movement ends, at half size: until the 1080p frame is sharp" },
};
#define N_CASES ((int)(sizeof cases / sizeof cases[0]))

void daemon_figure(const struct daemon_bench *bench, const char *name, const char *unit, double value,
                   enum daemon_bound kind, double bound)
{
	struct figure *f = figures;

	while (f < figures + n_figures && (f->number != number_now || strcmp(f->name, name) != 0))
		f++;
	if (f == figures + MOST_FIGURES)
		report_die("figures", "are too many");
	if (f == figures + n_figures) {
		*f = (struct figure){ .number = number_now, .unit = unit, .kind = kind, .bound = bound };
		snprintf(f->name, sizeof f->name, "%s", name);
		n_figures++;
	}
	f->value[bench->build] = value;
	f->has_value |= 1u << bench->build;
	fprintf(stderr, "  %s: %.4g %s\n", name, value, unit);
}

static int is_met(const struct figure *f)
{
	return f->kind == DAEMON_AT_MOST ? f->value[0] <= f->bound : f->value[0] >= f->bound;
}

static void print_figure(const struct daemon_bench *bench, const struct figure *f)
{
	printf("%4d  %-42s", f->number, f->name);
	for (unsigned b = 0; b < bench->n_builds; b++)
		if (f->has_value >> b & 1)
			printf(" %10.4g", f->value[b]);
		else
			printf(" %10s", "-");
	printf("  %-4s", f->unit);
	if (f->kind != DAEMON_NO_BOUND && f->has_value & 1)
		printf(" %8s %-5g %s", f->kind == DAEMON_AT_MOST ? "at most" : "at least", f->bound, is_met(f) ? "met" : "missed");
	printf("\n");
}

static void print_all(const struct daemon_bench *bench)
{
	int last = 0;

	for (unsigned b = 0; b < bench->n_builds; b++)
		printf("%c: %s\n", 'A' + (int)b, bench->psrd[b]);
	printf("\n%4s  %-42s", "case", "figure");
	for (unsigned b = 0; b < bench->n_builds; b++)
		printf(" %10c", 'A' + (int)b);
	printf("  %-4s %14s\n", "unit", "target");
	for (const struct figure *f = figures; f < figures + n_figures; f++) {
		if (f->number != last)
			printf("%4d  %s\n", f->number, cases[f->number].what);
		last = f->number;
		print_figure(bench, f);
	}
}

static void write_json(const struct daemon_bench *bench, const char *path)
{
	for (const struct figure *f = figures; f < figures + n_figures; f++) {
		cJSON *item = report_add(report_array("figures"));

		report_number(item, "case", f->number);
		report_text(item, "name", f->name);
		report_text(item, "unit", f->unit);
		for (unsigned b = 0; b < bench->n_builds; b++)
			if (f->has_value >> b & 1)
				report_number(item, bench->psrd[b], f->value[b]);
		if (f->kind != DAEMON_NO_BOUND)
			report_number(item, f->kind == DAEMON_AT_MOST ? "at most" : "at least", f->bound);
	}
	report_write(path);
}

static void run_cases(struct daemon_bench *bench, const char *only)
{
	char wanted[64], number[16];

	snprintf(wanted, sizeof wanted, ",%s,", only);
	for (number_now = 1; number_now < N_CASES; number_now++) {
		snprintf(number, sizeof number, ",%d,", number_now);
		if (*only != '\0' && strstr(wanted, number) == NULL)
			continue;
		for (bench->build = 0; bench->build < bench->n_builds; bench->build++) {
			fprintf(stderr, "%d %s: %s\n", number_now, bench->psrd[bench->build], cases[number_now].what);
			daemon_others();
			cases[number_now].run(bench);
			daemon_figure(bench, "the machine's processors, used by others", "%", 100 * daemon_others(), DAEMON_NO_BOUND, 0);
		}
	}
}

static struct psr_model *open_model(const char *psr_model, const char *folder, const char *cache)
{
	char source[4096];

	if (mkdir(folder, 0777) != 0 && access(folder, W_OK) != 0)
		report_die(folder, "cannot be made");
	snprintf(source, sizeof source, "%s/dragon.ply", cache);
	if (access(source, R_OK) != 0)
		scene_standard(source, psr_model, folder, "teapot");
	return scene_model(psr_model, folder, DAEMON_MODEL, source, DAEMON_RESOLUTION);
}

/* The first build is an operand. */
static struct daemon_bench bench = { .n_builds = 1, .seconds = 4 };

static int add_build(const char *path, void *userdata, struct psr_error *err)
{
	(void)userdata;
	if (bench.n_builds == DAEMON_MOST_BUILDS)
		return psr_fail(err, PSR_ERR_ARG, "--psrd %s: %d others are compared already", path, DAEMON_MOST_BUILDS - 1);
	bench.psrd[bench.n_builds++] = path;
	return PSR_OK;
}

int main(int argc, char **argv)
{
	const char *json = "", *only = "";
	const struct psr_opt opts[] = {
		{ .name = "psrd", .type = PSR_OPT_CALL, .arg = "PATH", .call = add_build,
		  .help = "Another build's psrd, to be measured beside; repeatable." },
		{ .name = "only", .type = PSR_OPT_STRING, .value = &only, .arg = "N,...", .help = "These cases alone." },
		{ .name = "seconds", .type = PSR_OPT_REAL, .value = &bench.seconds, .arg = "S", .min = 0.1, .max = 3600,
		  .help = "How long a measurement takes; a case has several." },
		{ .name = "json", .type = PSR_OPT_STRING, .value = &json, .arg = "FILE", .help = "Takes the figures, too." },
		{ 0 },
	};
	const struct psr_cli cli = {
		"daemon [options] PSR-MODEL MODELS CACHE PSRD",
		"Measures psrd with two threads under many clients. MODELS is a folder for models, CACHE that of real meshes.",
		opts, NULL, NULL,
	};
	struct psr_error err;
	int n, code = psr_cli_parse(&cli, argc, argv, &n, &err);

	if (code == PSR_OK && n != 4)
		code = psr_fail(&err, PSR_ERR_ARG, "%d operands were given; 4 are needed: daemon --help names them", n);
	if (code != PSR_OK)
		return code < 0 ? psr_cli_fail("daemon", &err) : 0;
	bench.folder = argv[2];
	bench.psrd[0] = argv[4];
	bench.model = open_model(argv[1], argv[2], argv[3]);
	turns_be_short(); /* clients would have machines of their own */
	run_cases(&bench, only);
	printf("psrd with two threads. Where others used the processors, too, compare figures of one run alone.\n");
	print_all(&bench);
	if (*json != '\0')
		write_json(&bench, json);
	psr_model_unref(bench.model);
	return 0;
}
