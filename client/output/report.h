/* The report of a picture as JSON; docs/man/psr.1 lists its fields. */
#ifndef PSR_CLIENT_OUTPUT_REPORT_H
#define PSR_CLIENT_OUTPUT_REPORT_H

#include "client/scene/scene.h"

struct shot_facts {
	const struct scene *scene;
	const struct psr_msg_frame *frame; /* the request */
	const struct psr_event *event;     /* of the frame */
	const char *server;                /* name and version from WELCOME */
	uint64_t start_ns;                 /* clock_ns() before anything was opened */
};

/* Writes the report to a file; "-" is standard output. */
int report_write(const struct shot_facts *facts, const char *path, struct psr_error *err);

#endif
