/* What psr-model info says of the streams of a laser scan. */
#ifndef MODELS_INFO_SCAN_H
#define MODELS_INFO_SCAN_H

#include <cjson/cJSON.h>
#include "octree/octree.h"

/* Print lines, or add an object "scan", if the tree has any of these streams. */
void info_print_scan(const struct octree *tree);
void info_add_scan(cJSON *root, const struct octree *tree);

#endif
