#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/vec.h"
#include "models/studies/cull.h"
#include "models/studies/cull_part.h"
#include "psr/build.h"
#include "render/stages.h"
#include "sample/pack/visibility_mask.h"
#include "tests/unit/sample/meshes.h"

#define N_THREADS 2
#define RESOLUTION 64
#define N_EYES 12

static const struct cull_choice frustum = { 0, CULL_NO_MASK, 0 }, cones = { 1, CULL_NO_MASK, 0 },
                                masks = { 0, 2, 2 }, both = { 1, 2, 2 };

/* A mesh, what is made of it, and its rays. */
struct object {
	struct psr_mesh *mesh;
	struct psr_model *model;
	struct ray_scene *scene;
	struct psr_pool *pool;
	struct cull_set *set;
	const struct psr_blocks *blocks;
	uint8_t *is_kept, *n_seen;
};

static struct object make_object(struct psr_mesh *mesh, int finest)
{
	struct object o = { .mesh = mesh };
	struct psr_build_options options;
	const struct psr_model_info *info;

	psr_build_options_default(&options);
	options.resolution = RESOLUTION;
	options.n_threads = N_THREADS;
	assert_int_equal(psr_model_build(&o.model, mesh, &options, NULL, NULL), PSR_OK);
	info = psr_model_info(o.model);
	assert_int_equal(ray_scene_create(&o.scene, mesh, info->origin, info->scale, NULL), PSR_OK);
	assert_int_equal(psr_pool_create(&o.pool, N_THREADS, NULL), PSR_OK);
	assert_int_equal(cull_set_create(&o.set, o.model, finest, o.pool, NULL), PSR_OK);
	o.blocks = psr_model_blocks(cull_set_base(o.set));
	assert_int_equal(o.blocks->n_blocks, cull_set_n_blocks(o.set));
	o.is_kept = calloc(o.blocks->n_blocks, 1);
	o.n_seen = calloc(o.blocks->n_blocks, 1);
	return o;
}

static void drop_object(struct object *o)
{
	free(o->is_kept);
	free(o->n_seen);
	cull_set_destroy(o->set);
	psr_pool_destroy(o->pool);
	ray_scene_destroy(o->scene);
	psr_model_unref(o->model);
	meshes_free(o->mesh);
}

static double radius_of(const struct object *o, uint32_t b)
{
	float center[3], radius;

	psr_blocks_sphere(o->blocks, b, center, &radius);
	return (double)radius;
}

static void center_of(const struct object *o, uint32_t b, double c[3])
{
	float center[3], radius;

	psr_blocks_sphere(o->blocks, b, center, &radius);
	v3d_set(c, (double)center[0], (double)center[1], (double)center[2]);
}

/* Adds a copy of a mesh, with its faces turned if asked for. */
static struct psr_mesh *join(struct psr_mesh *a, struct psr_mesh *b, int is_turned)
{
	struct psr_mesh *mesh = meshes_new(a->n_vertices + b->n_vertices, a->n_triangles + b->n_triangles);

	memcpy(mesh->position, a->position, a->n_vertices * sizeof *a->position);
	memcpy(mesh->position + a->n_vertices, b->position, b->n_vertices * sizeof *b->position);
	memcpy(mesh->triangle, a->triangle, a->n_triangles * sizeof *a->triangle); /* without normals: the faces' own */
	for (uint32_t i = 0; i < b->n_triangles; i++)
		for (int k = 0; k < 3; k++)
			mesh->triangle[a->n_triangles + i][k] = b->triangle[i][is_turned ? 2 - k : k] + a->n_vertices;
	meshes_free(a);
	meshes_free(b);
	return mesh;
}

static struct psr_mesh *ball(double x, double y, double z, double radius)
{
	const double center[3] = { x, y, z };

	return meshes_sphere(24, center, radius);
}

/* ---- a convex body ---- */

/* A block at the unit vector c with c . e < 0, for an eye e at 2.92, is |e - c| > 3.08 away, and g = c . (c - e) > 1:
 * render/cull.c's test, g > (sin alpha + 0.0135) |e - c| + 1.0125 r, holds when alpha and r are below 0.2, and the
 * more, the farther round it is. */
