/* Differential points of meshes: few, all over the surface, with its looks and sides. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/vec.h"
#include "model/blocks.h"
#include "sample/dpoint/of_mesh.h"

#define AROUND 48
#define UP 24
#define RADIUS 3.0

/* A sphere about 10, 0, 0 with the normals of its shape; without a cap if it is open. */
static struct psr_mesh *sphere(int is_open)
{
	double (*position)[3] = malloc(AROUND * (UP + 1) * sizeof *position);
	uint32_t (*triangle)[3] = malloc(2 * AROUND * UP * sizeof *triangle), n = 0;
	struct psr_mesh *mesh;

	for (int i = 0; i < AROUND; i++)
		for (int k = 0; k <= UP; k++) {
			const double a = 2 * M_PI * i / AROUND, b = M_PI * k / UP;

			v3d_set(position[i * (UP + 1) + k], 10 + RADIUS * sin(b) * cos(a), RADIUS * cos(b), -RADIUS * sin(b) * sin(a));
		}
	for (uint32_t i = 0; i < AROUND; i++)
		for (uint32_t k = is_open ? UP / 4 : 0; k < UP; k++) {
			const uint32_t j = (i + 1) % AROUND, a = i * (UP + 1) + k, b = j * (UP + 1) + k;

			memcpy(triangle[n++], (const uint32_t[3]){ a, a + 1, b + 1 }, sizeof *triangle);
			memcpy(triangle[n++], (const uint32_t[3]){ a, b + 1, b }, sizeof *triangle);
		}
	assert_int_equal(psr_mesh_create(&mesh, (const double(*)[3])position, AROUND * (UP + 1),
	                                 (const uint32_t(*)[3])triangle, n, NULL), PSR_OK);
	free(position);
	free(triangle);
	mesh->material[0].two_sided = 1;
	mesh->material[0].base_color[0] = 0.5f;
	mesh->material[0].metallic = 1;
	return mesh;
}

static void make(struct dpoint_set *set, struct psr_model_info *info, struct dpoint_build_report *report,
                 const struct psr_mesh *mesh, uint32_t resolution)
{
	struct dpoint_build_options options;
	struct psr_error err = { 0 };

	dpoint_build_options_default(&options, resolution);
	options.degrees = 6;
	options.piece = 0.05;
	options.height = 0.01;
	*info = (struct psr_model_info){ .scale = 0 };
	if (dpoint_of_mesh(set, info, report, mesh, &options, &err) != PSR_OK)
		fail_msg("%s", err.text);
}

/* The chord of a facet is off the sphere by 1 - cos(pi / UP / 2) of its radius, and normals between corners are as much
 * off as two facets turn: all points are so near, and two thirds of the pieces are superfluous at least. */
static void points_lie_on_the_surface_and_are_few(void **state)
{
	struct psr_mesh *mesh = sphere(0);
	struct dpoint_build_report report;
	struct psr_model_info info;
	struct dpoint_set set;

	(void)state;
	make(&set, &info, &report, mesh, 128);
	assert_true(fabs(info.origin[0] - 10) < 1e-9 && fabs(info.scale - RADIUS) < 1e-4 * RADIUS);
	assert_true(info.box_min[1] == -RADIUS && info.box_max[1] == RADIUS && info.resolution == 128);
	assert_int_equal(report.n_kept, set.n_points);
	assert_int_equal(report.n_open, 0);
	assert_true(3 * report.n_kept < report.n_candidates);
	for (uint32_t i = 0; i < set.n_groups; i++)
		for (uint32_t k = 0; k < set.group[i].n; k++) {
			struct dpoint p;

			dpoint_unpack(&p, &set.word[set.group[i].first + k], &set.group[i].box);
			assert_true(fabs((double)v3f_length(p.at) - 1) < 1 - cos(M_PI / UP / 2) + 0.01);
			/* Where 48 slivers meet, some are mended by points that lean. */
			assert_true(fabsf(p.at[1]) > 0.98f || v3f_dot(p.at, p.normal) > 0.98f);
			assert_int_equal(set.group[i].flags, 0); /* it is closed: nobody sees its back */
			assert_int_equal(PSR_ATTR_METALLIC(p.attr), 31);
			assert_true(PSR_ATTR_BASE(p.attr) == 0xffffbc); /* 0.5 as sRGB */
		}
	dpoint_set_fini(&set);
	psr_mesh_destroy(mesh);
}

static void an_open_surface_is_seen_from_the_sides_that_its_material_has(void **state)
{
	(void)state;
	for (int two_sided = 0; two_sided < 2; two_sided++) {
		struct psr_mesh *mesh = sphere(1);
		struct dpoint_build_report report;
		struct psr_model_info info;
		struct dpoint_set set;

		mesh->material[0].two_sided = two_sided;
		make(&set, &info, &report, mesh, 128);
		for (uint32_t i = 0; i < set.n_groups; i++)
			assert_int_equal(set.group[i].flags & DPOINT_TWO_SIDED, two_sided ? DPOINT_TWO_SIDED : 0);
		dpoint_set_fini(&set);
		psr_mesh_destroy(mesh);
	}
}

