/* Opening takes minutes where a model has to be built first, and the thread that waits for it can do nothing else; so a
 * second one, with a connection of its own, asks for it. */
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "link_inside.h"

#define TIMEOUT_MS 10000

struct link_errand {
	pthread_mutex_t lock;
	unsigned n_refs;             /* of the thread, and of who asks */
	int wake_fd, fd;             /* fd: shut down to interrupt; -1: none */
	int is_left, is_done, code;
	struct psr_error err;
	struct psr_msg_progress progress;
	uint32_t at, n;
	struct psr_msg_list_entry *list;
	uint32_t n_list;
	char address[300], program[PSR_WIRE_MAX_NAME + 1];
	struct link_errand_model model[];
};

static void unref(struct link_errand *errand)
{
	int is_last;

	pthread_mutex_lock(&errand->lock);
	is_last = --errand->n_refs == 0;
	pthread_mutex_unlock(&errand->lock);
	if (!is_last)
		return;
	pthread_mutex_destroy(&errand->lock);
	close(errand->wake_fd);
	free(errand->list);
	free(errand);
}

static void on_progress(const struct psr_msg_progress *progress, void *userdata)
{
	struct link_errand *errand = userdata;

	pthread_mutex_lock(&errand->lock);
	errand->progress = *progress;
	pthread_mutex_unlock(&errand->lock);
	link_wake(errand->wake_fd);
}

static int open_all(struct link_errand *errand, struct psr_client *client, struct psr_error *err)
{
	struct psr_msg_opened opened;
	int code = PSR_OK;

	psr_client_on_progress(client, on_progress, errand);
	for (uint32_t i = 0; i < errand->n && code == PSR_OK; i++) {
		pthread_mutex_lock(&errand->lock);
		errand->at = i;
		memset(&errand->progress, 0, sizeof errand->progress);
		pthread_mutex_unlock(&errand->lock);
		psr_client_set_resolution(client, errand->model[i].pixels);
		psr_client_set_levels(client, errand->model[i].levels);
		code = psr_client_open(client, errand->model[i].name, TIMEOUT_MS, &opened, err);
	}
	return code;
}

static int go(struct link_errand *errand, struct psr_error *err)
{
	struct psr_client *client;
	int is_left, code = psr_client_connect(&client, errand->address, errand->program,
	                                       errand->n > 0 ? errand->model[0].name : NULL, LINK_CONNECT_MS, err);

	if (code != PSR_OK)
		return code;
	pthread_mutex_lock(&errand->lock);
	errand->fd = psr_client_fd(client, NULL);
	is_left = errand->is_left;
	pthread_mutex_unlock(&errand->lock);
	if (!is_left && errand->n > 0)
		code = open_all(errand, client, err);
	else if (!is_left)
		code = psr_client_list(client, &errand->list, &errand->n_list, TIMEOUT_MS, err);
	pthread_mutex_lock(&errand->lock);
	errand->fd = -1;
	pthread_mutex_unlock(&errand->lock);
	psr_client_close(client);
	return code;
}

static void *run(void *userdata)
{
	struct link_errand *errand = userdata;
	struct psr_error err = { 0 };
	const int code = go(errand, &err);

	pthread_mutex_lock(&errand->lock);
	errand->code = code;
	errand->err = err;
	errand->is_done = 1;
	pthread_mutex_unlock(&errand->lock);
	link_wake(errand->wake_fd);
	unref(errand);
	return NULL;
}

int link_errand_start(struct link_errand **out, const struct link *link, const struct link_errand_model *model,
                      uint32_t n, struct psr_error *err)
{
	struct link_errand *errand = calloc(1, sizeof *errand + n * sizeof *model);
	pthread_t thread;

	if (errand == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a second connection");
	pthread_mutex_init(&errand->lock, NULL);
	errand->n_refs = 2;
	errand->fd = -1;
	errand->n = n;
	memcpy(errand->address, link->address, sizeof errand->address);
	memcpy(errand->program, link->program, sizeof errand->program);
	if (n > 0)
		memcpy(errand->model, model, n * sizeof *model);
	errand->wake_fd = fcntl(link->wake_fd, F_DUPFD_CLOEXEC, 0);
	if (errand->wake_fd >= 0 && pthread_create(&thread, NULL, run, errand) == 0) {
		pthread_detach(thread);
		*out = errand;
		return PSR_OK;
	}
	if (errand->wake_fd >= 0)
		close(errand->wake_fd);
	pthread_mutex_destroy(&errand->lock);
	free(errand);
	return psr_fail(err, PSR_ERR_IO, "the system gives no second connection: no more descriptors, or no more threads");
}

int link_errand_ask(struct link_errand *errand, int *code, struct psr_error *err, char *model,
                    struct psr_msg_progress *progress)
{
	int is_done;

	pthread_mutex_lock(&errand->lock);
	is_done = errand->is_done;
	if (is_done) {
		*code = errand->code;
		*err = errand->err;
	}
	strcpy(model, errand->n > 0 ? errand->model[errand->at].name : "");
	*progress = errand->progress;
	pthread_mutex_unlock(&errand->lock);
	return is_done;
}

struct psr_msg_list_entry *link_errand_list(struct link_errand *errand, uint32_t *n)
{
	struct psr_msg_list_entry *list = errand->list;

	*n = errand->n_list;
	errand->list = NULL;
	return list;
}

void link_errand_leave(struct link_errand *errand)
{
	if (errand == NULL)
		return;
	pthread_mutex_lock(&errand->lock);
	errand->is_left = 1;
	if (errand->fd >= 0)
		shutdown(errand->fd, SHUT_RDWR);
	pthread_mutex_unlock(&errand->lock);
	unref(errand);
}
