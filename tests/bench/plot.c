/* Plots of what the JSON has, by gnuplot; without it they are left out, with a word. */
#include <stdio.h>
#include <string.h>
#include "child.h"
#include "parts.h"
#include "report.h"

#define MOST_LINES 3

struct line {
	const char *title, *key; /* of a number of each item */
};

static const struct plot {
	const char *array, *title, *x_label, *y_label, *axes;
	struct line line[MOST_LINES];
} plots[] = {
	{ "samples", "1024x1024: milliseconds by samples of the scene", "samples", "ms", "set logscale xy",
	  { { "one level", "ms" }, { "all levels", "ms_with_levels" } } },
	{ "pixels", "milliseconds by pixels, half covered", "pixels", "ms", "set logscale xy", { { "frame", "ms" } } },
	{ "lights", "1024x1024 half covered: milliseconds by lights", "lights", "ms", "set yrange [0:*]",
	  { { "directional", "ms" }, { "point", "ms_point" } } },
	{ "instances", "1024x1024: milliseconds by instances in the room of one", "instances", "ms",
	  "set logscale x 2\nset yrange [0:*]",   { { "frame", "ms" } } },
	{ "warp", "warp with culling and binning, by threads", "threads", "Mpt/s", "set yrange [0:*]\nset xtics 1",
	  { { "C", "c" }, { "AVX2", "avx2" }, { "AVX-512", "avx512" } } },
};

static void write_data(FILE *file, const cJSON *array, const char *key)
{
	const cJSON *item;

	cJSON_ArrayForEach(item, array) {
		const cJSON *y = cJSON_GetObjectItemCaseSensitive(item, key);

		if (y != NULL)
			fprintf(file, "%.17g %.17g\n", cJSON_GetNumberValue(cJSON_GetObjectItemCaseSensitive(item, "x")),
			        cJSON_GetNumberValue(y));
	}
	fputs("e\n", file);
}

static int has_data(const cJSON *array, const char *key)
{
	const cJSON *item;
	int n = 0;

	cJSON_ArrayForEach(item, array)
		n += key != NULL && cJSON_GetObjectItemCaseSensitive(item, key) != NULL;
	return n > 0;
}

static int write_plot(FILE *file, const struct part *part, const struct plot *plot)
{
	const cJSON *array = report_array(plot->array);

	if (cJSON_GetArraySize(array) == 0)
		return 0;
	fprintf(file, "reset\nset terminal svg size 640,400 background 'white'\nset output '%s/%s.svg'\nset title '%s'\n"
	        "set xlabel '%s'\nset ylabel '%s'\nset grid\nset key outside top horizontal\n%s\nplot", part->out,
	        plot->array, plot->title, plot->x_label, plot->y_label, plot->axes);
	for (int i = 0, n = 0; i < MOST_LINES; i++)
		if (has_data(array, plot->line[i].key))
			fprintf(file, "%s '-' with linespoints title '%s'", n++ > 0 ? "," : "", plot->line[i].title);
	fputs("\n", file);
	for (int i = 0; i < MOST_LINES; i++)
		if (has_data(array, plot->line[i].key))
			write_data(file, array, plot->line[i].key);
	return 1;
}

/* Bars, a picture each, of all renderers' times. */
static int write_peers(FILE *file, const struct part *part)
{
	static const char *const key[] = { "ours", "embree", "embree-shadow", "llvmpipe-mesh", "llvmpipe-points-vertex" };
	const cJSON *array = report_array("pictures"), *item;

	if (cJSON_GetArraySize(array) == 0)
		return 0;
	fprintf(file, "reset\nset terminal svg size 900,500 background 'white'\nset output '%s/peers.svg'\n"
	        "set title 'milliseconds a frame, nothing encoded'\nset style data histograms\nset style fill solid 0.7\n"
	        "set logscale y\nset yrange [0.1:*]\nset grid ytics\nset xtics rotate by -30\nset key outside top horizontal\nplot",
	        part->out);
	for (int i = 0; i < 5; i++)
		fprintf(file, "%s '-' using 2:xtic(1) title '%s'", i > 0 ? "," : "", key[i]);
	fputs("\n", file);
	for (int i = 0; i < 5; i++) {
		cJSON_ArrayForEach(item, array) {
			const cJSON *peer = cJSON_GetObjectItemCaseSensitive(item, key[i]);

			fprintf(file, "\"%s, %s\" %.17g\n",
			        cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, "model")),
			        cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, "picture")),
			        cJSON_GetNumberValue(cJSON_GetObjectItemCaseSensitive(peer, "ms")));
		}
		fputs("e\n", file);
	}
	return 1;
}

void plot_all(const struct part *part)
{
	char path[4096];
	const char *argv[] = { "/usr/bin/env", "gnuplot", path, NULL };
	struct child_use use;
	FILE *file;
	int n;

	snprintf(path, sizeof path, "%s/plots.gnuplot", part->out);
	file = fopen(path, "w");
	if (file == NULL)
		report_die(path, "cannot be written");
	n = write_peers(file, part);
	for (size_t i = 0; i < sizeof plots / sizeof plots[0]; i++)
		n += write_plot(file, part, &plots[i]);
	if (fclose(file) != 0)
		report_die(path, "cannot be written");
	if (n > 0 && child_run(&use, argv) != 0)
		printf("\nNo plots: gnuplot is missing, or refuses %s\n", path);
}
