/* What is drawn: models, pictures of them, and a camera that swings about them. */
#ifndef TESTS_BENCH_SCENE_H
#define TESTS_BENCH_SCENE_H

#include <stdint.h>
#include "psr/mesh.h"
#include "psr/model.h"
#include "psr/scene.h"

/* Opens FOLDER/NAME-RESOLUTION.psr, which psr-model builds of `source` first if it is not there or an older psr's. */
struct psr_model *scene_model(const char *psr_model, const char *folder, const char *name, const char *source,
                              int resolution);

/* Makes FOLDER/NAME.glb of the standard set, if it is not there, and writes its path. */
void scene_standard(char path[4096], const char *psr_model, const char *folder, const char *name);

/* One level of a model as a model of that one level. */
struct psr_model *scene_level(const struct psr_model *model, unsigned level);

#define SCENE_FOV 25.0 /* degrees: of a camera that shows the whole object */

struct scene_picture {
	const char *name;
	uint32_t width, height;
	double coverage; /* part of the picture that the object is to cover; 0: the whole object fits */
};

/* A camera that swings by 15 degrees to either side, its eye where one stands that shows the whole object; it looks at
 * the middle of the box plus `aim`, in half sides of the box, and has 1 / zoom of the opening. */
#define SCENE_FRAMES 24
struct scene_film {
	struct scene_picture picture;
	struct psr_model *model;
	struct psr_instance instance;
	struct psr_light light;
	double aim[3], zoom;
	double magnification; /* pixels between neighbouring samples of level 0 at the middle of the object */
};

/* The first frame looks straight; zoom is found so that the coverage is as asked, in the mean of three frames. */
void scene_film_init(struct scene_film *film, const struct scene_picture *picture, struct psr_model *model,
                     const double aim[3]);
/* The whole object at this magnification, if the picture has room for it. */
void scene_film_magnify(struct scene_film *film, double magnification);
void scene_film_camera(struct psr_camera *camera, const struct scene_film *film, int frame);

/* The scene of a frame: one white directional light from the upper left behind the first camera, ambient 0.15. It
 * points into the film. */
void scene_film_frame(struct psr_scene *scene, const struct scene_film *film, int frame);
#define SCENE_AMBIENT 0.15

/* n instances of a model on a square grid in the plane of the film's first picture, in the room of the film's one. */
void scene_spread(struct psr_instance *out, const struct scene_film *film, const struct psr_model *model, uint32_t n);

#endif
