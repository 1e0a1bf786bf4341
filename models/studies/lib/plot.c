#include <errno.h>
#include <math.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include "study.h"

extern char **environ;

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

static void write_quoted(FILE *to, const char *text)
{
	fputc('\'', to);
	for (; *text != '\0'; text++) {
		if (*text == '\'')
			fputc('\'', to);
		fputc(*text, to);
	}
	fputc('\'', to);
}

static void write_program(FILE *to, const struct study *study, const char *terminal, const char *path)
{
	const struct study_table *table = &study->table;

	fprintf(to, "set terminal %s\nset output ", terminal);
	write_quoted(to, path);
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

static int run_gnuplot(FILE *program, struct psr_error *err)
{
	char *argv[] = { "gnuplot", NULL };
	posix_spawn_file_actions_t actions;
	pid_t child;
	int rc, status = 0;

	if (posix_spawn_file_actions_init(&actions) != 0)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to start gnuplot");
	rc = posix_spawn_file_actions_adddup2(&actions, fileno(program), STDIN_FILENO);
	if (rc == 0)
		rc = posix_spawnp(&child, argv[0], &actions, NULL, argv, environ);
	posix_spawn_file_actions_destroy(&actions);
	if (rc == ENOENT)
		return psr_fail(err, PSR_ERR_NOT_FOUND,
		                "gnuplot, which draws plots, is not installed; install the package gnuplot-nox");
	if (rc != 0)
		return psr_fail(err, PSR_ERR_IO, "gnuplot cannot be started: %s", strerror(rc));
	while (waitpid(child, &status, 0) < 0)
		if (errno != EINTR)
			return psr_fail(err, PSR_ERR_IO, "gnuplot was lost: %s", strerror(errno));
	if (!WIFEXITED(status) || WEXITSTATUS(status) == 127)
		return psr_fail(err, PSR_ERR_IO, "gnuplot, of the package gnuplot-nox, cannot be run");
	if (WEXITSTATUS(status) != 0)
		return psr_fail(err, PSR_ERR_IO, "gnuplot failed; its message stands above");
	return PSR_OK;
}

int study_plot(const struct study *study, const char *path, struct psr_error *err)
{
	const char *terminal = NULL;
	FILE *program;
	int rc = terminal_of(&terminal, path, err);

	if (rc != PSR_OK)
		return rc;
	if (study->kind->plot == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--plot: '%s' is a table without a plot", study->kind->name);
	program = tmpfile();
	if (program == NULL)
		return psr_fail(err, PSR_ERR_IO, "cannot make a temporary file for gnuplot's program: %s", strerror(errno));
	write_program(program, study, terminal, path);
	if (fflush(program) != 0 || lseek(fileno(program), 0, SEEK_SET) != 0)
		rc = psr_fail(err, PSR_ERR_IO, "gnuplot's program cannot be written: %s", strerror(errno));
	else
		rc = run_gnuplot(program, err);
	fclose(program);
	return rc;
}
