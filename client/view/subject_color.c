/* Colours that tell a number of each point: which ones the models have, and the next one. */
#include "subject.h"

#include <stdio.h>

static int has_color(const struct psr_msg_opened *model, uint8_t color_by)
{
	const uint8_t colors = model->colors != 0 ? model->colors : 1 << PSR_WIRE_COLOR_HEIGHT;

	return colors >> color_by & 1;
}

int subject_has_color(const struct link_scene *scene, uint8_t color_by)
{
	for (uint32_t i = 0; i < scene->n_models; i++)
		if (!has_color(&scene->model[i].opened, color_by))
			return 0;
	return 1;
}

void subject_next_color(struct subject *subject, const struct link_scene *scene, char *note, size_t note_size)
{
	uint8_t by = subject->color_by;

	do
		by = (uint8_t)(by == PSR_WIRE_COLOR_RETURN ? PSR_WIRE_COLOR_OWN : by + 1);
	while (by != PSR_WIRE_COLOR_OWN && (scene == NULL || !subject_has_color(scene, by)));
	subject->color_by = by;
	if (by != PSR_WIRE_COLOR_OWN)
		snprintf(note, note_size, "coloured by %s", scene_colors[by]);
	else
		snprintf(note, note_size, "the model's own colours");
}

int subject_check_color(struct subject *subject, const struct link_scene *scene, struct psr_error *err)
{
	const uint8_t by = subject->color_by;

	for (uint32_t i = 0; by != PSR_WIRE_COLOR_OWN && i < scene->n_models; i++) {
		const struct link_model *model = &scene->model[i];

		if (has_color(&model->opened, by))
			continue;
		subject->color_by = PSR_WIRE_COLOR_OWN;
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s tells no %s of its points; it is shown in its own colours",
		                model->name, scene_colors[by]);
	}
	return PSR_OK;
}
