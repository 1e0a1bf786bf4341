#include <assert.h>
#include <stddef.h>
#include "shares.h"

static int level_of(enum pool_class class)
{
	return class == POOL_REFINING ? SHARES_REFINING : SHARES_FOREGROUND;
}

static int64_t running_ns(const struct shares_account *account, uint64_t now)
{
	return (int64_t)(account->n_running * now - account->starts_ns);
}

static int64_t virtual_ns(const struct shares_account *account, uint64_t now)
{
	return account->virtual_ns + running_ns(account, now);
}

/* Where a flow stands in the queue for one more core. */
static int64_t key_of(const struct shares_account *account, uint64_t now)
{
	return virtual_ns(account, now) + (int64_t)account->n_running * SHARES_QUANTUM_NS;
}

void shares_init(struct shares *shares)
{
	*shares = (struct shares){ 0 };
	shares->flows.next = shares->flows.previous = &shares->flows;
}

void shares_flow_init(struct shares_flow *flow)
{
	*flow = (struct shares_flow){ .last = &flow->first };
}

/* Returns the virtual time of all flows but one: that of the waiting flow which has least, not counting flows that wait
 * for their first core. If none waits, nobody is owed anything, and it is that of the flow which has most. */
static int64_t virtual_time(const struct shares *shares, const struct shares_flow *but, int level, uint64_t now)
{
	const struct shares_flow *least = NULL, *most = NULL;

	for (const struct shares_flow *flow = shares->flows.next; flow != &shares->flows; flow = flow->next) {
		const struct shares_account *account = &flow->account[level];
		const int64_t time = virtual_ns(account, now);

		if (flow == but || !account->is_awake)
			continue;
		if (account->n_wanting > 0 && (least == NULL || time < virtual_ns(&least->account[level], now)))
			least = flow;
		if (account->n_running > 0 && (most == NULL || time > virtual_ns(&most->account[level], now)))
			most = flow;
	}
	if (least == NULL)
		least = most;
	return least != NULL ? virtual_ns(&least->account[level], now) : shares->virtual_ns[level];
}

static void raise_to(struct shares_account *account, int64_t time, uint64_t now)
{
	const int64_t behind = time - virtual_ns(account, now);

	if (behind > 0)
		account->virtual_ns += behind;
}

void shares_enter(struct shares *shares, struct shares_claim *claim, struct shares_flow *flow, enum pool_class class,
                  uint64_t now)
{
	struct shares_account *account = &flow->account[level_of(class)];

	*claim = (struct shares_claim){ .flow = flow, .class = class };
	if (account->n_claims++ == 0) {
		raise_to(account, virtual_time(shares, flow, level_of(class), now) - SHARES_QUANTUM_NS, now);
		account->is_awake = 0;
	}
	if (flow->first == NULL) {
		flow->next = &shares->flows;
		flow->previous = shares->flows.previous;
		flow->previous->next = flow->next->previous = flow;
	}
	*flow->last = claim;
	flow->last = &claim->next;
}

void shares_leave(struct shares *shares, struct shares_claim *claim, uint64_t now)
{
	struct shares_flow *flow = claim->flow;
	const int level = level_of(claim->class);
	struct shares_account *account = &flow->account[level];
	struct shares_claim **at = &flow->first;

	shares_want(shares, claim, 0, now);
	while (*at != claim)
		at = &(*at)->next;
	*at = claim->next;
	if (flow->last == &claim->next)
		flow->last = at;
	account->n_claims--;
	if (shares->virtual_ns[level] < virtual_ns(account, now))
		shares->virtual_ns[level] = virtual_ns(account, now);
	if (flow->first == NULL) {
		flow->previous->next = flow->next;
		flow->next->previous = flow->previous;
	}
}

void shares_want(struct shares *shares, struct shares_claim *claim, int wants, uint64_t now)
{
	const int level = level_of(claim->class);
	struct shares_account *account = &claim->flow->account[level];

	if (claim->wants == wants)
		return;
	claim->wants = wants;
	if (!wants) {
		account->n_wanting--;
		shares->n_wanting[level]--;
		return;
	}
	if (account->n_wanting++ == 0)
		raise_to(account, virtual_time(shares, claim->flow, level, now) - SHARES_OWED_NS, now);
	shares->n_wanting[level]++;
}

void shares_begin(struct shares_claim *claim, uint64_t now)
{
	struct shares_account *account = &claim->flow->account[level_of(claim->class)];

	account->is_awake = 1;
	account->n_running++;
	account->starts_ns += now;
}

void shares_end(struct shares_claim *claim, uint64_t begun, uint64_t now)
{
	struct shares_account *account = &claim->flow->account[level_of(claim->class)];

	assert(account->n_running > 0);
	account->n_running--;
	account->starts_ns -= begun;
	account->virtual_ns += (int64_t)(now - begun);
	claim->flow->used_ns += now - begun;
}

static struct shares_claim *best_of(const struct shares_flow *flow, int level)
{
	struct shares_claim *best = NULL;

	for (struct shares_claim *claim = flow->first; claim != NULL; claim = claim->next)
		if (claim->wants && level_of(claim->class) == level && (best == NULL || claim->class < best->class))
			best = claim;
	return best;
}

/* Returns the first of the waiting flows, but for one. */
static struct shares_flow *first_flow(const struct shares *shares, const struct shares_flow *but, int level,
                                      uint64_t now)
{
	struct shares_flow *best = NULL;

	for (struct shares_flow *flow = shares->flows.next; flow != &shares->flows; flow = flow->next)
		if (flow != but && flow->account[level].n_wanting > 0
		    && (best == NULL || key_of(&flow->account[level], now) < key_of(&best->account[level], now)))
			best = flow;
	return best;
}

struct shares_claim *shares_best(const struct shares *shares, uint64_t now)
{
	const int level = shares->n_wanting[SHARES_FOREGROUND] > 0 ? SHARES_FOREGROUND : SHARES_REFINING;

	return shares->n_wanting[level] > 0 ? best_of(first_flow(shares, NULL, level, now), level) : NULL;
}

/* Behind a flow that holds a core, by more than a quantum if it would hold that core instead. Who wakes up does not
 * wait for that. */
static int is_behind(const struct shares_account *other, const struct shares_account *holder, uint64_t now)
{
	return key_of(other, now) + (other->is_awake ? 2 * SHARES_QUANTUM_NS : 0) < key_of(holder, now);
}

struct shares_claim *shares_rival(const struct shares *shares, const struct shares_claim *claim, uint64_t now)
{
	const int level = level_of(claim->class);
	const struct shares_account *own = &claim->flow->account[level];
	const struct shares_flow *other;
	struct shares_claim *best;

	if (level == SHARES_REFINING && shares->n_wanting[SHARES_FOREGROUND] > 0)
		return shares_best(shares, now);
	if (shares->n_wanting[level] == 0)
		return NULL;
	other = first_flow(shares, claim->flow, level, now);
	if (other != NULL && is_behind(&other->account[level], own, now))
		return best_of(other, level);
	best = best_of(claim->flow, level);
	return best != NULL && best->class < claim->class ? best : NULL;
}

uint64_t shares_used_ns(const struct shares_flow *flow, uint64_t now)
{
	uint64_t used = flow->used_ns;

	for (int level = 0; level < SHARES_LEVELS; level++) {
		const int64_t running = running_ns(&flow->account[level], now);

		used += running > 0 ? (uint64_t)running : 0;
	}
	return used;
}
