#include <string.h>
#include "answers.h"

#define HOME_FOV 0.6108652381980153 /* 35 degrees, as the client's */

/* Leaves out a preset that the protocol cannot hold. */
static void send_preset(struct conn *conn, uint32_t id, const struct psr_msg_preset *msg, uint32_t *n_sent)
{
	uint8_t bytes[512];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (psr_msg_preset_encode(&buf, id, msg, NULL) != PSR_OK)
		return;
	conn_send(conn, &buf);
	++*n_sent;
}

static void send_camera(struct conn *conn, uint32_t id, const struct psr_preset_camera *preset, uint32_t *n_sent)
{
	struct psr_msg_preset msg = { .kind = PSR_WIRE_PRESET_CAMERA, .camera = preset->camera };

	memcpy(msg.name, preset->name, sizeof preset->name);
	send_preset(conn, id, &msg, n_sent);
}

static void send_light(struct conn *conn, uint32_t id, const struct psr_preset_light *preset, uint32_t *n_sent)
{
	struct psr_msg_preset msg = { .kind = PSR_WIRE_PRESET_LIGHT };

	psr_msg_light_set(&msg.light, &preset->light);
	memcpy(msg.name, preset->name, sizeof preset->name);
	send_preset(conn, id, &msg, n_sent);
}

static int make_home(struct psr_preset_camera *home, const struct card *card)
{
	const struct psr_presets *presets = &card->presets;
	const struct psr_model_info *info = &card->info;

	if (presets->n_cameras == PSR_MAX_PRESETS)
		return 0;
	for (uint32_t i = 0; i < presets->n_cameras; i++)
		if (strcmp(presets->camera[i].name, PSR_WIRE_HOME) == 0)
			return 0;
	*home = (struct psr_preset_camera){ .name = PSR_WIRE_HOME };
	psr_camera_frame(&home->camera, info->box_min, info->box_max, info->up, HOME_FOV, 1);
	return 1;
}

void answer_presets(struct session *session, uint32_t id, uint32_t handle)
{
	const struct catalogue_model *found = handles_find(&session->handles, handle);
	const struct psr_presets *presets;
	struct psr_msg_presets_end end = { 0, 0 };
	struct psr_preset_camera home;
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (found == NULL) {
		refuse_handle(session, id, handle);
		return;
	}
	presets = &found->card.presets;
	for (uint32_t i = 0; i < presets->n_cameras; i++)
		send_camera(session->conn, id, &presets->camera[i], &end.n_cameras);
	if (make_home(&home, &found->card))
		send_camera(session->conn, id, &home, &end.n_cameras);
	for (uint32_t i = 0; i < presets->n_lights; i++)
		send_light(session->conn, id, &presets->light[i], &end.n_lights);
	if (psr_msg_presets_end_encode(&buf, id, &end, NULL) == PSR_OK)
		conn_send(session->conn, &buf);
}
