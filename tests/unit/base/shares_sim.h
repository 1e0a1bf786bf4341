/* Cores that work for jobs of flows, simulated: what a pool would ask shares.h. */
#ifndef TEST_SHARES_SIM_H
#define TEST_SHARES_SIM_H

#include <string.h>
#include "base/random.h"
#include "base/shares.h"

/* The clock is stepped from one end of an index or serial part to the next.
 * A job is a number of frames' phases: a serial part, then a loop. */

#define MAX_CORES 8
#define MAX_FLOWS 8
#define MAX_JOBS 24
#define NEVER UINT64_MAX
#define US UINT64_C(1000)
#define MS UINT64_C(1000000)

struct sim_job {
	struct shares_claim claim; /* the first member */
	int is_live, flow, is_in_loop, is_held; /* held: a core runs its serial part */
	unsigned n, taken, done, phases_left;
	uint64_t serial_ns, index_ns; /* at most; each is drawn anew */
};

struct core {
	struct sim_job *job; /* NULL: idle */
	uint64_t begun, ends;
};

struct sim {
	struct shares shares;
	struct shares_flow flow[MAX_FLOWS];
	struct sim_job job[MAX_JOBS];
	struct core core[MAX_CORES];
	int n_cores, n_flows;
	uint64_t now, random, steps;
	uint64_t longest; /* index or serial part so far */
	uint64_t waits_since[MAX_FLOWS]; /* it has had no core since its first claim came; or NEVER */
	uint64_t longest_wait;
};

static void sim_init(struct sim *sim, int n_cores, int n_flows, uint64_t seed)
{
	memset(sim, 0, sizeof *sim);
	shares_init(&sim->shares);
	sim->n_cores = n_cores;
	sim->n_flows = n_flows;
	sim->random = seed;
	for (int i = 0; i < n_flows; i++) {
		shares_flow_init(&sim->flow[i]);
		sim->waits_since[i] = NEVER;
	}
}

static uint64_t up_to(struct sim *sim, uint64_t ns)
{
	const uint64_t drawn = 1 + ns / 2 + random_below(&sim->random, (uint32_t)(ns / 2 + 1));

	if (drawn > sim->longest)
		sim->longest = drawn;
	return drawn;
}

/* What the machine is told, derived again from the jobs. */
static int has_work(const struct sim_job *job)
{
	return job->is_live && (job->is_in_loop ? job->taken < job->n : !job->is_held);
}

static int is_refining(const struct sim_job *job)
{
	return job->claim.class == POOL_REFINING;
}

static int some_foreground_waits(const struct sim *sim)
{
	for (int i = 0; i < MAX_JOBS; i++)
		if (has_work(&sim->job[i]) && !is_refining(&sim->job[i]))
			return 1;
	return 0;
}

static int is_idle(const struct sim *sim, int flow)
{
	for (int i = 0; i < MAX_JOBS; i++)
		if (sim->job[i].is_live && sim->job[i].flow == flow)
			return 0;
	return 1;
}

struct kind {
	int flow;
	enum pool_class class;
	unsigned n, phases;
	uint64_t serial_ns, index_ns;
};

static void submit(struct sim *sim, struct kind kind)
{
	struct sim_job *job = sim->job;

	while (job->is_live)
		assert_true(++job < sim->job + MAX_JOBS);
	if (is_idle(sim, kind.flow) && kind.class != POOL_REFINING)
		sim->waits_since[kind.flow] = sim->now;
	*job = (struct sim_job){ .is_live = 1, .flow = kind.flow, .n = kind.n, .phases_left = kind.phases,
	                         .serial_ns = kind.serial_ns, .index_ns = kind.index_ns };
	shares_enter(&sim->shares, &job->claim, &sim->flow[kind.flow], kind.class, sim->now);
	shares_want(&sim->shares, &job->claim, 1, sim->now);
}

