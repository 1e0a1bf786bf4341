/* The models that a client has open, by the numbers (handles) that it calls them by. */
#ifndef PSRD_HANDLES_H
#define PSRD_HANDLES_H

#include "catalogue.h"

struct handles {
	struct catalogue *catalogue;
	struct handle {
		uint32_t number;
		struct catalogue_model *model; /* a reference */
	} *handle;
	uint32_t n, max, last; /* last: number given most recently */
};

int handles_init(struct handles *handles, struct catalogue *catalogue, uint32_t max); /* MEMORY */
void handles_fini(struct handles *handles);

uint32_t handles_next(const struct handles *handles); /* the number that handles_add() will give; 0 if it cannot */
void handles_add(struct handles *handles, struct catalogue_model *model); /* handles_next() is not 0 */
int handles_close(struct handles *handles, uint32_t number);              /* 1 if there was one */

/* NULL if no open model has this number. */
struct catalogue_model *handles_find(const struct handles *handles, uint32_t number);

#endif
