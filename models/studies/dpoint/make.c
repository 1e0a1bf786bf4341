/* Points of models, as [K] has them: all samples, simplified ones, and flat ones; and models of them. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "dpoint/group.h"
#include "dpoint/mesh.h"
#include "model/points.h"
#include "model/tree.h"
#include "sample/dpoint/of_mesh.h"
#include "study_dpoint.h"
#include "surface/material.h"

#define PIECE 0.01   /* of a mesh; radii */
#define SPARSE 4
#define DEGREES 2
#define HEIGHT 0.002f

int study_dpoint_keep_all(struct dpoint_choice *choice, size_t n)
{
	*choice = (struct dpoint_choice){ malloc(n + 1), n, 0 };
	if (choice->is_kept == NULL)
		return PSR_ERR_MEMORY;
	memset(choice->is_kept, 1, n);
	return PSR_OK;
}

static int is_of_patches(const struct study_model *of)
{
	return strcmp(of->name, "teapot") == 0;
}

static int sample(struct dpoint_surface *surface, const struct study *study, const struct study_model *of,
                  uint32_t side, int is_simplified)
{
	const float delta = is_simplified ? STUDY_DPOINT_DELTA_FREE : STUDY_DPOINT_DELTA;
	struct dpoint_uniform uniform = { side, 2, .scale = 1 / of->scale, .delta = delta,
		                              .sine = is_simplified ? dpoint_sine(STUDY_DPOINT_EPSILON) : 0 };
	struct dpoint_mesh_options mesh = { .scale = 1 / of->scale, .cell = PIECE, .delta = delta };

	memcpy(uniform.origin, of->origin, sizeof uniform.origin);
	memcpy(mesh.origin, of->origin, sizeof mesh.origin);
	return is_of_patches(of) ? study_dpoint_teapot(surface, &uniform)
	                         : dpoint_sample_mesh(surface, of->mesh, &mesh, study->err);
}

int study_dpoint_make(struct study_dpoint *made, const struct study *study, const struct study_model *of, uint32_t side,
                      int is_simplified)
{
	const struct dpoint_cover_options fitted = STUDY_DPOINT_FITTED(DEGREES, HEIGHT);
	int rc;

	memset(made, 0, sizeof *made);
	dpoint_surface_init(&made->surface);
	rc = sample(&made->surface, study, of, side, is_simplified);
	if (rc == PSR_OK && is_simplified)
		rc = dpoint_simplify(&made->choice, &made->cover, &made->surface, &fitted, SPARSE, study->pool, NULL);
	else if (rc == PSR_OK)
		rc = study_dpoint_keep_all(&made->choice, made->surface.n_candidates);
	return rc == PSR_OK ? rc : psr_fail(study->err, rc, "the points of %s cannot be made", of->name);
}

void study_dpoint_fini(struct study_dpoint *made)
{
	dpoint_choice_fini(&made->choice);
	dpoint_cover_fini(&made->cover);
	dpoint_surface_fini(&made->surface);
}

/* ---- flat ones ---- */

/* The ball of [K] 6 reaches to the furthest of the samples beside, which are as far as the cell's sides are long. */
static float ball_of(float side[3], const struct dpoint_cell *cell)
{
	float most = 0;

	for (int c = 0; c < 4; c++) {
		float away[3];

		v3f_sub(away, cell->corner[(c + 1) % 4], cell->corner[c]);
		if (v3f_length(away) > most) {
			most = v3f_length(away);
			memcpy(side, away, sizeof away);
		}
	}
	return most;
}

/* Along the longest side of its cell, and flat. A delta of a class that is not below. */
static void flatten(struct dpoint_candidate *c, const struct dpoint_cell *cell, float wide)
{
	float side[3] = { 0, 0, 0 };
	const float extent = wide * ball_of(side, cell);
	unsigned class = dpoint_delta_class(extent);

	if (dpoint_delta_of_class(class) < extent && class > 0)
		class--;
	c->delta[0] = c->delta[1] = dpoint_delta_of_class(class);
	c->point.lambda_u = c->point.rho = 0;
	v3f_add_scaled(side, side, -v3f_dot(side, c->point.normal), c->point.normal);
	if (v3f_length(side) > 0)
		v3f_normalize(c->point.u, side);
}

