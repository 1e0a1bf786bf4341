#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "leaves.h"
#include "runs.h"
#include "scan.h"
#include "base/direction.h"

#define BATCH 4096
/* The protocol has no lengths beyond 1e30, and none of leaves, 2^-20 of the cube's, below 1e-30. */
#define LEAST_EDGE 1e-24
#define MOST_LENGTH 1e30

struct building {
	const struct octree_source *source;
	const struct octree_build_options *options;
	struct psr_error *err;
	uint64_t n_points;
	double low[3], high[3], edge; /* of the points; of the cube around them */
	double time[2];               /* the least and the greatest */
	int levels;
	struct runs runs;
	struct octree_maker maker;
	struct built built;
};

void octree_build_options_default(struct octree_build_options *options)
{
	const char *folder = getenv("TMPDIR");

	*options = (struct octree_build_options){ .levels = 10, .memory = (uint64_t)2 << 30 };
	options->folder = folder != NULL && folder[0] != '\0' ? folder : "/tmp";
}

/* Reads all points, and gives them to fn. */
static int read_points(struct building *b, const char *stage,
                       int (*fn)(struct building *b, const struct octree_point *point))
{
	const struct octree_source *source = b->source;
	struct octree_point *points = malloc(BATCH * sizeof *points);
	size_t n = 0;
	int rc = points != NULL ? source->rewind(source->userdata, b->err)
	                        : psr_fail(b->err, PSR_ERR_MEMORY, "no memory for points");

	b->n_points = 0;
	while (rc == PSR_OK) {
		if (psr_is_cancelled(b->options->cancel)) {
			rc = psr_fail(b->err, PSR_ERR_CANCELLED, "%s: cancelled", source->name);
			break;
		}
		rc = source->read(&n, points, BATCH, source->userdata, b->err);
		if (rc != PSR_OK || n == 0)
			break;
		for (size_t i = 0; i < n && rc == PSR_OK; i++, b->n_points++)
			rc = fn(b, &points[i]);
		built_progress(b->options, stage, b->n_points, source->n_points);
	}
	free(points);
	return rc;
}

static int bound_point(struct building *b, const struct octree_point *point)
{
	for (int c = 0; c < 3; c++) {
		if (!isfinite(point->at[c]))
			return psr_fail(b->err, PSR_ERR_FORMAT, "%s: point %llu (counted from 0) has no finite %c", b->source->name,
			                (unsigned long long)b->n_points, "xyz"[c]);
		b->low[c] = fmin(b->low[c], point->at[c]);
		b->high[c] = fmax(b->high[c], point->at[c]);
	}
	if (b->source->scan >> OCTREE_TIME & 1 && isfinite(point->time)) {
		b->time[0] = fmin(b->time[0], point->time);
		b->time[1] = fmax(b->time[1], point->time);
	}
	return PSR_OK;
}

static int check_options(const struct octree_build_options *options, struct psr_error *err)
{
	if ((options->levels == 0 && !(options->spacing > 0.0)) ||
	    (options->levels != 0 && (options->levels < OCTREE_LEAST_LEVELS || options->levels > OCTREE_MOST_LEVELS)) ||
	    options->memory < OCTREE_LEAST_MEMORY)
		return psr_fail(err, PSR_ERR_ARG, "an octree of %d levels, leaves of %g, sorted in %llu bytes, cannot be built",
		                options->levels, options->spacing, (unsigned long long)options->memory);
	return PSR_OK;
}

int octree_build_levels(int *levels, const struct octree_build_options *options, const char *name, double edge,
                        struct psr_error *err)
{
	int rc = check_options(options, err);

	if (rc == PSR_OK && (edge < LEAST_EDGE || edge > MOST_LENGTH))
		return psr_fail(err, PSR_ERR_FORMAT, "%s: it extends over %g: models are from %g to %g wide; scale it", name, edge,
		                LEAST_EDGE, MOST_LENGTH);
	*levels = options->levels > 0 ? options->levels : OCTREE_LEAST_LEVELS;
	for (; rc == PSR_OK && options->levels == 0 && ldexp(edge, -*levels) > options->spacing; ++*levels)
		if (*levels == OCTREE_MOST_LEVELS)
			return psr_fail(err, PSR_ERR_ARG, "%s: leaves of %g in a cube of %g are more than %d levels; %g is possible",
			                name, options->spacing, edge, OCTREE_MOST_LEVELS, ldexp(edge, -OCTREE_MOST_LEVELS));
	return rc;
}

