/* What the truth of pictures sees and where, against scenes whose answer is known. */
#include "sources.h"

/* A floor of -1..1 and a square of 0.2 beside x = -0.1, 0.5 above it, in the mesh's order. */
static struct psr_mesh *floor_and_roof(void)
{
	struct psr_mesh *mesh = meshes_square(1), *two = meshes_new(8, 4);

	for (uint32_t i = 0; i < 8; i++) {
		for (int k = 0; k < 2; k++)
			two->position[i][k] = mesh->position[i % 4][k] * (i < 4 ? 1 : 0.1);
		two->position[i][2] = i < 4 ? 0 : 0.5;
		two->normal[i][2] = 1;
	}
	for (uint32_t i = 0; i < 4; i++)
		for (int k = 0; k < 3; k++)
			two->triangle[i][k] = mesh->triangle[i % 2][k] + (i < 2 ? 0 : 4);
	meshes_free(mesh);
	return two;
}

/* The light falls from -x by a slope of 1: the shadow of -0.1..0.1 lies at 0.4..0.6. A lamp at (-0.5, 0, 1) throws its
 * edges to 0.3 and 0.7. */
static void shadows_have_sharp_edges_at_their_place(void **state)
{
	enum { N = 100 };
	struct psr_mesh *mesh = floor_and_roof();

	(void)state;
	for (int kind = 0; kind < 2; kind++) {
		struct psr_light light = kind == 0 ? sun(1, 0, -1) : (struct psr_light){ .kind = PSR_LIGHT_POINT,
			                                                                  .position = { -0.5, 0, 1 } };
		const struct psr_scene scene = scene_of(0, &light, 1);
		const double low = kind == 0 ? 0.4 : 0.3, high = kind == 0 ? 0.6 : 0.7;
		static float got[N * N][3];

		light.casts_shadow = 1;
		v3d_set(light.color, 1, 1, 1);
		draw(mesh, &scene, N, N, 3, &(struct psr_source_planes){ .light = got });
		/* The row of pixels above y = 0: centres are at -0.99, -0.97, ... */
		for (int x = 0; x < N; x++) {
			const double left = 2.0 * x / N - 1, right = left + 2.0 / N;
			const int is_dark = left > low - 1e-9 && right < high + 1e-9;

			if (left < 0.12 - 1e-9 && right > -0.12 + 1e-9)
				continue; /* the roof */
			assert_true(is_dark ? got[N * N / 2 + x][0] == 0 : got[N * N / 2 + x][0] > 0.01f);
		}
		light.casts_shadow = 0;
		draw(mesh, &scene, N, N, 1, &(struct psr_source_planes){ .light = got });
		assert_true(got[N * N / 2 + 75][0] > 0.01f);
	}
	meshes_free(mesh);
}

/* Glass between: half of the light. */
static void glass_dims_what_lies_behind_and_below(void **state)
{
	struct psr_mesh *mesh = floor_and_roof();
	struct psr_light light = sun(1, 0, -1);
	struct psr_scene scene = scene_of(0, &light, 1);
	float lit[3], shadowed[3], through[3];

	(void)state;
	free(mesh->material);
	mesh->material = calloc(2, sizeof *mesh->material);
	mesh->n_materials = 2;
	for (int i = 0; i < 2; i++)
		psr_material_default(&mesh->material[i]);
	mesh->triangle_material[2] = mesh->triangle_material[3] = 1;
	mesh->material[1].alpha = PSR_ALPHA_BLEND;
	mesh->material[1].base_color[3] = 0.75f;
	mesh->material[1].unlit = 1;
	light_at(mesh, &scene, 0.5, 0, NULL, lit);
	light.casts_shadow = 1;
	light_at(mesh, &scene, 0.5, 0, NULL, shadowed);
	light_at(mesh, &scene, 0, 0, NULL, through);
	assert_near((double)(shadowed[0] / lit[0]), 0.25, FLOATS);
	assert_near((double)through[0], 0.75 + 0.25 * (double)lit[0], FLOATS);
	meshes_free(mesh);
}

