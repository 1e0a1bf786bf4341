/* The event loop: one thread, one epoll set; signals, ticks and other threads' notes arrive by file descriptor.
 *
 * All functions but loop_post() belong to the loop's thread. Callbacks may add and remove any source, their own too.
 * The owner of a source must stay until on_batch_end, and may be freed there. */
#ifndef PSRD_LOOP_H
#define PSRD_LOOP_H

#include <pthread.h>
#include <signal.h>
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
};

struct loop_note { /* a message from another thread; its owner keeps it until fn runs */
	struct loop_note *next;
	void (*fn)(void *userdata);
	void *userdata;
};

struct loop {
	int epoll_fd;
	struct loop_source signals, ticks, wake;
	pthread_mutex_t mutex;
	struct loop_note *first_note, **last_note; /* under the mutex */
	uint64_t now_us;        /* monotonic; when this batch began */
	int is_stopping;
	struct epoll_event batch[LOOP_BATCH];
	int at, n_batch;
	void (*on_signal)(int number, void *userdata);
	void (*on_tick)(void *userdata);
	void (*on_batch_end)(void *userdata);
	void *userdata;         /* of these three */
};

/* Blocks `signals` in this thread and later ones, and delivers them to on_signal. IO. */
int loop_init(struct loop *loop, const sigset_t *signals, struct psr_error *err);
void loop_fini(struct loop *loop);

int loop_add(struct loop *loop, struct loop_source *source, uint32_t events, struct psr_error *err); /* IO */
void loop_set(struct loop *loop, struct loop_source *source, uint32_t events);
void loop_remove(struct loop *loop, struct loop_source *source); /* no callback comes any more; fd stays open */
void loop_set_ticking(struct loop *loop, int on); /* on_tick every LOOP_TICK_US */

void loop_post(struct loop *loop, struct loop_note *note); /* any thread: fn(userdata) runs in the loop, in order */

int loop_run(struct loop *loop, struct psr_error *err); /* until loop_stop; IO */
void loop_stop(struct loop *loop);

#endif
