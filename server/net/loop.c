#define _GNU_SOURCE
#include <assert.h>
#include <errno.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <unistd.h>
#include "base/clock.h"
#include "loop.h"

static void on_signals(uint32_t events, void *userdata)
{
	struct loop *loop = userdata;
	struct signalfd_siginfo info;

	(void)events;
	while (read(loop->signals.fd, &info, sizeof info) == sizeof info)
		loop->on_signal((int)info.ssi_signo, loop->userdata);
}

static void on_ticks(uint32_t events, void *userdata)
{
	struct loop *loop = userdata;
	uint64_t n;

	(void)events;
	if (read(loop->ticks.fd, &n, sizeof n) == sizeof n)
		loop->on_tick(loop->userdata);
}

static void on_wake(uint32_t events, void *userdata)
{
	struct loop *loop = userdata;
	struct loop_note *note;
	uint64_t n;

	(void)events;
	if (read(loop->wake.fd, &n, sizeof n) < 0)
		return;
	pthread_mutex_lock(&loop->mutex);
	note = loop->first_note;
	loop->first_note = NULL;
	loop->last_note = &loop->first_note;
	pthread_mutex_unlock(&loop->mutex);
	while (note != NULL) {
		struct loop_note *next = note->next; /* fn may free its note */

		note->fn(note->userdata);
		note = next;
	}
}

static int add_own(struct loop *loop, struct loop_source *source, int fd, void (*on_ready)(uint32_t, void *),
                   struct psr_error *err)
{
	if (fd < 0)
		return psr_fail(err, PSR_ERR_IO, "the event loop cannot start: %s", strerror(errno));
	*source = (struct loop_source){ .fd = fd, .on_ready = on_ready, .userdata = loop };
	return loop_add(loop, source, EPOLLIN, err);
}

int loop_init(struct loop *loop, const sigset_t *signals, struct psr_error *err)
{
	int code;

	memset(loop, 0, sizeof *loop);
	loop->signals.fd = loop->ticks.fd = loop->wake.fd = -1;
	loop->last_note = &loop->first_note;
	loop->now_us = clock_ns() / 1000;
	pthread_mutex_init(&loop->mutex, NULL);
	pthread_sigmask(SIG_BLOCK, signals, NULL);
	loop->epoll_fd = epoll_create1(EPOLL_CLOEXEC);
	if (loop->epoll_fd < 0)
		return psr_fail(err, PSR_ERR_IO, "the event loop cannot start: %s", strerror(errno));
	code = add_own(loop, &loop->signals, signalfd(-1, signals, SFD_NONBLOCK | SFD_CLOEXEC), on_signals, err);
	if (code == PSR_OK)
		code = add_own(loop, &loop->ticks, timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC), on_ticks, err);
	if (code == PSR_OK)
		code = add_own(loop, &loop->wake, eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), on_wake, err);
	return code;
}

void loop_fini(struct loop *loop)
{
	const int fds[] = { loop->wake.fd, loop->ticks.fd, loop->signals.fd, loop->epoll_fd };

	for (size_t i = 0; i < sizeof fds / sizeof fds[0]; i++)
		if (fds[i] >= 0)
			close(fds[i]);
	pthread_mutex_destroy(&loop->mutex);
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
	for (int i = loop->at; i < loop->n_batch; i++)
		if (loop->batch[i].data.ptr == source)
			loop->batch[i].data.ptr = NULL;
	source->fd = -1;
}

void loop_set_ticking(struct loop *loop, int on)
{
	const struct timespec period = { .tv_nsec = on ? LOOP_TICK_US * 1000 : 0 };

	timerfd_settime(loop->ticks.fd, 0, &(struct itimerspec){ .it_interval = period, .it_value = period }, NULL);
}

void loop_post(struct loop *loop, struct loop_note *note)
{
	const uint64_t one = 1;

	note->next = NULL;
	pthread_mutex_lock(&loop->mutex);
	*loop->last_note = note;
	loop->last_note = &note->next;
	/* Under the mutex: the loop may end once it has the note, and close the descriptor. */
	while (write(loop->wake.fd, &one, sizeof one) < 0 && errno == EINTR)
		;
	pthread_mutex_unlock(&loop->mutex);
}

static void dispatch(struct loop *loop, int i)
{
	struct loop_source *source = loop->batch[i].data.ptr;

	if (source == NULL)
		return;
	loop->batch[i].data.ptr = NULL;
	source->on_ready(loop->batch[i].events, source->userdata);
}

/* Timers first, then the rest in the order of the kernel. */
int loop_run(struct loop *loop, struct psr_error *err)
{
	while (!loop->is_stopping) {
		int n = epoll_wait(loop->epoll_fd, loop->batch, LOOP_BATCH, -1);

		if (n < 0 && errno != EINTR)
			return psr_fail(err, PSR_ERR_IO, "the event loop failed: %s", strerror(errno));
		loop->now_us = clock_ns() / 1000;
		loop->at = 0;
		loop->n_batch = n < 0 ? 0 : n;
		for (int i = 0; i < loop->n_batch; i++)
			if (loop->batch[i].data.ptr == &loop->ticks)
				dispatch(loop, i);
		for (; loop->at < loop->n_batch; loop->at++)
			dispatch(loop, loop->at);
		loop->n_batch = 0;
		loop->on_batch_end(loop->userdata);
	}
	return PSR_OK;
}

void loop_stop(struct loop *loop)
{
	loop->is_stopping = 1;
}