/* The next index, or the serial part. Refining begins only where nobody else waits. */
static void go_on(struct sim *sim, struct core *core, struct sim_job *job)
{
	if (is_refining(job))
		assert_false(some_foreground_waits(sim));
	assert_true(has_work(job));
	if (job->is_in_loop) {
		core->ends = sim->now + up_to(sim, job->index_ns);
		job->taken++;
	} else {
		core->ends = sim->now + up_to(sim, job->serial_ns);
		job->is_held = 1;
	}
	shares_want(&sim->shares, &job->claim, has_work(job), sim->now);
	sim->steps++;
}

static void fill_cores(struct sim *sim)
{
	for (int i = 0; i < sim->n_cores; i++) {
		struct core *core = &sim->core[i];
		struct sim_job *job;

		if (core->job != NULL)
			continue;
		job = (struct sim_job *)shares_best(&sim->shares, sim->now);
		if (job == NULL)
			break;
		core->job = job;
		core->begun = sim->now;
		shares_begin(&job->claim, sim->now);
		if (sim->waits_since[job->flow] != NEVER && !is_refining(job)) {
			const uint64_t waited = sim->now - sim->waits_since[job->flow];

			if (waited > sim->longest_wait)
				sim->longest_wait = waited;
			sim->waits_since[job->flow] = NEVER;
		}
		go_on(sim, core, job);
	}
}

/* No core is idle while a job has work. */
static void assert_all_work(const struct sim *sim)
{
	int n_idle = 0;

	for (int i = 0; i < sim->n_cores; i++)
		n_idle += sim->core[i].job == NULL;
	for (int i = 0; i < MAX_JOBS && n_idle > 0; i++)
		assert_false(has_work(&sim->job[i]));
}

static void end_phase(struct sim_job *job)
{
	if (!job->is_in_loop) {
		job->is_held = 0;
		job->is_in_loop = 1;
		job->taken = job->done = 0;
	} else if (++job->done == job->n) {
		job->is_in_loop = 0;
		job->phases_left--;
	}
}

static void leave(struct sim *sim, struct core *core)
{
	shares_end(&core->job->claim, core->begun, sim->now);
	core->job = NULL;
}

static void finish(struct sim *sim, struct core *core)
{
	struct sim_job *job = core->job;

	end_phase(job);
	if (job->phases_left == 0) {
		leave(sim, core);
		shares_leave(&sim->shares, &job->claim, sim->now);
		job->is_live = 0;
		return;
	}
	shares_want(&sim->shares, &job->claim, has_work(job), sim->now);
	if (has_work(job) && shares_rival(&sim->shares, &job->claim, sim->now) == NULL)
		go_on(sim, core, job);
	else
		leave(sim, core);
}

/* To the next end of an index or part, but not beyond `until`. */
static void step(struct sim *sim, uint64_t until)
{
	struct core *next = NULL;

	fill_cores(sim);
	assert_all_work(sim);
	for (int i = 0; i < sim->n_cores; i++)
		if (sim->core[i].job != NULL && (next == NULL || sim->core[i].ends < next->ends))
			next = &sim->core[i];
	if (next == NULL || next->ends > until) {
		sim->now = until;
		return;
	}
	sim->now = next->ends;
	finish(sim, next);
	fill_cores(sim);
}

static void run_until(struct sim *sim, uint64_t until)
{
	while (sim->now < until)
		step(sim, until);
}

static uint64_t used(const struct sim *sim, int flow)
{
	return shares_used_ns(&sim->flow[flow], sim->now);
}

static struct kind endless(int flow, enum pool_class class, uint64_t index_ns)
{
	return (struct kind){ .flow = flow, .class = class, .n = 1000000000, .phases = 1, .serial_ns = 10 * US,
	                      .index_ns = index_ns };
}

/* A flow's cores can each be an index and a quantum ahead of another flow that got none meanwhile. */
static uint64_t bound_of(const struct sim *sim)
{
	return (uint64_t)sim->n_cores * (sim->longest + SHARES_QUANTUM_NS);
}

#endif
