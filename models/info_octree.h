/* What psr-model info says of an octree. */
#ifndef MODELS_INFO_OCTREE_H
#define MODELS_INFO_OCTREE_H

#include <cjson/cJSON.h>
#include "octree/pack.h"

/* shares: of the packed file, zeros if there is none. scale: units of the source an inner unit. */
void info_print_octree(const struct octree *tree, const struct octree_shares *shares, double scale);
cJSON *info_octree_json(const struct octree *tree, const struct octree_shares *shares, double scale);

/* Estimates the bytes of what is made of it to draw it. */
uint64_t info_octree_drawn(const struct octree *tree);

#endif
