#include "trim_grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "base/vec.h"

#define STEPS 8         /* of a span, to tell its length and how it bends */
#define MOST_LOOKS 48   /* places across, where each span is looked at */
#define ALL_LOOKS (1u << 20)
#define MOST_LINES 4096
#define CLOSE 1e-10     /* of the domain */

static void place_in(double *out, const struct trim_grid *grid, const uint32_t span[2], const double uv[2])
{
	for (int k = 0; k < 2; k++) {
		const double *knot = grid->patch.knot[k] + span[k];

		out[k] = fmin(fmax((uv[k] - knot[0]) / (knot[1] - knot[0]), 0), 1);
	}
}

static void to_inner(double at[3], const struct dpoint_trimmed_options *options)
{
	for (int k = 0; k < 3; k++)
		at[k] = (at[k] - options->origin[k]) * options->scale;
}

static int local_in(struct dpoint_local *local, const struct trim_grid *grid, const uint32_t span[2],
                    const double uv[2], const struct dpoint_trimmed_options *options)
{
	const struct dpoint_span at = { { span[0], span[1] } };
	double in[2];
	int is_good;

	place_in(in, grid, span, uv);
	is_good = dpoint_patch_local(local, &grid->patch, &at, in);
	to_inner(local->at, options);
	for (int k = 0; k < 3; k++)
		local->shape[k] /= options->scale;
	return is_good;
}

int trim_local(struct dpoint_local *local, const struct trim_grid *grid, const uint32_t cell[2], const double uv[2],
               const struct dpoint_trimmed_options *options)
{
	return local_in(local, grid, (const uint32_t[2]){ grid->axis[0].knot[cell[0]], grid->axis[1].knot[cell[1]] }, uv,
	                options);
}

void trim_place(double at[3], const struct trim_grid *grid, const uint32_t cell[2], const double uv[2],
                const struct dpoint_trimmed_options *options)
{
	const struct dpoint_span span = { { grid->axis[0].knot[cell[0]], grid->axis[1].knot[cell[1]] } };
	double in[2];

	place_in(in, grid, span.at, uv);
	dpoint_patch_place(at, &grid->patch, &span, in);
	to_inner(at, options);
}

uint32_t trim_find(const struct trim_axis *axis, double x)
{
	uint32_t low = 0, high = axis->n;

	while (high - low > 1) {
		const uint32_t middle = low + (high - low) / 2;

		if (x >= axis->line[middle])
			low = middle;
		else
			high = middle;
	}
	return low;
}

/* ---- lines ---- */

struct part {
	uint32_t knot;
	double low, high;
};

/* What the bounds leave of each span. */
static uint32_t list_parts(struct part *part, const struct dpoint_patch *patch, int k, const double bound[2])
{
	uint32_t n = 0;

	for (uint32_t i = (uint32_t)patch->degree[k]; i < patch->n[k]; i++) {
		const double low = fmax(patch->knot[k][i], bound[0]), high = fmin(patch->knot[k][i + 1], bound[1]);

		if (high > low)
			part[n++] = (struct part){ i, low, high };
	}
	return n;
}

static double angle_between(const double a[3], const double b[3])
{
	double chord[3];

	v3d_sub(chord, a, b);
	return 2 * asin(fmin(0.5 * v3d_length(chord), 1));
}

/* Into how many columns a part has to be divided, by what is seen at places `across`. */
static double columns_of(const struct trim_grid *grid, int k, const struct part *part, const struct part *across,
                         double v, const struct dpoint_trimmed_options *options)
{
	struct dpoint_local local[2];
	int is_good[2] = { 0, 0 };
	double most = 1;

	for (int i = 0; i <= STEPS; i++) {
		struct dpoint_local *now = &local[i & 1], *before = &local[~i & 1];
		double uv[2], step[3];
		uint32_t span[2];

		uv[k] = i < STEPS ? part->low + (part->high - part->low) * i / STEPS : part->high;
		uv[1 - k] = v;
		span[k] = part->knot;
		span[1 - k] = across->knot;
		is_good[i & 1] = local_in(now, grid, span, uv, options);
		if (i == 0)
			continue;
		v3d_sub(step, now->at, before->at);
		most = fmax(most, v3d_length(step) * STEPS / options->cell);
		if (is_good[0] && is_good[1])
			most = fmax(most, angle_between(now->axis[2], before->axis[2]) * STEPS / options->turn);
	}
	return most;
}

/* Three places of each part across, or of some of them. */
static uint32_t count_columns(const struct trim_grid *grid, int k, const struct part *part, const struct part *across,
                              uint32_t n_across, uint32_t looks, const struct dpoint_trimmed_options *options)
{
	const uint32_t stride = 1 + 3 * n_across / looks;
	double most = 1;

	for (uint32_t i = 0; i < 3 * n_across; i += stride) {
		const struct part *a = &across[i / 3];

		most = fmax(most, columns_of(grid, k, part, a, a->low + 0.5 * (i % 3) * (a->high - a->low), options));
	}
	return (uint32_t)fmin(ceil(most - 1e-6), MOST_LINES);
}

