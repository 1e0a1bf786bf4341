#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/stats.h"
#include "report.h"
#include "truth.h"

#define N_VALUES 11

/* A line of the file of results: a build's key, a model, a row, and the values. */
struct line {
	uint64_t key;
	char model[32], row[32];
	double value[N_VALUES];
	uint64_t n[6];
};

static struct {
	struct line *line;
	size_t n;
	FILE *file;
} table;

static void pack(struct line *line, const struct psr_errors *e)
{
	const double value[N_VALUES] = { e->psnr,       e->psnr_inside, e->psnr_textured, e->psnr_shading,
		                             e->ssim,       e->flip,        e->depth_rmse,    e->depth_p999,
		                             e->outline_mean, e->outline_max, e->geometry };
	const uint64_t n[6] = { e->n_covered, e->n_inside, e->n_textured, e->n_holes, e->n_leaks, e->n_outline };

	memcpy(line->value, value, sizeof value);
	memcpy(line->n, n, sizeof n);
}

static void unpack(struct psr_errors *e, const struct line *line)
{
	const double *v = line->value;
	const uint64_t *n = line->n;

	*e = (struct psr_errors){ .n_covered = n[0], .n_inside = n[1], .n_textured = n[2], .psnr = v[0],
		                      .psnr_inside = v[1], .psnr_textured = v[2], .ssim = v[4], .flip = v[5], .n_holes = n[3], .n_leaks = n[4],
		                      .depth_rmse = v[6], .depth_p999 = v[7], .n_outline = n[5], .outline_mean = v[8],
		                      .outline_max = v[9], .geometry = v[10], .psnr_shading = v[3] };
}

static struct line *add_line(void)
{
	table.line = realloc(table.line, (table.n + 1) * sizeof *table.line);
	if (table.line == NULL)
		report_die("memory", "there is not enough");
	return &table.line[table.n++];
}

static int read_line(FILE *file, struct line *line)
{
	int n = fscanf(file, "%" SCNx64 " %31s %31s", &line->key, line->model, line->row);

	for (int i = 0; n == 3 && i < N_VALUES; i++)
		if (fscanf(file, "%lf", &line->value[i]) != 1)
			return 0;
	for (int i = 0; n == 3 && i < 6; i++)
		if (fscanf(file, "%" SCNu64, &line->n[i]) != 1)
			return 0;
	return n == 3;
}

void truth_table_open(const char *path)
{
	struct line line;

	table.file = fopen(path, "a+");
	if (table.file == NULL)
		report_die(path, "cannot be written");
	rewind(table.file);
	while (read_line(table.file, &line))
		*add_line() = line;
	fseek(table.file, 0, SEEK_END);
}

static const struct line *find(const struct truth_build *build, const char *model, const struct truth_row *row)
{
	for (size_t i = 0; i < table.n; i++)
		if (table.line[i].key == build->key && strcmp(table.line[i].model, model) == 0 &&
		    strcmp(table.line[i].row, row->name) == 0)
			return &table.line[i];
	return NULL;
}

int truth_table_find(struct truth_result *result, const struct truth_build *build, const char *model,
                     const struct truth_row *row)
{
	const struct line *line = find(build, model, row);

	if (line != NULL)
		unpack(&result->errors, line);
	return line != NULL;
}

void truth_table_add(const struct truth_result *result, const struct truth_build *build, const char *model,
                     const struct truth_row *row)
{
	struct line *line = add_line();

	line->key = build->key;
	snprintf(line->model, sizeof line->model, "%s", model);
	snprintf(line->row, sizeof line->row, "%s", row->name);
	pack(line, &result->errors);
	fprintf(table.file, "%016" PRIx64 " %s %s", line->key, line->model, line->row);
	for (int i = 0; i < N_VALUES; i++)
		fprintf(table.file, " %.9g", line->value[i]);
	for (int i = 0; i < 6; i++)
		fprintf(table.file, " %" PRIu64, line->n[i]);
	fputc('\n', table.file);
	fflush(table.file);
}

static double a_million(uint64_t n, uint64_t of)
{
	return of > 0 ? 1e6 * (double)n / (double)of : 0;
}

