#include "info_scan.h"

#include <inttypes.h>
#include <stdio.h>

/* As the ASPRS numbers them (LAS 1.4, table 17). */
static const char *const class_names[] = {
	"never classified", "unclassified", "ground", "low vegetation", "medium vegetation", "high vegetation", "building",
	"low noise", "reserved", "water", "rail", "road", "reserved", "wire guard", "wire", "tower", "wire connector",
	"bridge", "high noise",
};

static const char *class_name(unsigned class)
{
	return class < sizeof class_names / sizeof *class_names ? class_names[class] : class < 64 ? "reserved" : "user's";
}

struct figures {
	uint32_t least_intensity, most_intensity, most_returns, least_time, most_time;
	uint64_t n_of_class[256];
};

static void take_figures(struct figures *f, const struct octree *tree)
{
	const struct octree_scan *scan = &tree->scan;

	*f = (struct figures){ .least_intensity = UINT32_MAX, .least_time = UINT32_MAX };
	for (uint64_t i = 0; i < tree->n_leaves; i++) {
		const uint32_t intensity = scan->intensity != NULL ? scan->intensity[i] : 0;
		const uint32_t returns = scan->returns != NULL ? scan->returns[i] >> 4 : 0;
		const uint32_t time = scan->time != NULL ? scan->time[i] : 0;

		f->least_intensity = intensity < f->least_intensity ? intensity : f->least_intensity;
		f->most_intensity = intensity > f->most_intensity ? intensity : f->most_intensity;
		f->most_returns = returns > f->most_returns ? returns : f->most_returns;
		f->least_time = time < f->least_time ? time : f->least_time;
		f->most_time = time > f->most_time ? time : f->most_time;
		if (scan->class != NULL)
			f->n_of_class[scan->class[i]]++;
	}
}

static double seconds(const struct octree *tree, uint32_t time)
{
	return (*tree->scan.time_scale)[0] + (*tree->scan.time_scale)[1] * time;
}

static int has_scan(const struct octree *tree)
{
	const struct octree_scan *scan = &tree->scan;

	return scan->intensity != NULL || scan->class != NULL || scan->returns != NULL || scan->time != NULL;
}

void info_print_scan(const struct octree *tree)
{
	struct figures f;

	if (!has_scan(tree))
		return;
	take_figures(&f, tree);
	if (tree->scan.intensity != NULL)
		printf("  %-14s  %" PRIu32 " to %" PRIu32 "\n", "intensity", f.least_intensity, f.most_intensity);
	for (unsigned c = 0; c < 256; c++)
		if (f.n_of_class[c] > 0)
			printf("  class %-8u  %" PRIu64 " leaves, %s\n", c, f.n_of_class[c], class_name(c));
	if (tree->scan.returns != NULL)
		printf("  %-12s    up to %" PRIu32 " of a pulse\n", "returns", f.most_returns);
	if (tree->scan.time != NULL)
		printf("  %-14s  %.6f to %.6f\n", "GPS time", seconds(tree, f.least_time), seconds(tree, f.most_time));
}

void info_add_scan(cJSON *root, const struct octree *tree)
{
	struct figures f;
	cJSON *part, *list;

	if (!has_scan(tree))
		return;
	take_figures(&f, tree);
	part = cJSON_AddObjectToObject(root, "scan");
	if (tree->scan.intensity != NULL)
		cJSON_AddItemToObject(part, "intensity",
		                      cJSON_CreateIntArray((const int[]){ (int)f.least_intensity, (int)f.most_intensity }, 2));
	if (tree->scan.class != NULL) {
		list = cJSON_AddObjectToObject(part, "classes");
		for (unsigned c = 0; c < 256; c++) {
			char name[8];

			snprintf(name, sizeof name, "%u", c);
			if (f.n_of_class[c] > 0)
				cJSON_AddNumberToObject(list, name, (double)f.n_of_class[c]);
		}
	}
	if (tree->scan.returns != NULL)
		cJSON_AddNumberToObject(part, "returns", f.most_returns);
	if (tree->scan.time != NULL)
		cJSON_AddItemToObject(part, "time", cJSON_CreateDoubleArray((const double[]){ seconds(tree, f.least_time),
		                                                                              seconds(tree, f.most_time) }, 2));
}
