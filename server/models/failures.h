/* The latest 256 failures of builds, so that nobody pays for the same failure again and again. */
#ifndef PSRD_FAILURES_H
#define PSRD_FAILURES_H

#include "catalogue.h"

#define FAILURES_MAX 256
#define FAILURES_ALWAYS UINT64_MAX

struct failures {
	struct failure {
		char key[CATALOGUE_KEY];
		uint32_t resolution; /* 0: the failure holds for every resolution */
		uint64_t until_us;
		struct psr_error error;
	} *failure[FAILURES_MAX]; /* a ring */
	unsigned n;
};

void failures_fini(struct failures *failures);

/* Remembers a failure of this key until the given time; without memory it does not. */
void failures_add(struct failures *failures, const char *key, uint32_t resolution, uint64_t until_us,
                  const struct psr_error *error);

/* Returns NULL if no failure still counts. */
const struct psr_error *failures_find(const struct failures *failures, const char *key, uint32_t resolution,
                                      uint64_t now_us);

#endif