/* Colours at vertices, of two kinds: no rectangle of one reaches over the other by more than a pixel and the overhang
 * (twice: as it grows, and as its point moves), and far fewer points than pixels are kept. Over the ring of facets where
 * one colour becomes the other, 7.5 degrees wide, a point is as near to the colour of its place as the header says. */
static void rectangles_end_where_colours_do(void **state)
{
	const int resolution = 256;
	const double ring = sin(M_PI / UP), pixel = 2.0 / resolution;
	struct psr_mesh *mesh = sphere(0);
	struct dpoint_build_report report;
	struct psr_model_info info;
	struct dpoint_set set;

	(void)state;
	mesh->color = malloc(mesh->n_vertices * sizeof *mesh->color);
	for (uint32_t v = 0; v < mesh->n_vertices; v++)
		for (int c = 0; c < 4; c++)
			mesh->color[v][c] = c == 3 || mesh->position[v][1] > 0.1 ? 1 : 0;
	make(&set, &info, &report, mesh, (uint32_t)resolution);
	assert_int_equal(report.n_open, 0);
	assert_true((double)report.n_kept < 0.1 * M_PI * resolution * resolution);
	for (uint32_t i = 0; i < set.n_groups; i++)
		for (uint32_t k = 0; k < set.group[i].n; k++) {
			const struct dpoint_limit limit = dpoint_limit_of(&set, &set.group[i], k);
			float extent[2], v[3];
			struct dpoint p;
			double reach;

			dpoint_unpack(&p, &set.word[set.group[i].first + k], &set.group[i].box);
			dpoint_extent(extent, &p, &limit);
			v3f_cross(v, p.normal, p.u);
			reach = fabsf(p.u[1]) * extent[0] + fabsf(v[1]) * extent[1] - pixel - 2 * 5e-4;
			/* Black is below the ring, the full colour above it. */
			if ((PSR_ATTR_BASE(p.attr) & 255) == 0)
				assert_true(p.at[1] + reach < 0.1 * ring + 0.02);
			if ((PSR_ATTR_BASE(p.attr) & 255) == 0xbc)
				assert_true(p.at[1] - reach > 0.8 * ring - 0.02);
		}
	dpoint_set_fini(&set);
	psr_mesh_destroy(mesh);
}

static void what_cannot_be_is_refused(void **state)
{
	struct psr_mesh *mesh = sphere(1);
	struct dpoint_build_options options;
	struct dpoint_build_report report;
	struct psr_model_info info;
	struct psr_error err;
	struct dpoint_set set;

	(void)state;
	dpoint_build_options_default(&options, 128);
	options.epsilon = 0;
	assert_int_equal(dpoint_of_mesh(&set, &info, &report, mesh, &options, &err), PSR_ERR_ARG);
	options.epsilon = NAN;
	assert_int_equal(dpoint_of_mesh(&set, &info, &report, mesh, &options, &err), PSR_ERR_ARG);
	dpoint_build_options_default(&options, 128);
	mesh->material[0].alpha = PSR_ALPHA_MASK;
	mesh->material[0].alpha_cutoff = 2;
	assert_int_equal(dpoint_of_mesh(&set, &info, &report, mesh, &options, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "nothing of the surface"));
	psr_mesh_destroy(mesh);
}

#define TILES 12

static void *copy_of(const void *from, size_t n)
{
	void *to = malloc(n);

	memcpy(to, from, n);
	return to;
}

/* A row of humps, each a biquadratic patch with two triangles; their heights differ. */
static struct psr_mesh *humps(void)
{
	static const double knot[6] = { 0, 0, 0, 1, 1, 1 }, corner[4][2] = { { 0, 0 }, { 1, 0 }, { 1, 1 }, { 0, 1 } };
	static const uint32_t half[2][3] = { { 0, 1, 2 }, { 0, 2, 3 } };
	static const uint8_t rim[2] = { 9 * 3, 9 * 6 }; /* sides 0 and 1, and 1 and 2 */
	double position[4 * TILES][3];
	uint32_t triangle[2 * TILES][3];
	struct psr_mesh *mesh;

