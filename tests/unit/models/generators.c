#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include "models/shapes/generators.h"
#include "models/shapes/image.h"
#include "models/shapes/surfaces.h"
#include "models/shapes/sweep.h"
#include "models/shapes/teapot.h"

/* number[v] of those vertices that `stamp` marks with `mark` is their index in flat. */
static void flatten_part(struct shape *flat, const struct shape *shape, uint32_t part, uint32_t mark, uint32_t *stamp,
                         uint32_t *number)
{
	uint32_t corner[3];

	for (uint32_t t = 0; t < shape->n_triangles; t++) {
		if (shape->triangle_part[t] != part)
			continue;
		for (int k = 0; k < 3; k++) {
			uint32_t v = shape->triangle[t][k];
			if (stamp[v] != mark) {
				struct shape_vertex vertex;
				for (int j = 0; j < 3; j++) {
					vertex.p[j] = (double)shape->position[v][j];
					vertex.n[j] = (double)shape->normal[v][j];
				}
				stamp[v] = mark;
				number[v] = shape_vertex(flat, &vertex);
			}
			corner[k] = number[v];
		}
		flat->current = shape->triangle_material[t];
		shape_triangle(flat, corner[0], corner[1], corner[2]);
	}
}

/* Adds to `flat`, which is initialised and empty, the whole shape in one part, without pictures. */
static void flatten(struct shape *flat, const struct shape *shape)
{
	uint32_t *stamp = calloc((size_t)shape->n_vertices + 1, sizeof *stamp);
	uint32_t *number = malloc(((size_t)shape->n_vertices + 1) * sizeof *number);

	flat->failed |= shape->failed || stamp == NULL || number == NULL;
	for (uint32_t m = 0; m < shape->n_materials; m++)
		shape_material(flat, &shape->material[m]);
	if (!flat->failed)
		flatten_part(flat, shape, 0, 1, stamp, number);
	for (uint32_t i = 0; i < shape->n_instances && !flat->failed; i++) {
		const struct shape_instance *instance = &shape->instance[i];
		uint32_t first = flat->n_vertices;
		flatten_part(flat, shape, instance->part, i + 2, stamp, number);
		shape_transform(flat, first, instance->m, instance->move);
	}
	free(stamp);
	free(number);
}

/* A generated shape with its instances as triangles of their own. */
static void make_flat(struct shape *flat, const struct generator *generator)
{
	struct shape shape;

	shape_init(&shape);
	generator->make(&shape);
	assert_int_equal(shape_check(&shape, NULL), PSR_OK);
	shape_init(flat);
	flatten(flat, &shape);
	assert_int_equal(shape_check(flat, NULL), PSR_OK);
	shape_fini(&shape);
}

/* A generated shape with equal places joined. */
struct welded {
	struct shape shape;
	uint32_t *place;    /* vertex -> number of its place */
	uint32_t n_places;
};

static const struct shape *sort_shape;

static int by_place(const void *a, const void *b)
{
	const float *p = sort_shape->position[*(const uint32_t *)a], *q = sort_shape->position[*(const uint32_t *)b];

	for (int k = 0; k < 3; k++) {
		if (p[k] != q[k])
			return p[k] < q[k] ? -1 : 1;
	}
	return 0;
}

static void weld(struct welded *w, const struct generator *generator)
{
	uint32_t *order, n;

	make_flat(&w->shape, generator);
	n = w->shape.n_vertices;
	order = malloc(n * sizeof *order);
	w->place = malloc(n * sizeof *w->place);
	assert_non_null(order);
	assert_non_null(w->place);
	for (uint32_t i = 0; i < n; i++)
		order[i] = i;
	sort_shape = &w->shape;
	qsort(order, n, sizeof *order, by_place);
	w->n_places = 0;
	for (uint32_t i = 0; i < n; i++) {
		if (i == 0 || by_place(&order[i - 1], &order[i]) != 0)
			w->n_places++;
		w->place[order[i]] = w->n_places - 1;
	}
	free(order);
}

static void unweld(struct welded *w)
{
	free(w->place);
	shape_fini(&w->shape);
}

static int by_value(const void *a, const void *b)
{
	uint64_t p = *(const uint64_t *)a, q = *(const uint64_t *)b;
	return p < q ? -1 : p > q;
}

