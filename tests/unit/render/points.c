/* Differential points as pictures: spheres without holes, at true depths and with true normals, however large; from
 * both sides, in shadow maps, refined, beside blocks, and always the same. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "render/render.h"
#include "render/stages.h"
#include "tests/unit/lib/lines.h"
#include "tests/unit/lib/points.h"
#include "tests/unit/lib/threads.h"

#define SIDE 256
#define RADIUS 0.8
#define EPSILON 0.01

struct drawn {
	struct psr_frame frame;
	uint8_t rgb[3 * SIDE * SIDE];
	float depth[SIDE * SIDE];
	int16_t normal[3 * SIDE * SIDE];
	uint32_t id[SIDE * SIDE];
	uint8_t block[3 * SIDE * SIDE], weight[SIDE * SIDE];
	uint64_t words[SIDE * SIDE];
};

static struct dpoint_set set;
static struct psr_model *sphere;

static int setup(void **state)
{
	struct revolved s;

	(void)state;
	revolve(&s, 0, RADIUS, 6, 5);
	points_of_patch(&set, &s.patch, 24, POINTS_GREY);
	sphere = points_to_model(&set);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	psr_model_unref(sphere);
	dpoint_set_fini(&set);
	return 0;
}

static struct psr_instance place(const struct psr_model *model)
{
	return (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
}

/* A sphere of RADIUS fills `part` of the picture's height. */
static struct psr_camera camera_of(int is_perspective, double part)
{
	struct psr_camera camera = { .eye = { 1.2, 0.9, 2.6 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC,
		                         .ortho_height = 2 * RADIUS / part };
	const double distance = 3;

	v3d_normalize(camera.eye, camera.eye);
	v3d_scale(camera.eye, camera.eye, distance);
	if (is_perspective) {
		camera.kind = PSR_CAMERA_PERSPECTIVE;
		camera.ortho_height = 0;
		camera.fov_y = 2 * atan(RADIUS / sqrt(distance * distance - RADIUS * RADIUS) / part);
	}
	return camera;
}

struct way {
	int n_threads, is_full;
	unsigned pass;
	const struct simd *simd;
};

static void draw_by(struct drawn *to, const struct psr_scene *scene, const struct way *way)
{
	struct psr_renderer *renderer;
	struct render_settings settings;
	struct psr_pool *pool = NULL;
	struct refiner *refiner;
	struct psr_error err = { 0 };

	memset(to, 0, sizeof *to);
	to->frame = (struct psr_frame){ .width = SIDE, .height = SIDE, .rgb = to->rgb, .depth = to->depth };
	if (way->pass == 0) {
		to->frame.normal = to->normal;
		to->frame.id = to->id;
		to->frame.block = to->block;
		to->frame.weight = to->weight;
		to->frame.words = to->words;
	}
	render_settings_default(&settings, SIDE, SIDE);
	settings.pass = way->pass;
	settings.is_full = way->is_full;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	if (way->simd != NULL)
		renderer_use(renderer, way->simd);
	assert_int_equal(refiner_create(&refiner, renderer, NULL), PSR_OK);
	if (way->n_threads > 1)
		assert_int_equal(psr_pool_create(&pool, way->n_threads, NULL), PSR_OK);
	if (refiner_draw(refiner, scene, &settings, pool, &to->frame, &err))
		fail_msg("%s", err.text);
	psr_pool_destroy(pool);
	refiner_destroy(refiner);
	psr_renderer_destroy(renderer);
}

static struct drawn *draw(const struct psr_scene *scene, unsigned pass)
{
	struct drawn *to = malloc(sizeof *to);

	draw_by(to, scene, &(struct way){ .n_threads = 1, .pass = pass });
	return to;
}

/* ---- the truth ---- */

struct errors {
	unsigned n_inside, n_holes, n_stray;
	double depth, degrees, mean_degrees; /* depth: along the normal; degrees: worst */
};

/* `off`: how far the drawn surface may be from the sphere: inside are pixels whose lines meet a sphere so much smaller,
 * outside those that miss one so much larger. */
static struct errors compare(const struct psr_camera *camera, const struct drawn *p, double off)
{
	struct errors e = { 0 };

