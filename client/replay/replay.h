/* The part of a report from which the same frame can be drawn again. */
#ifndef PSR_CLIENT_REPLAY_REPLAY_H
#define PSR_CLIENT_REPLAY_REPLAY_H

#include <cjson/cJSON.h>
#include "client/scene/scene.h"

/* Adds "request": models, instances, lights, camera, size, settings, passes, planes, codec. */
void replay_add(cJSON *report, const struct scene *scene, const struct psr_msg_frame *frame);

/* Reads a report. *report is the caller's (cJSON_Delete), also after an error. NOT_FOUND, IO, FORMAT. */
int replay_read(cJSON **report, const char *path, struct psr_error *err);

/* Fills in the instances' wish, so that scene_open can open the models. FORMAT: the report lacks something, or it is no
 * report. */
int replay_wish(struct scene_wish *wish, const cJSON *report, struct psr_error *err);

/* Fills in the frame. FORMAT. */
int replay_frame(struct psr_msg_frame *frame, const cJSON *report, struct psr_error *err);

/* Makes an open scene that of the report: rotations, lights, ambient, background. FORMAT; VERSION: the server has other
 * models of these names. */
int replay_scene(struct scene *scene, const cJSON *report, struct psr_error *err);

#endif