static int is_sheet(const struct shape *shape, uint32_t triangle)
{
	return shape->material[shape->triangle_material[triangle]].two_sided;
}

static void every_edge_of_a_solid_is_shared_by_two_faces_in_opposite_directions(void **state)
{
	(void)state;
	for (size_t g = 0; g < n_generators; g++) {
		struct welded w;
		uint64_t *edge, *reverse;
		uint32_t n = 0;
		weld(&w, &generators[g]);
		edge = malloc(3 * w.shape.n_triangles * sizeof *edge);
		reverse = malloc(3 * w.shape.n_triangles * sizeof *reverse);
		assert_non_null(edge);
		assert_non_null(reverse);
		for (uint32_t i = 0; i < 3 * w.shape.n_triangles; i++) {
			const uint32_t *t = w.shape.triangle[i / 3];
			uint64_t a = w.place[t[i % 3]], b = w.place[t[(i + 1) % 3]];
			assert_true(a != b);
			if (is_sheet(&w.shape, i / 3))
				continue;
			edge[n] = a << 32 | b;
			reverse[n++] = b << 32 | a;
		}
		qsort(edge, n, sizeof *edge, by_value);
		qsort(reverse, n, sizeof *reverse, by_value);
		for (uint32_t i = 0; i < n; i++) {
			assert_true(i == 0 || edge[i] != edge[i - 1]);
			assert_true(edge[i] == reverse[i]);
		}
		free(edge);
		free(reverse);
		unweld(&w);
	}
}

static void face_normal(const struct shape *shape, const uint32_t t[3], double n[3])
{
	double a[3], b[3];

	for (int k = 0; k < 3; k++) {
		a[k] = (double)shape->position[t[1]][k] - shape->position[t[0]][k];
		b[k] = (double)shape->position[t[2]][k] - shape->position[t[0]][k];
	}
	n[0] = a[1] * b[2] - a[2] * b[1];
	n[1] = a[2] * b[0] - a[0] * b[2];
	n[2] = a[0] * b[1] - a[1] * b[0];
}

static void normals_are_unit_and_agree_with_their_faces(void **state)
{
	(void)state;
	for (size_t g = 0; g < n_generators; g++) {
		struct shape shape;
		make_flat(&shape, &generators[g]);
		for (uint32_t i = 0; i < shape.n_vertices; i++) {
			const float *n = shape.normal[i];
			double squared = (double)n[0] * n[0] + (double)n[1] * n[1] + (double)n[2] * n[2];
			/* each coordinate is rounded by at most 2^-24 of itself, so the square by 2^-23 of itself and a bit */
			assert_true(fabs(squared - 1) < 1.01 / (1 << 23));
		}
		for (uint32_t i = 0; i < shape.n_triangles; i++) {
			double face[3];
			face_normal(&shape, shape.triangle[i], face);
			for (int k = 0; k < 3; k++) {
				const float *n = shape.normal[shape.triangle[i][k]];
				assert_true(face[0] * n[0] + face[1] * n[1] + face[2] * n[2] > 0);
			}
		}
		shape_fini(&shape);
	}
}

static uint32_t root_of(uint32_t *parent, uint32_t i)
{
	while (parent[i] != i)
		i = parent[i] = parent[parent[i]];
	return i;
}

static void every_closed_piece_has_its_outside_outside(void **state)
{
	(void)state;
	for (size_t g = 0; g < n_generators; g++) {
		struct welded w;
		uint32_t *parent;
		double *volume;
		uint8_t *sheet;
		weld(&w, &generators[g]);
		parent = malloc(w.n_places * sizeof *parent);
		volume = calloc(w.n_places, sizeof *volume);
		assert_non_null(parent);
		sheet = calloc(w.n_places, 1);
		assert_non_null(volume);
		assert_non_null(sheet);
		for (uint32_t i = 0; i < w.n_places; i++)
			parent[i] = i;
		for (uint32_t i = 0; i < 3 * w.shape.n_triangles; i++) {
			const uint32_t *t = w.shape.triangle[i / 3];
			parent[root_of(parent, w.place[t[i % 3]])] = root_of(parent, w.place[t[(i + 1) % 3]]);
		}
		for (uint32_t i = 0; i < w.shape.n_triangles; i++) {
			const uint32_t *t = w.shape.triangle[i];
			const float *p = w.shape.position[t[0]];
			double n[3];
			if (is_sheet(&w.shape, i)) {
				sheet[root_of(parent, w.place[t[0]])] = 1;
				continue;
			}
			face_normal(&w.shape, t, n);
			volume[root_of(parent, w.place[t[0]])] += p[0] * n[0] + p[1] * n[1] + p[2] * n[2];
		}
		for (uint32_t i = 0; i < w.n_places; i++)
			assert_true(root_of(parent, i) != i || volume[i] > 0 || sheet[i]);
		free(parent);
		free(volume);
		free(sheet);
		unweld(&w);
	}
}

