/* A client's open models, and the numbers (handles) by which it names them. */
#ifndef PSRD_HANDLES_H
#define PSRD_HANDLES_H

#include "catalogue.h"

struct handles {
	struct catalogue *catalogue;
	struct handle {
		uint32_t number;
		struct catalogue_model *model; /* a reference */
	} *handle;
	uint32_t n, max, last; /* last: the latest number given */
};

int handles_init(struct handles *handles, struct catalogue *catalogue, uint32_t max); /* MEMORY */
void handles_fini(struct handles *handles);

uint32_t handles_next(const struct handles *handles); /* returns the number that handles_add() will give, or 0 if it
                                                       * cannot add */
void handles_add(struct handles *handles, struct catalogue_model *model); /* call it only if handles_next() is not 0 */
int handles_close(struct handles *handles, uint32_t number);              /* returns 1 if there was such a handle */

/* Returns NULL if no open model has this number. */
struct catalogue_model *handles_find(const struct handles *handles, uint32_t number);

#endif
