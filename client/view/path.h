/* The way that a camera goes: recorded while a hand moves it, played again later. The file is JSON:
 * {"poses": [{"seconds": 0, "eye": [x,y,z], "target": [x,y,z], "up": [x,y,z], "fov": 35}, ...]}, seconds rising,
 * "ortho" with a height in world units in the place of "fov". */
#ifndef PSR_CLIENT_VIEW_PATH_H
#define PSR_CLIENT_VIEW_PATH_H

#include <stddef.h>
#include "hand.h"

struct path_pose { double seconds; struct hand_pose pose; };
struct path {
	struct path_pose *pose; /* seconds rise */
	size_t n;
};

/* Adds a pose at the end; one that is like the last two only makes the last one later. MEMORY. */
int path_add(struct path *path, double seconds, const struct hand_pose *pose, struct psr_error *err);
/* The pose at this time, between two recorded ones a mean of them. The path has at least one. */
void path_at(const struct path *path, double seconds, struct hand_pose *pose);
double path_seconds(const struct path *path); /* of the last pose; 0 without one */

/* NOT_FOUND, IO, LIMIT, MEMORY; FORMAT says which pose is wrong. */
int path_read(struct path *path, const char *file, struct psr_error *err);
int path_write(const struct path *path, const char *file, struct psr_error *err);
void path_fini(struct path *path);

#endif
