#define _GNU_SOURCE
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include "outcome.h"

#define AGAIN "psrd tries again in 10 minutes at the earliest" /* BUILDER_RETRY_US */

/* The file's name, as people see it. */
static const char *name_of(const struct outcome *outcome)
{
	const char *slash = strrchr(outcome->source, '/');

	return slash != NULL ? slash + 1 : outcome->source;
}

/* Takes psr-model's last line, without the source's path in front, and with "the cache" for its target. */
static void get_words(char words[PSR_ERROR_TEXT], const struct outcome *outcome)
{
	const char *from = outcome->last_line, *target = strstr(from, outcome->target);
	const size_t n = strlen(outcome->source);

	if (from[0] == '\0')
		from = "psr-model failed without saying why";
	else if (target != NULL)
		snprintf(words, PSR_ERROR_TEXT, "%.*sthe cache%s", (int)(target - from), from, target + strlen(outcome->target));
	else if (strncmp(from, outcome->source, n) == 0 && from[n] == ':')
		from += n + 1 + strspn(from + n + 1, " ");
	if (target == NULL)
		snprintf(words, PSR_ERROR_TEXT, "%s", from);
}

static int explain_signal(struct psr_error *error, const struct outcome *outcome, int number)
{
	const struct builder_limits *limits = outcome->limits;
	const char *name = name_of(outcome);

	if (outcome->end == OUTCOME_UNWANTED)
		return psr_fail(error, PSR_ERR_CANCELLED, "%s: the build was ended, since nobody waited for it", name);
	if (outcome->end == OUTCOME_WALL)
		return psr_fail(error, PSR_ERR_LIMIT, "%s: the build was stopped: it took more than %" PRIu64 " s "
		                "(--build-wall-time); " AGAIN, name, limits->wall_seconds);
	if (number == SIGXCPU)
		return psr_fail(error, PSR_ERR_LIMIT, "%s: the build was stopped: it needed more than %" PRIu64 " s of processor "
		                "time (--build-time); a lower --max-resolution takes less; " AGAIN, name, limits->cpu_seconds);
	if (number == SIGXFSZ)
		return psr_fail(error, PSR_ERR_LIMIT, "%s: the build was stopped: it wrote a file of more than %.1f MB "
		                "(--build-file-size); a lower --max-resolution takes less; " AGAIN, name,
		                (double)limits->file_bytes * 1e-6);
	if (number == SIGSEGV || number == SIGBUS || number == SIGABRT || number == SIGFPE || number == SIGILL)
		return psr_fail(error, PSR_ERR_FORMAT, "%s: psr-model crashed on it (signal %d); " AGAIN, name, number);
	return psr_fail(error, PSR_ERR_BUSY, "%s: the build was killed (signal %d), by the system for lack of memory or by "
	                "somebody on the server; open it again to try once more", name, number);
}

static int explain_exit(struct psr_error *error, const struct outcome *outcome, int status)
{
	const struct builder_limits *limits = outcome->limits;
	const char *name = name_of(outcome);
	char words[PSR_ERROR_TEXT];

	get_words(words, outcome);
	switch (status) {
	case 3:
		if (strcasestr(words, "memory") == NULL)
			return psr_fail(error, PSR_ERR_IO, "%s: %.400s", name, words);
		return psr_fail(error, PSR_ERR_LIMIT, "%s: %.250s; a build may take %.1f MB (--build-memory), and a lower "
		                "--max-resolution takes less; " AGAIN, name, words, (double)limits->memory_bytes * 1e-6);
	case 4:
		return psr_fail(error, PSR_ERR_FORMAT, "%s: %.400s", name, words);
	case 5:
		return psr_fail(error, PSR_ERR_LIMIT, "%s: %.400s", name, words);
	default:
		return psr_fail(error, PSR_ERR_INTERNAL, "%s: %.400s", name, words);
	}
}

enum outcome_memory outcome_explain(struct psr_error *error, const struct outcome *outcome)
{
	int code;

	if (WIFSIGNALED(outcome->status))
		code = explain_signal(error, outcome, WTERMSIG(outcome->status));
	else
		code = explain_exit(error, outcome, WEXITSTATUS(outcome->status));
	if (code == PSR_ERR_FORMAT && WIFEXITED(outcome->status))
		return OUTCOME_FOR_GOOD;
	return code == PSR_ERR_FORMAT || code == PSR_ERR_LIMIT ? OUTCOME_FOR_A_WHILE : OUTCOME_FORGET;
}
