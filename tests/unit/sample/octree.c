/* Octrees of meshes. */
#define _GNU_SOURCE
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/direction.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "meshes.h"
#include "model/cubes.h"
#include "sample/octree/of_mesh.h"
#include "surface/material.h"

#define LEVELS 6
#define SIDE (1 << LEVELS)
#define DEGREES (180.0 / 3.14159265358979323846)
#define QUANTISED 1.27 /* degrees that a normal is off at most by its code */
#define HALF_STEP (1.7320508075688772 / 2 / OCTREE_OFFSETS) /* leaves that an offset is off by its code */

static struct octree_mesh_report report;

static int try_tree(struct octree **tree, const struct psr_mesh *mesh, int levels, struct psr_error *err)
{
	struct octree_build_options options;

	octree_build_options_default(&options);
	options.levels = levels;
	options.memory = OCTREE_LEAST_MEMORY;
	*tree = NULL;
	return octree_of_mesh(tree, &report, mesh, &options, err);
}

static struct octree *tree_of(const struct psr_mesh *mesh)
{
	struct psr_error err;
	struct octree *tree;

	if (try_tree(&tree, mesh, LEVELS, &err) != PSR_OK)
		fail_msg("%s", err.text);
	assert_int_equal(octree_check(tree, NULL, NULL), PSR_OK);
	return tree;
}

/* The points of a tree, as they are drawn. */
struct point {
	double at[3], normal[3], middle[3]; /* in units of the mesh; middle: the leaf's */
	const uint8_t *color;
};

struct each {
	const struct octree *tree;
	void (*look)(const struct point *point, void *userdata);
	void *userdata;
};

static int visit(const struct octree_node *node, void *userdata)
{
	const struct each *each = userdata;
	const struct octree *tree = each->tree;
	struct point point = { .color = tree->color[node->leaf] };

	octree_center(tree, node->path, tree->levels, point.middle);
	for (int c = 0; c < 3; c++) {
		point.normal[c] = (double)psr_direction_table()[tree->normal[node->leaf]][c];
		point.at[c] = point.middle[c] +
		              octree_offset(tree->offset[node->leaf]) * ldexp(tree->edge, -tree->levels) * point.normal[c];
	}
	each->look(&point, each->userdata);
	return 0;
}

static void each_point(const struct octree *tree, void (*look)(const struct point *point, void *userdata), void *userdata)
{
	struct each each = { tree, look, userdata };

	octree_walk(tree, tree->levels, visit, &each);
}

struct worst {
	double angle, distance; /* degrees; leaves */
};

static const double origin[3] = { 500000.0, 4000000.0, -70.0 };
#define RADIUS 30.0

static void look_at_sphere(const struct point *p, void *userdata)
{
	struct worst *worst = userdata;
	double out[3], n[3];

	v3d_sub(out, p->at, origin);
	v3d_normalize(n, out);
	worst->angle = fmax(worst->angle, acos(fmin(v3d_dot(n, p->normal), 1.0)) * DEGREES);
	worst->distance = fmax(worst->distance, fabs(v3d_length(out) - RADIUS) / (2.0 * RADIUS / SIDE));
}

/* Bounds. Two places of a leaf are at most sqrt(3) / 32 radians apart: 3.1 degrees is the most that the mean is from the
 * normal of any of them, and so, but for half a step of an offset, of the point that is drawn. Facets of 0.9 degrees
 * are within 3e-5 radii of the sphere. Where the line misses the surface within the leaf, its middle, at most 0.87
 * leaves beside the line, stands for it; there the sphere rises by the sine of 3.1 + 1.27 degrees. */
