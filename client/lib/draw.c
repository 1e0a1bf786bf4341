#include <stdlib.h>
#include <string.h>
#include "internal.h"

#define PROGRAM "libpsrclient"

static int send_scene(struct psr_client *client, uint32_t handle, const struct psr_shot *shot,
                      const struct psr_camera *camera, struct psr_error *err)
{
	struct psr_msg_scene *msg;
	struct psr_light key;
	int code;

	if (shot->n_lights > PSR_WIRE_MAX_LIGHTS)
		return psr_fail(err, PSR_ERR_LIMIT, "a shot has %u lights, the protocol takes %d", shot->n_lights,
		                PSR_WIRE_MAX_LIGHTS);
	msg = calloc(1, sizeof *msg);
	if (msg == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a scene");
	msg->ambient = shot->ambient;
	memcpy(msg->background, shot->background, sizeof msg->background);
	msg->n_instances = 1;
	msg->instance[0] = (struct psr_msg_instance){ .handle = handle, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	psr_light_key(&key, camera);
	msg->n_lights = (uint16_t)(shot->n_lights > 0 ? shot->n_lights : 1);
	for (uint32_t i = 0; i < msg->n_lights; i++)
		psr_msg_light_set(&msg->light[i], shot->n_lights > 0 ? &shot->light[i] : &key);
	code = psr_client_scene(client, msg, NULL, err);
	free(msg);
	return code;
}

static int send_frame(struct psr_client *client, const struct psr_shot *shot, const struct psr_camera *camera,
                      uint32_t *id, struct psr_error *err)
{
	const struct psr_settings *settings = &shot->settings;
	struct psr_msg_frame msg = {
		.pass_limit = (uint16_t)settings->pass, .width = settings->width, .height = settings->height,
		.planes = shot->planes, .budget = PSR_WIRE_BUDGET_SETTINGS, .camera = *camera,
		.settings = { .scale = 1, .smooth = (uint8_t)settings->smooth, .splats = settings->with_splats != 0,
		              .spacing_px = settings->spacing_px },
	};

	if (settings->pass > PSR_MAX_PASS)
		return psr_fail(err, PSR_ERR_LIMIT, "there is no pass %u, only passes up to %d", settings->pass, PSR_MAX_PASS);
	if (shot->planes & 1 << PSR_PLANE_COLOR)
		msg.color_codec = PSR_CODEC_ZSTD;
	if (shot->planes & 1 << PSR_PLANE_DEPTH) {
		msg.depth_format = PSR_WIRE_DEPTH_F32;
		msg.depth_codec = PSR_CODEC_ZSTD;
	}
	if (shot->planes & ~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH))
		msg.data_codec = PSR_CODEC_ZSTD;
	return psr_client_frame(client, &msg, id, err);
}

/* Takes the planes of the last pass out of the client. */
static int take_frame(struct psr_client *client, uint32_t id, struct psr_frame *frame, int timeout_ms,
                      struct psr_error *err)
{
	struct psr_event event;
	int code;

	do
		code = psr_client_wait(client, timeout_ms, &event, err);
	while (code > 0 && event.type == PSR_EVENT_FRAME && (event.id != id || !event.end->is_final));
	if (code < 0)
		return code;
	if (code == 0) {
		psr_client_cancel(client, id, NULL);
		return psr_fail(err, PSR_ERR_CONNECTION, "%s: no frame within %d ms", client->address, timeout_ms);
	}
	if (event.type == PSR_EVENT_FAILED)
		return psr_fail(err, event.error.code, "%s", event.error.text);
	*frame = client->done.picture;
	memset(&client->done.picture, 0, sizeof client->done.picture);
	return PSR_OK;
}

int psr_client_draw(struct psr_client *client, const char *model, const struct psr_shot *shot, struct psr_frame *frame,
                    int timeout_ms, struct psr_error *err)
{
	const uint32_t width = shot->settings.width, height = shot->settings.height, resolution = client->resolution;
	struct psr_msg_opened opened;
	struct psr_camera camera;
	uint32_t id;
	int code;

	memset(frame, 0, sizeof *frame);
	if (width == 0 || height == 0)
		return psr_fail(err, PSR_ERR_ARG, "the picture has %u x %u pixels: both sides need at least 1", width, height);
	for (size_t i = 0; i < PSR_WIRE_MAX_OPEN; i++)
		if (client->frame[i].id != 0 || client->queued != NULL)
			return psr_fail(err, PSR_ERR_BUSY, "frames are under way on this connection, or their events wait");
	psr_client_set_resolution(client, width > height ? width : height);
	code = psr_client_open(client, model, timeout_ms, &opened, err);
	client->resolution = resolution;
	if (code != PSR_OK)
		return code;
	if (shot->camera != NULL)
		camera = *shot->camera;
	else
		psr_camera_frame(&camera, opened.box_min, opened.box_max, opened.up, shot->fov_y, (double)width / height);
	code = send_scene(client, opened.handle, shot, &camera, err);
	if (code == PSR_OK)
		code = send_frame(client, shot, &camera, &id, err);
	if (code == PSR_OK)
		code = take_frame(client, id, frame, timeout_ms, err);
	if (client->broken.code == PSR_OK)
		psr_client_close_model(client, opened.handle, NULL);
	return code;
}

int psr_shot_draw_at(const char *address, const char *model, const struct psr_shot *shot, struct psr_frame *frame,
                     int timeout_ms, struct psr_error *err)
{
	struct psr_client *client = NULL;
	int code = psr_client_connect(&client, address, PROGRAM, model, timeout_ms, err);

	memset(frame, 0, sizeof *frame);
	if (code == PSR_OK)
		code = psr_client_draw(client, model, shot, frame, timeout_ms, err);
	psr_client_close(client);
	return code;
}