void truth_table_head(void)
{
	printf("%-12s %-8s %5s  %6s %6s %6s %6s %6s %6s %8s %8s %9s %6s %8s\n", "model", "row", "build", "PSNR", "inside",
	       "texture", "shading", "SSIM", "FLIP", "holes/M", "leaks/M", "outline/M", "edges", "depth");
}

void truth_table_print(const struct truth_result *result, unsigned n_builds, const char *model,
                       const struct truth_row *row)
{
	for (unsigned b = 0; b < n_builds; b++) {
		const struct psr_errors *e = &result[b].errors;

		printf("%-12s %-8s %5u  %6.2f %6.2f %6.2f %6.2f %6.4f %6.4f %8.1f %8.1f %9.0f %5.0f%% %8.3f", model, row->name,
		       b + 1, e->psnr, e->psnr_inside, e->psnr_textured, e->psnr_shading, e->ssim, e->flip,
		       a_million(e->n_holes, e->n_covered), a_million(e->n_leaks, e->n_covered),
		       a_million(e->n_outline, e->n_covered), 100 * e->geometry, e->depth_rmse);
		if (b > 0)
			printf("  %+.2f", e->psnr - result[0].errors.psnr);
		putchar('\n');
	}
	fflush(stdout);
}

/* ---- the end ---- */

/* The values of a row over models. */
struct column {
	double psnr[64], inside[64], textured[64], gain[64];
	size_t n, n_textured, n_good;
	uint64_t covered, holes, leaks;
};

static void collect(struct column *column, const struct truth_build *build, unsigned b, const struct truth_row *row)
{
	*column = (struct column){ .n = 0 };
	for (size_t i = 0; i < table.n && column->n < 64; i++) {
		const struct line *line = &table.line[i];
		const struct line *first = find(&build[0], line->model, row);

		if (line->key != build[b].key || strcmp(line->row, row->name) != 0 || first == NULL)
			continue;
		column->gain[column->n] = line->value[0] - first->value[0];
		column->psnr[column->n] = line->value[0];
		column->inside[column->n++] = line->value[1];
		if (line->n[2] > 0)
			column->textured[column->n_textured++] = line->value[2];
		column->n_good += line->value[0] >= 40;
		column->covered += line->n[0];
		column->holes += line->n[3];
		column->leaks += line->n[4];
	}
}

static void print_column(struct column *c, unsigned b)
{
	printf("  build %u, %zu models: median %.2f dB, inside %.2f", b + 1, c->n, stats_median(c->psnr, c->n),
	       stats_median(c->inside, c->n));
	if (b > 0)
		printf("; %+.2f dB beside build 1 in the median", stats_median(c->gain, c->n));
	printf("; %zu of 40 dB or more\n", c->n_good);
	if (c->n_textured > 0) {
		stats_sort(c->textured, c->n_textured);
		printf("    textured interiors: worst %.2f dB, median %.2f of %zu\n", c->textured[0],
		       stats_percentile(c->textured, c->n_textured, 0.5), c->n_textured);
	}
	printf("    holes %.2g, leaks %.2g of covered pixels\n", a_million(c->holes, c->covered) * 1e-6,
	       a_million(c->leaks, c->covered) * 1e-6);
}

void truth_table_sum_up(const struct truth_build *build, unsigned n_builds)
{
	static const char *const target[] = {
		"defaults: 4 dB above the old ones, median", "double: 22 dB, 27 inside", "still: 40 dB for 15 of 23",
		"textured interiors: 30 dB", "holes: 1e-6, leaks: 1e-4 of covered pixels",
	};

	for (unsigned r = 0; r < truth_n_rows; r++)
		for (unsigned b = 0; b < n_builds; b++) {
			struct column column;

			collect(&column, build, b, &truth_rows[r]);
			if (column.n == 0)
				continue;
			if (b == 0)
				printf("\n%s: %s\n", truth_rows[r].name, truth_rows[r].what);
			print_column(&column, b);
		}
	puts("\ntargets:");
	for (size_t i = 0; i < sizeof target / sizeof target[0]; i++)
		printf("  %s\n", target[i]);
}
