/* The generators of the standard set ([G] figures 5.4 and 8.1). Each fills an initialised, empty shape; a failed
 * allocation is left for shape_check. The same bytes on every machine. */
#ifndef MODELS_GENERATORS_H
#define MODELS_GENERATORS_H

#include <stddef.h>
#include "shape.h"

struct generator {
	const char *name;
	const char *summary; /* one line */
	void (*make)(struct shape *shape);
};

extern const struct generator generators[];
extern const size_t n_generators;

/* NULL and an error that lists the names if there is none of this name. */
const struct generator *generator_find(const char *name, struct psr_error *err);

void make_chair(struct shape *shape);  /* a Windsor chair that faces +z, in metres */
void make_dragon(struct shape *shape); /* a scaly tube in a trefoil knot, 6 across */
void make_gavel(struct shape *shape);  /* on its sounding block, 2.8 long */
void make_kittyhawk(struct shape *shape); /* the Flyer of 1903 with struts and wires, in metres, along +x */
void make_pinetree(struct shape *shape);  /* 6 high, every needle a pyramid, by instances */
void make_plant(struct shape *shape);     /* leaves as thin sheets with a picture; the pot's rim at 0.6 */
void make_sailboat(struct shape *shape);  /* a sloop in metres, its waterline near y = 0 */
void make_table(struct shape *shape);     /* with a checkered runner and a bowl of fruit, in metres */
void make_toybird(struct shape *shape);   /* on wheels with a string; it looks along +x */
void make_tree(struct shape *shape);      /* 26,438 cones and ellipsoids by instances, 6 high */
void make_teapot(struct shape *shape); /* Newell's 32 patches: radius 2, height 3.15, standing on y = 0 */
void make_top(struct shape *shape);    /* a spinning top: radius about 1, its tip at the origin */
void make_pencil(struct shape *shape); /* lies along x on y = 0, its point at x = 0.04: length about 9.6 */
void make_wheel(struct shape *shape);  /* a spoked wheel around z, standing on y = 0: radius 1 */

#endif
