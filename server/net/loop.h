/* The event loop: one thread, one epoll set. Signals and other threads' notes arrive by file descriptor. A batch begins
 * with the tick and ends with sources marked is_last, such as listeners: work for connections comes before new
 * connections.
 *
 * All functions but loop_post() belong to the loop's thread. Callbacks may add and remove any source, including their
 * own. The owner of a source must stay until on_batch_end, and may be freed there. */
#ifndef PSRD_LOOP_H
#define PSRD_LOOP_H

#include <signal.h>
#include <stdatomic.h>
#include <stdint.h>
#include <sys/epoll.h>
#include "psr/error.h"

#define LOOP_BATCH 64
#define LOOP_TICK_US 100000

struct loop_source { /* part of its owner */
	int fd;          /* the owner's; -1 while it is not in the loop */
	uint32_t events;
	void (*on_ready)(uint32_t events, void *userdata);
	void *userdata;
	int is_last;     /* handled after the other sources of a batch */
};

struct loop_note { /* a message from another thread; its owner keeps it until fn runs */
	struct loop_note *next;
	void (*fn)(void *userdata);
	void *userdata;
};

struct loop {
	int epoll_fd;
	struct loop_source signals, wake;
	/* Without a lock: the loop might wake a thread, which takes its core, and then wait for a lock that this thread
	 * holds. */
	struct loop_note *_Atomic last_note; /* head of a list, latest first */
	atomic_int is_asleep;   /* the next note has to wake the loop */
	atomic_uint n_posting;  /* threads inside of loop_post() */
	uint64_t now_us;        /* monotonic; when this batch began */
	uint64_t tick_us;       /* when the next tick is due; 0: no ticks */
	uint64_t late_us;       /* how late this tick is */
	uint64_t wake_us;       /* when a batch begins at the latest; 0: only when something happens */
	int is_stopping, goes_on;
	struct epoll_event batch[LOOP_BATCH];
	int n_batch;
	void (*on_signal)(int number, void *userdata);
	void (*on_tick)(void *userdata);
	void (*on_batch_end)(void *userdata);
	void *userdata;         /* of the three callbacks */
};

/* Blocks `signals` in this thread and later ones, and delivers them to on_signal. IO. */
int loop_init(struct loop *loop, const sigset_t *signals, struct psr_error *err);
void loop_fini(struct loop *loop);

int loop_add(struct loop *loop, struct loop_source *source, uint32_t events, struct psr_error *err); /* IO */
void loop_set(struct loop *loop, struct loop_source *source, uint32_t events);
void loop_remove(struct loop *loop, struct loop_source *source); /* ends its callbacks; fd stays open */
void loop_set_ticking(struct loop *loop, int on); /* on_tick every LOOP_TICK_US */
void loop_wake_at(struct loop *loop, uint64_t us); /* a batch begins then at the latest; 0: no such limit */
void loop_go_on(struct loop *loop); /* the next batch begins without waiting: there is work left */

void loop_post(struct loop *loop, struct loop_note *note); /* from any thread: the loop runs fn(userdata), in order */

int loop_run(struct loop *loop, struct psr_error *err); /* runs until loop_stop(). IO */
void loop_stop(struct loop *loop);

#endif