static void points_of_a_sphere_are_on_it_and_look_out(void **state)
{
	struct psr_mesh *mesh = meshes_sphere(200, origin, RADIUS);
	struct octree *tree = tree_of(mesh);
	struct worst worst = { 0.0, 0.0 };

	(void)state;
	each_point(tree, look_at_sphere, &worst);
	print_message("%llu leaves, worst normal %.2f degrees, worst place %.3f leaves\n", (unsigned long long)tree->n_leaves,
	              worst.angle, worst.distance);
	assert_true(worst.angle < sqrt(3.0) / 32.0 * DEGREES + QUANTISED + HALF_STEP / 32.0 * DEGREES);
	assert_true(worst.distance < HALF_STEP + 0.87 * sin((3.1 + QUANTISED) / DEGREES) + 3e-5 * 32.0);
	assert_int_equal(report.n_both, 0);
	assert_true(report.is_closed && tree->is_one_sided);
	octree_destroy(tree);
	meshes_free(mesh);
}

/* The faces are on sides of leaves: each leaf of the shell is there once, and no other. At an edge a normal is between
 * those of two faces, at a corner of three, and its line meets the nearest of them. */
static void look_at_box(const struct point *p, void *userdata)
{
	double outer = 0.0, normal = 0.0;
	int n = 0;

	(void)userdata;
	for (int c = 0; c < 3; c++) {
		outer = fmax(outer, fabs(p->at[c]));
		if (fabs(p->middle[c]) < 1.0 - 2.0 / SIDE)
			continue;
		n++;
		normal += copysign(p->normal[c], p->middle[c] * p->normal[c]);
	}
	assert_true(n > 0 && normal / sqrt(n) > cos(QUANTISED / DEGREES));
	assert_true(fabs(outer - 1.0) < HALF_STEP * 2.0 / SIDE);
}

static void points_of_a_box_are_on_its_sides(void **state)
{
	struct psr_mesh *mesh = meshes_box(1.0, 0);
	struct octree *tree = tree_of(mesh);

	(void)state;
	assert_int_equal(tree->n_leaves, SIDE * SIDE * SIDE - (SIDE - 2) * (SIDE - 2) * (SIDE - 2));
	each_point(tree, look_at_box, NULL);
	assert_true(report.is_closed && report.n_both == 0);
	octree_destroy(tree);
	meshes_free(mesh);
	mesh = meshes_box(1.0, 1);
	tree = tree_of(mesh);
	assert_false(report.is_closed || tree->is_one_sided);
	octree_destroy(tree);
	meshes_free(mesh);
}

/* Two sheets, at 0 and 1 of a cube of edge 2: the upper one is between two layers of leaves, and belongs to one. */
static void a_surface_between_leaves_belongs_to_one_layer(void **state)
{
	struct psr_mesh *mesh = meshes_new(8, 4);
	struct octree *tree;

	(void)state;
	for (uint32_t i = 0; i < 8; i++) {
		v3d_set(mesh->position[i], i % 4 == 1 || i % 4 == 2 ? 2.0 : 0.0, i % 4 >= 2 ? 2.0 : 0.0, i < 4 ? 0.0 : 1.0);
		mesh->normal[i][2] = 1.0f;
	}
	for (uint32_t t = 0; t < 4; t++)
		for (uint32_t k = 0; k < 3; k++)
			mesh->triangle[t][k] = 4 * (t / 2) + (k == 0 ? 0 : k + t % 2);
	tree = tree_of(mesh);
	assert_int_equal(tree->n_leaves, 2 * SIDE * SIDE);
	octree_destroy(tree);
	meshes_free(mesh);
}

/* Areas of a tube's sides sum up to nothing, as those of a solid do. Its seam is closed but for the rounding of a sine. */
static void a_tube_without_ends_is_seen_from_both_sides(void **state)
{
	struct psr_mesh *mesh = meshes_grid(12, 1);
	struct octree *tree;

	(void)state;
	for (uint32_t v = 0; v < mesh->n_vertices; v++) {
		const double a = 2 * 3.14159265358979323846 * (v / 2) / 12;

		v3d_set(mesh->position[v], cos(a), sin(a), v % 2);
		for (int c = 0; c < 3; c++)
			mesh->normal[v][c] = c < 2 ? (float)mesh->position[v][c] : 0;
	}
	tree = tree_of(mesh);
	assert_false(report.is_closed || tree->is_one_sided);
	octree_destroy(tree);
	meshes_free(mesh);
}

