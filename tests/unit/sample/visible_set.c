#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "ray/ray.h"
#include "sample/visible/visible_set.h"
#include "level.h"

#define RESOLUTION 64
#define DS (2.0 / RESOLUTION)

struct looked {
	struct psr_mesh *mesh;
	struct ray_scene *scene;
	struct visible_set visible;
};

static void look_at(struct looked *looked, struct psr_mesh *mesh, double ds, int n_threads)
{
	static const double zero[3];
	struct psr_pool *pool = NULL;

	looked->mesh = mesh;
	assert_int_equal(ray_scene_create(&looked->scene, mesh, zero, 1, NULL), PSR_OK);
	assert_int_equal(psr_pool_create(&pool, n_threads, NULL), PSR_OK);
	assert_int_equal(visible_set_init(&looked->visible, ds), PSR_OK);
	assert_int_equal(visible_set_look(&looked->visible, looked->scene, VISIBLE_ENOUGH, pool), PSR_OK);
	psr_pool_destroy(pool);
}

static void look_away(struct looked *looked)
{
	visible_set_fini(&looked->visible);
	ray_scene_destroy(looked->scene);
	meshes_free(looked->mesh);
}

/* Of a grid of places on all faces, at least two cells from edges (what is seen at an edge is seen by what is near it):
 * how many are seen from outside, and from inside. */
static void count_sides(const struct looked *looked, double half, int *n, int *n_outside, int *n_inside)
{
	*n = *n_outside = *n_inside = 0;
	for (uint32_t prim = 0; prim < looked->mesh->n_triangles; prim += 2) {
		const float *normal = ray_scene_normal(looked->scene, prim);
		int axis = fabsf(normal[0]) > 0.5f ? 0 : fabsf(normal[1]) > 0.5f ? 1 : 2;

		for (double a = -half + 4 * DS; a < half - 4 * DS; a += DS) {
			for (double b = -half + 4 * DS; b < half - 4 * DS; b += DS) {
				float p[3], back[3];

				p[axis] = normal[axis] * (float)half;
				p[(axis + 1) % 3] = (float)a;
				p[(axis + 2) % 3] = (float)b;
				v3f_scale(back, normal, -1);
				*n += 1;
				*n_outside += visible_set_has(&looked->visible, p, normal);
				*n_inside += visible_set_has(&looked->visible, p, back);
			}
		}
	}
	assert_true(*n > 500);
}

static void inside_of_a_closed_box_is_not_seen(void **state)
{
	struct psr_mesh *mesh = meshes_box(0.5, 0);
	struct looked looked;
	int n, n_outside, n_inside;

	(void)state;
	mesh->material->two_sided = 1;
	look_at(&looked, mesh, DS, 2);
	count_sides(&looked, 0.5, &n, &n_outside, &n_inside);
	assert_int_equal(n_outside, n);
	assert_int_equal(n_inside, 0);
	look_away(&looked);
}

static void inside_of_an_open_box_is_seen(void **state)
{
	struct psr_mesh *mesh = meshes_box(0.5, 1);
	struct looked looked;
	int n, n_outside, n_inside;

	(void)state;
	mesh->material->two_sided = 1;
	look_at(&looked, mesh, DS, 2);
	count_sides(&looked, 0.5, &n, &n_outside, &n_inside);
	assert_int_equal(n_outside, n);
	assert_int_equal(n_inside, n);
	look_away(&looked);
}

/* Fronts inside: from outside all that is seen are the fronts of the far walls. */
static void backs_of_one_sided_faces_are_looked_through(void **state)
{
	struct psr_mesh *mesh = meshes_box(0.5, 0);
	struct looked looked;
	int n, n_front, n_back;

	(void)state;
	for (uint32_t i = 0; i < mesh->n_triangles; i++) {
		uint32_t t = mesh->triangle[i][1];

		mesh->triangle[i][1] = mesh->triangle[i][2];
		mesh->triangle[i][2] = t;
	}
	look_at(&looked, mesh, DS, 2);
	count_sides(&looked, 0.5, &n, &n_front, &n_back);
	/* Their normals point inwards: count_sides() stands on the opposite wall, whose front faces the other way. */
	assert_int_equal(n_front, 0);
	assert_int_equal(n_back, n);
	look_away(&looked);
}

