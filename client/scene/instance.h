/* A model and its place, as users write them on the command line. */
#ifndef PSR_CLIENT_SCENE_INSTANCE_H
#define PSR_CLIENT_SCENE_INSTANCE_H

#include "psr/message.h"

struct instance_wish {
	char model[PSR_WIRE_MAX_NAME + 1];
	struct psr_msg_instance place; /* without a handle */
	const char *text; /* as the user wrote it: NAME,at=...; NULL if not in one text */
	uint32_t pixels, levels; /* for psr_client_set_resolution() and _levels(); 0: as the scene */
};

extern const char *const instance_representations[4]; /* "blocks" and so on, by enum psr_wire_rep; "" for AUTO */

/* Reads NAME[,at=X,Y,Z][,scale=S][,as=blocks|octree|dpoints][,rotate=AXIS:DEG]...: AXIS is X, Y, Z or x,y,z. Rotations apply
 * in their order, about the model's own 0,0,0, which `at` then places. ARG. */
int instance_parse(struct instance_wish *wish, const char *text, struct psr_error *err);

/* Finds where a point and a direction of the model are in the scene. */
void instance_apply(double out[3], const struct psr_msg_instance *place, const double point[3]);
void instance_rotate(double out[3], const struct psr_msg_instance *place, const double v[3]);

/* Grows the box low..high by the box of a placed model. */
void instance_add_box(double low[3], double high[3], const struct psr_msg_instance *place, const double box_min[3],
                      const double box_max[3]);

#endif
