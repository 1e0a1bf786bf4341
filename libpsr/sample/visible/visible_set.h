/* The parts of the surface that can be seen from outside: views from all around mark them, as [G] 6.3 marks blocks. */
#ifndef PSR_SAMPLE_VISIBLE_VISIBLE_SET_H
#define PSR_SAMPLE_VISIBLE_VISIBLE_SET_H

#include "base/pool.h"
#include "base/table.h"
#include "ray/ray.h"

struct visible_set {
	double width;       /* of a cell, inner units */
	unsigned n_views;   /* looked along so far */
	struct table table; /* keys alone: a cell and a facing */
	double ds;          /* a pixel of the finest level */
};

int visible_set_init(struct visible_set *set, double ds); /* MEMORY; visible_set_fini() either way */
void visible_set_fini(struct visible_set *set);

/* Looks from all around, a ray every fourth pixel, along new directions until there were 8,192. Stops after 64 views
 * that met at most one place in `enough` unseen by earlier ones, or after 512. MEMORY. */
#define VISIBLE_ENOUGH 4000 /* to begin with: nearly all that is unseen are rims of seen parts */
#define VISIBLE_LEAST_VIEWS 64
#define VISIBLE_MOST_VIEWS 512
int visible_set_look(struct visible_set *set, const struct ray_scene *scene, uint64_t enough, struct psr_pool *pool);

/* Makes a set with cells twice as wide, of the same ds. MEMORY; call visible_set_fini() even then. */
int visible_set_coarsen(struct visible_set *set, const struct visible_set *finer);

/* Returns whether views saw anything near p that faces like n (unit, on the side that the view met). */
int visible_set_has(const struct visible_set *set, const float p[3], const float n[3]);

/* Returns whether that may be the surface at p, and not one beneath which p is buried (buried.h). */
int visible_set_shows(const struct visible_set *set, const struct ray_scene *scene, const float p[3], const float n[3]);

/* Adds a place that the views missed. MEMORY. */
int visible_set_add(struct visible_set *set, const float p[3], const float n[3]);

#endif