static void holes_of_a_mask_are_looked_through(void **state)
{
	static const uint8_t holes[4 * 4] = { 255, 255, 255, 255, 255, 255, 255, 0, 255, 255, 255, 0, 255, 255, 255, 255 };
	struct psr_mesh *mesh = meshes_square(1);
	struct looked looked;
	const float up[3] = { 0, 0, 1 }, solid[3] = { -0.35f, 0.35f, 0 }, hole[3] = { 0.35f, 0.35f, 0 };

	(void)state;
	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		v3d_scale(mesh->position[i], mesh->position[i], 0.7);
	meshes_texture(mesh, 2, 2, holes);
	mesh->material->alpha = PSR_ALPHA_MASK;
	mesh->material->alpha_cutoff = 0.5f;
	mesh->material->base_texture.is_nearest = 1;
	look_at(&looked, mesh, DS, 2);
	assert_true(visible_set_has(&looked.visible, solid, up));
	assert_false(visible_set_has(&looked.visible, hole, up));
	look_away(&looked);
}

/* Enough of it that the table has to grow: cells of 1.5 pixels, over 4 pi 128^2 of them. */
static void what_is_seen_does_not_depend_on_threads(void **state)
{
	struct looked looked[3];
	uint64_t seed = 5;
	int n_seen = 0;

	(void)state;
	for (int i = 0; i < 3; i++) {
		look_at(&looked[i], meshes_sphere(20, (const double[3]){ 0, 0, 0 }, 1), 2.0 / 256, i + 1);
		assert_int_equal(looked[i].visible.n_views, looked[0].visible.n_views);
		assert_int_equal(looked[i].visible.table.n, looked[0].visible.table.n);
	}
	for (int i = 0; i < 200000; i++) {
		float p[3], n[3];
		int is_seen;

		for (int k = 0; k < 3; k++) {
			p[k] = (float)(2 * meshes_random(&seed) - 1);
			n[k] = (float)(2 * meshes_random(&seed) - 1);
		}
		if (v3f_normalize(n, n) == 0 || v3f_normalize(p, p) == 0)
			continue;
		v3f_scale(p, p, (float)(0.97 + 0.05 * meshes_random(&seed)));
		is_seen = visible_set_has(&looked[0].visible, p, n);
		assert_int_equal(visible_set_has(&looked[1].visible, p, n), is_seen);
		assert_int_equal(visible_set_has(&looked[2].visible, p, n), is_seen);
		n_seen += is_seen;
	}
	assert_in_range(n_seen, 20000, 180000);
	for (int i = 0; i < 3; i++)
		look_away(&looked[i]);
}

static void what_is_added_is_seen(void **state)
{
	struct looked looked;
	const float up[3] = { 0, 0, 1 }, down[3] = { 0, 0, -1 };
	uint64_t seed = 6;

	(void)state;
	look_at(&looked, meshes_sphere(20, (const double[3]){ 0, 0, 0 }, 0.5), DS, 2);
	for (int i = 0; i < 100000; i++) {
		float p[3];

		/* Clear of the sphere. */
		v3f_set(p, 0.7f + 0.2f * (float)meshes_random(&seed), (float)meshes_random(&seed), (float)meshes_random(&seed));
		assert_int_equal(visible_set_add(&looked.visible, p, up), PSR_OK);
		assert_true(visible_set_has(&looked.visible, p, up));
		v3f_set(p, -p[0], -p[1], -p[2]);
		assert_false(visible_set_has(&looked.visible, p, up));
		assert_false(visible_set_has(&looked.visible, p, down));
	}
	look_away(&looked);
}

/* n triangles of about `size`, anywhere. */
static struct psr_mesh *make_soup(uint32_t n, double size)
{
	struct psr_mesh *mesh = meshes_new(3 * n, n);
	uint64_t seed = 9;

	for (uint32_t i = 0; i < mesh->n_vertices; i++) {
		for (int k = 0; k < 3; k++)
			mesh->position[i][k] = i % 3 == 0 ? 1.1 * meshes_random(&seed) - 0.55
			                                  : mesh->position[i - i % 3][k] + size * (meshes_random(&seed) - 0.5);
		mesh->triangle[i / 3][i % 3] = i;
	}
	return mesh;
}

static void looking_ends_soon_where_nothing_hides(void **state)
{
	struct psr_pool *pool = NULL;
	struct looked ball, soup;
	unsigned n_views;

	(void)state;
	look_at(&ball, meshes_sphere(20, (const double[3]){ 0, 0, 0 }, 0.9), DS, 2);
	look_at(&soup, make_soup(3000, 0.2), DS, 2);
	assert_int_equal(soup.visible.n_views % VISIBLE_LEAST_VIEWS, 0);
	assert_in_range(soup.visible.n_views, 2 * ball.visible.n_views, VISIBLE_MOST_VIEWS);
	/* Asked again it goes on with other views. */
	n_views = ball.visible.n_views;
	assert_int_equal(psr_pool_create(&pool, 2, NULL), PSR_OK);
	assert_int_equal(visible_set_look(&ball.visible, ball.scene, VISIBLE_ENOUGH, pool), PSR_OK);
	assert_int_equal(ball.visible.n_views, n_views + VISIBLE_LEAST_VIEWS);
	psr_pool_destroy(pool);
	look_away(&ball);
	look_away(&soup);
}