#define GRID 13u /* quads a side of a face: their corners are on no side of a leaf */

/* A box whose faces are of many triangles, from 0 to `high`; normals point out of the sphere around it if is_round. */
static struct psr_mesh *make_fine_box(const double high[3], int is_round)
{
	struct psr_mesh *mesh = meshes_new(6 * (GRID + 1) * (GRID + 1), 12 * GRID * GRID);
	uint32_t v = 0, t = 0;

	for (unsigned face = 0; face < 6; face++) {
		const unsigned axis = face / 2, is_high = face % 2;
		const uint32_t first = v;

		for (uint32_t i = 0; i <= GRID; i++)
			for (uint32_t j = 0; j <= GRID; j++, v++) {
				double n[3];

				mesh->position[v][axis] = is_high ? high[axis] : 0;
				mesh->position[v][(axis + 1) % 3] = i == GRID ? high[(axis + 1) % 3] : high[(axis + 1) % 3] * i / GRID;
				mesh->position[v][(axis + 2) % 3] = j == GRID ? high[(axis + 2) % 3] : high[(axis + 2) % 3] * j / GRID;
				v3d_set(n, 0, 0, 0);
				n[axis] = is_high ? 1 : -1;
				for (int c = 0; is_round && c < 3; c++)
					n[c] = mesh->position[v][c] - high[c] / 2;
				v3d_normalize(n, n);
				for (int c = 0; c < 3; c++)
					mesh->normal[v][c] = (float)n[c];
			}
		for (uint32_t i = 0; i < GRID; i++)
			for (uint32_t j = 0; j < GRID; j++)
				for (unsigned half = 0; half < 2; half++, t++) {
					const uint32_t at = first + i * (GRID + 1) + j, across = at + GRID + 2;
					const uint32_t side = half ? at + 1 : at + GRID + 1;
					const int is_out = (half == 0) == (is_high == 1);

					mesh->triangle[t][0] = at;
					mesh->triangle[t][1] = is_out ? side : across;
					mesh->triangle[t][2] = is_out ? across : side;
				}
	}
	return mesh;
}

/* Rounding leaves out no triangle that lies on sides of leaves, and no place beyond the cube's own. */
static void fine_faces_between_leaves_are_whole(void **state)
{
	static const double sizes[] = { 1.0, 0.3, 0.7, 7.1, 1e-3, 1234.567, 1.0 / 3, 1e5 / 7 };

	(void)state;
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
		for (int is_half = 0; is_half < 2; is_half++) {
			const double s = sizes[i];
			struct psr_mesh *mesh = make_fine_box((const double[3]){ s, is_half ? s / 2 : s, s }, 0);
			struct octree *tree = tree_of(mesh);
			const uint64_t around = 4 * (SIDE - 1), n_layers = is_half ? SIDE / 2 - 1 : SIDE - 2;

			assert_int_equal(tree->n_leaves, 2 * SIDE * SIDE + n_layers * around);
			assert_true(tree->is_one_sided && tree->lean == NULL);
			octree_destroy(tree);
			meshes_free(mesh);
		}
}

/* Normals out of a sphere lean from a box's faces: in their middles not at all, at its edges by up to 45, at its corners
 * by 54.7 degrees. Cells of depth 4 are an eighth of a face from its middle to its edge. Nobody's leaves tell of a face
 * whose triangles are narrower than gaps that are filled in. */
