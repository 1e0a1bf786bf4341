#include "info_octree.h"
#include "info_scan.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include "base/maths.h"
#include "model/cubes.h"
#include "surface/material.h"

/* Bits a leaf of the arrays of a tree. */
struct stream {
	const char *name, *key;
	double bits, packed; /* packed: in the file, 0 where that is not packed as an octree */
};
#define N_STREAMS 7

static void take_streams(struct stream streams[N_STREAMS], const struct octree *tree, const struct octree_shares *shares)
{
	const double n = (double)tree->n_leaves;

	streams[0] = (struct stream){ "codes", "codes", 8.0 * (double)tree->n_codes / n, 0 };
	streams[1] = (struct stream){ "skip index", "skip", 8.0 * (double)tree->n_skips * sizeof *tree->skip / n, 0 };
	streams[2] = (struct stream){ "normals", "normals", tree->normal != NULL ? 16.0 : 0.0, 0 };
	streams[3] = (struct stream){ "offsets", "offsets", tree->offset != NULL ? 8.0 : 0.0, 0 };
	streams[4] = (struct stream){ "colours", "colors", tree->color != NULL ? 24.0 : 0.0, 0 };
	streams[5] = (struct stream){ "materials", "materials", tree->material != NULL ? 24.0 : 0.0, 0 };
	streams[6] = (struct stream){ "coarser levels", "coarser", 0.0, 8.0 * (double)shares->coarser / n };
	streams[0].packed = 8.0 * (double)shares->codes / n;
	for (int i = 0; i < OCTREE_STREAMS; i++)
		streams[2 + i].packed = 8.0 * (double)shares->stream[i] / n;
}

/* Sets *degrees to how far normals lean from faces at most; returns in how many cells they do. */
static int find_lean(double *degrees, const struct octree *tree)
{
	uint8_t most = 0;
	int n = 0;

	for (int i = 0; tree->lean != NULL && i < OCTREE_LEAN_CELLS; i++) {
		n += tree->lean[i] > 0;
		most = tree->lean[i] > most ? tree->lean[i] : most;
	}
	*degrees = asin(most / 255.0) / PSR_DEGREE;
	return n;
}

static void print_lean(const struct octree *tree)
{
	double degrees;
	const int n = find_lean(&degrees, tree);

	if (n > 0)
		printf("  %-14s  up to %.0f degrees from faces, in %d of %d cells\n", "normals lean", degrees, n,
		       OCTREE_LEAN_CELLS);
}

static void print_material(uint32_t material)
{
	struct look look;

	material_decode(&look, (uint64_t)material << 40);
	printf("  %-14s  metallic %.2f, reflectance %.3f, roughness %.2f\n", "one material", (double)look.metallic,
	       (double)look.reflectance, (double)look.roughness);
}

void info_print_octree(const struct octree *tree, const struct octree_shares *shares, double scale)
{
	struct stream streams[N_STREAMS];
	double bits = 0, packed = 0;

	take_streams(streams, tree, shares);
	printf("octree            %d levels, %" PRIu64 " leaves of %.4g, %" PRIu64 " byte codes\n", tree->levels,
	       tree->n_leaves, ldexp(tree->edge * scale, -tree->levels), tree->n_codes);
	for (int i = 0; i < (shares->codes > 0 ? N_STREAMS : N_STREAMS - 1); i++) {
		printf("  %-14s  %.2f bits a leaf", streams[i].name, streams[i].bits);
		printf(shares->codes > 0 ? ", %.2f packed\n" : "\n", streams[i].packed);
		bits += streams[i].bits;
		packed += streams[i].packed;
	}
	printf("  %-14s  %.2f bits a leaf", "all", bits);
	printf(shares->codes > 0 ? ", %.2f packed\n" : "\n", packed);
	if (tree->one_material != NULL)
		print_material(octree_material(tree, 0));
	print_lean(tree);
	info_print_scan(tree);
}

cJSON *info_octree_json(const struct octree *tree, const struct octree_shares *shares, double scale)
{
	struct stream streams[N_STREAMS];
	cJSON *root = cJSON_CreateObject(), *bits;
	double degrees;

	take_streams(streams, tree, shares);
	cJSON_AddNumberToObject(root, "levels", tree->levels);
	cJSON_AddNumberToObject(root, "leaves", (double)tree->n_leaves);
	cJSON_AddNumberToObject(root, "codes", (double)tree->n_codes);
	if (find_lean(&degrees, tree) > 0)
		cJSON_AddNumberToObject(root, "lean_degrees", degrees);
	info_add_scan(root, tree);
	cJSON_AddNumberToObject(root, "leaf_edge", ldexp(tree->edge * scale, -tree->levels));
	bits = cJSON_AddObjectToObject(root, "bits_per_leaf");
	for (int i = 0; i < N_STREAMS; i++)
		cJSON_AddNumberToObject(bits, streams[i].key, streams[i].bits);
	if (shares->codes > 0) {
		bits = cJSON_AddObjectToObject(root, "packed_bits_per_leaf");
		for (int i = 0; i < N_STREAMS; i++)
			cJSON_AddNumberToObject(bits, streams[i].key, streams[i].packed);
	}
	return root;
}

uint64_t info_octree_drawn(const struct octree *tree)
{
	const int has_offset = tree->normal != NULL && tree->offset != NULL;
	const int has_material = tree->material != NULL || tree->one_material != NULL;

	return psr_cubes_guess(tree, (tree->normal != NULL ? 2 : 0) + (tree->color != NULL ? 3 : 0) + (has_offset ? 1 : 0)
	                             + (has_material ? 3 : 0));
}