	for (int y = 0; y < SIDE; y++)
		for (int x = 0; x < SIDE; x++) {
			const struct line line = line_of(camera, SIDE, x + 0.5, y + 0.5);
			const double z = (double)p->depth[y * SIDE + x];
			double at[3], normal[3], along[3];

			e.n_stray += isinf(meet_sphere(&line, RADIUS + off)) && !isinf(z);
			if (isinf(meet_sphere(&line, RADIUS - off)))
				continue;
			e.n_inside++;
			e.n_holes += isinf(z);
			if (isinf(z))
				continue;
			memcpy(at, line.from, sizeof at);
			v3d_add_scaled(at, at, z, line.along);
			e.depth = fmax(e.depth, fabs(v3d_length(at) - RADIUS));
			for (int k = 0; k < 3; k++)
				normal[k] = p->normal[3 * (y * SIDE + x) + k] / 32767.0;
			v3d_normalize(along, at);
			v3d_cross(at, along, normal);
			const double degrees = asin(fmin(v3d_length(at), 1)) * 180 / 3.14159265358979;
			e.degrees = fmax(e.degrees, v3d_dot(along, normal) > 0 ? degrees : 180);
			e.mean_degrees += degrees;
		}
	e.mean_degrees /= fmax(e.n_inside, 1);
	return e;
}

/* Normals: 0.23 degrees of rounding (dpoint_pack()); and 6 % of what a curvature turns them by between the middle and
 * the corner of a rectangle, asin(sqrt(2 epsilon - epsilon^2)) along both sides. */
static double most_degrees(void)
{
	return 0.23 + 0.06 * sqrt(2) * asin(dpoint_sine(EPSILON)) * 180 / 3.14159265358979;
}

static void a_sphere_is_whole_and_true_at_every_size(void **state)
{
	static const double parts[] = { 0.02, 0.1, 0.5, 0.9, 2, 6, 20, 60 };
	const struct psr_instance instance = place(sphere);

	(void)state;
	for (int is_perspective = 0; is_perspective < 2; is_perspective++)
		for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
			const struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 },
				                             .camera = camera_of(is_perspective, parts[i]) };
			struct drawn *p = draw(&scene, 0);
			const struct errors e = compare(&scene.camera, p, (double)set.height);

			assert_true(e.n_inside > 0);
			if (e.n_holes + e.n_stray > 0 || e.depth > (double)set.height || e.degrees > most_degrees())
				fail_msg("part %g: %u holes, %u stray, depth off by %g, normals by %g degrees", parts[i], e.n_holes,
				         e.n_stray, e.depth, e.degrees);
			free(p);
		}
}

static void assert_same(const struct drawn *a, const struct drawn *b)
{
	assert_memory_equal(a->rgb, b->rgb, sizeof a->rgb);
	assert_memory_equal(a->depth, b->depth, sizeof a->depth);
	assert_memory_equal(a->normal, b->normal, sizeof a->normal);
	assert_memory_equal(a->words, b->words, sizeof a->words);
	assert_memory_equal(a->weight, b->weight, sizeof a->weight);
}

static void threads_and_instruction_sets_draw_the_same(void **state)
{
	const struct psr_instance instance[2] = { place(sphere), { .model = sphere, .rotation = { 0.6, 0, 0, 0.8 },
		.translation = { 0.5, 0.2, -0.1 }, .scale = 0.7 } };
	const struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -1, -2, -1 }, .color = { 1, 1, 1 } };
	struct drawn *first = malloc(sizeof *first), *other = malloc(sizeof *other);

	(void)state;
	for (int is_perspective = 0; is_perspective < 2; is_perspective++) {
		const struct psr_scene scene = { .instance = instance, .n_instances = 2, .light = &light, .n_lights = 1,
			                             .camera = camera_of(is_perspective, 1.5) };

		draw_by(first, &scene, &(struct way){ .n_threads = 1, .simd = simd_of(PSR_ISA_C) });
		for (int i = 0; i < PSR_N_ISAS; i++)
			for (int n_threads = 1; n_threads <= 3; n_threads += 2) {
				if (simd_of(i) == NULL)
					continue;
				draw_by(other, &scene, &(struct way){ .n_threads = n_threads, .simd = simd_of(i) });
				assert_same(first, other);
			}
		draw_by(other, &scene, &(struct way){ .n_threads = 1, .is_full = 1 });
		assert_memory_equal(first->rgb, other->rgb, sizeof first->rgb);
		assert_memory_equal(first->normal, other->normal, sizeof first->normal);
	}
	free(first);
	free(other);
}