static int make_lines(struct trim_grid *grid, int k, const struct part *part, uint32_t n, const struct part *across,
                      uint32_t n_across, const struct dpoint_trimmed_options *options)
{
	struct trim_axis *axis = &grid->axis[k];
	const uint32_t looks = (uint32_t)fmin(fmax(ALL_LOOKS / n, 3), MOST_LOOKS);
	uint32_t *columns = malloc((n + 1) * sizeof *columns);
	uint64_t total = 0;

	for (uint32_t i = 0; columns != NULL && i < n; i++)
		total += columns[i] = count_columns(grid, k, &part[i], across, n_across, looks, options);
	axis->n = 0;
	if (columns == NULL || total >= TRIM_MOST_CELLS) {
		free(columns);
		return total > 0 ? PSR_ERR_LIMIT : PSR_ERR_MEMORY;
	}
	axis->line = malloc((total + 1) * sizeof *axis->line);
	axis->knot = malloc((total + 1) * sizeof *axis->knot);
	for (uint32_t i = 0; axis->line != NULL && axis->knot != NULL && i < n; i++)
		for (uint32_t c = 0; c < columns[i]; c++) {
			axis->line[axis->n] = part[i].low + (part[i].high - part[i].low) * c / columns[i];
			axis->knot[axis->n++] = part[i].knot;
		}
	free(columns);
	if (axis->line == NULL || axis->knot == NULL)
		return PSR_ERR_MEMORY;
	axis->line[axis->n] = part[n - 1].high;
	axis->close = CLOSE * (axis->line[axis->n] - axis->line[0]);
	return PSR_OK;
}

/* ---- where rims are ---- */

static int mark(struct trim_grid *grid, size_t cell)
{
	if (grid->n_marks == TRIM_MOST_MARKS)
		return PSR_ERR_LIMIT;
	if (!ARRAY_ROOM(grid->mark, grid->n_marks, grid->marks_room))
		return PSR_ERR_MEMORY;
	grid->mark[grid->n_marks] = (struct trim_mark){ (uint32_t)grid->n_sides - 1, grid->first[cell] };
	grid->first[cell] = (uint32_t)grid->n_marks++;
	grid->state[cell] = TRIM_RIM;
	return PSR_OK;
}

/* All cells that the last side touches. */
static int mark_cells(struct trim_grid *grid, const double a[2], const double b[2])
{
	const struct trim_axis *x = &grid->axis[0], *y = &grid->axis[1];
	const uint32_t last = trim_find(x, fmax(a[0], b[0]) + x->close);
	int rc = PSR_OK;

	for (uint32_t i = trim_find(x, fmin(a[0], b[0]) - x->close); i <= last && rc == PSR_OK; i++) {
		double t[2] = { 0, 1 }, low, high;
		const double run = b[0] - a[0];
		uint32_t end;

		if (fabs(run) > x->close) {
			const double from = (x->line[i] - x->close - a[0]) / run, to = (x->line[i + 1] + x->close - a[0]) / run;

			t[0] = fmin(fmax(fmin(from, to), 0), 1);
			t[1] = fmin(fmax(fmax(from, to), 0), 1);
		}
		low = fmin(a[1] + t[0] * (b[1] - a[1]), a[1] + t[1] * (b[1] - a[1])) - y->close;
		high = fmax(a[1] + t[0] * (b[1] - a[1]), a[1] + t[1] * (b[1] - a[1])) + y->close;
		end = trim_find(y, high);
		for (uint32_t j = trim_find(y, low); j <= end && rc == PSR_OK; j++)
			rc = mark(grid, (size_t)i * y->n + j);
	}
	return rc;
}

static int put_side(struct trim_grid *grid, const double a[2], const double b[2],
                    const struct dpoint_trimmed_options *options)
{
	if (!ARRAY_ROOM(grid->side, grid->n_sides, grid->sides_room))
		return PSR_ERR_MEMORY;
	for (int e = 0; e < 2; e++) {
		const double *uv = e == 0 ? a : b;
		uint32_t cell[2];

		trim_find_cell(cell, grid, uv);
		trim_place(grid->side[grid->n_sides].end[e], grid, cell, uv, options);
	}
	grid->n_sides++;
	return mark_cells(grid, a, b);
}

/* A rim along the grid's own border parts no cell. */
static int is_along_border(const struct trim_grid *grid, const double a[2], const double b[2])
{
	for (int k = 0; k < 2; k++) {
		const struct trim_axis *axis = &grid->axis[k];

		if (a[k] == b[k] && (a[k] == axis->line[0] || a[k] == axis->line[axis->n]))
			return 1;
	}
	return 0;
}

