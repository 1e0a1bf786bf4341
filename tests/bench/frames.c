/* frames PSR-MODEL MODELS OUT CACHE [NAME...]: how fast frames are, beside other renderers, beside the thesis, and as
 * things grow. MODELS takes models that are built once, OUT pictures, plots and bench.json; CACHE has the real meshes.
 * NAME...: parts to run (dragon, engine, teapot, table-8.2, figure-7.4, growth, warp), all without any. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "ours.h"
#include "parts.h"
#include "report.h"

#define N_SUBJECTS 3

static void make_folder(const char *path)
{
	if (mkdir(path, 0777) != 0 && access(path, W_OK) != 0)
		report_die(path, "cannot be made");
}

static int is_asked(const char *name, char **names, int n)
{
	int asked = n == 0;

	for (int i = 0; i < n; i++)
		asked |= strcmp(names[i], name) == 0;
	return asked;
}

static void check_names(char **names, int n)
{
	static const char known[] = " dragon engine teapot table-8.2 figure-7.4 growth warp ";

	for (int i = 0; i < n; i++) {
		char word[64];

		snprintf(word, sizeof word, " %s ", names[i]);
		if (strstr(known, word) == NULL)
			report_die(names[i], "is no part; there are dragon, engine, teapot, table-8.2, figure-7.4, growth, warp");
	}
}

static void describe(const struct part *part)
{
	cJSON *machine = report_object("machine");
	char line[256], name[256] = "unknown processor";
	FILE *file = fopen("/proc/cpuinfo", "r");

	while (file != NULL && fgets(line, sizeof line, file) != NULL)
		if (sscanf(line, "model name : %255[^\n]", name) == 1)
			break;
	if (file != NULL)
		fclose(file);
	report_text(machine, "processor", name);
	report_number(machine, "threads", part->n_threads);
	printf("%s, %d threads. Every figure is the median of frames of a camera that swings; ratios hold, times drift.\n",
	       name, part->n_threads);
}

int main(int argc, char **argv)
{
	char path[N_SUBJECTS][4096], json[4096], **names;
	int n;
	struct subject subject[N_SUBJECTS] = {
		{ "dragon", "stanford", path[0], { 256, 1024, 1024, 2048 }, { -0.1, -0.15, 0 }, 1 },
		{ "engine", "engine", path[1], { 256, 1024, 1024, 1024 }, { 0, 0, 0 }, 0 },
		{ "teapot", "teapot", path[2], { 256, 1024, 1024, 2048 }, { 0, 0, 0 }, 0 },
	};
	struct part part;

	if (argc < 5) {
		fprintf(stderr, "usage: frames PSR-MODEL MODELS OUT CACHE [NAME...]\n");
		return 2;
	}
	names = argv + 5;
	n = argc - 5;
	check_names(names, n);
	part = (struct part){ .psr_model = argv[1], .models = argv[2], .out = argv[3], .n_threads = ours_threads() };
	make_folder(part.models);
	make_folder(part.out);
	snprintf(path[0], sizeof path[0], "%s/dragon.ply", argv[4]);
	snprintf(path[1], sizeof path[1], "%s/engine.glb", argv[4]);
	scene_standard(path[2], part.psr_model, part.models, "teapot");
	describe(&part);
	for (int i = 0; i < N_SUBJECTS; i++) {
		if (!is_asked(subject[i].name, names, n))
			continue;
		if (access(subject[i].source, R_OK) == 0)
			pictures_run(&part, &subject[i]);
		else
			printf("\n%s is not here: make models fetches it\n", subject[i].name);
	}
	const struct subject *largest = access(path[0], R_OK) == 0 ? &subject[0] : &subject[2];
	if (is_asked("table-8.2", names, n))
		thesis_table(&part);
	if (is_asked("figure-7.4", names, n))
		thesis_figure(&part);
	if (is_asked("growth", names, n))
		growth_run(&part, largest);
	if (is_asked("warp", names, n))
		warp_run(&part, largest);
	plot_all(&part);
	report_print_targets();
	snprintf(json, sizeof json, "%s/bench.json", part.out);
	report_write(json);
	printf("Numbers in %s, pictures and plots beside it\n", json);
	return 0;
}