	for (uint32_t i = 0; i < TILES; i++) {
		for (int c = 0; c < 4; c++)
			v3d_set(position[4 * i + (uint32_t)c], i + corner[c][0], corner[c][1], 0);
		for (uint32_t t = 0; t < 2; t++)
			for (int c = 0; c < 3; c++)
				triangle[2 * i + t][c] = 4 * i + half[t][c];
	}
	assert_int_equal(psr_mesh_create(&mesh, (const double(*)[3])position, 4 * TILES, (const uint32_t(*)[3])triangle,
	                                 2 * TILES, NULL), PSR_OK);
	mesh->n_patches = TILES;
	mesh->patch = calloc(TILES, sizeof *mesh->patch);
	mesh->triangle_patch = malloc(2 * TILES * sizeof *mesh->triangle_patch);
	for (uint32_t i = 0; i < TILES; i++) {
		struct psr_patch *p = &mesh->patch[i];
		double control[9][4];

		for (int k = 0; k < 9; k++) {
			v3d_set(control[k], i + 0.5 * (k / 3), 0.5 * (k % 3), k == 4 ? 0.1 * (i + 1) : 0);
			control[k][3] = 1;
		}
		*p = (struct psr_patch){ .degree = { 2, 2 }, .n = { 3, 3 }, .n_corners = 4, .n_triangles = 2 };
		p->knot[0] = copy_of(knot, sizeof knot);
		p->knot[1] = copy_of(knot, sizeof knot);
		p->control = copy_of(control, sizeof control);
		p->corner = copy_of(corner, sizeof corner);
		p->triangle = copy_of(half, sizeof half);
		p->rim = copy_of(rim, sizeof rim);
		mesh->triangle_patch[2 * i] = mesh->triangle_patch[2 * i + 1] = i;
	}
	return mesh;
}

static void patches_are_the_same_by_one_thread_and_by_several(void **state)
{
	static const int n_threads[3] = { 1, 2, 5 };
	struct psr_mesh *mesh = humps();
	struct dpoint_set set[3];

	(void)state;
	for (int i = 0; i < 3; i++) {
		struct dpoint_build_options options;
		struct dpoint_build_report report;
		struct psr_model_info info = { .scale = 0 };

		dpoint_build_options_default(&options, 128);
		assert_int_equal(psr_pool_create(&options.pool, n_threads[i], NULL), PSR_OK);
		assert_int_equal(dpoint_of_mesh(&set[i], &info, &report, mesh, &options, NULL), PSR_OK);
		psr_pool_destroy(options.pool);
		assert_true(set[i].n_points > TILES && report.normal_worst > 0.001); /* of the triangles it were 0 */
		assert_int_equal(set[i].n_points, set[0].n_points);
		assert_int_equal(set[i].n_groups, set[0].n_groups);
		assert_memory_equal(set[i].word, set[0].word, set[0].n_points * sizeof *set[0].word);
		assert_memory_equal(set[i].group, set[0].group, set[0].n_groups * sizeof *set[0].group);
		assert_int_equal(set[i].delta != NULL, set[0].delta != NULL);
		if (set[0].delta != NULL)
			assert_memory_equal(set[i].delta, set[0].delta, set[0].n_points * sizeof *set[0].delta);
	}
	for (int i = 0; i < 3; i++)
		dpoint_set_fini(&set[i]);
	psr_mesh_destroy(mesh);
}

static int is_cancelled(void *userdata)
{
	return --*(int *)userdata < 0;
}

/* A patch is an index of a loop, which asks before each: so the first answers end it among patches. */
static void a_build_can_be_cancelled(void **state)
{
	struct psr_mesh *mesh = humps();
	struct dpoint_build_options options;
	struct dpoint_build_report report;
	struct psr_model_info info = { .scale = 0 };
	struct psr_error err;
	struct dpoint_set set;
	int left, n_asked;
	const struct psr_cancel cancel = { is_cancelled, &left };

	(void)state;
	dpoint_build_options_default(&options, 128);
	options.cancel = &cancel;
	left = 1 << 20;
	assert_int_equal(dpoint_of_mesh(&set, &info, &report, mesh, &options, &err), PSR_OK);
	dpoint_set_fini(&set);
	n_asked = (1 << 20) - left;
	assert_true(n_asked > 2 * TILES);
	for (int n = 0; n < n_asked; n += n < 2 * TILES ? 1 : n_asked / 8) {
		left = n;
		assert_int_equal(dpoint_of_mesh(&set, &info, &report, mesh, &options, &err), PSR_ERR_CANCELLED);
		assert_string_equal(err.text, "cancelled");
		dpoint_set_fini(&set);
	}
	psr_mesh_destroy(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(points_lie_on_the_surface_and_are_few),
		cmocka_unit_test(an_open_surface_is_seen_from_the_sides_that_its_material_has),
		cmocka_unit_test(rectangles_end_where_colours_do),
		cmocka_unit_test(patches_are_the_same_by_one_thread_and_by_several),
		cmocka_unit_test(a_build_can_be_cancelled),
		cmocka_unit_test(what_cannot_be_is_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
