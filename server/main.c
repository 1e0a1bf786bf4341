#include <stdio.h>
#include "log.h"
#include "options.h"
#include "base/cli.h"
#include "server.h"

int main(int argc, char **argv)
{
	struct options options;
	struct server *server;
	struct psr_error error;
	int code = options_parse(&options, argc, argv, &error);

	if (code == PSR_OK) {
		log_set_verbose(options.verbose);
		code = server_start(&server, &options, &error);
		if (code == PSR_OK)
			code = server_run(server, &error);
	}
	options_fini(&options);
	return code < 0 ? psr_cli_fail("psrd", &error) : 0;
}