static void normals_that_lean_from_wide_faces_are_told(void **state)
{
	struct psr_mesh *mesh = make_fine_box((const double[3]){ 1, 1, 1 }, 1);
	struct octree *tree = NULL;
	struct psr_error err;
	unsigned n = 0;
	double most = 0;

	(void)state;
	assert_int_equal(try_tree(&tree, mesh, 9, &err), PSR_OK);
	assert_non_null(tree->lean);
	for (uint32_t k = 0; k < OCTREE_LEAN_CELLS; k++) {
		const double sine = tree->lean[k] / 255.0;
		uint32_t at[3];
		int is_inside = 1;

		octree_place(k, at);
		for (int c = 0; c < 3; c++)
			is_inside &= at[c] > 0 && at[c] < 15;
		assert_true(!is_inside || sine == 0);
		n += sine > 0;
		most = fmax(most, sine);
	}
	print_message("%u cells lean, up to %.1f degrees\n", n, asin(most) * DEGREES);
	assert_true(n > 600); /* of the shell's 1352 */
	assert_true(fabs(asin(most) * DEGREES - 54.7) < 54.7 * 0.05);
	octree_destroy(tree);
	assert_int_equal(try_tree(&tree, mesh, 4, &err), PSR_OK);
	assert_null(tree->lean);
	octree_destroy(tree);
	meshes_free(mesh);
}

/* ---- colours ---- */

static void look_at_halves(const struct point *p, void *userdata)
{
	const double leaf = 2.0 / SIDE;
	const int c = p->color[0];

	(void)userdata;
	if (p->middle[0] < -4.0 * leaf) /* a filter reaches 0.71 leaves and a texel of 2 / 64 */
		assert_true(c == 10 && p->color[1] == 200);
	else if (p->middle[0] > 4.0 * leaf)
		assert_true(c == 250 && p->color[1] == 20);
	else
		assert_true(c >= 10 && c <= 250);
}

static void textures_come_through(void **state)
{
	struct psr_mesh *mesh = meshes_square(3);
	uint8_t texels[64 * 64 * 4];
	struct octree *tree;

	(void)state;
	for (int i = 0; i < 64 * 64; i++) {
		texels[4 * i] = i % 64 < 32 ? 10 : 250;
		texels[4 * i + 1] = i % 64 < 32 ? 200 : 20;
		texels[4 * i + 2] = 99;
		texels[4 * i + 3] = 255;
	}
	meshes_texture(mesh, 64, 64, texels);
	mesh->material->base_texture.wrap_s = PSR_WRAP_CLAMP;
	tree = tree_of(mesh);
	assert_int_equal(tree->n_leaves, SIDE * SIDE);
	each_point(tree, look_at_halves, NULL);
	assert_int_equal(tree->color[0][2], 99);
	octree_destroy(tree);
	meshes_free(mesh);
}

/* Fine stripes, 64 in a leaf's width at least, are their mean: half of the light, code 188 of 0 and 255. */
static void look_at_stripes(const struct point *p, void *userdata)
{
	(void)userdata;
	assert_true(abs(p->color[0] - 188) <= 2);
}

static void textures_finer_than_leaves_are_filtered(void **state)
{
	const uint32_t width = 8192;
	uint8_t *texels = malloc((size_t)4 * width);
	struct psr_mesh *mesh = meshes_square(1);
	struct octree *tree;

	(void)state;
	assert_non_null(texels);
	for (uint32_t i = 0; i < 4 * width; i++)
		texels[i] = i / 4 % 2 == 0 || i % 4 == 3 ? 255 : 0;
	meshes_texture(mesh, width, 1, texels);
	tree = tree_of(mesh);
	each_point(tree, look_at_stripes, NULL);
	octree_destroy(tree);
	meshes_free(mesh);
	free(texels);
}

/* Vertex colours are linear: light grows with x, and a leaf's mean is that of its middle; a code is half a step off. */
static void look_at_ramp(const struct point *p, void *userdata)
{
	const double light = 0.5 + 0.5 * p->middle[0];
	const double low = (double)psr_srgb_to_linear[p->color[0] > 0 ? p->color[0] - 1 : 0];
	const double high = (double)psr_srgb_to_linear[p->color[0] < 255 ? p->color[0] + 1 : 255];

	(void)userdata;
	assert_true(light > low && light < high);
}

static void colors_of_vertices_are_those_of_the_middle(void **state)
{
	struct psr_mesh *mesh = meshes_square(2);
	struct octree *tree;

	(void)state;
	mesh->color = calloc(mesh->n_vertices, sizeof *mesh->color);
	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		for (int c = 0; c < 4; c++)
			mesh->color[i][c] = c == 3 ? 1.0f : (float)(0.5 + 0.5 * mesh->position[i][0]);
	tree = tree_of(mesh);
	each_point(tree, look_at_ramp, NULL);
	octree_destroy(tree);
	meshes_free(mesh);
}

