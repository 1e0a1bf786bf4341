#include <stdio.h>
#include <string.h>
#include "base/gnuplot.h"
#include "price.h"

/* Knobs that are drawn in a colour of their own; others are grey. */
static const struct {
	const char *knob, *title;
} groups[] = {
	{ "spacing", "spacing" }, { "smoothing", "smoothing" }, { "passes", "passes" }, { "resolution", "resolution of the model" },
	{ "gaps", "gaps" }, { "culling", "culling" },
};
#define N_GROUPS (sizeof groups / sizeof groups[0])

static int is_in(const struct price *price, uint32_t setting, size_t group)
{
	return strcmp(price->set.setting[setting].knob, groups[group].knob) == 0;
}

static void write_points(FILE *to, const struct price *price)
{
	for (size_t g = 0; g < N_GROUPS; g++) {
		fprintf(to, "$group%zu << EOD\n", g);
		for (uint32_t i = 0; i < price->n_choices; i++)
			if (is_in(price, price->choice[i], g))
				fprintf(to, "%.6g %.6g\n", price->point[price->choice[i]].ms, price->point[price->choice[i]].rmse);
		fputs("EOD\n", to);
	}
	fprintf(to, "$usual << EOD\n%.6g %.6g\nEOD\n$unbeaten << EOD\n", price->point[0].ms, price->point[0].rmse);
	for (uint32_t i = 0; i < price->n_unbeaten; i++)
		fprintf(to, "%.6g %.6g \"%s\"\n", price->point[price->unbeaten[i]].ms, price->point[price->unbeaten[i]].rmse,
		        price->set.setting[price->unbeaten[i]].name);
	fputs("EOD\n", to);
}

static void write_plot(FILE *to, const struct price *price, const char *terminal, const char *name)
{
	char path[PRICE_PATH];

	snprintf(path, sizeof path, "%s/%s", price->options->out, name);
	fprintf(to, "set terminal %s\nset output ", terminal);
	gnuplot_quote(to, path);
	fputs("\nplot $unbeaten using 1:2 with fsteps lw 2 lc rgb '#888888' title 'no choice beats these'", to);
	for (size_t g = 0; g < N_GROUPS; g++)
		fprintf(to, ", $group%zu using 1:2 with points pt 7 ps 0.7 title '%s'", g, groups[g].title);
	fputs(", $usual using 1:2 with points pt 6 ps 2 lw 2 lc rgb 'black' title 'usual'"
	      ", $unbeaten using 1:2:3 with labels left offset 0.6,0.6 font ',9' noenhanced notitle\nunset output\n", to);
}

int price_write_plots(struct price *price, struct psr_error *err)
{
	struct psr_error why;
	FILE *to;
	int code = gnuplot_open(&to, &why);

	price->has_plot = 0;
	if (code == PSR_OK) {
		fputs("set logscale xy\nset grid\nset key below horizontal\nset xlabel 'milliseconds a frame'\n"
		      "set ylabel 'error, codes of sRGB (root mean square)'\nset title ", to);
		gnuplot_quote(to, price->title);
		fputs(" noenhanced\n", to);
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