static void passes_have_no_holes(void **state)
{
	const struct psr_instance instance = place(sphere);
	const struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 },
		                             .camera = camera_of(1, 3) };
	struct drawn *p = draw(&scene, 2);

	(void)state;
	for (int i = 0; i < SIDE * SIDE; i++)
		assert_true(isfinite(p->depth[i]) && p->rgb[3 * i] == 0xb4);
	free(p);
}

/* From inside the sphere there are backs alone. */
static void backs_are_seen_of_two_sided_groups_alone(void **state)
{
	struct dpoint_group *group = malloc(set.n_groups * sizeof *group);
	struct dpoint_set both = set;
	struct psr_model *model;

	(void)state;
	memcpy(group, set.group, set.n_groups * sizeof *group);
	for (uint32_t i = 0; i < set.n_groups; i++)
		group[i].flags = DPOINT_TWO_SIDED;
	both.group = group;
	model = points_to_model(&both);
	for (int is_both = 0; is_both < 2; is_both++) {
		const struct psr_instance instance = place(is_both ? model : sphere);
		const struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 },
			                             .camera = { .eye = { 0.1, 0.2, 0.3 }, .target = { 0, 0, -1 },
			                                         .up = { 0, 1, 0 }, .fov_y = 1.8 } };
		struct drawn *p = draw(&scene, 0);

		for (int i = 0; i < SIDE * SIDE; i++) {
			assert_int_equal(isfinite(p->depth[i]), is_both);
			if (is_both)
				assert_true(fabs((double)p->depth[i]) < 2 * RADIUS && p->normal[3 * i + 2] > 0);
		}
		free(p);
	}
	psr_model_unref(model);
	free(group);
}

/* A plane of few rectangles, each much larger than the distance of the eye, which stands on it. */
static void a_floor_has_no_hole_under_the_eye(void **state)
{
	struct psr_model *model;
	struct dpoint_set floor;
	struct revolved plane;

	(void)state;
	quadric(&plane, 0, 0, 0);
	points_of_patch(&floor, &plane.patch, 6, POINTS_GREY);
	assert_true(floor.n_points < 50);
	model = points_to_model(&floor);
	for (int k = 0; k < 3; k++) {
		const double height = k == 0 ? 0.3 : k == 1 ? 0.02 : 0.003;
		const struct psr_instance instance = place(model);
		const struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 },
			                             .camera = { .eye = { 0.03, -0.05, height }, .target = { 0.03, 0.95, height },
			                                         .up = { 0, 0, 1 }, .fov_y = 1.5, .near_z = 1e-4 } };
		const double pixel = 2 * tan(0.75) / SIDE;
		struct drawn *p = draw(&scene, 0);
		unsigned n_inside = 0;

		for (int y = 0; y < SIDE; y++)
			for (int x = 0; x < SIDE; x++) {
				const double down = (y + 0.5 - SIDE / 2.0) * pixel, right = (x + 0.5 - SIDE / 2.0) * pixel;
				const double z = height / down, seen = (double)p->depth[y * SIDE + x];

				/* Slopes of rounded normals, 0.004, move the horizon. */
				if (!(down > 0.008) || z > 0.95 || fabs(0.03 + right * z) > 0.95)
					continue;
				n_inside++;
				assert_true(isfinite(seen) && fabs(seen - z) * down <= (double)floor.height);
			}
		assert_true(n_inside > SIDE);
		free(p);
	}
	psr_model_unref(model);
	dpoint_set_fini(&floor);
}

