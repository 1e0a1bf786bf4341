#include "fine.h"
#include "groups.h"
#include "render.h"

/* Pixels between samples of level 0, in the root mean square of a view, above which a fine picture is the smooth one. At
 * twice the size blocks of some three sub-pixels between samples begin to have samples more than four apart, whose cells
 * are wide and square (decision 0131); of other representations a smaller distance is known (0133). */
#define FINE_APART 1.5
#define FINE_APART_OTHERS 1.25

/* Splats mix their leaves, however wide. */
static int is_all_splats(const struct psr_scene *scene, const struct render_settings *settings)
{
	for (uint32_t i = 0; i < scene->n_instances; i++)
		if (!is_octree(&scene->instance[i]))
			return 0;
	return settings->with_ewa;
}

double fine_most_apart(const struct psr_scene *scene)
{
	for (uint32_t i = 0; i < scene->n_instances; i++)
		if (instance_drawn_as(&scene->instance[i]) != PSR_BLOCKS)
			return FINE_APART_OTHERS;
	return FINE_APART;
}

int fine_is_worth(int *is_worth, struct surveyor **surveyor, const struct psr_scene *scene,
                  const struct render_settings *settings, struct psr_error *err)
{
	struct survey survey;
	int rc = settings_validate(settings, err);

	if (rc == PSR_OK)
		rc = psr_scene_validate(scene, err);
	*is_worth = rc == PSR_OK && is_all_splats(scene, settings);
	if (rc || *is_worth)
		return rc;
	if (*surveyor == NULL)
		*surveyor = surveyor_create();
	const int known = *surveyor == NULL ? -1 : survey_scene(&survey, *surveyor, scene, settings->width, settings->height,
	                                                        NULL, 0);
	if (known < 0) /* no picture may depend on the memory that is left */
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a fine picture");
	/* A scene of too many clusters for a survey is taken for one of samples enough. */
	*is_worth = known == 0 || survey.apart <= fine_most_apart(scene);
	return PSR_OK;
}
