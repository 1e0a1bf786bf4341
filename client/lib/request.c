/* What a client asks for. */
#include <inttypes.h>
#include "base/clock.h"
#include "internal.h"

/* Completes a request that was encoded behind `start`. */
static int finish_request(struct psr_client *client, size_t start, int code, const char *what, struct psr_error *err)
{
	if (code == PSR_ERR_MEMORY)
		return psr_fail(err, PSR_ERR_BUSY, "%s waits until the server has taken earlier requests", client->address);
	if (code != PSR_OK)
		return code;
	if (client->out.size - start > client->welcome.max_message) {
		size_t n = client->out.size - start;

		client->out.size = start;
		return psr_fail(err, PSR_ERR_LIMIT, "the %s takes %zu bytes, the server takes messages of at most %u", what, n,
		                client->welcome.max_message);
	}
	client->next_id++;
	client_flush(client);
	return PSR_OK;
}

static int start_request(struct psr_client *client, struct psr_error *err)
{
	if (client->broken.code != PSR_OK)
		return client_check(client, err);
	if (client->next_id == UINT32_MAX)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: the ids of this connection are used up; connect again",
		                client->address);
	return PSR_OK;
}

int psr_client_scene(struct psr_client *client, const struct psr_msg_scene *scene, uint32_t *id, struct psr_error *err)
{
	size_t start = client->out.size;
	int code = start_request(client, err);

	for (unsigned i = 0; code == PSR_OK && i < scene->n_lights && i < PSR_WIRE_MAX_LIGHTS; i++)
		if (scene->light[i].flags & PSR_WIRE_LIGHT_SHADOW && !(client->welcome.capabilities & PSR_CAP_SHADOWS))
			code = psr_fail(err, PSR_ERR_UNSUPPORTED, "%s draws no shadows (%s); leave `shadow` out", client->address,
			                client->welcome.server);
	for (unsigned i = 0; code == PSR_OK && i < scene->n_instances && i < PSR_WIRE_MAX_INSTANCES; i++) {
		const unsigned kind = scene->instance[i].representation;
		const uint32_t needs = kind == PSR_WIRE_REP_OCTREE ? PSR_CAP_OCTREE
		                       : kind == PSR_WIRE_REP_DPOINT ? PSR_CAP_DPOINT : 0;

		if ((client->welcome.capabilities & needs) != needs)
			code = psr_fail(err, PSR_ERR_UNSUPPORTED, "%s draws no %s (%s)", client->address,
			                kind == PSR_WIRE_REP_OCTREE ? "octrees" : "differential points", client->welcome.server);
		if (scene->instance[i].color_by != PSR_WIRE_COLOR_OWN && !(client->welcome.capabilities & PSR_CAP_COLOR_BY))
			code = psr_fail(err, PSR_ERR_UNSUPPORTED, "%s draws models in their own colours alone (%s)", client->address,
			                client->welcome.server);
	}
	if (code != PSR_OK)
		return code;
	if (id != NULL)
		*id = client->next_id;
	code = psr_msg_scene_encode(&client->out, client->next_id, scene, err);
	return finish_request(client, start, code, "scene", err);
}

static struct client_frame *free_frame(struct psr_client *client, uint16_t view)
{
	struct client_frame *frame = NULL;
	unsigned n_open = 0;

	for (size_t i = 0; i < PSR_WIRE_MAX_OPEN; i++) {
		if (client->frame[i].id == 0)
			frame = frame == NULL ? &client->frame[i] : frame;
		else if (client->frame[i].view == 0)
			n_open++;
	}
	return view > 0 || n_open < client->welcome.max_open ? frame : NULL;
}

static int check_offered(const struct psr_client *client, uint16_t view, const struct psr_msg_frame *asked,
                         struct psr_error *err)
{
	const struct {
		int is_asked;
		uint64_t capability;
		const char *what;
	} needs[] = {
		{ view > 0, PSR_CAP_VIEWS, "keep views" },
		{ asked->base != 0, PSR_CAP_BASE, "send changes to a base" },
		{ asked->pass_limit > 0, PSR_CAP_REFINE, "refine frames" },
		{ asked->budget == PSR_WIRE_BUDGET_SETTINGS && asked->settings.scale != 1, PSR_CAP_SETTINGS,
		  "draw at other scales" },
		{ asked->budget == PSR_WIRE_BUDGET_TIME, PSR_CAP_TIME_BUDGET, "keep budgets of time" },
		{ asked->budget == PSR_WIRE_BUDGET_ERROR, PSR_CAP_ERROR_BOUND, "keep bounds on the error" },
		{ asked->budget == PSR_WIRE_BUDGET_RMSE, PSR_CAP_RMSE_BOUND, "keep bounds on the RMSE" },
		{ asked->settings.pass > 0, PSR_CAP_TIME_BUDGET | PSR_CAP_ERROR_BOUND, "draw a pass at once" },
		{ asked->settings.smooth > 1, PSR_CAP_FINE, "draw fine pictures" },
		{ asked->settings.splats != 0, PSR_CAP_SPLATS, "draw octrees as splats" },
		{ asked->depth_format > PSR_WIRE_DEPTH_F32, PSR_CAP_DEPTH_U16, "send depth as u16" },
		{ asked->flags & PSR_WIRE_FRAME_SHARP, PSR_CAP_SHARP, "send sharp frames" },
	};