static void every_material_is_used_and_every_index_exists(void **state)
{
	(void)state;
	for (size_t g = 0; g < n_generators; g++) {
		struct shape shape;
		uint32_t used = 0;
		shape_init(&shape);
		generators[g].make(&shape);
		assert_in_range(shape.n_materials, 2, 31);
		for (uint32_t i = 0; i < shape.n_triangles; i++) {
			for (int k = 0; k < 3; k++)
				assert_true(shape.triangle[i][k] < shape.n_vertices);
			assert_true(shape.triangle_material[i] < shape.n_materials);
			used |= 1u << shape.triangle_material[i];
		}
		assert_int_equal(used, (1u << shape.n_materials) - 1);
		shape_fini(&shape);
	}
}

/* A change of a generator changes its hash on purpose; a CPU or a compiler must not. */
static void shapes_are_the_same_on_every_machine(void **state)
{
	static const struct {
		const char *name;
		uint64_t hash;
	} expected[] = {
		{ "chair", 0xbbefe45aed58bfeb },
		{ "dragon", 0x16f0e2621d36dde1 },
		{ "gavel", 0xa27eeecd920185e5 },
		{ "kittyhawk", 0xe334d11e88d46349 },
		{ "pencil", 0x7cfd91295a6d7501 },
		{ "pinetree", 0x63e52b1f3e6a79a2 },
		{ "plant", 0x9ac2809e2cbb2c84 },
		{ "sailboat", 0xc99cda44aed45c93 },
		{ "table", 0xa35f9f8d6596f7a1 },
		{ "teapot", 0xae1ea9aadcad83fd },
		{ "top", 0x543e221d6a91af52 },
		{ "toybird", 0x0f999d5e3dbc7b41 },
		{ "tree", 0x04629821004c9324 },
		{ "wheel", 0x712d506fb579016c },
	};

	int n_other = 0;

	(void)state;
	assert_int_equal(n_generators, sizeof expected / sizeof expected[0]);
	for (size_t g = 0; g < n_generators; g++) {
		struct shape shape;
		XXH64_hash_t hash;
		shape_init(&shape);
		generators[g].make(&shape);
		hash = XXH64(shape.position, shape.n_vertices * sizeof *shape.position, 0);
		hash = XXH64(shape.normal, shape.n_vertices * sizeof *shape.normal, hash);
		hash = XXH64(shape.triangle, shape.n_triangles * sizeof *shape.triangle, hash);
		hash = XXH64(shape.triangle_material, shape.n_triangles * sizeof *shape.triangle_material, hash);
		for (uint32_t i = 0; i < shape.n_instances; i++) {
			const struct shape_instance *instance = &shape.instance[i];
			hash = XXH64(&instance->part, sizeof instance->part, hash);
			hash = XXH64(instance->m, sizeof instance->m, hash);
			hash = XXH64(instance->move, sizeof instance->move, hash);
		}
		for (uint32_t i = 0; i < shape.n_images; i++) {
			hash = XXH64(shape.uv, shape.n_vertices * sizeof *shape.uv, hash);
			hash = XXH64(shape.image[i].rgb, (size_t)3 * shape.image[i].size * shape.image[i].size, hash);
		}
		assert_string_equal(generators[g].name, expected[g].name);
		if (hash != expected[g].hash)
			print_message("# %s: 0x%016llx\n", generators[g].name, (unsigned long long)hash);
		n_other += hash != expected[g].hash;
		shape_fini(&shape);
	}
	assert_int_equal(n_other, 0);
}