static void cones_cull_the_back_half_of_a_ball(void **state)
{
	struct object o = make_object(ball(0, 0, 0, 1), 2);
	uint32_t n_front = 0, n_back = 0;

	(void)state;
	for (uint32_t which = 0; which < N_EYES; which++) {
		struct cull_eye eye;

		cull_eye_place(&eye, which, 1);
		cull_set_test(o.set, &eye, &cones, o.is_kept);
		for (uint32_t b = 0; b < o.blocks->n_blocks; b++) {
			double c[3];

			assert_true(radius_of(&o, b) < 0.2);
			center_of(&o, b, c);
			if (v3d_dot(c, eye.place) < 0) {
				assert_int_equal(o.is_kept[b], 0);
				n_back++;
			} else if (v3d_dot(c, eye.place) > 1.1) { /* the horizon is at 1, where c . e is 1 */
				assert_int_equal(o.is_kept[b], 1);
				n_front++;
			}
		}
	}
	assert_true(n_front > 100 && n_back > 100);
	drop_object(&o);
}

/* A sample at p on a unit ball is seen iff n . (e - p) > 0. Margins, as sines: normals turned by 0.0125 by being
 * quantised, 0.0125 that still count, and half the angle between faces, pi / 48, against the ball's own normals. A
 * sample that no margin decides may count or not. */
static void rays_find_the_cap_of_a_ball(void **state)
{
	const double margin = 0.0125 + 0.0125 + 0.0655;
	struct object o = make_object(ball(0, 0, 0, 1), 0);
	uint64_t n_least = 0, n_all = 0;

	(void)state;
	for (uint32_t which = 0; which < N_EYES; which++) {
		struct cull_eye eye;

		cull_eye_place(&eye, which, 1);
		cull_set_look(o.set, o.scene, &eye, o.pool, o.n_seen);
		for (uint32_t b = 0; b < o.blocks->n_blocks; b++) {
			double c[3], to_eye[3], g, r = radius_of(&o, b);

			center_of(&o, b, c);
			v3d_sub(to_eye, eye.place, c);
			v3d_normalize(to_eye, to_eye);
			v3d_normalize(c, c);
			g = v3d_dot(c, to_eye);
			n_all += (uint64_t)__builtin_popcountll(o.blocks->mask[b]);
			if (g > margin + 2 * r) { /* r turns the normal by as much, and the direction to the eye by less */
				assert_int_equal(o.n_seen[b], __builtin_popcountll(o.blocks->mask[b]));
				n_least += o.n_seen[b];
			}
			if (g < -margin - 2 * r)
				assert_int_equal(o.n_seen[b], 0);
		}
	}
	assert_true(n_least > n_all / 20);
	drop_object(&o);
}

/* ---- nothing to see ---- */

static void an_eye_that_looks_away_sees_nothing(void **state)
{
	struct object o = make_object(ball(0, 0, 0, 1), 2);

	(void)state;
	for (uint32_t which = 0; which < N_EYES; which++) {
		struct cull_eye eye;

		cull_eye_place(&eye, which, 1);
		v3d_scale(eye.frame[0], eye.frame[0], -1);
		v3d_scale(eye.frame[2], eye.frame[2], -1);
		cull_set_test(o.set, &eye, &frustum, o.is_kept);
		assert_null(memchr(o.is_kept, 1, o.blocks->n_blocks));
		cull_set_look(o.set, o.scene, &eye, o.pool, o.n_seen);
		for (uint32_t b = 0; b < o.blocks->n_blocks; b++)
			assert_int_equal(o.n_seen[b], 0);
	}
	drop_object(&o);
}

/* The unit sphere fills the picture: every block is in view. Zoomed in four times, at most a sixteenth of a sphere's
 * outline is, and of what the frustum leaves out rays find nothing. */