	for (size_t i = 0; i < sizeof needs / sizeof needs[0]; i++)
		if (needs[i].is_asked && !(client->welcome.capabilities & needs[i].capability))
			return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s does not %s (%s)", client->address, needs[i].what,
			                client->welcome.server);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (asked->planes >> plane & 1 && psr_plane_capability(plane) & ~client->welcome.capabilities)
			return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s: this server does not send the %s plane", client->address,
			                psr_plane_name(plane));
	return PSR_OK;
}

int psr_client_frame_in(struct psr_client *client, uint16_t view, const struct psr_msg_frame *asked, uint32_t *id,
                        struct psr_error *err)
{
	struct client_frame *frame = free_frame(client, view);
	size_t start = client->out.size;
	int code = start_request(client, err);

	if (code != PSR_OK)
		return code;
	if (frame == NULL)
		return psr_fail(err, PSR_ERR_BUSY, "%s takes %u requests at a time", client->address,
		                view > 0 ? PSR_WIRE_MAX_OPEN : client->welcome.max_open);
	if (asked->color_codec > PSR_CODEC_ZSTD)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this client asks for frames without PNG");
	if (asked->base != 0 && asked->base != psr_client_base(client, view))
		return psr_fail(err, PSR_ERR_ARG, "frame %" PRIu32 " is no base: the last one acknowledged in view %u is %" PRIu32,
		                asked->base, view, psr_client_base(client, view));
	code = check_offered(client, view, asked, err);
	if (code != PSR_OK)
		return code;
	code = psr_msg_frame_encode(&client->out, client->next_id, view, asked, err);
	*id = client->next_id;
	code = finish_request(client, start, code, "request", err);
	if (code != PSR_OK)
		return code;
	client_assembly_init(&frame->assembly, asked, 0);
	frame->id = *id;
	frame->view = view;
	frame->bytes = frame->decode_ns = 0;
	frame->sent_ns = clock_ns();
	return PSR_OK;
}

int psr_client_frame(struct psr_client *client, const struct psr_msg_frame *asked, uint32_t *id, struct psr_error *err)
{
	return psr_client_frame_in(client, 0, asked, id, err);
}

int psr_client_cancel(struct psr_client *client, uint32_t id, struct psr_error *err)
{
	size_t i = 0;
	int code = client_check(client, err);

	if (code != PSR_OK)
		return code;
	while (i < PSR_WIRE_MAX_OPEN && (id == 0 || client->frame[i].id != id))
		i++;
	if (i == PSR_WIRE_MAX_OPEN)
		return psr_fail(err, PSR_ERR_NOT_FOUND, "no frame %" PRIu32 " is under way", id);
	code = psr_msg_cancel_encode(&client->out, id, client->frame[i].view, err);
	if (code == PSR_ERR_MEMORY)
		return psr_fail(err, PSR_ERR_BUSY, "%s waits until the server has taken earlier requests", client->address);
	client_flush(client);
	return code;
}

int psr_client_pause(struct psr_client *client, uint16_t view, int is_paused, struct psr_error *err)
{
	size_t start = client->out.size;
	int code = start_request(client, err);

	if (code != PSR_OK)
		return code;
	if (!(client->welcome.capabilities & PSR_CAP_PAUSE))
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s does not pause views (%s)", client->address,
		                client->welcome.server);
	code = (is_paused ? psr_msg_pause_encode : psr_msg_resume_encode)(&client->out, client->next_id, view, err);
	return finish_request(client, start, code, "request", err);
}

int psr_client_close_model(struct psr_client *client, uint32_t handle, struct psr_error *err)
{
	const struct psr_msg_close msg = { .handle = handle };
	size_t start = client->out.size;
	int code = start_request(client, err);

	if (code != PSR_OK)
		return code;
	code = psr_msg_close_encode(&client->out, client->next_id, &msg, err);
	return finish_request(client, start, code, "request", err);
}

int psr_client_ping(struct psr_client *client, struct psr_error *err)
{
	const struct psr_msg_ping ping = { 0 };
	const int code = client_check(client, err);

	if (code != PSR_OK)
		return code;
	if (psr_msg_ping_encode(&client->out, &ping, NULL) != PSR_OK)
		return psr_fail(err, PSR_ERR_BUSY, "%s waits for the server to take what was sent before", client->address);
	client_flush(client);
	return PSR_OK;
}