static void unknown_name_gets_the_list_of_names(void **state)
{
	struct psr_error err = { 0 };

	(void)state;
	assert_null(generator_find("teapott", &err));
	assert_int_equal(err.code, PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "'teapott'"));
	for (size_t g = 0; g < n_generators; g++) {
		assert_non_null(strstr(err.text, generators[g].name));
		assert_ptr_equal(generator_find(generators[g].name, &err), &generators[g]);
	}
}

/* Newell's file without repeated points: 32 patches on 290 control points. */
static void teapot_has_the_patches_and_points_of_the_original(void **state)
{
	static const struct {
		const char *part;
		int n;
	} parts[] = { { "rim", 4 }, { "body", 8 }, { "lid", 8 }, { "bottom", 4 }, { "handle", 4 }, { "spout", 4 } };
	double point[TEAPOT_PATCHES * 16][3], control[4][4][3];
	int n = 0, count[6] = { 0 };

	(void)state;
	for (uint32_t i = 0; i < TEAPOT_PATCHES; i++) {
		const char *part = teapot_patch(i, control);
		for (int k = 0; k < 6; k++)
			count[k] += strcmp(parts[k].part, part) == 0;
		for (int k = 0; k < 16; k++) {
			const double *p = control[k / 4][k % 4];
			int known = 0;
			for (int j = 0; j < n && !known; j++)
				known = p[0] == point[j][0] && p[1] == point[j][1] && p[2] == point[j][2];
			if (!known)
				memcpy(point[n++], p, sizeof point[0]);
		}
	}
	assert_int_equal(n, 290);
	for (int k = 0; k < 6; k++)
		assert_int_equal(count[k], parts[k].n);
}

static void teapot_is_symmetric_and_stands_on_the_ground(void **state)
{
	struct welded w;
	struct generator teapot = { "teapot", "", make_teapot };
	int balance = 0;
	float low = 1, reach[2] = { 0, 0 };

	(void)state;
	weld(&w, &teapot);
	for (uint32_t i = 0; i < w.shape.n_vertices; i++)
		low = fminf(low, w.shape.position[i][1]);
	assert_true(low == 0);
	/* z = 0 is the mirror: as many vertices on either side, and both reach equally far */
	for (uint32_t i = 0; i < w.shape.n_vertices; i++) {
		balance += (w.shape.position[i][2] > 0) - (w.shape.position[i][2] < 0);
		reach[w.shape.position[i][2] > 0] = fmaxf(reach[w.shape.position[i][2] > 0], fabsf(w.shape.position[i][2]));
	}
	assert_int_equal(balance, 0);
	assert_true(reach[0] == reach[1] && reach[0] > 1.9f);
	unweld(&w);
}

/* One primitive of the tree is drawn as it is, the others are instances. */
static void tree_has_the_thesis_number_of_cones_and_ellipsoids(void **state)
{
	struct shape shape;
	uint32_t count[8] = { 0 };

	(void)state;
	shape_init(&shape);
	make_tree(&shape);
	assert_int_equal(shape.n_instances + 1, 26438);
	assert_int_equal(shape.n_parts, 6);
	for (uint32_t i = 0; i < shape.n_instances; i++)
		count[shape.instance[i].part]++;
	/* cones are branches, ellipsoids leaves: there are many of both */
	assert_true(count[0] == 0 && count[1] > 50 && count[2] > 2000);
	assert_true(count[3] > 5000 && count[4] > 5000 && count[5] > 500);
	shape_fini(&shape);
}

static void every_model_stays_near_the_ground_and_the_origin(void **state)
{
	(void)state;
	for (size_t g = 0; g < n_generators; g++) {
		struct shape shape;
		float low[3] = { 1e9f, 1e9f, 1e9f }, high[3] = { -1e9f, -1e9f, -1e9f };
		make_flat(&shape, &generators[g]);
		for (uint32_t i = 0; i < shape.n_vertices; i++) {
			for (int k = 0; k < 3; k++) {
				low[k] = fminf(low[k], shape.position[i][k]);
				high[k] = fmaxf(high[k], shape.position[i][k]);
			}
		}
		for (int k = 0; k < 3; k++)
			assert_true(high[k] - low[k] > 0.1f && high[k] - low[k] < 13 && low[k] > -7);
		shape_fini(&shape);
	}
}