/* A sphere over a floor: the shadow is where the light's line meets the sphere, but for its rim, some texels wide. */
static void points_cast_shadows_and_receive_them(void **state)
{
	struct psr_model *model;
	struct dpoint_set floor;
	struct revolved plane;
	const double to_light[3] = { 0.2, 0.3, 0.9327379053088815 };

	(void)state;
	quadric(&plane, 0, 0, 0);
	points_of_patch(&floor, &plane.patch, 6, POINTS_GREY);
	model = points_to_model(&floor);
	const struct psr_instance instance[2] = { place(model), { .model = sphere, .rotation = { 0, 0, 0, 1 },
		.translation = { 0, 0, 0.5 }, .scale = 0.4 } };
	const struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .color = { 1, 1, 1 }, .casts_shadow = 1,
		                             .direction = { -to_light[0], -to_light[1], -to_light[2] } };
	const struct psr_scene scene = { .instance = instance, .n_instances = 2, .light = &light, .n_lights = 1,
		                             .camera = { .eye = { 0, -3, 3 }, .up = { 0, 0, 1 }, .fov_y = 0.35 } };
	struct drawn *p = draw(&scene, 0);
	unsigned n[2] = { 0, 0 };

	for (int y = 0; y < SIDE; y++)
		for (int x = 0; x < SIDE; x++) {
			const struct line line = line_of(&scene.camera, SIDE, x + 0.5, y + 0.5);
			const double t = -line.from[2] / line.along[2], r = 0.4 * RADIUS;
			double at[3], from[3], gap;

			memcpy(at, line.from, sizeof at);
			v3d_add_scaled(at, at, t, line.along);
			if (p->id[y * SIDE + x] != 0 || fmax(fabs(at[0]), fabs(at[1])) > 0.9)
				continue;
			v3d_sub(from, (const double[3]){ 0, 0, 0.5 }, at);
			v3d_add_scaled(from, from, -v3d_dot(from, to_light), to_light);
			gap = v3d_length(from) - r;
			if (fabs(gap) < 0.02)
				continue;
			n[gap > 0]++;
			assert_true((p->rgb[3 * (y * SIDE + x)] > 20) == (gap > 0));
		}
	assert_true(n[0] > 500 && n[1] > 5000);
	free(p);
	psr_model_unref(model);
	dpoint_set_fini(&floor);
}

/* ---- points that lean ---- */

/* How shading's normals lean from the plane z = 0: along x and y, at a place of it. */
static void lean_at(double lean[2], double x, double y)
{
	lean[0] = 0.3 + 0.5 * x - 0.2 * y;
	lean[1] = -0.1 + 0.4 * x + 0.3 * y;
}

static void lean_of(struct dpoint_lean *lean, const struct dpoint *p)
{
	const double growth[2][2] = { { 0.5, -0.2 }, { 0.4, 0.3 } }, axis[2][2] = { { p->u[0], p->u[1] },
		                                                                        { -p->u[1], p->u[0] } };
	double in[2];

	lean_at(in, p->at[0], p->at[1]);
	for (int c = 0; c < 2; c++) {
		lean->at[c] = (int16_t)lrint((axis[c][0] * in[0] + axis[c][1] * in[1]) / (double)DPOINT_LEAN_STEP);
		for (int k = 0; k < 2; k++) {
			double by = 0;

			for (int i = 0; i < 2; i++)
				for (int j = 0; j < 2; j++)
					by += axis[c][i] * growth[i][j] * axis[k][j];
			lean->by[c][k] = (uint16_t)((psr_bits_from_float((float)by) + 0x8000) >> 16);
		}
	}
}

/* The plane of a floor's points, all of which lean; the caller frees group and lean. */
static void make_leaning(struct dpoint_set *to, const struct dpoint_set *floor)
{
	struct dpoint_group *group = malloc(floor->n_groups * sizeof *group);
	struct dpoint_lean *lean = malloc(floor->n_points * sizeof *lean);

	*to = *floor;
	to->n_lean = floor->n_points;
	to->group = memcpy(group, floor->group, floor->n_groups * sizeof *group);
	to->lean = lean;
	for (uint32_t i = 0; i < floor->n_groups; i++) {
		group[i].flags |= DPOINT_LEANING;
		for (uint32_t k = 0; k < group[i].n; k++) {
			struct dpoint p;

			dpoint_unpack(&p, &floor->word[group[i].first + k], &group[i].box);
			lean_of(&lean[group[i].first + k], &p);
		}
	}
}

