#include "gnuplot.h"
#include <errno.h>
#include <signal.h>
#include <string.h>
#include <sys/wait.h>

int gnuplot_open(FILE **out, struct psr_error *err)
{
	signal(SIGPIPE, SIG_IGN); /* where there is no gnuplot */
	*out = popen("command -v gnuplot >/dev/null || exit 127; exec gnuplot", "w");
	return *out != NULL ? PSR_OK : psr_fail(err, PSR_ERR_IO, "gnuplot cannot be started: %s", strerror(errno));
}

void gnuplot_quote(FILE *gnuplot, const char *text)
{
	fputc('\'', gnuplot);
	for (; *text != '\0'; text++) {
		if (*text == '\'')
			fputc('\'', gnuplot);
		fputc(*text, gnuplot);
	}
	fputc('\'', gnuplot);
}

int gnuplot_close(FILE *gnuplot, struct psr_error *err)
{
	const int status = pclose(gnuplot);

	if (WIFEXITED(status) && WEXITSTATUS(status) == 127)
		return psr_fail(err, PSR_ERR_NOT_FOUND,
		                "gnuplot, which draws plots, is not installed; install the package gnuplot-nox");
	return status == 0 ? PSR_OK : psr_fail(err, PSR_ERR_IO, "gnuplot failed; its message stands above");
}
