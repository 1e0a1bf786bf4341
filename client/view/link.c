/* The user's side of a link: what it wishes, and what came. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>
#include "link_inside.h"

void link_wake(int fd)
{
	const uint64_t one = 1;

	while (write(fd, &one, sizeof one) < 0 && errno == EINTR)
		;
}

void link_drain(int fd)
{
	uint64_t n;

	while (read(fd, &n, sizeof n) < 0 && errno == EINTR)
		;
}

void link_say(struct link *link, unsigned news)
{
	link->news |= news;
	link_wake(link->news_fd);
}

void link_set_phase(struct link *link, enum link_phase phase, const struct psr_error *why)
{
	struct link_state *state = &link->state;

	pthread_mutex_lock(&link->lock);
	if (state->phase != phase || state->error.code != (why != NULL ? why->code : PSR_OK)
	    || (why != NULL && strcmp(state->error.text, why->text) != 0)) {
		state->phase = phase;
		memset(&state->error, 0, sizeof state->error);
		if (why != NULL)
			state->error = *why;
		if (phase != LINK_LOST)
			state->retry_ns = 0;
		link_say(link, LINK_NEWS_STATE);
	}
	pthread_mutex_unlock(&link->lock);
}

void link_set_progress(struct link *link, const char *model, const struct psr_msg_progress *progress)
{
	pthread_mutex_lock(&link->lock);
	memcpy(link->state.model, model, strlen(model) + 1);
	link->state.progress = *progress;
	link_say(link, LINK_NEWS_STATE);
	pthread_mutex_unlock(&link->lock);
}

static void destroy(struct link *link)
{
	link_release(link->picture);
	link_pictures_unref(link->pictures);
	link_scene_free(link->scene);
	free(link->list);
	link_box_fini(&link->wish);
	if (link->wake_fd >= 0)
		close(link->wake_fd);
	if (link->news_fd >= 0)
		close(link->news_fd);
	pthread_mutex_destroy(&link->lock);
	free(link);
}

/* The thread, and what frees it if its user has not waited. */
static void *run(void *userdata)
{
	struct link *link = userdata;
	int is_left;

	link_thread(link);
	pthread_mutex_lock(&link->lock);
	is_left = link->is_left;
	pthread_mutex_unlock(&link->lock);
	if (is_left)
		destroy(link);
	return NULL;
}

int link_open(struct link **out, const char *address, const char *program, struct psr_error *err)
{
	struct link *link;
	int code = psr_address_check(address, err);

	if (code != PSR_OK)
		return code;
	link = calloc(1, sizeof *link);
	if (link == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a connection");
	pthread_mutex_init(&link->lock, NULL);
	link->fd = -1;
	link->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
	link->news_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
	strncpy(link->address, address, sizeof link->address - 1);
	strncpy(link->program, program, sizeof link->program - 1);
	if (link->wake_fd < 0 || link->news_fd < 0)
		code = psr_fail(err, PSR_ERR_IO, "the system gives no more descriptors: %s", strerror(errno));
	else if (link_pictures_create(&link->pictures) != PSR_OK)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for pictures");
	else if (pthread_create(&link->thread, NULL, run, link) != 0)
		code = psr_fail(err, PSR_ERR_IO, "the system gives no more threads");
	if (code != PSR_OK) {
		destroy(link);
		return code;
	}
	*out = link;
	return PSR_OK;
}

/* Connecting, and looking names up, ends in its own time. */
void link_close(struct link *link)
{
	pthread_t thread;
	int is_left;

	if (link == NULL)
		return;
	pthread_mutex_lock(&link->lock);
	link->is_closing = 1;
	is_left = link->is_left = link->is_connecting;
	thread = link->thread;
	if (link->fd >= 0)
		shutdown(link->fd, SHUT_RDWR);
	link_wake(link->wake_fd);
	if (is_left)
		pthread_detach(thread);
	pthread_mutex_unlock(&link->lock);
	if (is_left)
		return;
	pthread_join(thread, NULL);
	destroy(link);
}

uint64_t link_wish(struct link *link, const struct link_wish *wish)
{
	uint64_t number;
	int has_same_models;

	if (link_wish_check(wish) != PSR_OK)
		return 0;
	pthread_mutex_lock(&link->lock);
	number = link->wish.number;
	if (number == 0 || !link_wish_is_same(wish, &link->wish.wish)) {
		has_same_models = number > 0 && link_wish_has_same_models(wish, &link->wish.wish);
		number = link_box_set(&link->wish, wish, number + 1) == PSR_OK ? number + 1 : 0;
		if (number > 0 && !has_same_models && link->is_opening) {
			link->is_interrupted = 1;
			shutdown(link->fd, SHUT_RDWR);
		}
		link_wake(link->wake_fd);
	}
	pthread_mutex_unlock(&link->lock);
	return number;
}

int link_fd(const struct link *link)
{
	return link->news_fd;
}

unsigned link_heard(struct link *link)
{
	unsigned news;

	pthread_mutex_lock(&link->lock);
	link_drain(link->news_fd);
	news = link->news;
	link->news = 0;
	pthread_mutex_unlock(&link->lock);
	return news;
}

struct link_picture *link_take(struct link *link)
{
	struct link_picture *picture;

	pthread_mutex_lock(&link->lock);
	picture = link->picture;
	link->picture = NULL;
	pthread_mutex_unlock(&link->lock);
	return picture;
}

void link_state(struct link *link, struct link_state *state)
{
	pthread_mutex_lock(&link->lock);
	*state = link->state;
	pthread_mutex_unlock(&link->lock);
}

struct link_scene *link_scene_take(struct link *link)
{
	struct link_scene *scene;

	pthread_mutex_lock(&link->lock);
	scene = link->scene;
	link->scene = NULL;
	pthread_mutex_unlock(&link->lock);
	return scene;
}

void link_scene_free(struct link_scene *scene)
{
	if (scene == NULL)
		return;
	for (uint32_t i = 0; i < scene->n_models; i++)
		free(scene->model[i].preset);
	free(scene->model);
	free(scene);
}

void link_list_ask(struct link *link)
{
	pthread_mutex_lock(&link->lock);
	link->is_list_asked = 1;
	link_wake(link->wake_fd);
	pthread_mutex_unlock(&link->lock);
}

struct psr_msg_list_entry *link_list_take(struct link *link, uint32_t *n_entries)
{
	struct psr_msg_list_entry *list;

	pthread_mutex_lock(&link->lock);
	list = link->list;
	*n_entries = link->n_list;
	link->list = NULL;
	link->n_list = 0;
	pthread_mutex_unlock(&link->lock);
	return list;
}
