/* What is kept from frame to frame stands for the instances of a scene: whether they are still the same. */
#ifndef PSR_RENDER_PLACED_H
#define PSR_RENDER_PLACED_H

#include "psr/scene.h"

/* Zeros at first. Owns the array. */
struct placed {
	struct placed_instance *instance;
	uint32_t n;
};

/* Keeps the instances of a validated scene. *has_changed: they differ from those kept before. MEMORY, after which none
 * are kept. */
int placed_note(struct placed *placed, const struct psr_scene *scene, int *has_changed);
uint64_t placed_bytes(const struct placed *placed);
void placed_clear(struct placed *placed);

/* Whether two cameras draw the same pictures. */
int placed_same_camera(const struct psr_camera *a, const struct psr_camera *b);

#endif
