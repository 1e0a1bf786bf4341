/* The request in a report, which draws the same frame again. */
#ifndef PSR_CLIENT_REPLAY_REPLAY_H
#define PSR_CLIENT_REPLAY_REPLAY_H

#include <cjson/cJSON.h>
#include "client/scene/scene.h"

/* Adds "request": models, instances, lights, camera, size, settings, passes, planes, codec. */
void replay_add(cJSON *report, const struct scene *scene, const struct psr_msg_frame *frame);

/* Reads a report. The caller owns *report (cJSON_Delete), also after FORMAT. NOT_FOUND, IO, LIMIT, FORMAT. */
int replay_read(cJSON **report, const char *path, struct psr_error *err);

/* Fills in the instances, for scene_open(). FORMAT: a member of the report is missing or wrong. */
int replay_wish(struct scene_wish *wish, const cJSON *report, struct psr_error *err);

/* Fills in the frame. FORMAT. */
int replay_frame(struct psr_msg_frame *frame, const cJSON *report, struct psr_error *err);

/* Sets lights, ambient and background of an open scene. FORMAT; VERSION: the server's models of these names differ from
 * the report's. */
int replay_scene(struct scene *scene, const cJSON *report, struct psr_error *err);

#endif
