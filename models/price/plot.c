#include <math.h>
#include <stdio.h>
#include <string.h>
#include "base/gnuplot.h"
#include "price.h"

/* Knobs, each in a colour that colour-blind people tell from the others (Okabe, Ito 2008). */
static const struct {
	const char *knob, *title;
	const char *color;
} groups[] = {
	{ "spacing", "spacing", "#0072b2" },       { "smoothing", "smoothing", "#e69f00" },
	{ "passes", "passes", "#d55e00" },         { "resolution", "resolution of the model", "#009e73" },
	{ "gaps", "gaps", "#cc79a7" },             { "shadows", "shadows", "#56b4e9" },
};
#define LABEL_LOG 0.1 /* a name needs so much room above the next */
#define N_GROUPS (sizeof groups / sizeof groups[0])

static int is_in(const struct price *price, uint32_t setting, size_t group)
{
	return strcmp(price->set.setting[setting].knob, groups[group].knob) == 0;
}

/* Room around all choices, and for names on the right. */
static void write_ranges(FILE *to, const struct price *price)
{
	struct ladder_point least = { INFINITY, INFINITY }, most = { 0, 0 };

	for (uint32_t i = 0; i < price->n_choices; i++) {
		const struct ladder_point *point = &price->point[price->choice[i]];

		least = (struct ladder_point){ fmin(least.ms, point->ms), fmin(least.rmse, point->rmse) };
		most = (struct ladder_point){ fmax(most.ms, point->ms), fmax(most.rmse, point->rmse) };
	}
	fprintf(to, "set xrange [%.6g:%.6g]\nset yrange [%.6g:%.6g]\n", least.ms / 1.3, most.ms * 2.5,
	        fmax(least.rmse, 0.01) / 1.2, fmax(most.rmse, 0.01) * 1.2);
}

static void write_points(FILE *to, const struct price *price)
{
	const struct ladder_point *labelled = NULL;

	for (size_t g = 0; g < N_GROUPS; g++) {
		fprintf(to, "$group%zu << EOD\n", g);
		for (uint32_t i = 0; i < price->n_choices; i++)
			if (is_in(price, price->choice[i], g))
				fprintf(to, "%.6g %.6g\n", price->point[price->choice[i]].ms, price->point[price->choice[i]].rmse);
		fputs("EOD\n", to);
	}
	fprintf(to, "$usual << EOD\n%.6g %.6g\nEOD\n$unbeaten << EOD\n", price->point[0].ms, price->point[0].rmse);
	for (uint32_t i = 0; i < price->n_unbeaten; i++) {
		const struct ladder_point *point = &price->point[price->unbeaten[i]];
		const int has_room = labelled == NULL || fabs(log(point->rmse / labelled->rmse)) > LABEL_LOG;

		fprintf(to, "%.6g %.6g \"%s\"\n", point->ms, point->rmse,
		        has_room ? price->set.setting[price->unbeaten[i]].name : "");
		labelled = has_room ? point : labelled;
	}
	fputs("EOD\n", to);
}

static void write_plot(FILE *to, const struct price *price, const char *terminal, const char *name)
{
	char path[PRICE_PATH];

	snprintf(path, sizeof path, "%s/%s", price->options->out, name);
	fprintf(to, "set terminal %s\nset output ", terminal);
	gnuplot_quote(to, path);
	fputs("\nplot $unbeaten using 1:2 with steps lw 2 lc rgb '#888888' title 'no choice beats these'", to);
	for (size_t g = 0; g < N_GROUPS; g++)
		fprintf(to, ", $group%zu using 1:2 with points pt 7 ps 0.8 lc rgb '%s' title '%s'", g, groups[g].color,
		        groups[g].title);
	fputs(", $usual using 1:2 with points pt 6 ps 2 lw 2 lc rgb 'black' title 'usual'"
	      ", $unbeaten using 1:2:3 with labels left offset 0.6,0.6 font ',9' noenhanced notitle\nunset output\n", to);
}

int price_write_plots(struct price *price, struct psr_error *err)
{
	char title[256];
	struct psr_error why;
	FILE *to;
	int code = gnuplot_open(&to, &why);

	price->has_plot = 0;
	if (code == PSR_OK) {
		fputs("set logscale xy\nset ytics add (2, 3, 5, 20, 30, 50)\nset grid xtics ytics\nset key below horizontal\n"
		      "set xlabel 'milliseconds a frame'\n"
		      "set ylabel 'error, codes of sRGB (root mean square)'\nset title ", to);
		snprintf(title, sizeof title, "What accuracy costs: %s", price->title);
		gnuplot_quote(to, title);
		fputs(" noenhanced\n", to);
		write_ranges(to, price);
		write_points(to, price);
		write_plot(to, price, "svg size 900,560 background 'white' font 'sans,12'", "plot.svg");
		write_plot(to, price, "png size 900,560 font 'sans,10'", "plot.png");
		code = gnuplot_close(to, &why);
	}
	price->has_plot = code == PSR_OK;
	if (code == PSR_ERR_NOT_FOUND)
		fprintf(stderr, "psr-model accuracy: there is no plot: %s\n", why.text);
	return code == PSR_OK || code == PSR_ERR_NOT_FOUND ? PSR_OK : psr_fail(err, code, "%s", why.text);
}
