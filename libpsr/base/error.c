#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "psr/error.h"

static const struct {
	const char *name;
	int exit_status;
} code_table[] = {
	[-PSR_OK] = { "ok", 0 },
	[-PSR_ERR_ARG] = { "invalid argument", 2 },
	[-PSR_ERR_MEMORY] = { "out of memory", 3 },
	[-PSR_ERR_IO] = { "input/output error", 3 },
	[-PSR_ERR_NOT_FOUND] = { "not found", 3 },
	[-PSR_ERR_FORMAT] = { "bad data", 4 },
	[-PSR_ERR_VERSION] = { "unknown version", 4 },
	[-PSR_ERR_UNSUPPORTED] = { "not supported", 4 },
	[-PSR_ERR_LIMIT] = { "over a limit", 5 },
	[-PSR_ERR_BUSY] = { "busy", 6 },
	[-PSR_ERR_CANCELLED] = { "cancelled", 6 },
	[-PSR_ERR_PROTOCOL] = { "protocol violated", 6 },
	[-PSR_ERR_CONNECTION] = { "no connection", 6 },
	[-PSR_ERR_INTERNAL] = { "internal error", 7 },
};

#define N_CODES ((int)(sizeof code_table / sizeof code_table[0]))

const char *psr_strerror(int code)
{
	return code > 0 || code <= -N_CODES ? "unknown error" : code_table[-code].name;
}

int psr_exit_status(int code)
{
	return code > 0 || code <= -N_CODES ? 7 : code_table[-code].exit_status;
}

int psr_fail(struct psr_error *err, int code, const char *format, ...)
{
	va_list args;
	size_t length;

	if (err == NULL)
		return code;
	err->code = code;
	va_start(args, format);
	if (vsnprintf(err->text, sizeof err->text, format, args) < 0)
		snprintf(err->text, sizeof err->text, "%s", psr_strerror(code));
	va_end(args);
	length = strlen(err->text);
	while (length > 0 && err->text[length - 1] == '\n')
		err->text[--length] = '\0';
	return code;
}
