#define _GNU_SOURCE
#include <assert.h>
#include <errno.h>
#include <sched.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/turns.h"
#include "loop.h"

static void on_signals(uint32_t events, void *userdata)
{
	struct loop *loop = userdata;
	struct signalfd_siginfo info;

	(void)events;
	while (read(loop->signals.fd, &info, sizeof info) == sizeof info)
		loop->on_signal((int)info.ssi_signo, loop->userdata);
}

static void run_notes(struct loop *loop)
{
	struct loop_note *last, *note = NULL;

	atomic_store(&loop->is_asleep, 0);
	last = atomic_exchange(&loop->last_note, NULL);
	while (last != NULL) {
		struct loop_note *before = last->next;

		last->next = note;
		note = last;
		last = before;
	}
	while (note != NULL) {
		struct loop_note *next = note->next; /* fn may free its note */

		note->fn(note->userdata);
		note = next;
	}
}

/* Does nothing: each batch begins with the notes. The source is edge-triggered, so nobody has to read it. */
static void on_wake(uint32_t events, void *userdata)
{
	(void)events;
	(void)userdata;
}

static int add_own(struct loop *loop, struct loop_source *source, int fd, uint32_t events, struct psr_error *err)
{
	if (fd < 0)
		return psr_fail(err, PSR_ERR_IO, "the event loop cannot start: %s", strerror(errno));
	source->fd = fd;
	source->userdata = loop;
	return loop_add(loop, source, events, err);
}

int loop_init(struct loop *loop, const sigset_t *signals, struct psr_error *err)
{
	int code;

	memset(loop, 0, sizeof *loop);
	loop->signals.fd = loop->wake.fd = -1;
	loop->signals.on_ready = on_signals;
	loop->wake.on_ready = on_wake;
	loop->now_us = clock_ns() / 1000;
	pthread_sigmask(SIG_BLOCK, signals, NULL);
	loop->epoll_fd = epoll_create1(EPOLL_CLOEXEC);
	if (loop->epoll_fd < 0)
		return psr_fail(err, PSR_ERR_IO, "the event loop cannot start: %s", strerror(errno));
	code = add_own(loop, &loop->signals, signalfd(-1, signals, SFD_NONBLOCK | SFD_CLOEXEC), EPOLLIN, err);
	if (code == PSR_OK)
		code = add_own(loop, &loop->wake, eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), EPOLLIN | EPOLLET, err);
	return code;
}

void loop_fini(struct loop *loop)
{
	const int fds[] = { loop->wake.fd, loop->signals.fd, loop->epoll_fd };

	while (atomic_load(&loop->n_posting) > 0) /* the note has arrived, but its thread may still have to write to the
	                                           * descriptor */
		sched_yield();
	for (size_t i = 0; i < sizeof fds / sizeof fds[0]; i++)
		if (fds[i] >= 0)
			close(fds[i]);
}

int loop_add(struct loop *loop, struct loop_source *source, uint32_t events, struct psr_error *err)
{
	struct epoll_event event = { .events = events, .data.ptr = source };

	if (epoll_ctl(loop->epoll_fd, EPOLL_CTL_ADD, source->fd, &event) != 0)
		return psr_fail(err, PSR_ERR_IO, "a descriptor cannot be watched: %s", strerror(errno));
	source->events = events;
	return PSR_OK;
}

void loop_set(struct loop *loop, struct loop_source *source, uint32_t events)
{
	struct epoll_event event = { .events = events, .data.ptr = source };

	if (source->fd < 0 || source->events == events)
		return;
	source->events = events;
	if (epoll_ctl(loop->epoll_fd, EPOLL_CTL_MOD, source->fd, &event) != 0)
		assert(!"a source that is in the loop can be changed");
}

void loop_remove(struct loop *loop, struct loop_source *source)
{
	if (source->fd < 0)
		return;
	epoll_ctl(loop->epoll_fd, EPOLL_CTL_DEL, source->fd, NULL);
	for (int i = 0; i < loop->n_batch; i++)
		if (loop->batch[i].data.ptr == source)
			loop->batch[i].data.ptr = NULL;
	source->fd = -1;
}

void loop_set_ticking(struct loop *loop, int on)
{
	loop->tick_us = on ? loop->now_us + LOOP_TICK_US : 0;
}

void loop_go_on(struct loop *loop)
{
	loop->goes_on = 1;
}

void loop_post(struct loop *loop, struct loop_note *note)
{
	const uint64_t one = 1;

	atomic_fetch_add(&loop->n_posting, 1);
	note->next = atomic_load(&loop->last_note);
	while (!atomic_compare_exchange_weak(&loop->last_note, &note->next, note))
		;
	if (atomic_exchange(&loop->is_asleep, 0))
		while (write(loop->wake.fd, &one, sizeof one) < 0 && errno == EINTR)
			;
	atomic_fetch_sub(&loop->n_posting, 1);
}

/* Returns how many milliseconds epoll may wait, or -1 for no limit. From here on a note wakes the loop. */
static int fall_asleep(struct loop *loop)
{
	uint64_t due_us = loop->tick_us, now_us;

	if (loop->goes_on) {
		loop->goes_on = 0;
		return 0;
	}
	atomic_store(&loop->is_asleep, 1);
	if (atomic_load(&loop->last_note) != NULL)
		return 0;
	if (loop->wake_us != 0 && (due_us == 0 || loop->wake_us < due_us))
		due_us = loop->wake_us;
	if (due_us == 0)
		return -1;
	now_us = clock_ns() / 1000;
	return now_us >= due_us ? 0 : (int)((due_us - now_us + 999) / 1000);
}

static void dispatch(struct loop *loop, int are_last)
{
	for (int i = 0; i < loop->n_batch; i++) {
		struct loop_source *source = loop->batch[i].data.ptr;

		if (source == NULL || source->is_last != are_last)
			continue;
		loop->batch[i].data.ptr = NULL;
		source->on_ready(loop->batch[i].events, source->userdata);
	}
}

void loop_wake_at(struct loop *loop, uint64_t us)
{
	loop->wake_us = us;
}

int loop_run(struct loop *loop, struct psr_error *err)
{
	turns_be_short();
	while (!loop->is_stopping) {
		int n = epoll_wait(loop->epoll_fd, loop->batch, LOOP_BATCH, fall_asleep(loop));

		if (n < 0 && errno != EINTR)
			return psr_fail(err, PSR_ERR_IO, "the event loop failed: %s", strerror(errno));
		loop->now_us = clock_ns() / 1000;
		loop->n_batch = n < 0 ? 0 : n;
		if (loop->tick_us != 0 && loop->now_us >= loop->tick_us) {
			loop->late_us = loop->now_us - loop->tick_us;
			loop->tick_us = loop->now_us + LOOP_TICK_US;
			loop->on_tick(loop->userdata);
		}
		run_notes(loop);
		dispatch(loop, 0);
		dispatch(loop, 1);
		loop->n_batch = 0;
		loop->on_batch_end(loop->userdata);
		if (atomic_load(&loop->last_note) != NULL) { /* what its end did itself is done without another wait */
			run_notes(loop);
			loop->on_batch_end(loop->userdata);
		}
	}
	return PSR_OK;
}

void loop_stop(struct loop *loop)
{
	loop->is_stopping = 1;
}
