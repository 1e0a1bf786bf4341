/* A connection's session: messages to actions. Handles of open models, scenes, open ids. */
#ifndef PSRD_SESSION_H
#define PSRD_SESSION_H

#include <stdint.h>
#include "server/models/catalogue.h"
#include "proto/proto.h"
#include "psr/scene.h"

struct conn;

/* What a SCENE message became: immutable, shared by its slot and the frames that were asked for while it stood there.
 * Counted in the loop's thread. */
struct scene {
	uint32_t n_refs;
	struct catalogue *catalogue;
	struct psr_scene scene;      /* camera unset */
	uint8_t background[3];
	struct psr_instance *instance;
	struct catalogue_model **model; /* one an instance, each a reference */
	struct psr_light light[PSR_WIRE_MAX_LIGHTS];
};

struct scene *scene_ref(struct scene *scene);
void scene_unref(struct scene *scene); /* NULL is fine */

struct handle {
	uint32_t number;
	struct catalogue_model *model; /* a reference */
};

struct session {
	uint32_t last_id, n_open, last_handle;
	struct handle *handle;
	uint32_t n_handles;
	struct scene *slot[PSR_WIRE_MAX_SCENES];
};

int session_init(struct session *session, uint32_t max_handles); /* MEMORY */
void session_fini(struct session *session, struct catalogue *catalogue);

/* One message of an accepted client. PSR_OK, or a negative code: the peer broke the protocol. */
int session_take(struct conn *conn, const struct psr_message *message, struct psr_error *err);

/* Ends OPEN `id`: a handle and OPENED, or an ERROR if there is no handle left. */
void session_opened(struct conn *conn, uint32_t id, struct catalogue_model *model);

/* Ends any open id by an ERROR. */
void session_refuse(struct conn *conn, uint32_t id, uint16_t view, int code, const char *text);
void session_refuse_handle(struct conn *conn, uint32_t id, uint32_t handle);

#endif
