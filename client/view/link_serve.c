/* One connection: the models of the wish are opened, finer ones fetched by an errand, and its view runs. */
#define _GNU_SOURCE
#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "link_inside.h"

#define AGAIN_NS UINT64_C(2000000000) /* until a model is asked for again that the server had no room for */

struct serve {
	struct link *link;
	struct psr_client *client;
	struct link_view view;
	struct link_probe probe;
	struct link_models models;
	struct link_box wish;
	struct link_place *place;
	uint32_t n_places;
	double box_min[3], box_max[3];
	struct link_errand *opening, *listing; /* NULL: none */
	struct link_errand_model *wanted; /* of `opening` */
	uint32_t n_wanted;
	uint64_t n_received, heard_ns; /* bytes, when the last came */
	int is_pinged;
	int is_refused;              /* until the wish changes, or a retry */
	int is_scene_refused;        /* of this wish: its frames fail, too, for want of it, and that is no reason to tell */
	struct psr_error beside;     /* why a model is not there, or no finer one; code 0: all are */
	uint64_t again_ns;           /* when such a model is asked for again; PACE_NEVER: once the wish changes */
};

/* ---- the wish ---- */

static int is_closing(struct link *link)
{
	int is;

	pthread_mutex_lock(&link->lock);
	is = link->is_closing;
	pthread_mutex_unlock(&link->lock);
	return is;
}