int study_dpoint_flat(struct dpoint_surface *surface, const struct study_model *of, uint32_t side, float wide)
{
	struct dpoint_uniform uniform = { side, 1, .scale = 1 / of->scale, .delta = STUDY_DPOINT_DELTA };
	int rc;

	memcpy(uniform.origin, of->origin, sizeof uniform.origin);
	rc = study_dpoint_teapot(surface, &uniform);
	for (size_t i = 0; i < surface->n_candidates && rc == PSR_OK; i++)
		flatten(&surface->candidate[i], &surface->cell[surface->candidate[i].cell], wide);
	return rc;
}

/* ---- models ---- */

void study_dpoint_dull(struct psr_material *material)
{
	material->is_specular_glossiness = 1;
	material->glossiness = 0;
	memset(material->specular, 0, sizeof material->specular);
}

static uint64_t word_of(const struct psr_mesh *mesh, int is_specular)
{
	struct psr_material material = mesh->material[0];
	struct material_values values;

	if (!is_specular)
		study_dpoint_dull(&material);
	material_values_default(&values, &material);
	return material_word(&material, &values);
}

static struct psr_model_info info_of(const struct study_model *of)
{
	struct psr_model_info info = { .up = { 0, 1, 0 }, .scale = of->scale, .resolution = STUDY_DPOINT_RESOLUTION };

	memcpy(info.origin, of->origin, sizeof info.origin);
	info.spacing = 2 * of->scale / info.resolution;
	for (int k = 0; k < 3; k++) {
		info.box_min[k] = of->origin[k] - of->scale;
		info.box_max[k] = of->origin[k] + of->scale;
	}
	return info;
}

int study_dpoint_model(struct psr_model **out, struct study *study, const struct study_model *of,
                       struct dpoint_surface *surface, const struct dpoint_choice *choice, int is_specular)
{
	const struct psr_model_info info = info_of(of);
	const uint64_t word = word_of(of->mesh, is_specular);
	struct dpoint_set set;
	int rc;

	for (size_t i = 0; i < surface->n_candidates; i++)
		surface->candidate[i].point.attr = word | PSR_ATTR_NORMAL(surface->candidate[i].point.attr);
	rc = dpoint_set_make(&set, &(struct dpoint_grouping){ surface, choice, dpoint_sine(STUDY_DPOINT_EPSILON), NULL });
	if (rc == PSR_OK)
		rc = psr_model_create_of(out, &info, &(struct psr_model_parts){ .points = &set }, NULL, study->err);
	else
		psr_fail(study->err, rc, "no memory for the points of %s", of->name);
	dpoint_set_fini(&set);
	return rc;
}

int study_dpoint_of_mesh(struct psr_model **out, const struct study *study, const struct study_model *of)
{
	struct dpoint_build_options options;
	struct dpoint_build_report report;
	struct psr_model_info info = { .up = { 0, 1, 0 } };
	struct dpoint_set set;
	int rc;

	dpoint_build_options_default(&options, study->resolution);
	options.pool = study->pool;
	rc = dpoint_of_mesh(&set, &info, &report, of->mesh, &options, study->err);
	if (rc == PSR_OK)
		rc = psr_model_create_of(out, &info, &(struct psr_model_parts){ .points = &set }, NULL, study->err);
	dpoint_set_fini(&set);
	return rc;
}

int study_dpoint_blocks(struct psr_model **out, const struct study *study, const struct study_model *of, uint32_t times)
{
	struct study finer = *study;

	finer.resolution *= times;
	return study_build(out, NULL, &finer, of);
}
