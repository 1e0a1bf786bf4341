#include "sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"

struct sampling {
	struct dpoint_surface *surface;
	const struct dpoint_patch *patch;
	const struct dpoint_uniform *uniform;
	struct dpoint_span span;
};

/* Local shape in inner units. */
static int local_at(struct dpoint_local *local, const struct sampling *s, double u, double v)
{
	const double scale = s->uniform->scale;
	int is_good = dpoint_patch_local(local, s->patch, &s->span, (const double[2]){ u, v });

	for (int k = 0; k < 3; k++) {
		local->at[k] = (local->at[k] - s->uniform->origin[k]) * scale;
		local->shape[k] /= scale;
	}
	return is_good;
}

static int put_sample(const struct sampling *s, double u, double v, const struct dpoint_candidate *like)
{
	struct dpoint_local local;
	const int is_good = local_at(&local, s, u, v);

	return dpoint_surface_put(s->surface, is_good ? &local : NULL, like);
}

/* Whether the sample's rectangle is over the corners of its part. */
static int is_wide_enough(const struct sampling *s, const struct dpoint_candidate *sample, uint32_t i, uint32_t j)
{
	const double scale = s->uniform->scale;
	float extent[2], side[3];

	dpoint_candidate_extent(extent, sample, s->uniform->sine);
	v3f_cross(side, sample->point.normal, sample->point.u);
	for (uint32_t k = 0; k < 4; k++) {
		const double uv[2] = { (double)(i + (k & 1)) / s->uniform->n, (double)(j + (k >> 1)) / s->uniform->n };
		float away[3];
		double at[3];

		dpoint_patch_place(at, s->patch, &s->span, uv);
		for (int c = 0; c < 3; c++)
			away[c] = (float)((at[c] - s->uniform->origin[c]) * scale) - sample->point.at[c];
		if (!(fabsf(v3f_dot(away, sample->point.u)) < extent[0] && fabsf(v3f_dot(away, side)) < extent[1]))
			return 0;
	}
	return 1;
}

static int put_in_cells(const struct sampling *s, uint32_t i, uint32_t j, struct dpoint_candidate *like)
{
	const uint32_t n = s->uniform->n, cells = s->uniform->cells, first = like->cell;
	const double all = (double)n * cells;
	int rc = PSR_OK;

	for (uint32_t k = 0; k < cells * cells && rc == PSR_OK; k++) {
		const uint32_t row = i * cells + k / cells, column = j * cells + k % cells;

		like->cell = first + row * n * cells + column;
		rc = put_sample(s, (row + 0.5) / all, (column + 0.5) / all, like);
	}
	return rc;
}

static int put_candidates(const struct sampling *s)
{
	const uint32_t n = s->uniform->n, cells = s->uniform->cells, first = (uint32_t)s->surface->n_cells;
	struct dpoint_candidate like = { .delta = { s->uniform->delta, s->uniform->delta }, .part = s->uniform->part,
		                             .point.attr = s->uniform->attr };
	int rc = PSR_OK;

	for (uint32_t i = 0; i < n && rc == PSR_OK; i++)
		for (uint32_t j = 0; j < n && rc == PSR_OK; j++) {
			const size_t before = s->surface->n_candidates;

			like.cell = first + (i * cells + cells / 2) * n * cells + j * cells + cells / 2;
			rc = put_sample(s, (i + 0.5) / n, (j + 0.5) / n, &like);
			if (rc != PSR_OK || s->uniform->sine == 0 || cells == 1 || s->surface->n_candidates == before ||
			    is_wide_enough(s, &s->surface->candidate[before], i, j))
				continue;
			like.cell = first;
			rc = put_in_cells(s, i, j, &like);
		}
	return rc;
}

/* Two rows of corners at a time. */
static int put_cells(const struct sampling *s)
{
	const uint32_t n = s->uniform->n * s->uniform->cells;
	float (*corner)[3] = malloc(2 * ((size_t)n + 1) * sizeof *corner);
	int rc = corner != NULL ? PSR_OK : PSR_ERR_MEMORY;

	for (uint32_t i = 0; i <= n && rc == PSR_OK; i++) {
		float (*row)[3] = corner + (i & 1) * ((size_t)n + 1), (*before)[3] = corner + (~i & 1) * ((size_t)n + 1);

		for (uint32_t j = 0; j <= n; j++) {
			double at[3];

			dpoint_patch_place(at, s->patch, &s->span, (const double[2]){ (double)i / n, (double)j / n });
			for (int k = 0; k < 3; k++)
				row[j][k] = (float)((at[k] - s->uniform->origin[k]) * s->uniform->scale);
		}
		for (uint32_t j = 0; j < n && i > 0 && rc == PSR_OK; j++) {
			struct dpoint_cell *cell = dpoint_surface_cell(s->surface);
			struct dpoint_local local;

			if (cell == NULL) {
				rc = PSR_ERR_MEMORY;
				break;
			}
			memcpy(cell->corner[0], before[j], sizeof *row);
			memcpy(cell->corner[1], row[j], sizeof *row);
			memcpy(cell->corner[2], row[j + 1], sizeof *row);
			memcpy(cell->corner[3], before[j + 1], sizeof *row);
			cell->part = s->uniform->part;
			cell->attr = s->uniform->attr;
			memset(cell->normal, 0, sizeof cell->normal);
			if (local_at(&local, s, (i - 0.5) / n, (j + 0.5) / n))
				for (int k = 0; k < 3; k++)
					cell->normal[k] = (float)local.axis[2][k];
		}
	}
	free(corner);
	return rc;
}

int dpoint_sample_uniform(struct dpoint_surface *surface, const struct dpoint_patch *patch,
                          const struct dpoint_uniform *uniform)
{
	struct sampling s = { surface, patch, uniform, { { 0, 0 } } };
	int rc = PSR_OK;

	for (uint32_t i = 0; rc == PSR_OK && dpoint_patch_span(&s.span, patch, i); i++) {
		rc = put_candidates(&s);
		if (rc == PSR_OK)
			rc = put_cells(&s);
	}
	return rc;
}
