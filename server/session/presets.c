#include <string.h>
#include "answers.h"
#include "server/frames/wire.h"

#define HOME_CAMERA "home"
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

static int make_home(struct psr_preset_camera *home, const struct psr_model *model)
{
	const struct psr_presets *presets = psr_model_presets(model);
	const struct psr_model_info *info = psr_model_info(model);

	if (presets->n_cameras == PSR_MAX_PRESETS)
		return 0;
	for (uint32_t i = 0; i < presets->n_cameras; i++)
		if (strcmp(presets->camera[i].name, HOME_CAMERA) == 0)
			return 0;
	*home = (struct psr_preset_camera){ .name = HOME_CAMERA };
	psr_camera_frame(&home->camera, info->box_min, info->box_max, info->up, HOME_FOV, 1);
	return 1;
}

void answer_presets(struct session *session, uint32_t id, uint32_t handle)
{
	const struct catalogue_model *found = handles_find(&session->handles, handle);
	const struct psr_presets *presets;
	struct psr_msg_presets_end end = { 0, 0 };
	struct psr_preset_camera home;
	struct psr_msg_preset msg;
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (found == NULL) {
		refuse_handle(session, id, handle);
		return;
	}
	presets = psr_model_presets(found->model);
	for (uint32_t i = 0; i < presets->n_cameras; i++) {
		wire_from_camera(&msg, &presets->camera[i]);
		send_preset(session->conn, id, &msg, &end.n_cameras);
	}
	if (make_home(&home, found->model)) {
		wire_from_camera(&msg, &home);
		send_preset(session->conn, id, &msg, &end.n_cameras);
	}
	for (uint32_t i = 0; i < presets->n_lights; i++) {
		wire_from_light(&msg, &presets->light[i]);
		send_preset(session->conn, id, &msg, &end.n_lights);
	}
	if (psr_msg_presets_end_encode(&buf, id, &end, NULL) == PSR_OK)
		conn_send(session->conn, &buf);
}