/* Finds the cube and its levels. */
static int find_cube(struct building *b)
{
	double largest = 0.0;

	for (int c = 0; c < 3; c++) {
		b->low[c] = INFINITY;
		b->high[c] = -INFINITY;
	}
	b->time[0] = INFINITY;
	b->time[1] = -INFINITY;
	if (read_points(b, "bounds", bound_point) != PSR_OK)
		return b->err->code;
	if (b->n_points == 0)
		return psr_fail(b->err, PSR_ERR_FORMAT, "%s: there are no points", b->source->name);
	for (int c = 0; c < 3; c++) {
		b->edge = fmax(b->edge, b->high[c] - b->low[c]);
		largest = fmax(largest, fmax(fabs(b->high[c]), fabs(b->low[c])));
	}
	if (b->edge == 0.0)
		return psr_fail(b->err, PSR_ERR_FORMAT, "%s: all %llu points are at %g %g %g", b->source->name,
		                (unsigned long long)b->n_points, b->low[0], b->low[1], b->low[2]);
	if (!isfinite(b->edge) || b->edge < ldexp(largest, -50))
		return psr_fail(b->err, PSR_ERR_FORMAT, "%s: points that extend over %g at coordinates of %g cannot be told apart",
		                b->source->name, b->edge, largest);
	if (largest > MOST_LENGTH)
		return psr_fail(b->err, PSR_ERR_FORMAT, "%s: points at coordinates of %g: a model's are at most %g; scale them",
		                b->source->name, largest, MOST_LENGTH);
	return octree_build_levels(&b->levels, b->options, b->source->name, b->edge, b->err);
}

static uint16_t normal_code(const float normal[3])
{
	if (!isfinite(normal[0]) || !isfinite(normal[1]) || !isfinite(normal[2]) ||
	    (normal[0] == 0.0f && normal[1] == 0.0f && normal[2] == 0.0f))
		return RECORD_NO_NORMAL;
	return psr_direction_encode(normal);
}

static int sort_point(struct building *b, const struct octree_point *point)
{
	struct scan_record scan;
	struct record record = { .color = { point->color[0], point->color[1], point->color[2] },
		                     .normal = b->source->has_normal ? normal_code(point->normal) : RECORD_NO_NORMAL };
	uint32_t at[3];

	for (int c = 0; c < 3; c++) {
		/* The highest places, and those of a source that changes, go to the last leaf. */
		const double place = ldexp(fmax(point->at[c] - b->low[c], 0.0) / b->edge, b->levels);
		const double most = (double)((uint32_t)1 << b->levels) - 1.0;
		const double inside = fmin(floor(place), most);

		at[c] = (uint32_t)inside;
		record.part[c] = (uint8_t)fmin(256.0 * (place - inside), 255.0);
	}
	record.path = octree_path(at);
	if (b->source->scan == 0)
		return runs_put(&b->runs, &record, b->err);
	scan_of_point(&scan, point, b->time);
	scan.record = record;
	return runs_put(&b->runs, &scan.record, b->err);
}

/* The points of one leaf. */
struct sum {
	uint64_t n, path, color[3], part[3];
	int64_t normal[3];
	uint16_t first; /* of the normals */
	struct scan_sum scan;
};

static void add_record(struct sum *sum, const struct record *record)
{
	sum->path = record->path;
	sum->n++;
	for (int c = 0; c < 3; c++) {
		sum->color[c] += record->color[c];
		sum->part[c] += record->part[c];
		if (record->normal != RECORD_NO_NORMAL)
			sum->normal[c] += (int16_t)(psr_direction_words()[record->normal] >> 16 * c & 0xffff);
	}
	if (sum->first == RECORD_NO_NORMAL)
		sum->first = record->normal;
}

/* Makes sure that leaf n has places for its attributes. */
static int leaf_room(struct building *b, uint64_t n, uint64_t *room)
{
	const uint64_t more = n + n / 4 + 4096;
	struct octree *tree = b->maker.tree;

	if (n < *room)
		return 1;
	if (!leaves_grow(&b->built.part, more) || (b->source->has_color && !leaves_grow(&tree->color, more)) ||
	    (b->source->has_normal && !leaves_grow(&tree->normal, more)) || !scan_grow(&tree->scan, b->source->scan, more))
		return 0;
	*room = more;
	return 1;
}

