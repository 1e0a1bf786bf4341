/* Octrees of analytic surfaces as models. */
#ifndef TESTS_UNIT_LIB_TREES_H
#define TESTS_UNIT_LIB_TREES_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "base/direction.h"
#include "model/tree.h"
#include "octree/octree.h"

struct tree_options {
	int levels;
	double radius;    /* of a sphere about the origin; the cube is -1..1 in each direction */
	int is_solid;     /* the sphere's inside, too */
	int is_one_sided;
	int with_offsets;
	int with_scan;    /* intensity 30,000 (y + 1); class 2 where x > 0, else 6; return 1 of 1 where z > 0, else 2 of 2 */
	double keep;      /* of the leaves: 1 keeps all, less makes a cloud */
};

struct tree_making {
	const struct tree_options *options;
	struct octree_maker maker;
	uint64_t random;
};

/* Whether a closed cell meets the sphere, or the ball. */
static inline int tree_meets(const double low[3], double edge, double r, int is_solid)
{
	double nearest = 0, farthest = 0;

	for (int a = 0; a < 3; a++) {
		const double high = low[a] + edge, near = low[a] > 0 ? low[a] : high < 0 ? high : 0;

		nearest += near * near;
		farthest += fmax(low[a] * low[a], high * high);
	}
	return nearest <= r * r && (is_solid || r * r <= farthest);
}

static inline void tree_descend(struct tree_making *m, const double low[3], double edge, uint64_t path, int depth)
{
	if (!tree_meets(low, edge, m->options->radius, m->options->is_solid))
		return;
	if (depth == m->options->levels) {
		m->random = m->random * 6364136223846793005u + 1442695040888963407u;
		if ((double)(m->random >> 33) < m->options->keep * 0x1p31 && octree_maker_put(&m->maker, path, NULL) != PSR_OK)
			abort();
		return;
	}
	for (unsigned j = 0; j < 8; j++) {
		const double child[3] = { low[0] + (j & 1 ? edge / 2 : 0), low[1] + (j & 2 ? edge / 2 : 0),
			                      low[2] + (j & 4 ? edge / 2 : 0) };

		tree_descend(m, child, edge / 2, path << 3 | j, depth + 1);
	}
}

struct tree_filling {
	const struct tree_options *options;
	struct octree *tree;
};

static inline int tree_fill(const struct octree_node *node, void *userdata)
{
	const struct tree_filling *filling = userdata;
	struct octree *tree = filling->tree;
	const double h = ldexp(tree->edge, -tree->levels);
	double c[3];

	octree_center(tree, node->path, tree->levels, c);
	const float n[3] = { (float)c[0], (float)c[1], (float)c[2] };
	const double r = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
	tree->normal[node->leaf] = psr_direction_encode(n);
	tree->offset[node->leaf] = (uint8_t)octree_offset_step((filling->options->radius - r) / h);
	for (int a = 0; a < 3; a++)
		tree->color[node->leaf][a] = c[a] > 0 ? 200 : 60;
	if (!filling->options->with_scan)
		return 0;
	tree->scan.intensity[node->leaf] = (uint16_t)(30000 * (c[1] + 1));
	tree->scan.class[node->leaf] = c[0] > 0 ? 2 : 6;
	tree->scan.returns[node->leaf] = c[2] > 0 ? 0x11 : 0x22;
	return 0;
}

/* Returns a model of the leaves that meet the sphere, with normals, and colours of 200 or 60 by the signs of x, y and z.
 * Aborts on failure: this is a test's fixture. */
static inline struct psr_model *tree_build(const struct tree_options *options)
{
	struct tree_making m = { .options = options };
	struct psr_model_info info = { .scale = 1, .up = { 0, 1, 0 }, .resolution = 1u << options->levels };
	struct psr_model *model = NULL;
	struct psr_error err;

	if (octree_maker_init(&m.maker, options->levels, NULL) != PSR_OK)
		abort();
	tree_descend(&m, (const double[3]){ -1, -1, -1 }, 2, 0, 0);
	struct octree *tree = octree_maker_take(&m.maker);
	for (int a = 0; a < 3; a++) {
		tree->low[a] = -1;
		info.box_min[a] = -options->radius;
		info.box_max[a] = options->radius;
	}
	tree->edge = 2;
	tree->is_one_sided = options->is_one_sided;
	tree->is_cloud = options->keep < 1;
	tree->normal = malloc(tree->n_leaves * sizeof *tree->normal);
	tree->color = malloc(tree->n_leaves * sizeof *tree->color);
	tree->offset = malloc(tree->n_leaves);
	if (options->with_scan) {
		tree->scan.intensity = malloc(tree->n_leaves * sizeof *tree->scan.intensity);
		tree->scan.class = malloc(tree->n_leaves);
		tree->scan.returns = malloc(tree->n_leaves);
	}
	octree_walk(tree, options->levels, tree_fill, &(struct tree_filling){ options, tree });
	if (!options->with_offsets) {
		free(tree->offset);
		tree->offset = NULL;
	}
	info.spacing = sqrt(3) * ldexp(2, -options->levels);
	if (psr_model_create_octree(&model, &info, tree, NULL, &err) != PSR_OK) {
		fprintf(stderr, "%s\n", err.text);
		abort();
	}
	octree_destroy(tree);
	octree_maker_fini(&m.maker);
	return model;
}

#endif
