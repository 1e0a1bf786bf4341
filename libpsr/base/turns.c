#define _GNU_SOURCE
#include <sched.h>
#include <stdint.h>
#include <sys/syscall.h>
#include <unistd.h>
#include "turns.h"

/* Threads and processes that this one starts have turns of the usual length. */
#define RESET_ON_FORK 1

/* As linux/sched/types.h has it, which cannot stand beside sched.h; its first version. */
struct attributes {
	uint32_t size, policy;
	uint64_t flags;
	int32_t nice;
	uint32_t priority;
	uint64_t runtime, deadline, period;
};

void turns_be_short(void)
{
	struct attributes attributes = { .size = sizeof attributes };

	if (syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0) != 0 || attributes.policy != 0)
		return;
	attributes.flags |= RESET_ON_FORK;
	attributes.runtime = 100000;
	syscall(SYS_sched_setattr, 0, &attributes, 0);
}

void turns_let_others_in(void)
{
	sched_yield();
}

void turns_keep_apart(const pthread_t *thread, int n)
{
	cpu_set_t all, own;
	int cpu = -1;

	if (pthread_getaffinity_np(pthread_self(), sizeof all, &all) != 0 || CPU_COUNT(&all) != n)
		return;
	for (int i = 0; i < n; i++) {
		do
			cpu++;
		while (!CPU_ISSET(cpu, &all));
		CPU_ZERO(&own);
		CPU_SET(cpu, &own);
		pthread_setaffinity_np(thread[i], sizeof own, &own);
	}
}
