/* A suite: requests for pictures, and what is expected of them. docs/man/psr-suite.5 describes the file. */
#ifndef PSR_CLIENT_TEST_SUITE_H
#define PSR_CLIENT_TEST_SUITE_H

#include "client/scene/quality.h"
#include "client/scene/view.h"
#include "expect.h"

#define SUITE_MAX_TESTS 10000
#define SUITE_MAX_PICTURES 100000

struct suite_test {
	const char *name;
	int line, column; /* of the word test=NAME */
	struct scene_wish scene;
	struct view_wish view;
	struct quality_wish quality;
	const char *cameras; /* file, or NULL */
	int64_t n_turn;      /* pictures of a turntable; 0: this is not one */
	struct expect expect;
	/* made of these: */
	struct views views;
	struct psr_msg_frame frame; /* all fields but the camera */
	uint32_t n_pictures;
};

struct suite {
	const char *path;   /* the caller's */
	char *name;         /* of the file without folders and ending */
	char *folder;       /* of the file, with a / at its end; "": the current one */
	const char *models; /* folder that a private psrd serves, or NULL */
	struct suite_test *test;
	uint32_t n_tests;
	char *text;         /* holds the strings */
	char **made;        /* paths beside the suite */
	uint32_t n_made;
};

/* Reads and checks a suite, and the files of scenes and cameras that it names. Errors of its text are ARG or LIMIT, and
 * name the place, `demo.suite:3:14: ...`; NOT_FOUND, IO, FORMAT, MEMORY. */
int suite_read(struct suite **out, const char *path, struct psr_error *err);

/* The same for a text of malloc(), which the suite owns from now on, also after a failure. */
int suite_parse(struct suite **out, const char *path, char *text, struct psr_error *err);
void suite_free(struct suite *suite); /* NULL is fine */

/* Returns the path of a file that the suite names, which is absolute or beside the suite; NULL: no memory. */
const char *suite_beside(struct suite *suite, const char *name);

#endif