static void pictures_are_png_that_anyone_can_read(void **state)
{
	(void)state;
	for (uint32_t size = 16; size <= 1024; size *= 4) {
		uint8_t *rgb = image_wood(size, 0x102030, 0xf0e0d0, 1), *png = malloc(image_png_bytes(size)), *back;
		png_image image = { .version = PNG_IMAGE_VERSION };
		assert_non_null(rgb);
		assert_non_null(png);
		image_png(png, size, rgb);
		assert_true(png_image_begin_read_from_memory(&image, png, image_png_bytes(size)));
		assert_int_equal(image.width, size);
		assert_int_equal(image.height, size);
		image.format = PNG_FORMAT_RGB;
		back = malloc((size_t)3 * size * size);
		assert_non_null(back);
		assert_true(png_image_finish_read(&image, NULL, back, 0, NULL));
		assert_memory_equal(back, rgb, (size_t)3 * size * size);
		free(rgb);
		free(png);
		free(back);
	}
}

/* A vertex of an instance is where the matrix puts it, and its normal is perpendicular to what were its tangents. */
static void instances_are_moved_and_keep_their_normals(void **state)
{
	static const struct shape_material paint = { "paint", 0xffffff, 0, 1, 0 };
	static const double m[3][3] = { { 0, 0, 3 }, { 2, 0, 0 }, { 0, 0.5, 0 } }, move[3] = { 10, 20, 30 };
	static const double center[3] = { 0, 0, 0 }, half[3] = { 1, 1, 1 };
	struct shape shape, flat;

	(void)state;
	shape_init(&shape);
	shape_init(&flat);
	shape_material(&shape, &paint);
	uint32_t part = shape_part(&shape);
	sweep_ball(&shape, center, half, 16, 16);
	shape_place(&shape, part, m, move);
	flatten(&flat, &shape);
	assert_int_equal(flat.n_triangles, shape.n_triangles);
	for (uint32_t i = 0; i < flat.n_vertices; i++) {
		const float *p = flat.position[i], *n = flat.normal[i];
		/* the ellipsoid with the half axes 3, 2 and 0.5; its normal is the gradient */
		double x = (p[0] - 10) / 3.0, y = (p[1] - 20) / 2.0, z = (p[2] - 30) / 0.5;
		double gradient[3] = { x / 3, y / 2, z / 0.5 };
		double length = sqrt(gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2]);
		/* a coordinate near 30 is rounded by 2^-20, a quarter of 10^-5 of a half axis of 0.5 */
		assert_true(fabs(x * x + y * y + z * z - 1) < 1e-5);
		for (int k = 0; k < 3; k++)
			assert_true(fabs(gradient[k] / length - n[k]) < 1e-5);
	}
	shape_fini(&shape);
	shape_fini(&flat);
}

static void turns_are_exactly_symmetric(void **state)
{
	(void)state;
	for (uint32_t n = 1; n <= 200; n++) {
		for (uint32_t k = 0; k < n; k++) {
			double c, s, c2, s2, angle = 6.283185307179586 * k / n;
			surface_turn(k, n, &c, &s);
			/* two roundings of an argument below 2 pi, and psr_sincos' own 1e-15 */
			assert_true(fabs(c - cos(angle)) < 4e-15 && fabs(s - sin(angle)) < 4e-15);
			surface_turn(n - k, n, &c2, &s2);
			assert_true(c == c2 && s == -s2);
			surface_turn(k + n, n, &c2, &s2);
			assert_true(c == c2 && s == s2);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_edge_of_a_solid_is_shared_by_two_faces_in_opposite_directions),
		cmocka_unit_test(normals_are_unit_and_agree_with_their_faces),
		cmocka_unit_test(every_closed_piece_has_its_outside_outside),
		cmocka_unit_test(every_material_is_used_and_every_index_exists),
		cmocka_unit_test(shapes_are_the_same_on_every_machine),
		cmocka_unit_test(unknown_name_gets_the_list_of_names),
		cmocka_unit_test(teapot_has_the_patches_and_points_of_the_original),
		cmocka_unit_test(teapot_is_symmetric_and_stands_on_the_ground),
		cmocka_unit_test(tree_has_the_thesis_number_of_cones_and_ellipsoids),
		cmocka_unit_test(every_model_stays_near_the_ground_and_the_origin),
		cmocka_unit_test(pictures_are_png_that_anyone_can_read),
		cmocka_unit_test(instances_are_moved_and_keep_their_normals),
		cmocka_unit_test(turns_are_exactly_symmetric),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
