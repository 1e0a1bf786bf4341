#include <stdlib.h>
#include <string.h>
#include "placed.h"

/* All of an instance that a picture depends on. */
struct placed_instance {
	uint8_t content_id[16];
	double rotation[4], translation[3], scale;
	uint64_t representation;
};

int placed_note(struct placed *placed, const struct psr_scene *scene, int *has_changed)
{
	const uint32_t n = scene->n_instances;

	*has_changed = n != placed->n;
	if (*has_changed) {
		free(placed->instance);
		placed->instance = calloc(n, sizeof *placed->instance);
		placed->n = placed->instance != NULL ? n : 0;
		if (placed->instance == NULL)
			return PSR_ERR_MEMORY;
	}
	for (uint32_t i = 0; i < n; i++) {
		const struct psr_instance *from = &scene->instance[i];
		struct placed_instance to = { .scale = from->scale, .representation = from->representation };

		psr_model_content_id(from->model, to.content_id);
		memcpy(to.rotation, from->rotation, sizeof to.rotation);
		memcpy(to.translation, from->translation, sizeof to.translation);
		*has_changed |= memcmp(&to, &placed->instance[i], sizeof to) != 0;
		placed->instance[i] = to;
	}
	return PSR_OK;
}

uint64_t placed_bytes(const struct placed *placed)
{
	return placed->n * sizeof *placed->instance;
}

void placed_clear(struct placed *placed)
{
	free(placed->instance);
}

int placed_same_camera(const struct psr_camera *a, const struct psr_camera *b)
{
	return memcmp(a->eye, b->eye, sizeof a->eye) == 0 && memcmp(a->target, b->target, sizeof a->target) == 0
	       && memcmp(a->up, b->up, sizeof a->up) == 0 && a->kind == b->kind && a->fov_y == b->fov_y
	       && a->ortho_height == b->ortho_height && a->near_z == b->near_z;
}
