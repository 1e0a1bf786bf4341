/* LIST requests that a session has still to answer: one after another, each in parts. */
#ifndef PSRD_SESSION_LISTS_H
#define PSRD_SESSION_LISTS_H

#include <assert.h>
#include <string.h>
#include "proto/proto.h"

#define LISTS_MAX 64 /* a client has no more open ids */

struct lists {
	uint32_t id[LISTS_MAX];             /* a ring */
	unsigned first, n;
	char after[PSR_WIRE_MAX_NAME + 1];  /* the last name sent; "": none yet */
	uint32_t n_sent;
};

static inline void lists_ask(struct lists *lists, uint32_t id)
{
	assert(lists->n < LISTS_MAX);
	lists->id[(lists->first + lists->n++) % LISTS_MAX] = id;
}

/* Returns the request under way; 0: none. */
static inline uint32_t lists_id(const struct lists *lists)
{
	return lists->n > 0 ? lists->id[lists->first] : 0;
}

/* Ends the request under way, and returns its id; 0: there was none. */
static inline uint32_t lists_end(struct lists *lists)
{
	uint32_t id = lists_id(lists);

	if (id == 0)
		return 0;
	lists->first = (lists->first + 1) % LISTS_MAX;
	lists->n--;
	lists->after[0] = '\0';
	lists->n_sent = 0;
	return id;
}

#endif
