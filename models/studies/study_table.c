#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "study.h"

int study_table_init(struct study_table *table, const char *first, const struct study_column *column, int n_columns,
                     int n_rows, int n_models, struct psr_error *err)
{
	size_t n = (size_t)n_rows * (size_t)n_models * (size_t)n_columns;

	assert(n_columns <= STUDY_MOST_COLUMNS);

	*table = (struct study_table){ .first = first, .column = column, .n_columns = n_columns, .n_rows = n_rows,
		                           .n_models = n_models };
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

double study_mean(const struct study_table *table, int row, int column)
{
	double sum = 0;
	int n = 0;

	for (int m = 0; m < table->n_models; m++) {
		double value = *study_at(table, row, m, column);

		if (!isnan(value)) {
			sum += value;
			n++;
		}
	}
	return n != 0 ? sum / n : NAN;
}

void study_relate(const struct study_table *table, int from, int to, int base)
{
	for (int row = 0; row < table->n_rows; row++)
		for (int m = 0; m < table->n_models; m++)
			*study_at(table, row, m, to) = *study_at(table, row, m, from) / *study_at(table, base, m, from);
}

static void format(char text[32], double value, int decimals)
{
	if (isnan(value))
		strcpy(text, "-");
	else
		snprintf(text, 32, "%.*f", decimals, value);
}

#define PAGE_COLUMNS 100

void study_table_print(const struct study_table *table, FILE *to)
{
	size_t first = strlen(table->first), width[STUDY_MOST_COLUMNS], all;
	char text[32];

	for (int row = 0; row < table->n_rows; row++)
		first = strlen(table->label[row]) > first ? strlen(table->label[row]) : first;
	all = first;
	for (int c = 0; c < table->n_columns; c++) {
		width[c] = strlen(table->column[c].name);
		for (int row = 0; row < table->n_rows; row++) {
			format(text, study_mean(table, row, c), table->column[c].decimals);
			width[c] = strlen(text) > width[c] ? strlen(text) : width[c];
		}
		all += 2 + width[c];
	}
	const int gap = all > PAGE_COLUMNS && all - (size_t)table->n_columns <= PAGE_COLUMNS ? 1 : 2;

	for (int row = -1; row < table->n_rows; row++) {
		fprintf(to, "%-*s", (int)first, row < 0 ? table->first : table->label[row]);
		for (int c = 0; c < table->n_columns; c++) {
			if (row >= 0)
				format(text, study_mean(table, row, c), table->column[c].decimals);
			fprintf(to, "%*s", gap + (int)width[c], row < 0 ? table->column[c].name : text);
		}
		fputc('\n', to);
	}
}