/* ---- materials ---- */

static uint32_t material_of(const struct psr_material *material)
{
	struct material_values values;

	material_values_default(&values, material);
	return (uint32_t)(material_word(material, &values) >> 40);
}

static void leaves_have_the_material_of_their_surface(void **state)
{
	struct psr_mesh *mesh = meshes_square(2);
	struct psr_material *two = calloc(2, sizeof *two);
	uint32_t of[2];
	struct octree *tree;

	(void)state;
	mesh->material->roughness = 0.3f;
	mesh->material->metallic = 1;
	tree = tree_of(mesh);
	assert_null(tree->material);
	assert_non_null(tree->one_material);
	assert_int_equal(octree_material(tree, 9), material_of(mesh->material));
	octree_destroy(tree);
	/* Each triangle its own. Within a leaf that both meet all is between the two, as metal is by area. */
	memcpy(two, mesh->material, sizeof *two);
	two[1] = two[0];
	two[1].metallic = 0;
	two[1].roughness = 0.8f;
	free(mesh->material);
	mesh->material = two;
	mesh->n_materials = 2;
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		mesh->triangle_material[t] = t % 2;
	for (int i = 0; i < 2; i++)
		of[i] = material_of(&two[i]);
	tree = tree_of(mesh);
	assert_null(tree->one_material);
	uint64_t n[3] = { 0 };
	for (uint64_t i = 0; i < tree->n_leaves; i++) {
		const uint32_t material = octree_material(tree, i), rough = material >> 16;

		n[material == of[0] ? 0 : material == of[1] ? 1 : 2]++;
		assert_true(rough >= of[0] >> 16 && rough <= of[1] >> 16);
		assert_true((material & 31) == (of[0] & 31) || (material >> 5 & 31) == (of[1] >> 5 & 31));
	}
	/* Diagonals of two squares a side of the mesh are in SIDE leaves each, or in twice as many. */
	assert_true(n[0] > 0 && n[1] > 0 && n[2] <= 4 * SIDE);
	octree_destroy(tree);
	meshes_free(mesh);
}

/* A square of two materials, of which the second is as bright whatever the light: leaves are of one or the other. */
static void leaves_of_what_is_unlit_are_unlit(void **state)
{
	struct psr_mesh *mesh = meshes_square(2);
	struct psr_material *two = calloc(2, sizeof *two);
	uint64_t n[2] = { 0 };
	struct octree *tree;

	(void)state;
	for (int i = 0; i < 2; i++)
		memcpy(&two[i], mesh->material, sizeof *two);
	two[1].emissive[0] = 1;
	two[1].base_color[0] = two[1].base_color[1] = two[1].base_color[2] = 0;
	two[0].base_color[0] = 0;
	free(mesh->material);
	mesh->material = two;
	mesh->n_materials = 2;
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		mesh->triangle_material[t] = t % 2;
	tree = tree_of(mesh);
	for (uint32_t i = 0; i < tree->n_leaves; i++) {
		const uint64_t attr = psr_cubes_attr(tree, i);
		const int is_unlit = octree_material(tree, i) == OCTREE_UNLIT;

		n[is_unlit]++;
		assert_int_equal(PSR_ATTR_UNLIT(attr), is_unlit);
		assert_int_equal(PSR_ATTR_NORMAL(attr), tree->normal[i]);
		assert_int_equal(PSR_ATTR_BASE(attr), is_unlit ? 0x0000ff : 0xffff00);
		assert_true(!is_unlit || attr >> 40 == 0);
	}
	assert_true(n[0] > tree->n_leaves / 3 && n[1] > tree->n_leaves / 3);
	octree_destroy(tree);
	/* All of them have it once. */
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		mesh->triangle_material[t] = 1;
	tree = tree_of(mesh);
	assert_null(tree->material);
	assert_int_equal(octree_material(tree, 9), OCTREE_UNLIT);
	octree_destroy(tree);
	meshes_free(mesh);
}

