#include "info_points.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

static double bytes_of(const struct dpoint_set *set)
{
	return (double)dpoint_set_bytes(set) / set->n_points;
}

static double epsilon_of(const struct dpoint_set *set)
{
	return 1 - sqrt(1 - (double)set->sine * (double)set->sine);
}

static double pixels_of(const struct dpoint_set *set, const struct psr_model_info *info)
{
	return (double)set->height * info->resolution / 2;
}

void info_print_points(const struct dpoint_set *set, const struct psr_model_info *info, uint64_t file_bytes)
{
	printf("points            %" PRIu32 " differential points in %" PRIu32 " groups, %.1f bytes a point; %.1f in the "
	       "file\n", set->n_points, set->n_groups, bytes_of(set), (double)file_bytes / set->n_points);
	if (set->n_lean > 0)
		printf("  leaning         %" PRIu32 " lie in faces that shading's normals lean from\n", set->n_lean);
	printf("  epsilon         %.4g\n", epsilon_of(set));
	printf("  off by          %.3g at most, %.3g pixels of the resolution\n", (double)set->height * info->scale,
	       pixels_of(set, info));
}

cJSON *info_points_json(const struct dpoint_set *set, const struct psr_model_info *info, uint64_t file_bytes)
{
	cJSON *part = cJSON_CreateObject();

	cJSON_AddNumberToObject(part, "points", set->n_points);
	cJSON_AddNumberToObject(part, "leaning", set->n_lean);
	cJSON_AddNumberToObject(part, "groups", set->n_groups);
	cJSON_AddNumberToObject(part, "bytes_per_point", bytes_of(set));
	cJSON_AddNumberToObject(part, "bytes_per_point_in_file", (double)file_bytes / set->n_points);
	cJSON_AddNumberToObject(part, "epsilon", epsilon_of(set));
	cJSON_AddNumberToObject(part, "height", (double)set->height * info->scale);
	cJSON_AddNumberToObject(part, "height_pixels", pixels_of(set, info));
	return part;
}
