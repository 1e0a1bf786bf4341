/* What a test of a suite expects of its pictures. */
#ifndef PSR_CLIENT_TEST_EXPECT_H
#define PSR_CLIENT_TEST_EXPECT_H

#include "client/cli/optlist.h"
#include "psr/frame.h"

#define EXPECT_MOST_DRAWS 1000

enum expect_metric { EXPECT_EXACT, EXPECT_PSNR, EXPECT_SSIM, EXPECT_FLIP, EXPECT_OFF, EXPECT_DEPTH, EXPECT_N_METRICS };

struct expect_hash {
	const char *text;  /* a hash for each picture, with commas between; "?": not known yet; NULL: nothing expected */
	uint64_t *value;   /* of each picture; NULL: not known yet */
};

struct expect {
	struct expect_hash hash[PSR_N_PLANES];
	const char *reference, *depth; /* files, numbered where there are several pictures; NULL: none */
	double bound[EXPECT_N_METRICS]; /* NAN: none. Bounds without a reference are defaults, and not used */
	int is_said[EXPECT_N_METRICS]; /* how often the test itself said the bound, beside the defaults */
	int is_exact;
	unsigned off_codes;
	const char *of;                /* the test whose time is compared; NULL: none */
	double ratio;                  /* most that the time may be of the other's */
	int64_t n_draws;               /* of each of the two */
	int time_line, time_column;    /* of the word */
	uint32_t of_test;              /* its index; suite_parse() finds it */
	int error;                     /* code that the server must answer; PSR_OK: a picture is expected */
};

/* Where the words of times put the place: set before words are parsed. */
struct expect_reader {
	struct expect *expect;
	const struct wordfile *file;
};

void expect_init(struct expect *expect);
void expect_begin(struct expect *expect); /* what it has is defaults: words of a test follow */
void expect_add_options(struct optlist *list, struct expect_reader *reader);

/* Checks what does not depend on other tests, and reads the hashes of n pictures. ARG, MEMORY. */
int expect_finish(struct expect *expect, uint32_t n_pictures, struct psr_error *err);
void expect_fini(struct expect *expect);

/* Returns the planes that are needed: bits of enum psr_plane. */
uint32_t expect_planes(const struct expect *expect);
int expect_wants_hash(const struct expect *expect);

#endif