/* The normal is of a face to half a step of its code, where the mean of two faces would be 45 degrees off both. */
static void look_at_face(const struct point *p, void *userdata)
{
	double most = 0.0, outer = 0.0;

	(void)userdata;
	for (int c = 0; c < 3; c++) {
		most = fmax(most, fabs(p->normal[c]));
		outer = fmax(outer, fabs(p->at[c]));
	}
	assert_true(most > cos(QUANTISED / DEGREES));
	assert_true(fabs(outer - 1.0) < HALF_STEP * 2.0 / SIDE);
}

static void leaves_that_shine_are_of_one_face(void **state)
{
	struct psr_mesh *mesh = meshes_box(1.0, 0);
	uint64_t n_leaves;
	struct octree *tree;

	(void)state;
	mesh->material->metallic = 1;
	mesh->material->roughness = 0.3f;
	tree = tree_of(mesh);
	n_leaves = tree->n_leaves;
	each_point(tree, look_at_face, NULL);
	octree_destroy(tree);
	mesh->material->metallic = 0;
	mesh->material->roughness = 1;
	tree = tree_of(mesh);
	assert_int_equal(tree->n_leaves, n_leaves);
	double most = 1.0;
	for (uint64_t i = 0; i < tree->n_leaves; i++) {
		const float *n = psr_direction_table()[tree->normal[i]];

		most = fmin(most, (double)fmaxf(fmaxf(fabsf(n[0]), fabsf(n[1])), fabsf(n[2])));
	}
	assert_true(most < cos(45.0 / DEGREES)); /* a corner's */
	octree_destroy(tree);
	meshes_free(mesh);
}

/* Half of a texture is not there: its leaves neither, but for those about the border. */
static void look_at_there(const struct point *p, void *userdata)
{
	(void)userdata;
	assert_true(p->middle[0] < 3.0 / SIDE);
}

static void transparent_places_have_no_leaves(void **state)
{
	static const uint8_t texels[16] = { 255, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 0, 0, 0, 0, 0 };
	struct psr_mesh *mesh = meshes_square(1);
	struct psr_error err;
	struct octree *tree;

	(void)state;
	meshes_texture(mesh, 4, 1, texels);
	mesh->material->base_texture.is_nearest = 1;
	mesh->material->alpha = PSR_ALPHA_MASK;
	mesh->material->alpha_cutoff = 0.5f;
	tree = tree_of(mesh);
	assert_true(tree->n_leaves >= SIDE * SIDE / 2 - SIDE && tree->n_leaves <= SIDE * SIDE / 2 + SIDE);
	each_point(tree, look_at_there, NULL);
	octree_destroy(tree);
	mesh->material->alpha_cutoff = 2.0f;
	assert_int_equal(try_tree(&tree, mesh, LEVELS, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "nothing of the surface of 2 triangles is opaque"));
	meshes_free(mesh);
}

/* ---- sides ---- */

/* Half a leaf thick, and closed. */
static void both_sides_of_a_thin_sheet_are_counted(void **state)
{
	struct psr_mesh *mesh = meshes_box(1.0, 0);
	struct octree *tree;

	(void)state;
	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		mesh->position[i][2] = 0.3 / SIDE * mesh->position[i][2];
	tree = tree_of(mesh);
	assert_int_equal(tree->n_leaves, SIDE * SIDE);
	assert_int_equal(report.n_both, SIDE * SIDE);
	for (uint64_t i = 0; i < tree->n_leaves; i++) /* of one side, and not of none */
		assert_true(fabsf(psr_direction_table()[tree->normal[i]][2]) > 0.5f);
	octree_destroy(tree);
	meshes_free(mesh);
}

static void turn_inside_out(struct psr_mesh *mesh)
{
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		const uint32_t swap = mesh->triangle[t][1];

		mesh->triangle[t][1] = mesh->triangle[t][2];
		mesh->triangle[t][2] = swap;
	}
}

