/* What psr-model info says of differential points. */
#ifndef MODELS_INFO_POINTS_H
#define MODELS_INFO_POINTS_H

#include <cjson/cJSON.h>
#include "model/points.h"

/* scale: units of the source an inner unit. */
void info_print_points(const struct dpoint_set *set, double scale);
cJSON *info_points_json(const struct dpoint_set *set, double scale);

#endif
