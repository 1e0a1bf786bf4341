/* The link's own thread: connects, serves the connection until it ends, and connects again. */
#include <math.h>
#include <poll.h>
#include <string.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/random.h"
#include "link_inside.h"

#define MOST_HELP 3

/* 0: link_close() was called. */
static int begin_connecting(struct link *link)
{
	int is_open;

	pthread_mutex_lock(&link->lock);
	is_open = !link->is_closing;
	link->is_connecting = is_open;
	pthread_mutex_unlock(&link->lock);
	return is_open;
}

/* The same, with what WELCOME said; client NULL: it failed. */
static int end_connecting(struct link *link, const struct psr_client *client)
{
	struct link_state *state = &link->state;
	int is_open;

	pthread_mutex_lock(&link->lock);
	link->is_connecting = 0;
	is_open = !link->is_closing;
	if (is_open && client != NULL) {
		link->fd = psr_client_fd(client, NULL);
		state->n_connected++;
		state->capabilities = psr_client_welcome(client)->capabilities;
		memcpy(state->server, psr_client_welcome(client)->server, sizeof state->server);
		link_say(link, LINK_NEWS_STATE);
	}
	pthread_mutex_unlock(&link->lock);
	return is_open;
}

static void name_first_model(char name[PSR_WIRE_MAX_NAME + 1], struct link *link)
{
	pthread_mutex_lock(&link->lock);
	strcpy(name, link->wish.wish.n_instances > 0 ? link->wish.instance[0].model : "");
	pthread_mutex_unlock(&link->lock);
}

/* The link's own thread decodes, too, and the window's threads have to draw. Without help it decodes alone. */
static void get_help(struct psr_client *client)
{
	const long n_cores = sysconf(_SC_NPROCESSORS_ONLN), n = n_cores - 1 < MOST_HELP ? n_cores - 1 : MOST_HELP;

	if (n > 0)
		psr_client_use_threads(client, (int)n, NULL);
}

/* One connection. PSR_ERR_CANCELLED: no error, but other models are wished, or link_close() was called. */
static int connect_and_serve(struct link *link, int *has_shown, struct psr_error *err)
{
	char model[PSR_WIRE_MAX_NAME + 1];
	struct psr_client *client = NULL;
	int code;

	name_first_model(model, link);
	code = psr_client_connect(&client, link->address, link->program, model[0] != '\0' ? model : NULL, LINK_CONNECT_MS,
	                          err);
	if (code == PSR_OK)
		get_help(client);
	if (end_connecting(link, client) && code == PSR_OK)
		code = link_serve(link, client, has_shown, err);
	pthread_mutex_lock(&link->lock);
	link->fd = -1;
	link->state.is_refining = 0;
	if (link->is_interrupted)
		code = PSR_ERR_CANCELLED;
	link->is_interrupted = 0;
	pthread_mutex_unlock(&link->lock);
	psr_client_close(client);
	return code;
}

static void sleep_until(struct link *link, uint64_t until_ns)
{
	struct pollfd waits = { .fd = link->wake_fd, .events = POLLIN };
	int is_closing = 0;

	for (uint64_t now_ns; !is_closing && (now_ns = clock_ns()) < until_ns;) {
		poll(&waits, 1, (int)((until_ns - now_ns) / 1000000 + 1));
		link_drain(link->wake_fd);
		pthread_mutex_lock(&link->lock);
		is_closing = link->is_closing;
		pthread_mutex_unlock(&link->lock);
	}
}

void *link_thread(void *userdata)
{
	struct link *link = userdata;
	uint64_t random = clock_ns();
	double backoff_s = LINK_BACKOFF_LOW_S;

	while (begin_connecting(link)) {
		struct psr_error err = { 0 };
		int has_shown = 0;
		const int code = connect_and_serve(link, &has_shown, &err);
		uint64_t until_ns;

		if (code == PSR_ERR_CANCELLED)
			continue;
		if (has_shown)
			backoff_s = LINK_BACKOFF_LOW_S;
		until_ns = clock_ns() + (uint64_t)(random_in(&random, 0.75, 1.25) * backoff_s * 1e9);
		backoff_s = fmin(2 * backoff_s, LINK_BACKOFF_HIGH_S);
		pthread_mutex_lock(&link->lock);
		link->state.retry_ns = until_ns;
		pthread_mutex_unlock(&link->lock);
		link_set_phase(link, LINK_LOST, &err);
		sleep_until(link, until_ns);
	}
	return NULL;
}