static void closed_parts_of_two_sides_are_turned_out(void **state)
{
	struct psr_mesh *mesh = meshes_sphere(100, origin, RADIUS);
	struct worst worst = { 0.0, 0.0 };
	struct octree *tree;

	(void)state;
	turn_inside_out(mesh);
	mesh->material->two_sided = 1;
	tree = tree_of(mesh);
	each_point(tree, look_at_sphere, &worst);
	assert_true(worst.angle < 10.0);
	octree_destroy(tree);
	mesh->material->two_sided = 0; /* then a room, seen from within */
	tree = tree_of(mesh);
	worst.angle = 0.0;
	each_point(tree, look_at_sphere, &worst);
	assert_true(worst.angle > 170.0);
	octree_destroy(tree);
	meshes_free(mesh);
}

/* ---- the rest ---- */

static int is_cancelled(void *userdata)
{
	return --*(int *)userdata < 0;
}

static void a_build_can_be_cancelled_and_fits_little_memory(void **state)
{
	struct psr_mesh *mesh = meshes_sphere(100, origin, RADIUS);
	struct octree *tree, *again = NULL;
	struct octree_build_options options;
	int left;
	const struct psr_cancel cancel = { is_cancelled, &left };

	(void)state;
	assert_int_equal(try_tree(&tree, mesh, 8, NULL), PSR_OK); /* 400,000 pairs, 33,000 at a time */
	octree_build_options_default(&options);
	options.levels = 8;
	options.cancel = &cancel;
	for (left = 0; left < 60; left += 7) {
		const int was = left;

		assert_int_equal(octree_of_mesh(&again, NULL, mesh, &options, NULL), PSR_ERR_CANCELLED);
		assert_null(again);
		left = was;
	}
	options.cancel = NULL;
	assert_int_equal(octree_of_mesh(&again, NULL, mesh, &options, NULL), PSR_OK);
	assert_int_equal(again->n_leaves, tree->n_leaves);
	assert_memory_equal(again->normal, tree->normal, tree->n_leaves * sizeof *tree->normal);
	assert_memory_equal(again->offset, tree->offset, tree->n_leaves);
	octree_destroy(tree);
	octree_destroy(again);
	meshes_free(mesh);
}

static void bad_options_are_refused(void **state)
{
	struct psr_mesh *mesh = meshes_box(1.0, 0);
	struct psr_error err;
	struct octree *tree;

	(void)state;
	assert_int_equal(try_tree(&tree, mesh, 1, &err), PSR_ERR_ARG);
	assert_int_equal(try_tree(&tree, mesh, 21, &err), PSR_ERR_ARG);
	mesh->n_triangles = 0;
	assert_int_equal(try_tree(&tree, mesh, LEVELS, &err), PSR_ERR_ARG);
	assert_null(tree);
	meshes_free(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(points_of_a_sphere_are_on_it_and_look_out),
		cmocka_unit_test(points_of_a_box_are_on_its_sides),
		cmocka_unit_test(a_surface_between_leaves_belongs_to_one_layer),
		cmocka_unit_test(a_tube_without_ends_is_seen_from_both_sides),
		cmocka_unit_test(fine_faces_between_leaves_are_whole),
		cmocka_unit_test(normals_that_lean_from_wide_faces_are_told),
		cmocka_unit_test(textures_come_through),
		cmocka_unit_test(textures_finer_than_leaves_are_filtered),
		cmocka_unit_test(colors_of_vertices_are_those_of_the_middle),
		cmocka_unit_test(leaves_have_the_material_of_their_surface),
		cmocka_unit_test(leaves_of_what_is_unlit_are_unlit),
		cmocka_unit_test(leaves_that_shine_are_of_one_face),
		cmocka_unit_test(transparent_places_have_no_leaves),
		cmocka_unit_test(both_sides_of_a_thin_sheet_are_counted),
		cmocka_unit_test(closed_parts_of_two_sides_are_turned_out),
		cmocka_unit_test(a_build_can_be_cancelled_and_fits_little_memory),
		cmocka_unit_test(bad_options_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
