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

void make_teapot(struct shape *shape); /* Newell's 32 patches: radius 2, height 3.15, standing on y = 0 */
void make_top(struct shape *shape);    /* a spinning top: radius about 1, its tip at the origin */
void make_pencil(struct shape *shape); /* lies along x on y = 0, its point at x = 0.04: length about 9.6 */
void make_wheel(struct shape *shape);  /* a spoked wheel around z, standing on y = 0: radius 1 */

#endif
