/* Draws the chosen tests of a suite, many at a time, and judges them. */
#ifndef PSR_CLIENT_TEST_RUN_H
#define PSR_CLIENT_TEST_RUN_H

#include "result.h"

struct run {
	struct psr_client *client;
	struct results *results;
	int timeout_ms;    /* longest silence of the server */
	int wants_figures; /* of pictures that fail */
	/* Called after each picture; may be NULL. */
	void (*on_result)(void *userdata);
	void *userdata;
};

/* Fills in the results of all chosen tests. Whatever a test does, the next one goes on: errors are those of the
 * connection (CONNECTION, PROTOCOL, VERSION), MEMORY, and IO of references that are written. */
int run_tests(const struct run *run, struct psr_error *err);

/* ---- between run.c and time.c ---- */

/* A test on the connection, ready to be drawn. */
struct request {
	const struct suite_test *test;
	struct scene *scene;
	struct psr_camera *camera; /* of each picture */
};
int request_open(struct request *request, const struct run *run, const struct suite_test *test, struct psr_error *err);
void request_close(struct request *request, const struct run *run);

/* Sends picture k. BUSY: frames under way are to be read first. */
struct sent {
	uint32_t frame, scene; /* ids: where the scene fails, the frame shows another one */
};
int request_send(const struct request *request, uint32_t k, struct sent *sent, struct psr_error *err);

/* Whether an error is of the connection or this program, and not of what was asked for. */
int run_is_over(int code);

/* Adds the nanoseconds that a FRAME event says its drawing took to *ns. Returns 0 if it says nothing. */
int run_add_time(uint64_t *ns, const struct psr_event *event);

/* Draws the tests that compare times, one picture at a time, after all others. */
int time_tests(const struct run *run, struct psr_error *err);

#endif