/* Half a degree: 0.23 of packed normals, as much again of what turns their tangents, and growth's 8 bits. */
static void check_normals(const struct drawn *p, const struct psr_camera *camera)
{
	unsigned n = 0;

	for (int y = 0; y < SIDE; y++)
		for (int x = 0; x < SIDE; x++) {
			const struct line line = line_of(camera, SIDE, x + 0.5, y + 0.5);
			const double t = -line.from[2] / line.along[2];
			double at[3], seen[3], normal[3] = { 0, 0, 1 };

			memcpy(at, line.from, sizeof at);
			v3d_add_scaled(at, at, t, line.along);
			if (fmax(fabs(at[0]), fabs(at[1])) > 0.95)
				continue;
			lean_at(normal, at[0], at[1]);
			v3d_normalize(normal, normal);
			for (int k = 0; k < 3; k++)
				seen[k] = p->normal[3 * (y * SIDE + x) + k] / 32767.0;
			n++;
			assert_true(v3d_dot(seen, normal) > cos(0.5 * 3.14159265358979 / 180));
		}
	assert_true(n > SIDE * SIDE / 4);
}

/* Places are those of the points that do not lean, and so is what a light's shadow asks for: a light that is behind the
 * plane does not reach it, though normals lean towards the light. */
static void points_that_lean_have_shadings_normals_in_their_planes(void **state)
{
	struct dpoint_set floor, leaning;
	struct psr_model *model[2];
	struct revolved plane;

	(void)state;
	quadric(&plane, 0, 0, 0);
	points_of_patch(&floor, &plane.patch, 6, POINTS_GREY);
	make_leaning(&leaning, &floor);
	model[0] = points_to_model(&floor);
	model[1] = points_to_model(&leaning);
	for (int is_perspective = 0; is_perspective < 2; is_perspective++) {
		const struct psr_instance instance[2] = { place(model[0]), place(model[1]) };
		struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .color = { 1, 1, 1 }, .casts_shadow = 1,
			                       .direction = { -1, 0, 0.05 } };
		struct psr_scene scene = { .instance = &instance[1], .n_instances = 1, .light = &light, .n_lights = 1,
			                       .camera = camera_of(is_perspective, 0.8) };
		struct drawn *first = malloc(sizeof *first), *other = malloc(sizeof *other);

		draw_by(first, &scene, &(struct way){ .n_threads = 1, .simd = simd_of(PSR_ISA_C) });
		check_normals(first, &scene.camera);
		for (int i = 0; i < SIDE * SIDE; i++)
			assert_true(!isfinite(first->depth[i]) || first->rgb[3 * i] == 0);
		for (int i = 0; i < PSR_N_ISAS; i++)
			for (int n_threads = 1; n_threads <= 3 && simd_of(i) != NULL; n_threads += 2) {
				draw_by(other, &scene, &(struct way){ .n_threads = n_threads, .simd = simd_of(i) });
				assert_same(first, other);
			}
		scene.instance = &instance[0];
		draw_by(other, &scene, &(struct way){ .n_threads = 1 });
		assert_memory_equal(first->depth, other->depth, sizeof first->depth);
		light.casts_shadow = 0;
		scene.instance = &instance[1];
		draw_by(other, &scene, &(struct way){ .n_threads = 1 });
		assert_true(other->rgb[3 * (SIDE / 2 * SIDE + SIDE / 2)] > 20);
		free(first);
		free(other);
	}
	psr_model_unref(model[0]);
	psr_model_unref(model[1]);
	free((void *)(uintptr_t)leaning.group);
	free((void *)(uintptr_t)leaning.lean);
	dpoint_set_fini(&floor);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_sphere_is_whole_and_true_at_every_size),
		cmocka_unit_test(threads_and_instruction_sets_draw_the_same),
		cmocka_unit_test(passes_have_no_holes),
		cmocka_unit_test(backs_are_seen_of_two_sided_groups_alone),
		cmocka_unit_test(a_floor_has_no_hole_under_the_eye),
		cmocka_unit_test(points_cast_shadows_and_receive_them),
		cmocka_unit_test(points_that_lean_have_shadings_normals_in_their_planes),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, setup, teardown);
}
