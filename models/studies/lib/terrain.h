#ifndef MODELS_STUDIES_LIB_TERRAIN_H
#define MODELS_STUDIES_LIB_TERRAIN_H

#include "models/shapes/shape.h"

/* Half a million triangles, a unit wide and deep. */
void make_terrain(struct shape *shape);

#endif
