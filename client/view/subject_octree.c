/* Octrees, which are shown as points or as splats. */
#include "subject.h"

#include <stdio.h>
#include <string.h>

/* As the server chooses where nobody does: blocks first. */
static int is_octree(const struct link_model *model, uint8_t representation)
{
	const int has_blocks = model->opened.representations >> PSR_WIRE_REP_BLOCKS & 1;

	if (representation != PSR_WIRE_REP_AUTO)
		return representation == PSR_WIRE_REP_OCTREE;
	return !has_blocks && model->opened.representations >> PSR_WIRE_REP_OCTREE & 1;
}

int subject_has_octree(const struct subject *subject, const struct link_scene *scene)
{
	for (uint32_t i = 0; scene != NULL && i < subject->n_instances; i++)
		for (uint32_t m = 0; m < scene->n_models; m++)
			if (strcmp(scene->model[m].name, subject->instance[i].link.model) == 0
			    && is_octree(&scene->model[m], subject->instance[i].link.representation))
				return 1;
	return 0;
}

void subject_toggle_splats(struct subject *subject, const struct link_scene *scene, char *note, size_t note_size)
{
	if (!subject_has_octree(subject, scene)) {
		snprintf(note, note_size, "no octree is shown: other models have no splats");
		return;
	}
	subject->with_splats = !subject->with_splats;
	snprintf(note, note_size, subject->with_splats ? "octrees as splats" : "octrees as points");
}
