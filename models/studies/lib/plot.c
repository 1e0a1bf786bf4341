#include <math.h>
#include <string.h>
#include "base/gnuplot.h"
#include "study.h"

static int terminal_of(const char **terminal, const char *path, struct psr_error *err)
{
	const char *dot = strrchr(path, '.');

	for (const char *c = path; *c != '\0'; c++)
		if ((unsigned char)*c < 0x20)
			return psr_fail(err, PSR_ERR_ARG, "--plot: the file's name contains a control character");
	if (dot != NULL && strcmp(dot, ".svg") == 0)
		*terminal = "svg size 720,420 font 'sans,13' background '#ffffff'";
	else if (dot != NULL && strcmp(dot, ".png") == 0)
		*terminal = "pngcairo size 720,420 font 'sans,10'";
	else
		return psr_fail(err, PSR_ERR_ARG, "--plot: the name of '%.200s' must end in .svg or .png", path);
	return PSR_OK;
}

static void write_program(FILE *to, const struct study *study, const char *terminal, const char *path)
{
	const struct study_table *table = &study->table;

	fprintf(to, "set terminal %s\nset output ", terminal);
	gnuplot_quote(to, path);
	fputs("\nset datafile missing 'nan'\n$table << EOD\n", to);
	for (int row = 0; row < table->n_rows; row++) {
		fprintf(to, "%d \"%s\"", row, table->label[row]);
		for (int c = 0; c < table->n_columns; c++) {
			double value = study_mean(table, row, c);

			if (isnan(value))
				fputs(" nan", to);
			else
				fprintf(to, " %.9g", value);
		}
		fputc('\n', to);
	}
	fprintf(to, "EOD\n%s\n", study->kind->plot);
}

int study_plot(const struct study *study, const char *path, struct psr_error *err)
{
	const char *terminal = NULL;
	FILE *gnuplot;
	int rc = terminal_of(&terminal, path, err);

	if (rc != PSR_OK)
		return rc;
	if (study->kind->plot == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--plot: '%s' is a table without a plot", study->kind->name);
	rc = gnuplot_open(&gnuplot, err);
	if (rc != PSR_OK)
		return rc;
	write_program(gnuplot, study, terminal, path);
	return gnuplot_close(gnuplot, err);
}
