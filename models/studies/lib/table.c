#include <assert.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include "study.h"

int study_table_init(struct study_table *table, struct study_form form, int n_rows, int n_models,
                     struct psr_error *err)
{
	size_t n = (size_t)n_rows * (size_t)n_models * (size_t)form.n_columns;

	assert(form.n_columns <= STUDY_MOST_COLUMNS);
	*table = (struct study_table){ .first = form.first, .column = form.column, .n_columns = form.n_columns,
		                           .n_rows = n_rows, .n_models = n_models };
	table->label = calloc((size_t)n_rows, sizeof *table->label);
	table->value = calloc(n, sizeof *table->value);
	if (table->label == NULL || table->value == NULL) {
		study_table_fini(table);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a table");
	}
	for (size_t i = 0; i < n; i++)
		table->value[i] = NAN;
	return PSR_OK;
}

void study_table_fini(struct study_table *table)
{
	free(table->label);
	free(table->value);
	memset(table, 0, sizeof *table);
}

double *study_at(const struct study_table *table, int row, int model, int column)
{
	return &table->value[((size_t)row * (size_t)table->n_models + (size_t)model) * (size_t)table->n_columns
	                     + (size_t)column];
}

void study_label(const struct study_table *table, int row, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	vsnprintf(table->label[row], sizeof *table->label, format, args);
	va_end(args);
}

double study_mean(const struct study_table *table, int row, int column)
{
	double sum = 0;
	int n = 0;

	for (int m = 0; m < table->n_models; m++) {
		double value = *study_at(table, row, m, column);

		sum += isnan(value) ? 0 : value;
		n += !isnan(value);
	}
	return n != 0 ? sum / n : NAN;
}

void study_relate(const struct study_table *table, int from, int to, int base)
{
	for (int row = 0; row < table->n_rows; row++)
		for (int m = 0; m < table->n_models; m++)
			*study_at(table, row, m, to) = *study_at(table, row, m, from) / *study_at(table, base, m, from);
}

/* A table's cell as text; row -1 is the headings, column -1 the labels. */
static const char *cell(char text[32], const struct study_table *table, int row, int column)
{
	if (column < 0)
		return row < 0 ? table->first : table->label[row];
	if (row < 0)
		return table->column[column].name;
	if (isnan(study_mean(table, row, column)))
		return "-";
	snprintf(text, 32, "%.*f", table->column[column].decimals, study_mean(table, row, column));
	return text;
}

#define PAGE_COLUMNS 100

void study_table_print(const struct study_table *table, FILE *to)
{
	int width[STUDY_MOST_COLUMNS + 1] = { 0 }, all = 0, gap; /* of column c: width[c + 1] */
	char text[32];

	for (int c = -1; c < table->n_columns; c++) {
		for (int row = -1; row < table->n_rows; row++) {
			const int n = (int)strlen(cell(text, table, row, c));

			width[c + 1] = n > width[c + 1] ? n : width[c + 1];
		}
		all += width[c + 1];
	}
	/* One space between columns where that fits a page and two do not. */
	gap = all + 2 * table->n_columns > PAGE_COLUMNS && all + table->n_columns <= PAGE_COLUMNS ? 1 : 2;
	for (int row = -1; row < table->n_rows; row++) {
		fprintf(to, "%-*s", width[0], cell(text, table, row, -1));
		for (int c = 0; c < table->n_columns; c++)
			fprintf(to, "%*s", gap + width[c + 1], cell(text, table, row, c));
		fputc('\n', to);
	}
}

void study_step(struct study *study, const char *what)
{
	study->done++;
	if (study->has_bar)
		fprintf(stderr, "\r%-14s %3d/%-3d %-24.24s", study->kind->name, study->done, study->total, what);
}
