/* The report of a shot as JSON; docs/man/psr.1 lists its fields. */
#ifndef PSR_CLIENT_REPORT_H
#define PSR_CLIENT_REPORT_H

#include "psr/client.h"

struct shot_facts {
	const char *model, *codec;
	const struct psr_msg_opened *opened;
	const struct psr_event *event; /* of the frame */
	const char *server;            /* name and version, as WELCOME has it */
	uint64_t total_ns;             /* opening and the frame */
};

int report_write(const struct shot_facts *facts, const char *path, struct psr_error *err);

#endif