/* Opposite normals have no mean: the first of them stands for all. */
static uint16_t mean_normal(const struct sum *sum)
{
	const float mean[3] = { (float)sum->normal[0], (float)sum->normal[1], (float)sum->normal[2] };

	if (sum->first == RECORD_NO_NORMAL || (mean[0] == 0.0f && mean[1] == 0.0f && mean[2] == 0.0f))
		return sum->first;
	return psr_direction_encode(mean);
}

static int end_leaf(struct building *b, const struct sum *sum, uint64_t *room)
{
	struct octree *tree = b->maker.tree;
	const uint64_t leaf = tree->n_leaves;

	if (!leaf_room(b, leaf, room))
		return psr_fail(b->err, PSR_ERR_MEMORY, "no memory for an octree of %llu leaves", (unsigned long long)leaf);
	for (int c = 0; c < 3; c++) {
		b->built.part[leaf][c] = (uint8_t)((sum->part[c] + sum->n / 2) / sum->n);
		if (tree->color != NULL)
			tree->color[leaf][c] = (uint8_t)((sum->color[c] + sum->n / 2) / sum->n);
	}
	if (tree->normal != NULL) {
		tree->normal[leaf] = mean_normal(sum);
		b->built.n_without += tree->normal[leaf] == RECORD_NO_NORMAL;
	}
	scan_put(&tree->scan, leaf, &sum->scan, sum->n);
	return octree_maker_put(&b->maker, sum->path, b->err);
}

static int merge(struct building *b)
{
	const struct record *record;
	struct sum sum = { .first = RECORD_NO_NORMAL };
	uint64_t room = 0, done = 0;
	int rc = octree_maker_init(&b->maker, b->levels, b->err), end;

	while (rc == PSR_OK && (record = runs_next(&b->runs, &rc, b->err)) != NULL) {
		if (sum.n > 0 && record->path != sum.path) {
			rc = end_leaf(b, &sum, &room);
			sum = (struct sum){ .first = RECORD_NO_NORMAL };
		}
		add_record(&sum, record);
		if (b->source->scan != 0)
			scan_add(&sum.scan, (const struct scan_record *)(const void *)record);
		if (++done % 65536 == 0) {
			built_progress(b->options, "merge", done, b->n_points);
			if (psr_is_cancelled(b->options->cancel))
				rc = psr_fail(b->err, PSR_ERR_CANCELLED, "%s: cancelled", b->source->name);
		}
	}
	end = rc == PSR_OK ? end_leaf(b, &sum, &room) : rc;
	if (end == PSR_OK)
		b->built.tree = octree_maker_take(&b->maker);
	octree_maker_fini(&b->maker);
	return end;
}

static int build(struct building *b)
{
	int rc = find_cube(b);

	if (rc != PSR_OK)
		return rc;
	rc = runs_init(&b->runs, b->options->folder, 3 * b->levels, b->source->scan != 0, b->options->memory, b->err);
	if (rc == PSR_OK)
		rc = read_points(b, "points", sort_point);
	if (rc == PSR_OK && b->n_points == 0)
		rc = psr_fail(b->err, PSR_ERR_FORMAT, "%s: the points are gone on second reading", b->source->name);
	if (rc == PSR_OK)
		rc = runs_end(&b->runs, b->err);
	if (rc == PSR_OK)
		rc = merge(b);
	runs_fini(&b->runs);
	if (rc != PSR_OK)
		return rc;
	memcpy(b->built.tree->low, b->low, sizeof b->low);
	b->built.tree->edge = b->edge;
	if (!scan_end(b->built.tree, b->time))
		return psr_fail(b->err, PSR_ERR_MEMORY, "%s: no memory for the times of points", b->source->name);
	b->built.tree->is_cloud = 1;
	rc = built_normals(&b->built, b->options);
	return rc == PSR_OK ? rc : psr_fail(b->err, rc, "%s: %s", b->source->name, rc == PSR_ERR_CANCELLED ? "cancelled" :
	                                                                     "no memory for the normals of its leaves");
}

int octree_build(struct octree **out, const struct octree_source *source, const struct octree_build_options *options,
                 struct psr_error *err)
{
	struct psr_error own;
	struct building b = { .source = source, .options = options, .err = err != NULL ? err : &own };
	int rc = check_options(options, b.err);

	if (rc != PSR_OK)
		return rc;
	rc = build(&b);
	free(b.built.part);
	if (rc == PSR_OK)
		*out = b.built.tree;
	else
		octree_destroy(b.built.tree);
	return rc;
}
