#include <stdlib.h>
#include <string.h>
#include "failures.h"

void failures_fini(struct failures *failures)
{
	for (size_t i = 0; i < FAILURES_MAX; i++)
		free(failures->failure[i]);
}

void failures_add(struct failures *failures, const char *key, uint32_t resolution, uint64_t until_us,
                  const struct psr_error *error)
{
	struct failure **place = &failures->failure[failures->n++ % FAILURES_MAX];

	if (*place == NULL)
		*place = malloc(sizeof **place);
	if (*place == NULL) {
		failures->n--;
		return;
	}
	memcpy((*place)->key, key, CATALOGUE_KEY);
	(*place)->resolution = resolution;
	(*place)->until_us = until_us;
	(*place)->error = *error;
}

const struct psr_error *failures_find(const struct failures *failures, const char *key, uint32_t resolution,
                                      uint64_t now_us)
{
	for (size_t i = 0; i < FAILURES_MAX && failures->failure[i] != NULL; i++) {
		const struct failure *failure = failures->failure[i];

		if (now_us < failure->until_us && strcmp(failure->key, key) == 0
		    && (failure->resolution == 0 || failure->resolution == resolution))
			return &failure->error;
	}
	return NULL;
}