static void a_checker_seen_from_afar_is_its_mean(void **state)
{
	static const uint8_t texel[16] = { 255, 255, 255, 255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255, 255 };
	struct psr_mesh *mesh = meshes_square(1);
	struct psr_scene scene = scene_of(0, NULL, 0);
	float got[64][3];

	(void)state;
	meshes_texture(mesh, 2, 2, texel);
	mesh->material->unlit = 1;
	mesh->material->two_sided = 1;
	mesh->material->base_texture.transform[0] = mesh->material->base_texture.transform[4] = 64;
	for (int i = 0; i < 2; i++) {
		/* Head on, and by 80 degrees; all rays meet the square. */
		v3d_set(scene.camera.eye, 0, i == 0 ? 0 : -sin(1.4), i == 0 ? 1 : cos(1.4));
		scene.camera.ortho_height = i == 0 ? 2 : 2 * cos(1.4);
		draw(mesh, &scene, 4, 4, 2, &(struct psr_source_planes){ .light = got });
		for (int k = 0; k < 16; k++)
			/* Of two levels 0.5 is the upper; the lower one's taps would be off by its part of a period. */
			if (i == 0 || (k % 4 != 0 && k % 4 != 3))
				assert_near((double)got[k][0], 0.5, 0.02);
	}
	meshes_free(mesh);
}

static void emission_occlusion_and_vertex_colours_count_once(void **state)
{
	static const uint8_t half[4] = { 51, 0, 0, 255 };
	struct psr_mesh *mesh = meshes_square(1);
	const struct psr_light light = sun(0, 0, -1);
	struct psr_scene scene = scene_of(0.5, &light, 0);
	struct psr_material *m = mesh->material;
	float open[3], closed[3], lit[3], unlit[3];

	(void)state;
	m->is_specular_glossiness = 1;
	v3f_set(m->specular, 0, 0, 0);
	m->glossiness = 0;
	m->emissive[1] = 3;
	mesh->color = calloc(mesh->n_vertices, sizeof *mesh->color);
	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		for (int c = 0; c < 4; c++)
			mesh->color[i][c] = 0.5f;
	light_at(mesh, &scene, 0, 0, NULL, open);
	meshes_texture(mesh, 1, 1, half);
	m->occlusion_texture = m->base_texture;
	m->base_texture.image = -1;
	light_at(mesh, &scene, 0, 0, NULL, closed);
	scene.n_lights = 1;
	light_at(mesh, &scene, 0, 0, NULL, lit);
	m->unlit = 1;
	light_at(mesh, &scene, 0, 0, NULL, unlit);
	/* The texel is a fifth. It dims the surroundings and no lamp; emission is what it is. */
	assert_near((double)closed[0], (double)open[0] / 5, FLOATS);
	assert_near((double)open[1] - (double)open[0], 3, 3 * FLOATS);
	assert_near((double)lit[0] - (double)closed[0], 0.5, FLOATS);
	assert_near((double)unlit[0], 0.5, FLOATS);
	meshes_free(mesh);
}

/* Masks: the texel's alpha is 0.2, and cut off below 0.5. */
static void masks_let_everything_through_or_nothing(void **state)
{
	static const uint8_t texel[8] = { 255, 255, 255, 51, 255, 255, 255, 255 };
	struct psr_mesh *mesh = meshes_square(1);
	struct psr_scene scene = scene_of(1, NULL, 0);
	float coverage[4], depth[4];

	(void)state;
	meshes_texture(mesh, 2, 1, texel);
	mesh->material->base_texture.is_nearest = 1;
	mesh->material->alpha = PSR_ALPHA_MASK;
	draw(mesh, &scene, 2, 2, 4, &(struct psr_source_planes){ .coverage = coverage, .depth = depth });
	assert_true(coverage[0] == 0 && coverage[1] == 1);
	assert_true(isinf(depth[0]) && fabsf(depth[1] - 3) < 1e-5f);
	meshes_free(mesh);
}