/* The scene of what is open, for the view and for the user. */
static int arrange(struct serve *serve, struct psr_error *err)
{
	const struct link_wish *wish = &serve->wish.wish;
	struct link_scene *scene, *old;
	struct link *link = serve->link;

	free(serve->place);
	serve->place = link_models_place(&serve->models, wish, &serve->n_places);
	if (serve->n_places == 0)
		return PSR_OK;
	scene = link_models_scene(&serve->models, wish, serve->place, serve->n_places);
	if (scene == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a scene");
	memcpy(serve->box_min, scene->box_min, sizeof serve->box_min);
	memcpy(serve->box_max, scene->box_max, sizeof serve->box_max);
	pthread_mutex_lock(&link->lock);
	old = link->scene;
	link->scene = scene;
	link_say(link, LINK_NEWS_SCENE);
	pthread_mutex_unlock(&link->lock);
	link_scene_free(old);
	return PSR_OK;
}

static int is_same_arrangement(const struct link_wish *a, const struct link_wish *b)
{
	if (!link_wish_has_same_models(a, b))
		return 0;
	for (uint32_t i = 0; i < a->n_instances; i++)
		if (memcmp(a->instance[i].rotation, b->instance[i].rotation, sizeof a->instance[i].rotation) != 0
		    || memcmp(a->instance[i].translation, b->instance[i].translation, sizeof a->instance[i].translation) != 0
		    || a->instance[i].scale != b->instance[i].scale)
			return 0;
	return 1;
}

/* Takes a newer wish over. */
static int take_wish(struct serve *serve, struct psr_error *err)
{
	struct link *link = serve->link;
	int code = PSR_OK, is_new, is_arranged = 1;

	pthread_mutex_lock(&link->lock);
	is_new = link->wish.number != serve->wish.number;
	if (is_new) {
		is_arranged = serve->wish.number != 0 && is_same_arrangement(&link->wish.wish, &serve->wish.wish);
		code = link_box_set(&serve->wish, &link->wish.wish, link->wish.number);
	}
	pthread_mutex_unlock(&link->lock);
	if (code != PSR_OK)
		return psr_fail(err, code, "no memory for the instances of a scene");
	if (!is_new)
		return PSR_OK;
	serve->is_refused = serve->is_scene_refused = 0;
	if (!is_arranged) {
		memset(&serve->beside, 0, sizeof serve->beside);
		serve->again_ns = 0;
		link_errand_leave(serve->opening);
		serve->opening = NULL;
		code = arrange(serve, err);
	}
	if (serve->wish.wish.width == 0)
		link_view_cancel(&serve->view);
	link_view_changed(&serve->view, &serve->wish.wish, clock_ns());
	return code;
}

/* ---- what comes ---- */

static void refuse(struct serve *serve, const struct psr_error *why)
{
	serve->is_refused = 1;
	link_set_phase(serve->link, LINK_REFUSED, why);
}

static int read_all(struct serve *serve, struct psr_error *err)
{
	struct psr_event event;
	struct psr_error why;
	int got;

	while ((got = psr_client_wait(serve->client, 0, &event, err)) > 0) {
		if (link_probe_event(&serve->probe, serve->link, &event))
			continue;
		const int is_newest = event.id == serve->view.newest;

		if (link_view_event(&serve->view, &event, &why)) {
			serve->is_scene_refused |= !is_newest;
			if (!is_newest || !serve->is_scene_refused)
				refuse(serve, &why);
		} else if (event.type == PSR_EVENT_FRAME && is_newest) {
			serve->is_refused = serve->is_scene_refused = 0;
		}
	}
	if (psr_client_bytes_received(serve->client) != serve->n_received) {
		pthread_mutex_lock(&serve->link->lock);
		serve->link->state.n_bytes += psr_client_bytes_received(serve->client) - serve->n_received;
		pthread_mutex_unlock(&serve->link->lock);
		serve->n_received = psr_client_bytes_received(serve->client);
		serve->heard_ns = clock_ns();
		serve->is_pinged = 0;
	}
	return got;
}

/* Sleeps until the server, the user or an errand says something, or until_ns. */
static int wait_until(struct serve *serve, uint64_t until_ns)
{
	struct pollfd fds[2] = { { .events = POLLIN }, { .fd = serve->link->wake_fd, .events = POLLIN } };
	const uint64_t now_ns = clock_ns();
	struct timespec time = { 0, 0 };

	fds[0].fd = psr_client_fd(serve->client, &fds[0].events);
	if (until_ns > now_ns) {
		time.tv_sec = (time_t)((until_ns - now_ns) / 1000000000);
		time.tv_nsec = (long)((until_ns - now_ns) % 1000000000);
		if (time.tv_sec > 3600)
			time.tv_sec = 3600;
	}
	if (ppoll(fds, 2, &time, NULL) < 0 && errno != EINTR)
		return PSR_ERR_IO;
	if (fds[1].revents != 0)
		link_drain(serve->link->wake_fd);
	return PSR_OK;
}

/* A network that is gone says nothing: after a while a PING asks. */
static int check_silence(struct serve *serve, uint64_t now_ns, uint64_t *again_ns, struct psr_error *err)
{
	uint64_t next_ns = serve->heard_ns + LINK_PING_NS;

	if (now_ns >= serve->heard_ns + LINK_SILENCE_NS)
		return psr_fail(err, PSR_ERR_CONNECTION, "%s: the server has not answered for %d s", serve->link->address,
		                (int)(LINK_SILENCE_NS / 1000000000));
	if (now_ns >= next_ns) {
		if (!serve->is_pinged && psr_client_ping(serve->client, NULL) == PSR_OK)
			serve->is_pinged = 1;
		next_ns = serve->heard_ns + LINK_SILENCE_NS;
	}
	if (next_ns < *again_ns)
		*again_ns = next_ns;
	return PSR_OK;
}

/* ---- models ---- */

/* Until the wish changes, or until there may be room. */
static void give_up(struct serve *serve, const struct psr_error *why)
{
	const int may_pass = why->code == PSR_ERR_BUSY || why->code == PSR_ERR_MEMORY || why->code == PSR_ERR_CONNECTION;

	serve->beside = *why;
	serve->again_ns = may_pass ? clock_ns() + AGAIN_NS : PACE_NEVER;
}

/* Opens models on this connection. The server's ERROR is put into serve->beside; others end the connection. */
static int open_here(struct serve *serve, const struct link_errand_model *wanted, uint32_t n, struct psr_error *err)
{
	struct link *link = serve->link;
	int code = PSR_OK, is_lost;
	struct psr_error inner;

	pthread_mutex_lock(&link->lock);
	link->is_opening = 1;
	link->is_interrupted = link->wish.number != serve->wish.number
	                       && !link_wish_has_same_models(&link->wish.wish, &serve->wish.wish);
	is_lost = link->is_interrupted || link->is_closing;
	pthread_mutex_unlock(&link->lock);
	memset(&serve->beside, 0, sizeof serve->beside);
	for (uint32_t i = 0; i < n && code == PSR_OK && !is_lost; i++) {
		if (link_models_open(&serve->models, &wanted[i], &inner) == PSR_OK)
			continue;
		serve->beside = inner;
		code = psr_client_ping(serve->client, err); /* says whether the connection is sound */
	}
	pthread_mutex_lock(&link->lock);
	link->is_opening = 0;
	if (link->is_interrupted || link->is_closing)
		code = PSR_ERR_CANCELLED;
	pthread_mutex_unlock(&link->lock);
	serve->heard_ns = clock_ns();
	if (code == PSR_OK) /* what came meanwhile waits, and no poll() tells of it */
		code = read_all(serve, err);
	if (serve->beside.code != PSR_OK)
		give_up(serve, &serve->beside);
	if (code == PSR_OK)
		code = arrange(serve, err);
	link_view_changed(&serve->view, &serve->wish.wish, clock_ns());
	return code;
}

/* Models that are open are drawn meanwhile; for the first ones there is nothing to draw. */
static int begin_opening(struct serve *serve, struct psr_error *err)
{
	const struct link_wish *wish = &serve->wish.wish;
	int code = link_models_lack(&serve->wanted, &serve->n_wanted, &serve->models, wish, 0);

	if (code == PSR_OK && serve->n_wanted == 0 && serve->view.n_pictures > 0)
		code = link_models_lack(&serve->wanted, &serve->n_wanted, &serve->models, wish, 1);
	if (code != PSR_OK)
		return psr_fail(err, code, "no memory for a list of models");
	if (serve->n_wanted > 0 && serve->n_places > 0)
		return link_errand_start(&serve->opening, serve->link, serve->wanted, serve->n_wanted, err);
	if (serve->n_wanted > 0) {
		link_set_progress(serve->link, serve->wanted[0].name, &(struct psr_msg_progress){ 0 });
		link_set_phase(serve->link, LINK_OPENING, NULL);
		code = open_here(serve, serve->wanted, serve->n_wanted, err);
		if (code == PSR_OK && serve->n_places == 0)
			refuse(serve, &serve->beside);
	}
	return code;
}

static void tell_refining(struct serve *serve, const char *model, const struct psr_msg_progress *progress)
{
	pthread_mutex_lock(&serve->link->lock);
	serve->link->state.is_refining = model != NULL;
	pthread_mutex_unlock(&serve->link->lock);
	link_set_progress(serve->link, model != NULL ? model : "", progress);
}

static int tend_opening(struct serve *serve, struct psr_error *err)
{
	char model[PSR_WIRE_MAX_NAME + 1];
	struct psr_msg_progress progress;
	struct psr_error why;
	int code;

	if (serve->opening == NULL) {
		if (serve->again_ns > clock_ns())
			return PSR_OK;
		free(serve->wanted);
		serve->wanted = NULL;
		return begin_opening(serve, err);
	}
	if (!link_errand_ask(serve->opening, &code, &why, model, &progress)) {
		tell_refining(serve, model, &progress);
		return PSR_OK;
	}
	link_errand_leave(serve->opening);
	serve->opening = NULL;
	tell_refining(serve, NULL, &(struct psr_msg_progress){ 0 });
	if (code == PSR_OK)
		return open_here(serve, serve->wanted, serve->n_wanted, err);
	give_up(serve, &why);
	return PSR_OK;
}

/* ---- the list ---- */

static void tend_listing(struct serve *serve)
{
	struct link *link = serve->link;
	char model[PSR_WIRE_MAX_NAME + 1];
	struct psr_msg_progress progress;
	struct psr_error why;
	int is_asked, code;

	if (serve->listing != NULL && link_errand_ask(serve->listing, &code, &why, model, &progress)) {
		pthread_mutex_lock(&link->lock);
		free(link->list);
		link->list = link_errand_list(serve->listing, &link->n_list);
		link_say(link, LINK_NEWS_LIST);
		pthread_mutex_unlock(&link->lock);
		link_errand_leave(serve->listing);
		serve->listing = NULL;
	}
	pthread_mutex_lock(&link->lock);
	is_asked = link->is_list_asked && serve->listing == NULL;
	link->is_list_asked &= !is_asked;
	pthread_mutex_unlock(&link->lock);
	if (is_asked)
		link_errand_start(&serve->listing, link, NULL, 0, NULL);
}

/* ---- all of it ---- */

/* Of a request, before it was sent; the connection is sound. */
static int is_refusal(int code)
{
	return code == PSR_ERR_ARG || code == PSR_ERR_UNSUPPORTED || code == PSR_ERR_LIMIT;
}

static int step(struct serve *serve, struct psr_error *err)
{
	const struct link_content content = {
		&serve->wish.wish, serve->wish.number, serve->place, serve->n_places, serve->box_min, serve->box_max,
		serve->beside.code == PSR_OK && !link_models_are_fine(&serve->models, &serve->wish.wish)
	};
	uint64_t again_ns = PACE_NEVER;
	const uint64_t now_ns = clock_ns();
	int code = link_view_ask(&serve->view, &content, now_ns, &again_ns, err);

	if (code == PSR_OK)
		code = link_probe_ask(&serve->probe, &serve->view, &content, err);
	if (code == PSR_OK || is_refusal(code)) {
		if (code != PSR_OK) /* such as too many lights for this server */
			refuse(serve, err);
		code = check_silence(serve, now_ns, &again_ns, err);
	}
	if (serve->again_ns > now_ns && serve->again_ns < again_ns)
		again_ns = serve->again_ns;
	if (code == PSR_OK)
		code = wait_until(serve, again_ns);
	return code == PSR_OK ? read_all(serve, err) : code;
}

static int run(struct serve *serve, struct psr_error *err)
{
	int code = PSR_OK;

	while (code == PSR_OK) {
		if (is_closing(serve->link))
			return psr_fail(err, PSR_ERR_CANCELLED, "closed");
		code = take_wish(serve, err);
		if (code == PSR_OK)
			code = tend_opening(serve, err);
		tend_listing(serve);
		if (code == PSR_OK && !serve->is_refused)
			link_set_phase(serve->link, LINK_LIVE, serve->beside.code != PSR_OK ? &serve->beside : NULL);
		if (code == PSR_OK)
			code = step(serve, err);
	}
	return code;
}

int link_serve(struct link *link, struct psr_client *client, int *has_shown, struct psr_error *err)
{
	struct serve serve = { .link = link, .client = client, .models = { .client = client, .link = link } };
	int code = PSR_OK;

	*has_shown = 0;
	serve.heard_ns = clock_ns();
	if (!(psr_client_welcome(client)->capabilities & PSR_CAP_VIEWS))
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s keeps no views (%s), which pictures that move need",
		                link->address, psr_client_welcome(client)->server);
	if (link_view_init(&serve.view, link, client) != PSR_OK)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for a scene");
	if (code == PSR_OK)
		code = run(&serve, err);
	*has_shown = serve.view.n_pictures > 0;
	link_errand_leave(serve.opening);
	link_errand_leave(serve.listing);
	link_view_fini(&serve.view);
	link_models_fini(&serve.models);
	link_box_fini(&serve.wish);
	free(serve.place);
	free(serve.wanted);
	return code;
}