static void the_frustum_culls_what_is_not_in_the_picture(void **state)
{
	const struct cull_views whole = { .n = N_EYES, .zoom = 1 }, part = { .n = N_EYES, .zoom = 4 };
	struct object o = make_object(ball(0, 0, 0, 1), 2);
	struct cull_figures figures;
	struct cull_truth truth;

	(void)state;
	assert_int_equal(cull_measure(o.set, o.scene, &whole, &frustum, 1, o.pool, &figures, &truth, NULL), PSR_OK);
	assert_true(figures.blocks == 0 && figures.samples == 0);
	assert_true(truth.blocks > 0.4 && truth.samples > 0.6); /* (1 + 1 / 2.92) / 2 = 0.67 of a ball is hidden */
	assert_int_equal(cull_measure(o.set, o.scene, &part, &frustum, 1, o.pool, &figures, &truth, NULL), PSR_OK);
	assert_true(figures.blocks > 0.5);
	assert_true(figures.wrong == 0);
	assert_true(truth.samples > 1 - 1.5 / 16);
	drop_object(&o);
}

/* ---- one in the other ---- */

/* A bowl open towards +z with a ball in it, which is seen from above alone. */
static struct psr_mesh *ball_in_a_bowl(void)
{
	struct psr_mesh *bowl = ball(0, 0, 0, 1), *inside = ball(0, 0, 0, 0.95);
	uint32_t n = 0;

	bowl = join(bowl, inside, 1);
	for (uint32_t i = 0; i < bowl->n_triangles; i++) {
		const uint32_t *t = bowl->triangle[i];

		if (bowl->position[t[0]][2] < 0.5 && bowl->position[t[1]][2] < 0.5 && bowl->position[t[2]][2] < 0.5)
			memmove(bowl->triangle[n++], t, sizeof *bowl->triangle);
	}
	bowl->n_triangles = n;
	return join(bowl, ball(0, 0, -0.35, 0.5), 0);
}

/* An eye below z = -2.1 looks up at 46 degrees at least, and each of its rays, 27 degrees from the middle one at most,
 * comes from below: through no opening. Masks are made of samples, which leave a pixel in some thousands open: a block
 * that is behind one of them is kept, though rays do not find it. */
static void masks_cull_a_ball_in_a_bowl_from_below(void **state)
{
	struct object o = make_object(ball_in_a_bowl(), 2);
	const struct psr_model_info *info = psr_model_info(o.model);
	uint32_t n_inner = 0, n_kept = 0, n_above = 0;

	(void)state;
	for (uint32_t which = 0; which < 4 * N_EYES; which++) {
		struct cull_eye eye;

		cull_eye_place(&eye, which, 1);
		cull_set_look(o.set, o.scene, &eye, o.pool, o.n_seen);
		cull_set_test(o.set, &eye, &masks, o.is_kept);
		for (uint32_t b = 0; b < o.blocks->n_blocks; b++) {
			double c[3];

			center_of(&o, b, c);
			v3d_scale(c, c, info->scale);
			v3d_add(c, c, info->origin);
			c[2] += 0.35;
			if (v3d_length(c) > 0.52)
				continue;
			if (eye.place[2] < -2.1) {
				assert_int_equal(o.n_seen[b], 0);
				n_kept += o.is_kept[b];
				n_inner++;
			}
			n_above += eye.place[2] > 2.1 && o.is_kept[b];
		}
	}
	assert_true(n_inner > 100 && n_above > 100);
	assert_true(n_kept * 10 < n_inner);
	drop_object(&o);
}

/* ---- whatever the choice ---- */

static struct psr_mesh *seven_balls(void)
{
	struct psr_mesh *mesh = ball(0, 0, 0, 0.4);
	uint64_t seed = 2;

	for (int i = 0; i < 6; i++) {
		double p[3];

		for (int k = 0; k < 3; k++)
			p[k] = 1.1 * meshes_random(&seed) - 0.55;
		mesh = join(mesh, ball(p[0], p[1], p[2], 0.15 + 0.2 * meshes_random(&seed)), 0);
	}
	return mesh;
}

