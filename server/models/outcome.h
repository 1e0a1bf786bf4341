/* What the end of a build means for people and for the next request. */
#ifndef PSRD_OUTCOME_H
#define PSRD_OUTCOME_H

#include "builder.h"

enum outcome_end { OUTCOME_BY_ITSELF, OUTCOME_WALL, OUTCOME_UNWANTED }; /* why psrd killed the child, or that it did
                                                                         * not */

struct outcome {
	const char *source, *target; /* paths */
	const char *last_line; /* last line that the child wrote on standard error; "": none */
	int status;            /* as from waitpid() */
	enum outcome_end end;
	const struct builder_limits *limits;
};

enum outcome_memory { OUTCOME_FORGET, OUTCOME_FOR_A_WHILE, OUTCOME_FOR_GOOD };

/* Fills the error, which names the file without its folder. Returns for how long the failure counts. Expects exit
 * statuses of psr_exit_status(). */
enum outcome_memory outcome_explain(struct psr_error *error, const struct outcome *outcome);

#endif
