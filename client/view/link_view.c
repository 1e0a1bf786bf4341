/* Requests and frames of a connection's view: what pace asks for is sent, what comes is handed over. */
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "link_inside.h"

#define RETRY_LOW_S 0.5
#define RETRY_HIGH_S 5.0

int link_view_init(struct link_view *view, struct link *link, struct psr_client *client)
{
	memset(view, 0, sizeof *view);
	view->link = link;
	view->client = client;
	view->retry_s = RETRY_LOW_S;
	view->sent = calloc(1, sizeof *view->sent);
	view->next = calloc(1, sizeof *view->next);
	return view->sent != NULL && view->next != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

void link_view_fini(struct link_view *view)
{
	free(view->sent);
	free(view->next);
}

static struct link_request *find(struct link_view *view, uint32_t id)
{
	for (unsigned i = 0; id != 0 && i < LINK_REQUESTS; i++)
		if (view->request[i].id == id)
			return &view->request[i];
	return NULL;
}

void link_view_cancel(struct link_view *view)
{
	for (unsigned i = 0; i < LINK_REQUESTS; i++)
		if (view->request[i].id != 0) {
			view->request[i].is_cancelled = 1;
			psr_client_cancel(view->client, view->request[i].id, NULL);
		}
}

/* ---- asking ---- */

void link_view_changed(struct link_view *view, const struct link_wish *wish, uint64_t now_ns)
{
	struct pace_wish pace_wish;

	link_pace_wish(&pace_wish, wish, psr_client_welcome(view->client)->capabilities);
	view->needs_direct = 0;
	view->retry_ns = 0;
	view->retry_s = RETRY_LOW_S;
	if (wish->width == 0)
		return;
	if (!view->is_paced)
		pace_init(&view->pace, &pace_wish, now_ns);
	else if (memcmp(&pace_wish, &view->pace_wish, sizeof pace_wish) != 0)
		pace_set_wish(&view->pace, &pace_wish, now_ns);
	else
		pace_moved(&view->pace, now_ns);
	if (wish->is_rest)
		pace_rested(&view->pace);
	view->is_paced = 1;
	view->pace_wish = pace_wish;
}

int link_view_scene(struct link_view *view, const struct link_content *content, const struct psr_camera *camera,
                    struct psr_error *err)
{
	struct psr_msg_scene *sent = view->sent;
	int code;

	link_scene_message(view->next, content->wish, content->place, content->n_places, camera);
	if (view->has_sent && memcmp(sent, view->next, sizeof *sent) == 0)
		return PSR_OK;
	code = psr_client_scene(view->client, view->next, NULL, err);
	if (code == PSR_OK) {
		view->sent = view->next;
		view->next = sent;
		view->has_sent = 1;
	}
	return code;
}

/* A base saves bytes where the camera stands: light, background and refinement change. */
static uint32_t find_base(const struct link_view *view, const struct psr_msg_frame *frame)
{
	const struct psr_msg_frame *last = &view->last;
	const int is_same = memcmp(&last->camera, &frame->camera, sizeof last->camera) == 0 && last->width == frame->width
	                    && last->height == frame->height && last->planes == frame->planes
	                    && last->settings.scale == frame->settings.scale && last->depth_format == frame->depth_format;

	if (!is_same || !(psr_client_welcome(view->client)->capabilities & PSR_CAP_BASE))
		return 0;
	return psr_client_base(view->client, LINK_VIEW);
}

static int send_frame(struct link_view *view, const struct link_content *content, struct pace_request *asked,
                      uint64_t now_ns, struct psr_error *err)
{
	const uint64_t offered = psr_client_welcome(view->client)->capabilities;
	const int is_direct = view->needs_direct || !(offered & PSR_CAP_SHARP);
	struct link_request *request = &view->request[view->n_requests % LINK_REQUESTS];
	struct psr_msg_frame frame;
	uint32_t id;
	int code;

	link_frame(&frame, asked, content->wish, content->box_min, content->box_max, is_direct);
	frame.settings.splats = content->wish->with_splats && offered & PSR_CAP_SPLATS;
	code = link_view_scene(view, content, &frame.camera, err);
	if (code != PSR_OK)
		return code;
	frame.base = find_base(view, &frame);
	code = psr_client_frame_in(view->client, LINK_VIEW, &frame, &id, err);
	if (code != PSR_OK)
		return code;
	pace_sent(&view->pace, id, asked, now_ns);
	*request = (struct link_request){
		.id = id, .wish = content->number, .sent_ns = now_ns, .width = content->wish->width,
		.height = content->wish->height, .is_rest = asked->is_sharp, .is_smooth = content->wish->is_smooth != 0,
		.is_coarse = content->is_coarse, .color_by = link_color_by(content->wish),
		.is_direct = asked->is_sharp && !(frame.flags & PSR_WIRE_FRAME_SHARP),
	};
	if (request->is_direct) /* what it costs says nothing about the next JPEG */
		pace_ended(&view->pace, id);
	view->n_requests++;
	view->newest = id;
	view->last = frame;
	return PSR_OK;
}

static void send_acks(struct link_view *view)
{
	while (view->n_unacked > 0) {
		if (psr_client_ack(view->client, view->unacked[0].id, view->unacked[0].pass, NULL) == PSR_ERR_BUSY)
			return;
		view->unacked[0] = view->unacked[1];
		view->n_unacked--;
	}
}

int link_view_ask(struct link_view *view, const struct link_content *content, uint64_t now_ns, uint64_t *again_ns,
                  struct psr_error *err)
{
	struct pace_request request;

	*again_ns = PACE_NEVER;
	send_acks(view);
	if (content->wish->width == 0 || content->n_places == 0 || !view->is_paced)
		return PSR_OK;
	if (view->retry_ns != 0 && now_ns >= view->retry_ns) {
		view->retry_ns = 0;
		pace_moved(&view->pace, now_ns);
		pace_rested(&view->pace);
	}
	while (view->request[view->n_requests % LINK_REQUESTS].id == 0
	       && pace_next(&view->pace, now_ns, &request, again_ns)) {
		const int code = send_frame(view, content, &request, now_ns, err);

		if (code == PSR_ERR_BUSY) { /* the socket is full */
			*again_ns = now_ns + 10000000;
			return PSR_OK;
		}
		if (code != PSR_OK)
			return code;
	}
	if (view->retry_ns != 0 && view->retry_ns < *again_ns)
		*again_ns = view->retry_ns;
	return PSR_OK;
}

/* ---- what comes ---- */

static uint64_t report_ns(const struct psr_msg_frame_end *end, uint16_t id)
{
	for (unsigned i = 0; i < end->n_entries; i++)
		if (end->entry[i].id == id)
			return end->entry[i].ns;
	return 0;
}

/* The first bytes are those that had come when the frame began to be read: all but what came since. */
static void tell_pace(struct link_view *view, const struct link_request *request, const struct psr_event *event,
                      uint64_t now_ns)
{
	const uint64_t since = psr_client_bytes_received(view->client) - request->received;
	const struct pace_cost cost = {
		.bytes = event->bytes, .queue_ns = report_ns(event->end, PSR_WIRE_REPORT_QUEUE),
		.server_ns = report_ns(event->end, PSR_WIRE_REPORT_TOTAL),
	};

	pace_first_bytes(&view->pace, event->id, since < event->bytes ? event->bytes - since : 1, request->begun_ns);
	pace_complete(&view->pace, event->id, &cost, now_ns);
}

static int is_sharp(const struct link_request *request, const struct psr_msg_frame_begin *begin)
{
	const int is_lossy = begin->planes >> PSR_PLANE_COLOR & 1 && begin->color_codec == PSR_CODEC_JPEG;

	return request->is_rest && begin->settings.scale == 1 && begin->settings.smooth == request->is_smooth
	       && !is_lossy;
}

static void copy_planes(struct psr_frame *to, const struct psr_frame *from)
{
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (psr_frame_plane(from, plane) != NULL)
			memcpy(psr_frame_plane(to, plane), psr_frame_plane(from, plane),
			       (size_t)from->width * from->height * psr_plane_bytes(plane));
}

/* A picture that nobody took makes room for the newer one. */
static struct link_picture *make_picture(struct link *link, const struct psr_event *event)
{
	const struct psr_msg_frame_begin *begin = event->begin;
	struct link_picture *picture = link_pictures_get(link->pictures, begin->width, begin->height, begin->planes);

	if (picture == NULL) {
		link_release(link_take(link));
		picture = link_pictures_get(link->pictures, begin->width, begin->height, begin->planes);
	}
	if (picture != NULL)
		copy_planes(&picture->frame, event->picture);
	return picture;
}

static void hand_over(struct link_view *view, const struct link_request *request, const struct psr_event *event)
{
	struct link *link = view->link;
	const uint64_t start_ns = clock_ns();
	struct link_picture *picture = make_picture(link, event);
	struct link_state *state = &link->state;

	if (picture == NULL)
		return;
	picture->camera = event->begin->camera;
	picture->width = request->width;
	picture->height = request->height;
	picture->wish = request->wish;
	picture->is_sharp = is_sharp(request, event->begin);
	picture->is_final = picture->is_sharp && event->end->is_final;
	picture->is_coarse = request->is_coarse;
	picture->color_by = request->color_by;
	picture->begin = *event->begin;
	picture->end = *event->end;
	picture->bytes = event->bytes;
	picture->asked_ns = request->sent_ns;
	picture->begun_ns = request->begun_ns;
	picture->came_ns = clock_ns();
	picture->decode_ns = event->decode_ns + (picture->came_ns - start_ns);
	view->n_pictures++;
	pthread_mutex_lock(&link->lock);
	link_release(link->picture);
	link->picture = picture;
	state->n_pictures++;
	state->rate = pace_rate(&view->pace);
	state->round_s = view->pace.latency;
	link_say(link, LINK_NEWS_PICTURE);
	pthread_mutex_unlock(&link->lock);
}

static void end_request(struct link_view *view, struct link_request *request)
{
	pace_ended(&view->pace, request->id);
	request->id = 0;
}

static void retry_later(struct link_view *view)
{
	view->retry_ns = clock_ns() + (uint64_t)(view->retry_s * 1e9);
	view->retry_s = 2 * view->retry_s < RETRY_HIGH_S ? 2 * view->retry_s : RETRY_HIGH_S;
}

static void on_frame(struct link_view *view, struct link_request *request, const struct psr_event *event)
{
	const uint64_t now_ns = clock_ns();
	const int is_final = event->end->is_final, is_newest = event->id == view->newest;
	const int is_enough = !request->is_rest || is_sharp(request, event->begin);
	const uint32_t id = event->id;
	const uint16_t pass = event->begin->pass;

	tell_pace(view, request, event, now_ns);
	hand_over(view, request, event);
	if (view->n_unacked < PSR_WIRE_MAX_UNACKED) { /* the server begins no third */
		view->unacked[view->n_unacked].id = id;
		view->unacked[view->n_unacked++].pass = pass;
	}
	send_acks(view);
	pace_acknowledged(&view->pace, id, event->decode_ns, clock_ns());
	if (!is_final)
		return;
	end_request(view, request);
	/* The server gave its sharp frame up, without a newer request. */
	if (is_newest && !is_enough && !request->is_cancelled) {
		view->needs_direct = 1;
		retry_later(view);
	}
}

/* Shortness passes; all else stays until the wish changes. */
static int may_pass(int code)
{
	return code == PSR_ERR_BUSY || code == PSR_ERR_MEMORY || code == PSR_ERR_CANCELLED || code == PSR_ERR_IO
	       || code == PSR_ERR_LIMIT || code == PSR_ERR_INTERNAL;
}

int link_view_event(struct link_view *view, const struct psr_event *event, struct psr_error *why)
{
	struct link_request *request = find(view, event->id);

	if (event->type == PSR_EVENT_FAILED && request == NULL) { /* a SCENE: the frames of it fail, too */
		*why = event->error;
		return 1;
	}
	if (request == NULL)
		return 0;
	switch (event->type) {
	case PSR_EVENT_BEGIN:
		request->begun_ns = clock_ns();
		request->received = psr_client_bytes_received(view->client);
		return 0;
	case PSR_EVENT_FRAME:
		on_frame(view, request, event);
		return 0;
	case PSR_EVENT_SUPERSEDED:
		end_request(view, request);
		return 0;
	case PSR_EVENT_FAILED:
		end_request(view, request);
		if (event->id != view->newest || request->is_cancelled)
			return 0;
		if (may_pass(event->error.code))
			retry_later(view);
		*why = event->error;
		return 1;
	}
	return 0;
}
