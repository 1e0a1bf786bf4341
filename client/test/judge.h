/* Compares a picture with what is expected of it. */
#ifndef PSR_CLIENT_TEST_JUDGE_H
#define PSR_CLIENT_TEST_JUDGE_H

#include "result.h"

struct judge {
	const struct suite_test *test;
	uint32_t k;          /* picture of the test, from 0 */
	int wants_figure;    /* of a picture that fails */
	int is_accepted;     /* references that fail are written anew; hashes are left to accept_write() */
};

/* Fills in the result of a frame. MEMORY, IO: a reference cannot be written. */
int judge_frame(struct result *result, const struct judge *judge, const struct psr_event *event,
                struct psr_error *err);

/* Fills in the result of a picture that the server answered by an error. */
void judge_error(struct result *result, const struct suite_test *test, const struct psr_error *error);

#endif