/* An instance that is turned, scaled and moved, seen by a camera that was moved along, and by threads of any number. */
static void instances_and_threads_do_not_change_the_picture(void **state)
{
	enum { N = 40 };
	static const double zero[3];
	const double half = sqrt(0.5);
	const struct psr_instance moved = { .rotation = { 0, half, 0, half }, .translation = { 10, 20, 30 }, .scale = 2 };
	struct psr_mesh *mesh = meshes_sphere(24, zero, 0.7);
	struct psr_light light = sun(0.3, -0.4, -1);
	struct psr_scene scene = scene_of(0.2, &light, 1);
	struct psr_source *source = NULL;
	static float one[N * N][3], other[N * N][3];

	(void)state;
	light.casts_shadow = 1;
	scene.background[2] = 0.3;
	assert_int_equal(psr_source_create(&source, mesh, NULL), PSR_OK);
	struct psr_source_shot shot = { source, &scene, N, N, 3, 1 };
	assert_int_equal(psr_source_draw(&shot, &(struct psr_source_planes){ .light = one }, NULL), PSR_OK);
	shot.n_threads = 3;
	assert_int_equal(psr_source_draw(&shot, &(struct psr_source_planes){ .light = other }, NULL), PSR_OK);
	assert_memory_equal(one, other, sizeof one);
	/* Turned by 90 degrees around y: +z becomes +x. */
	scene.instance = &moved;
	scene.n_instances = 1;
	v3d_set(scene.camera.eye, 10 + 2 * 3, 20, 30);
	v3d_set(scene.camera.target, 10, 20, 30);
	scene.camera.ortho_height = 4;
	v3d_set(light.direction, -1, -0.4, -0.3);
	assert_int_equal(psr_source_draw(&shot, &(struct psr_source_planes){ .light = other }, NULL), PSR_OK);
	for (int i = 0; i < N * N; i++)
		for (int c = 0; c < 3; c++)
			assert_near((double)other[i][c], (double)one[i][c], 1e-4);
	psr_source_destroy(source);
	meshes_free(mesh);
}

static void what_is_out_of_range_is_refused(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	struct psr_light light = sun(0, 0, 0);
	struct psr_scene scene = scene_of(0, &light, 1);
	struct psr_source *source = NULL;
	struct psr_error err;
	float got[1][3];
	const struct psr_source_planes to = { .light = got };

	(void)state;
	assert_int_equal(psr_source_create(&source, mesh, NULL), PSR_OK);
	assert_int_equal(psr_source_draw(&(struct psr_source_shot){ source, &scene, 1, 1, 1, 1 }, &to, &err), PSR_ERR_ARG);
	scene.n_lights = 0;
	assert_int_equal(psr_source_draw(&(struct psr_source_shot){ source, &scene, 1, 1, 17, 1 }, &to, &err), PSR_ERR_ARG);
	assert_int_equal(psr_source_draw(&(struct psr_source_shot){ source, &scene, 0, 1, 1, 1 }, &to, &err), PSR_ERR_ARG);
	scene.ambient[0] = NAN;
	assert_int_equal(psr_source_draw(&(struct psr_source_shot){ source, &scene, 1, 1, 1, 1 }, &to, &err), PSR_ERR_ARG);
	psr_source_destroy(source);
	meshes_free(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(shadows_have_sharp_edges_at_their_place),
		cmocka_unit_test(glass_dims_what_lies_behind_and_below),
		cmocka_unit_test(a_checker_seen_from_afar_is_its_mean),
		cmocka_unit_test(emission_occlusion_and_vertex_colours_count_once),
		cmocka_unit_test(masks_let_everything_through_or_nothing),
		cmocka_unit_test(instances_and_threads_do_not_change_the_picture),
		cmocka_unit_test(what_is_out_of_range_is_refused),
	};

	return cmocka_run_group_tests_name("source", tests, NULL, NULL);
}
