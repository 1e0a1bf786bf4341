#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <unistd.h>
#include "viewer.h"

struct bell {
	pthread_t thread;
	int fd, control[2]; /* bytes into control: 'h' heard, 'q' ends */
	uint32_t event;
};

/* Waits until somebody has heard the last ring before it listens again. */
static void *ring(void *userdata)
{
	struct bell *bell = userdata;
	struct pollfd polled[2] = { { .fd = bell->control[0], .events = POLLIN }, { .fd = bell->fd, .events = POLLIN } };
	int has_rung = 0;

	for (;;) {
		SDL_Event event = { .type = bell->event };
		char word;

		if (poll(polled, has_rung ? 1 : 2, -1) < 0 && errno != EINTR)
			return NULL;
		if (polled[0].revents != 0) {
			if (read(bell->control[0], &word, 1) != 1 || word == 'q')
				return NULL;
			has_rung = 0;
		} else if (!has_rung && polled[1].revents != 0) {
			has_rung = SDL_PushEvent(&event) == 1;
		}
	}
}

int bell_create(struct bell **out, int fd, uint32_t event, struct psr_error *err)
{
	struct bell *bell = calloc(1, sizeof *bell);

	if (bell == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a window");
	bell->fd = fd;
	bell->event = event;
	if (pipe(bell->control) != 0) {
		free(bell);
		return psr_fail(err, PSR_ERR_IO, "the system gives no pipe");
	}
	if (pthread_create(&bell->thread, NULL, ring, bell) != 0) {
		close(bell->control[0]);
		close(bell->control[1]);
		free(bell);
		return psr_fail(err, PSR_ERR_MEMORY, "the system starts no more threads");
	}
	*out = bell;
	return PSR_OK;
}

static void say(struct bell *bell, char word)
{
	while (write(bell->control[1], &word, 1) < 0 && errno == EINTR)
		;
}

void bell_heard(struct bell *bell)
{
	say(bell, 'h');
}

void bell_destroy(struct bell *bell)
{
	if (bell == NULL)
		return;
	say(bell, 'q');
	pthread_join(bell->thread, NULL);
	close(bell->control[0]);
	close(bell->control[1]);
	free(bell);
}
