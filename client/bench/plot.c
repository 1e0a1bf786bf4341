#include "plot.h"
#include <stdio.h>
#include <string.h>
#include "base/gnuplot.h"
#include "base/outfile.h"

static const char *terminal_of(const char *path)
{
	const char *ending = outfile_ending(path);

	return strcmp(ending, "svg") == 0 ? "svg size 900,420 background 'white' font 'sans,11'"
	       : strcmp(ending, "png") == 0 ? "png size 900,420 font 'sans,9'" : NULL;
}

int plot_check(const char *path, struct psr_error *err)
{
	return terminal_of(path) != NULL
	           ? PSR_OK : psr_fail(err, PSR_ERR_ARG, "--plot: '%.200s' ends neither in .svg nor in .png", path);
}

static int open_gnuplot(FILE **out, const char *path, const char *what, struct psr_error *err)
{
	struct psr_error why;
	const int code = gnuplot_open(out, &why);

	if (code != PSR_OK)
		return psr_fail(err, code, "--plot: %s", why.text);
	fprintf(*out, "set terminal %s\nset output ", terminal_of(path));
	gnuplot_quote(*out, path);
	fputs("\nset multiplot layout 1,2 title ", *out);
	gnuplot_quote(*out, what);
	fputs(" noenhanced\nset grid\nset key below horizontal\n", *out);
	return PSR_OK;
}

static int close_gnuplot(FILE *gnuplot, struct psr_error *err)
{
	struct psr_error why;
	int code;

	fputs("unset multiplot\n", gnuplot);
	code = gnuplot_close(gnuplot, &why);
	return code == PSR_OK ? PSR_OK : psr_fail(err, code, "--plot: %s", why.text);
}

int plot_load(const struct bench_result *result, const char *what, const char *path, struct psr_error *err)
{
	const struct histogram *latency = &result->measure.latency;
	FILE *to;
	uint64_t n = 0;
	int code = latency->n > 0 ? open_gnuplot(&to, path, what, err)
	                          : psr_fail(err, PSR_ERR_CONNECTION, "--plot: nothing was answered, so there is no plot");

	if (code != PSR_OK)
		return code;
	fputs("$rows << EOD\n", to);
	for (size_t i = 0; i < result->n_rows; i++)
		fprintf(to, "%.3f %.4f %.4f %.4f\n", result->row[i].seconds, (double)result->row[i].p50_ns / 1e6,
		        (double)result->row[i].p99_ns / 1e6, (double)result->row[i].max_ns / 1e6);
	fputs("EOD\n$part << EOD\n", to); /* how rare: one of so many takes longer */
	for (size_t i = 0; i < HISTOGRAM_BUCKETS; i++) {
		if (latency->count[i] == 0)
			continue;
		n += latency->count[i];
		fprintf(to, "%.6g %.4f\n", n < latency->n ? (double)latency->n / (double)(latency->n - n) : 2.0 * (double)n,
		        (double)histogram_value(i) / 1e6);
	}
	fprintf(to, "EOD\nset logscale y\nset xrange [0:%.6g]\n", result->seconds);
	fputs("set xlabel 'seconds'\nset ylabel 'latency, ms'\n"
	      "plot $rows using 1:2 with lines lw 2 title 'p50', '' using 1:3 with lines lw 2 title 'p99', "
	      "'' using 1:4 with lines title 'max'\n"
	      "set logscale x\nset xrange [1:*]\nset xlabel 'per cent of the answers that came sooner'\nunset key\n"
	      "set xtics ('0' 1, '50' 2, '90' 10, '99' 100, '99.9' 1000, '99.99' 10000, '99.999' 100000)\n"
	      "plot $part using 1:2 with steps lw 2\n", to);
	return close_gnuplot(to, err);
}

int plot_sweep(const struct sweep *sweep, const struct sweep_points *points, const char *what, const char *path,
               struct psr_error *err)
{
	const char *label = sweep->is_rate ? "requests a second" : "clients";
	FILE *to;
	int code = open_gnuplot(&to, path, what, err);

	if (code != PSR_OK)
		return code;
	fputs("$points << EOD\n", to);
	for (uint32_t i = 0; i < points->n; i++)
		fprintf(to, "%.6g %.4f %.4f %.4f %d\n", points->point[i].load, points->point[i].frames_per_s,
		        points->point[i].ms.p50, points->point[i].ms.p99, (int)i == points->knee);
	fprintf(to, "EOD\nset logscale x 2\nset xlabel '%s'\nset ylabel 'frames/s'\nset yrange [0:*]\n"
	        "plot $points using 1:2 with linespoints lw 2 notitle, "
	        "'' using 1:($5 == 1 ? $2 : NaN) with points pt 7 ps 2 lc rgb 'black' title 'knee'\n", label);
	fputs("set ylabel 'latency, ms'\nset logscale y\nset yrange [*:*]\n"
	      "plot $points using 1:3 with linespoints lw 2 title 'p50', '' using 1:4 with linespoints lw 2 title 'p99', "
	      "'' using 1:($5 == 1 ? $4 : NaN) with points pt 7 ps 2 lc rgb 'black' title 'knee'\n", to);
	return close_gnuplot(to, err);
}