static int mark_rims(struct trim_grid *grid, const struct psr_patch *patch,
                     const struct dpoint_trimmed_options *options)
{
	int rc = PSR_OK;

	for (uint32_t t = 0; t < patch->n_triangles; t++)
		for (int i = 0; i < 3 && rc == PSR_OK; i++) {
			const double *a = patch->corner[patch->triangle[t][i]], *b = patch->corner[patch->triangle[t][(i + 1) % 3]];

			if ((patch->rim[t] >> i & 1) && !is_along_border(grid, a, b))
				rc = put_side(grid, a, b, options);
		}
	return rc;
}

static double distance_of(const struct trim_side *side, const double at[3])
{
	double along[3], away[3];
	double square, t;

	v3d_sub(along, side->end[1], side->end[0]);
	v3d_sub(away, at, side->end[0]);
	square = v3d_dot(along, along);
	t = square > 0 ? fmin(fmax(v3d_dot(away, along) / square, 0), 1) : 0;
	v3d_add_scaled(away, away, -t, along);
	return v3d_length(away);
}

int trim_along(double along[3], const struct trim_grid *grid, const uint32_t cell[2], const double at[3])
{
	const struct trim_side *nearest = NULL;
	double least = INFINITY;

	for (uint32_t i = cell[0] > 0 ? cell[0] - 1 : 0; i <= cell[0] + 1 && i < grid->axis[0].n; i++)
		for (uint32_t j = cell[1] > 0 ? cell[1] - 1 : 0; j <= cell[1] + 1 && j < grid->axis[1].n; j++)
			for (uint32_t m = grid->first[(size_t)i * grid->axis[1].n + j]; m != UINT32_MAX; m = grid->mark[m].next) {
				const struct trim_side *side = &grid->side[grid->mark[m].side];
				const double distance = distance_of(side, at);

				if (distance < least) {
					least = distance;
					nearest = side;
				}
			}
	if (nearest != NULL)
		v3d_sub(along, nearest->end[1], nearest->end[0]);
	return nearest != NULL;
}

static void find_bounds(double bound[2][2], const struct psr_patch *patch)
{
	for (int k = 0; k < 2; k++) {
		bound[k][0] = INFINITY;
		bound[k][1] = -INFINITY;
		for (uint32_t i = 0; i < patch->n_corners; i++) {
			bound[k][0] = fmin(bound[k][0], patch->corner[i][k]);
			bound[k][1] = fmax(bound[k][1], patch->corner[i][k]);
		}
	}
}

static int find_rims(struct trim_grid *grid, const struct psr_patch *patch,
                     const struct dpoint_trimmed_options *options)
{
	const uint64_t n = (uint64_t)grid->axis[0].n * grid->axis[1].n;

	if (n > TRIM_MOST_CELLS)
		return PSR_ERR_LIMIT;
	grid->state = calloc(n + 1, sizeof *grid->state);
	grid->first = malloc((n + 1) * sizeof *grid->first);
	if (grid->state == NULL || grid->first == NULL)
		return PSR_ERR_MEMORY;
	memset(grid->first, 0xff, n * sizeof *grid->first);
	return n > 0 ? mark_rims(grid, patch, options) : PSR_OK;
}

int trim_init(struct trim_grid *grid, const struct psr_patch *patch, const struct dpoint_trimmed_options *options,
              struct psr_error *err)
{
	double bound[2][2];
	struct part *part[2] = { malloc(patch->n[0] * sizeof **part), malloc(patch->n[1] * sizeof **part) };
	uint32_t n[2] = { 0, 0 };
	int rc = part[0] != NULL && part[1] != NULL ? PSR_OK : PSR_ERR_MEMORY;

	memset(grid, 0, sizeof *grid);
	grid->patch = (struct dpoint_patch){ .degree = { patch->degree[0], patch->degree[1] },
		                                 .n = { patch->n[0], patch->n[1] }, .knot = { patch->knot[0], patch->knot[1] },
		                                 .control = (const double (*)[4])patch->control };
	find_bounds(bound, patch);
	for (int k = 0; k < 2 && rc == PSR_OK; k++)
		n[k] = list_parts(part[k], &grid->patch, k, bound[k]);
	for (int k = 0; k < 2 && rc == PSR_OK && n[0] > 0 && n[1] > 0; k++)
		rc = make_lines(grid, k, part[k], n[k], part[1 - k], n[1 - k], options);
	free(part[0]);
	free(part[1]);
	if (rc == PSR_OK)
		rc = find_rims(grid, patch, options);
	if (rc == PSR_ERR_LIMIT)
		return psr_fail(err, PSR_ERR_LIMIT, "a face would be divided into more than %u cells of %g; build blocks",
		                TRIM_MOST_CELLS, options->cell);
	return rc == PSR_OK ? rc : psr_fail(err, PSR_ERR_MEMORY, "no memory to divide a face");
}

void trim_fini(struct trim_grid *grid)
{
	for (int k = 0; k < 2; k++) {
		free(grid->axis[k].line);
		free(grid->axis[k].knot);
	}
	free(grid->state);
	free(grid->first);
	free(grid->side);
	free(grid->mark);
	memset(grid, 0, sizeof *grid);
}