/* Of a soup of triangles, with places and normals of all kinds. */
static void what_is_seen_is_seen_of_coarser_cells(void **state)
{
	struct psr_mesh *mesh = make_soup(200, 0.04);
	struct visible_set coarse, coarser;
	struct looked looked;
	uint64_t seed = 10;
	int n_seen = 0;

	(void)state;
	look_at(&looked, mesh, DS, 2);
	assert_int_equal(visible_set_coarsen(&coarse, &looked.visible), PSR_OK);
	assert_int_equal(visible_set_coarsen(&coarser, &coarse), PSR_OK);
	for (int i = 0; i < 300000; i++) {
		float p[3], n[3];

		for (int k = 0; k < 3; k++) {
			p[k] = (float)(1.3 * meshes_random(&seed) - 0.65);
			n[k] = (float)(2 * meshes_random(&seed) - 1);
		}
		if (v3f_normalize(n, n) == 0 || !visible_set_has(&looked.visible, p, n))
			continue;
		n_seen++;
		assert_true(visible_set_has(&coarse, p, n));
		assert_true(visible_set_has(&coarser, p, n));
	}
	assert_in_range(n_seen, 3000, 200000);
	visible_set_fini(&coarse);
	visible_set_fini(&coarser);
	look_away(&looked);
}

/* A floor, and a lid of half its side above the middle. */
static struct psr_mesh *make_floor(double above)
{
	struct psr_mesh *mesh = meshes_new(8, 4);

	for (uint32_t i = 0; i < 8; i++) {
		const double half = i < 4 ? 0.6 : 0.3;

		mesh->position[i][0] = (i & 1 ? 1 : -1) * half;
		mesh->position[i][1] = (i & 2 ? 1 : -1) * half;
		mesh->position[i][2] = i < 4 ? 0 : above;
	}
	for (uint32_t t = 0; t < 4; t++) {
		const uint32_t first = 4 * (t / 2);

		mesh->triangle[t][0] = first + t % 2;
		mesh->triangle[t][1] = first + 1 + 2 * (t % 2);
		mesh->triangle[t][2] = first + 2;
	}
	return mesh;
}

/* Rays less than 72 degrees off the normal reach h tan 72, 1.24 pixels for 0.4, under the lid's edge. */
static void what_lies_close_beneath_is_not_seen(void **state)
{
	static const double above[] = { 0.4, 1.1 }; /* pixels: within the 0.75 that cover, and beyond */
	const float up[3] = { 0, 0, 1 };

	(void)state;
	for (int i = 0; i < 2; i++) {
		struct looked looked;
		struct visible_set coarse;
		int n_beneath = 0;

		look_at(&looked, make_floor(above[i] * DS), DS, 2);
		/* No ray of a view passes within two pixels of the middle. */
		for (double x = 4 * DS; x < 0.55; x += DS / 3)
			for (double y = 4 * DS; y < 0.55; y += DS / 3) {
				const float p[3] = { (float)x, (float)y, 0 }, lid[3] = { (float)x, (float)y, (float)(above[i] * DS) };
				const double outside = fmax(x, y) - 0.3;

				const int is_near = visible_set_has(&looked.visible, p, up);
				const int is_seen = visible_set_shows(&looked.visible, looked.scene, p, up);
				assert_int_equal(visible_set_coarsen(&coarse, &looked.visible), PSR_OK);
				if (outside > 0 || i == 1)
					assert_int_equal(is_seen, is_near);
				else if (outside < -1.24 * DS)
					assert_false(is_seen | visible_set_shows(&coarse, looked.scene, p, up));
				n_beneath += is_near && outside < -1.24 * DS;
				if (outside < 0)
					assert_true(visible_set_shows(&looked.visible, looked.scene, lid, up));
				visible_set_fini(&coarse);
			}
		assert_true(n_beneath > 100); /* they would count as seen by the lid's cells alone */
		look_away(&looked);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(inside_of_a_closed_box_is_not_seen),
		cmocka_unit_test(inside_of_an_open_box_is_seen),
		cmocka_unit_test(backs_of_one_sided_faces_are_looked_through),
		cmocka_unit_test(holes_of_a_mask_are_looked_through),
		cmocka_unit_test(what_is_seen_does_not_depend_on_threads),
		cmocka_unit_test(what_is_added_is_seen),
		cmocka_unit_test(looking_ends_soon_where_nothing_hides),
		cmocka_unit_test(what_is_seen_is_seen_of_coarser_cells),
		cmocka_unit_test(what_lies_close_beneath_is_not_seen),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