static void no_block_that_a_ray_finds_is_culled_by_its_cone(void **state)
{
	struct object o = make_object(seven_balls(), 0);
	const struct cull_views views = { .n = 8 * N_EYES, .zoom = 1 };
	struct cull_figures figures;
	struct cull_truth truth;

	(void)state;
	assert_int_equal(cull_measure(o.set, o.scene, &views, &cones, 1, o.pool, &figures, &truth, NULL), PSR_OK);
	assert_true(figures.wrong == 0);
	assert_true(figures.blocks > 0.3 && figures.blocks < truth.blocks);
	drop_object(&o);
}

/* Directions of which masks are made are 6 degrees apart: what is seen between two of them alone is missed, which is no
 * pixel of a picture in a hundred thousand, and hardly ever a block of which a single ray finds a sample. */
static void masks_lose_no_pixel_and_hardly_a_block(void **state)
{
	struct object o = make_object(seven_balls(), CULL_FINEST);
	const struct cull_views views = { .n = 2 * N_EYES, .zoom = 1 };
	struct cull_choice choice[16];
	struct cull_figures figures[16];
	struct cull_truth truth;
	uint64_t n_lost = 1;

	(void)state;
	for (int i = 0; i < 16; i++)
		choice[i] = (struct cull_choice){ .cones = i & 1, .level = i / 4, .n = i / 2 % 2 * 3 };
	assert_int_equal(cull_measure(o.set, o.scene, &views, choice, 16, o.pool, figures, &truth, NULL), PSR_OK);
	for (int i = 0; i < 16; i++) {
		assert_true(figures[i].wrong < 1e-3);
		assert_true(figures[i].blocks <= truth.blocks);
		if (i % 2 == 1) /* cones add to masks */
			assert_true(figures[i].blocks >= figures[i - 1].blocks);
		if (i / 2 % 2 == 1) /* a finer screen culls no less: masks of nodes are within their parents' */
			assert_true(figures[i].blocks >= figures[i - 2].blocks);
	}
	for (int i = 0; i + 4 < 16; i++) /* nor do finer masks: their bits are within the coarser's */
		assert_true(figures[i + 4].blocks >= figures[i].blocks);
	assert_true(figures[12].blocks > 0.1);
	assert_int_equal(visibility_mask_lost(psr_model_blocks(o.model), o.scene, 100000, o.pool, &n_lost), PSR_OK);
	assert_int_equal(n_lost, 0);
	drop_object(&o);
}

static void shares_do_not_depend_on_threads_and_times_are_there(void **state)
{
	struct object o = make_object(seven_balls(), 2);
	const struct cull_choice choice[] = { frustum, cones, masks, both };
	const struct cull_views timed = { .n = 3, .zoom = 1, .is_timed = 1 }, untimed = { .n = 3, .zoom = 1 };
	struct cull_figures a[4], b[4];
	struct cull_truth truth[2];

	(void)state;
	assert_int_equal(cull_measure(o.set, o.scene, &timed, choice, 4, o.pool, a, &truth[0], NULL), PSR_OK);
	assert_int_equal(cull_measure(o.set, o.scene, &untimed, choice, 4, NULL, b, &truth[1], NULL), PSR_OK);
	assert_memory_equal(&truth[0], &truth[1], sizeof truth[0]);
	for (int i = 0; i < 4; i++) {
		assert_true(a[i].blocks == b[i].blocks && a[i].samples == b[i].samples && a[i].wrong == b[i].wrong);
		assert_true(a[i].test_seconds > 0 && a[i].frame_seconds > 0);
		assert_true(b[i].test_seconds == 0 && b[i].frame_seconds == 0);
	}
	drop_object(&o);
}

/* ---- parts ---- */

static void draw(const struct psr_model *model, const struct cull_eye *eye, uint8_t *rgb, float *depth)
{
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 } };
	struct psr_frame frame = { .width = RESOLUTION, .height = RESOLUTION, .rgb = rgb, .depth = depth };
	struct psr_renderer *renderer;
	struct render_settings settings;

	scene.camera = (struct psr_camera){ .fov_y = 2 * atan(eye->tangent) };
	memcpy(scene.camera.eye, eye->place, sizeof eye->place);
	v3d_add(scene.camera.target, eye->place, eye->frame[2]);
	v3d_scale(scene.camera.up, eye->frame[1], -1);
	render_settings_default(&settings, RESOLUTION, RESOLUTION);
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(renderer_draw(renderer, &scene, &settings, NULL, &frame, NULL), PSR_OK);
	psr_renderer_destroy(renderer);
}

