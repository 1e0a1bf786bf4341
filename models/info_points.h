/* What psr-model info says of differential points. */
#ifndef MODELS_INFO_POINTS_H
#define MODELS_INFO_POINTS_H

#include <cjson/cJSON.h>
#include "model/points.h"

void info_print_points(const struct dpoint_set *set, const struct psr_model_info *info, uint64_t file_bytes);
cJSON *info_points_json(const struct dpoint_set *set, const struct psr_model_info *info, uint64_t file_bytes);

#endif
