/* What drawing a scene will meet, counted in some of its blocks before it is drawn: for choices among settings. Takes
 * some tenths of a millisecond at most, whatever the scene. */
#ifndef PSR_RENDER_SURVEY_H
#define PSR_RENDER_SURVEY_H

#include <stddef.h>
#include "psr/scene.h"

#define SURVEY_MOST 16

/* Of one density: how many drawn pixels stand beside each other in one of the picture, over the settings' spacing. */
struct survey_counts {
	double n_blocks;  /* that the cull will test */
	double n_samples; /* of the blocks that it will leave */
	double spread;    /* of these, the sum of squares of the distance to the next sample, pixels of this density */
};

struct survey {
	double area;   /* pixels of the picture that blocks cover; estimates, as all counts */
	double apart;  /* pixels between samples of level 0, the root of the mean square; 0: none in view */
	double layers; /* how many times samples cover the area */
	struct survey_counts at[SURVEY_MOST];
};

struct surveyor; /* memory of surveys; one thread at a time */
struct surveyor *surveyor_create(void); /* NULL without memory */
void surveyor_destroy(struct surveyor *surveyor); /* NULL is fine */
size_t surveyor_bytes(void); /* of one, its scene apart */

/* Surveys a scene that psr_scene_validate() took, whose models are there, in a picture of this size; lights do not
 * matter. Fills at[0..n-1] for densities > 0, n at most SURVEY_MOST. Returns 1; 0 if the scene has too many clusters,
 * -1 if there is no memory: then nothing is known. */
int survey_scene(struct survey *survey, struct surveyor *surveyor, const struct psr_scene *scene, uint32_t width,
                 uint32_t height, const double *density, int n);

#endif
