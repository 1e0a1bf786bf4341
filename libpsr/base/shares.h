/* Decides who gets a core next: fair queueing of jobs by flow. A state machine without threads, clock or memory of its
 * own: its caller gives the time (`now`, in ns, which never falls but for races of some microseconds), keeps all
 * structs, and calls one function at a time.
 *
 * A job has a claim, which wants cores or does not. Refining claims come after all others. Before that the flow with
 * the least virtual time comes first. A flow's virtual time is the time that it held cores; when its first claim comes,
 * it rises to a quantum less than that of waiting flows, so that a flow saves up no idle time, and is next when it
 * comes back. Within a flow the class comes first, then the older claim. Refining time is counted apart, since it takes
 * nothing from anyone. A core that a flow holds counts as a quantum more, so that flows of equal right spread over the
 * cores. */
#ifndef PSR_BASE_SHARES_H
#define PSR_BASE_SHARES_H

#include <stdint.h>
#include "pool.h"

/* A core changes its flow when another flow is behind by more than this: a hand-over costs some 10 us. */
#define SHARES_QUANTUM_NS 1000000

/* The most that a flow with claims can be owed: a flow that could use a single core for seconds, while others took the
 * rest, does not get all cores for seconds after it. */
#define SHARES_OWED_NS 50000000

enum { SHARES_FOREGROUND, SHARES_REFINING, SHARES_LEVELS };

/* A flow's standing at one level. */
struct shares_account {
	int64_t virtual_ns;  /* of ended parts */
	uint64_t starts_ns;  /* sum over the running parts, modulo 2^64 */
	unsigned n_claims, n_wanting, n_running;
	int is_awake;        /* it got a core since its first claim came */
};

struct shares_flow {
	struct shares_flow *next, *previous; /* list of the flows that have claims */
	struct shares_claim *first, **last;
	struct shares_account account[SHARES_LEVELS];
	uint64_t used_ns; /* of ended parts */
};

struct shares_claim {
	struct shares_claim *next;
	struct shares_flow *flow;
	enum pool_class class;
	int wants;
};

struct shares {
	struct shares_flow flows; /* head of a ring */
	int64_t virtual_ns[SHARES_LEVELS]; /* virtual time of the last flow when it left no other behind */
	unsigned n_wanting[SHARES_LEVELS];
};

void shares_init(struct shares *shares);
void shares_flow_init(struct shares_flow *flow);

/* Adds a claim, which wants nothing yet; removes one for which no core works. */
void shares_enter(struct shares *shares, struct shares_claim *claim, struct shares_flow *flow, enum pool_class class,
                  uint64_t now);
void shares_leave(struct shares *shares, struct shares_claim *claim, uint64_t now);

void shares_want(struct shares *shares, struct shares_claim *claim, int wants, uint64_t now);

/* A core begins to work for the claim; a core that began at this time ends. */
void shares_begin(struct shares_claim *claim, uint64_t now);
void shares_end(struct shares_claim *claim, uint64_t begun, uint64_t now);

/* Returns the claim that gets the next core, or NULL. */
struct shares_claim *shares_best(const struct shares *shares, uint64_t now);

/* A core that works for `claim` could stop: returns the claim that takes it, or NULL. */
struct shares_claim *shares_rival(const struct shares *shares, const struct shares_claim *claim, uint64_t now);

/* Returns all time that cores worked for the flow. */
uint64_t shares_used_ns(const struct shares_flow *flow, uint64_t now);

#endif
