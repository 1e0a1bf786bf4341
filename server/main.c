#include <malloc.h>
#include <stdio.h>
#include "log.h"
#include "options.h"
#include "base/cli.h"
#include "server.h"

#define LARGE_BYTES (128 << 10)

/* Freed large blocks go back to the system. By default, once one has been freed, glibc keeps ever larger ones (up to 32
 * MB) in the heaps of its threads, where pictures of many sizes leave gaps: memory grows beyond what is in use, and
 * beyond --max-memory. */
static void return_large_blocks(void)
{
#ifdef M_MMAP_THRESHOLD
	mallopt(M_MMAP_THRESHOLD, LARGE_BYTES);
#endif
}

int main(int argc, char **argv)
{
	struct options options;
	struct server *server;
	struct psr_error error;
	int code;

	return_large_blocks();
	code = options_parse(&options, argc, argv, &error);
	if (code == PSR_OK) {
		log_set_verbose(options.verbose);
		code = server_start(&server, &options, &error);
		if (code == PSR_OK)
			code = server_run(server, &error);
	}
	options_fini(&options);
	return code < 0 ? psr_cli_fail("psrd", &error) : 0;
}