/* Cones cull only blocks whose samples the renderer leaves out one by one, were they there. */
static void a_part_that_cones_leave_has_the_same_picture(void **state)
{
	static float depth[2][RESOLUTION * RESOLUTION];
	static uint8_t rgb[2][3 * RESOLUTION * RESOLUTION];
	struct object o = make_object(seven_balls(), 0);

	(void)state;
	for (uint32_t which = 0; which < N_EYES; which++) {
		struct psr_model *part = NULL;
		struct cull_eye eye;

		cull_eye_place(&eye, which, 1);
		cull_set_test(o.set, &eye, &cones, o.is_kept);
		assert_int_equal(cull_part(&part, cull_set_base(o.set), o.is_kept, NULL, NULL), PSR_OK);
		assert_true(psr_model_blocks(part)->n_blocks < o.blocks->n_blocks);
		draw(cull_set_base(o.set), &eye, rgb[0], depth[0]);
		draw(part, &eye, rgb[1], depth[1]);
		assert_memory_equal(rgb[0], rgb[1], sizeof rgb[0]);
		assert_memory_equal(depth[0], depth[1], sizeof depth[0]);
		psr_model_unref(part);
	}
	drop_object(&o);
}

static void a_part_has_the_blocks_of_level_0_that_are_kept(void **state)
{
	struct object o = make_object(seven_balls(), 0);
	const struct psr_blocks *all = psr_model_blocks(o.model), *b;
	uint32_t *index = calloc(all->n_blocks, sizeof *index), n = 0;
	uint8_t *is_kept = calloc(all->n_blocks, 1);
	struct psr_model *part = NULL;

	(void)state;
	assert_int_equal(cull_part(&part, o.model, is_kept, index, NULL), PSR_ERR_ARG);
	for (uint32_t i = 0; i < all->n_blocks; i += 3)
		is_kept[i] = 1;
	assert_int_equal(cull_part(&part, o.model, is_kept, index, NULL), PSR_OK);
	b = psr_model_blocks(part);
	assert_null(b->cone_x);
	assert_null(b->visibility_mask);
	for (uint32_t i = 0; i < all->n_blocks; i++) {
		size_t n_samples = (size_t)__builtin_popcountll(all->mask[i]);
		uint32_t from, to;

		if (!is_kept[i] || psr_blocks_level(all, i) != 0)
			continue;
		assert_int_equal(index[n], i);
		assert_true(b->mask[n] == all->mask[i] && b->sphere_x[n] == all->sphere_x[i] && b->flags[n] == all->flags[i]);
		to = psr_blocks_attr_first(b, n);
		from = psr_blocks_attr_first(all, i);
		assert_memory_equal(b->attr + to, all->attr + from, n_samples * sizeof *b->attr);
		assert_memory_equal(b->depth + to, all->depth + from, n_samples * sizeof *b->depth);
		n++;
	}
	assert_int_equal(b->n_blocks, n);
	psr_model_unref(part);
	free(is_kept);
	free(index);
	drop_object(&o);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(cones_cull_the_back_half_of_a_ball),
		cmocka_unit_test(rays_find_the_cap_of_a_ball),
		cmocka_unit_test(an_eye_that_looks_away_sees_nothing),
		cmocka_unit_test(the_frustum_culls_what_is_not_in_the_picture),
		cmocka_unit_test(masks_cull_a_ball_in_a_bowl_from_below),
		cmocka_unit_test(no_block_that_a_ray_finds_is_culled_by_its_cone),
		cmocka_unit_test(masks_lose_no_pixel_and_hardly_a_block),
		cmocka_unit_test(shares_do_not_depend_on_threads_and_times_are_there),
		cmocka_unit_test(a_part_that_cones_leave_has_the_same_picture),
		cmocka_unit_test(a_part_has_the_blocks_of_level_0_that_are_kept),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
