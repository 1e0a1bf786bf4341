/* The light of the truth's surfaces against closed formulas. */
#include "measure/brdf.h"
#include "sources.h"

/* GGX by tangents and Smith's Lambda, as Walter and Heitz write it: times pi and the cosine. */
static double ggx(double alpha, double nh, double nl, double nv)
{
	const double tan2 = (1 - nh * nh) / (nh * nh);
	const double d = 1 / (PI * alpha * alpha * pow(nh, 4) * pow(1 + tan2 / (alpha * alpha), 2));
	const double lambda_l = (sqrt(1 + alpha * alpha * (1 / (nl * nl) - 1)) - 1) / 2;
	const double lambda_v = (sqrt(1 + alpha * alpha * (1 / (nv * nv) - 1)) - 1) / 2;

	return PI * d / (1 + lambda_l + lambda_v) / (4 * nv);
}

static double schlick(double f0, double vh)
{
	return f0 + (1 - f0) * pow(1 - vh, 5);
}

static void a_rough_plane_lit_head_on_has_the_light_of_gltf(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	const struct psr_light light = sun(0, 0, -2);
	const struct psr_scene scene = scene_of(0, &light, 1);
	float got[3];

	(void)state;
	for (int c = 0; c < 3; c++)
		mesh->material->base_color[c] = 0.5f;
	light_at(mesh, &scene, 0.1, 0.2, NULL, got);
	/* 0.96 * 0.5 + 0.04 / 4 */
	assert_near((double)got[1], 0.49, 0.49 * FLOATS);
	meshes_free(mesh);
}

static void planes_at_all_angles_follow_the_closed_formula(void **state)
{
	static const double tilt[] = { 0, 0.4, 0.9, 1.3, 1.5 };
	static const float roughness[] = { 0.2f, 0.5f, 1 };
	struct psr_mesh *mesh = meshes_square(1);

	(void)state;
	mesh->material->base_color[0] = 0.7f;
	mesh->material->metallic = 0.25f;
	for (int i = 0; i < 5 * 5 * 3; i++) {
		const double a = tilt[i % 5], b = tilt[i / 5 % 5];
		const double to_light[3] = { sin(a), 0, cos(a) }, eye[3] = { -sin(b) * 0.6, sin(b) * 0.8, cos(b) };
		const struct psr_light light = sun(-to_light[0], -to_light[1], -to_light[2]);
		const struct psr_scene scene = scene_of(0, &light, 1);
		double h[3];
		float got[3];

		mesh->material->roughness = roughness[i / 25];
		const double alpha = (double)mesh->material->roughness * (double)mesh->material->roughness;
		light_at(mesh, &scene, 0, 0, eye, got);
		v3d_add(h, to_light, eye);
		v3d_normalize(h, h);
		const double f = schlick(0.04 + 0.25 * ((double)0.7f - 0.04), v3d_dot(h, eye));
		const double beneath = 1 - schlick(0.04, v3d_dot(h, eye));
		const double expected = beneath * 0.75 * (double)0.7f * cos(a) + f * ggx(alpha, h[2], cos(a), cos(b));
		assert_near((double)got[0], expected, expected * FLOATS);
	}
	meshes_free(mesh);
}

/* A metal that mirrors everything tells the lobe; black glass of the same lobe over it is Fresnel's share. */
static void fresnel_is_4_percent_at_0_degrees_and_all_at_90(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);

	(void)state;
	mesh->material->roughness = 0.3f;
	for (int i = 0; i < 2; i++) {
		const double angle = i == 0 ? 0 : 89.9 * PI / 180, eye[3] = { sin(angle), 0, cos(angle) };
		const struct psr_light light = sun(sin(angle), 0, -cos(angle));
		const struct psr_scene scene = scene_of(0, &light, 1);
		float metal[3], glass[3];

		mesh->material->metallic = 1;
		for (int c = 0; c < 3; c++)
			mesh->material->base_color[c] = 1;
		light_at(mesh, &scene, 0, 0, eye, metal);
		mesh->material->metallic = 0;
		for (int c = 0; c < 3; c++)
			mesh->material->base_color[c] = 0;
		light_at(mesh, &scene, 0, 0, eye, glass);
		assert_near((double)(glass[0] / metal[0]), i == 0 ? 0.04 : schlick(0.04, cos(angle)), 2 * FLOATS);
	}
	assert_true(schlick(0.04, cos(89.9 * PI / 180)) > 0.99);
	meshes_free(mesh);
}

/* The sphere's polygons lie up to 4e-5 beneath it, so that a normal at a place of the picture is off by up to
 * 4e-5 / 0.5 where the sphere is tilted by 60 degrees, the most that counts here. The logarithm of a lobe of alpha 0.09 changes by
 * 2 / alpha a radian at most, together 0.0018; where light grazes, it changes by the normal's error itself. */
static void a_highlight_on_a_sphere_has_its_place_width_and_peak(void **state)
{
	enum { N = 96 };
	static const double zero[3];
	struct psr_mesh *mesh = meshes_sphere(256, zero, 1);
	const double to_light[3] = { 0.6, 0.48, 0.64 }, eye[3] = { 0, 0, 1 }, alpha = (double)0.3f * (double)0.3f;
	const struct psr_light light = sun(-0.6, -0.48, -0.64);
	const struct psr_scene scene = scene_of(0, &light, 1);
	static float got[N * N][3], coverage[N * N], depth[N * N];
	double h[3];
	int n = 0;

	(void)state;
	mesh->material->roughness = 0.3f;
	mesh->material->metallic = 1;
	draw(mesh, &scene, N, N, 1, &(struct psr_source_planes){ .light = got, .coverage = coverage, .depth = depth });
	v3d_add(h, to_light, eye);
	v3d_normalize(h, h);
	for (int i = 0; i < N * N; i++) {
		const double x = 2 * (i % N + 0.5) / N - 1, y = 1 - 2 * (i / N + 0.5) / N, z2 = 1 - x * x - y * y;
		const double normal[3] = { x, y, sqrt(fmax(z2, 0)) };
		const double nl = v3d_dot(normal, to_light), nh = v3d_dot(normal, h);

		if (fabs(z2) > 0.01)
			assert_true(coverage[i] == (z2 > 0 ? 1.0f : 0.0f));
		if (z2 < 0.25)
			continue;
		const double expected = nl > 0 ? schlick(1, h[2]) * ggx(alpha, nh, nl, normal[2]) : 0;
		assert_near((double)depth[i], 3 - normal[2], 1e-3);
		assert_near((double)got[i][0], expected, 0.002 * expected + (fabs(nl) < 0.01 ? 1e-4 : 0));
		n++;
	}
	assert_true(n > N * N / 2);
	meshes_free(mesh);
}

/* Adds up the light of a quarter of all directions, cell by cell, the other half of the hemisphere being the same: it
 * must be that of surroundings of 1, and of metals never more than arrives. */
static void surroundings_give_what_their_lights_give(void **state)
{
	enum { N = 256 };
	struct brdf_albedo albedo;

	(void)state;
	brdf_albedo_init(&albedo);
	for (int i = 0; i < 4 * 4 * 2; i++) {
		const double roughness = 0.25 + 0.25 * (i % 4), nv = 0.25 + 0.25 * (i / 4 % 4), f0 = i < 16 ? 1 : 0.04;
		const struct brdf brdf = { { 1 - f0, 1 - f0, 1 - f0 }, { f0, f0, f0 }, { f0, f0, f0 },
			                      roughness * roughness, 0, { 0 }, 0 };
		const double n[3] = { 0, 0, 1 }, v[3] = { sqrt(1 - nv * nv), 0, nv };
		double ambient[3], sum = 0;

		brdf_ambient(&albedo, &brdf, nv, ambient);
		for (int k = 0; k < N * N; k++) {
			const double down = PI / 2 * (k / N + 0.5) / N, angle = PI * (k % N + 0.5) / N;
			const double l[3] = { sin(down) * cos(angle), sin(down) * sin(angle), cos(down) };
			double out[3];

			brdf_reflect(&brdf, n, v, l, out);
			sum += out[0] * sin(down) * PI / (N * N);
		}
		assert_near(ambient[0], sum, 0.01); /* an entry of the table is the mean of 16 x 16 directions */
		if (f0 == 1)
			assert_true(ambient[0] <= 1); /* dielectrics of glTF may send back more at grazing angles */
	}
}

static void a_spot_is_full_inside_dark_outside_and_smooth_between(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	const struct psr_light light = { .kind = PSR_LIGHT_SPOT, .position = { 0, 0, 1 }, .direction = { 0, 0, -5 },
		                             .color = { 2, 2, 2 }, .inner = 0.2, .outer = 0.6, .reference = 0.5 };
	const struct psr_scene scene = scene_of(0, &light, 1);

	(void)state;
	mesh->material->is_specular_glossiness = 1;
	v3f_set(mesh->material->specular, 0, 0, 0);
	mesh->material->glossiness = 0;
	for (int i = 0; i < 40; i++) {
		const double angle = 0.02 * i, cosine = cos(angle);
		const double t = (cosine - cos(0.6)) / (cos(0.2) - cos(0.6));
		const double edge = angle > 0.6 ? 0 : angle < 0.2 ? 1 : t * t * (3 - 2 * t);
		/* Intensity 2 at a distance of 0.5; Schlick's 90 degrees shine without an f0, too. */
		const double amount = 2 * 0.25 * cosine * cosine * edge, f = schlick(0, cos(angle / 2));
		const double expected = amount * ((1 - f) * cosine + f * ggx(1, cos(angle / 2), cosine, 1));
		float got[3];

		light_at(mesh, &scene, tan(angle), 0, NULL, got);
		assert_near((double)got[2], expected, FLOATS);
	}
	meshes_free(mesh);
}

/* A map of one normal: by 45 degrees towards +x, then towards +y, which is up in the image. */
static void normal_maps_tilt_towards_x_and_up(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);

	(void)state;
	mesh->material->metallic = 1;
	mesh->material->roughness = 0.5f;
	for (int axis = 0; axis < 2; axis++)
		for (int has_tangents = 0; has_tangents < 2; has_tangents++) {
			uint8_t texel[4] = { 128, 128, 218, 255 };
			double normal[3], to_light[3] = { 0, 0, 0.8 }, h[3];
			const double eye[3] = { 0, 0, 1 };

			texel[axis] = 218;
			to_light[axis] = 0.6;
			for (int k = 0; k < 3; k++)
				normal[k] = texel[k] / 127.5 - 1;
			v3d_normalize(normal, normal);
			if (mesh->image == NULL) {
				meshes_texture(mesh, 1, 1, texel);
				mesh->material->normal_texture = mesh->material->base_texture;
				mesh->material->base_texture.image = -1;
			}
			memcpy(mesh->image->rgba, texel, 4);
			if (has_tangents)
				mesh->tangent = calloc(mesh->n_vertices, sizeof *mesh->tangent);
			for (uint32_t i = 0; has_tangents && i < mesh->n_vertices; i++)
				mesh->tangent[i][0] = mesh->tangent[i][3] = 1;
			const struct psr_light light = sun(-to_light[0], -to_light[1], -to_light[2]);
			const struct psr_scene scene = scene_of(0, &light, 1);
			float got[3];
			light_at(mesh, &scene, 0, 0, NULL, got);
			v3d_add(h, to_light, eye);
			v3d_normalize(h, h);
			const double expected = ggx(0.25, v3d_dot(normal, h), v3d_dot(normal, to_light), normal[2]);
			assert_near((double)got[0], expected, expected * FLOATS);
			free(mesh->tangent);
			mesh->tangent = NULL;
		}
	meshes_free(mesh);
}

static void obj_s_highlight_is_added_by_the_half_way_angle(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	const struct psr_light light = sun(-0.6, 0, -0.8);
	const struct psr_scene scene = scene_of(0.5, &light, 1);
	float got[3];

	(void)state;
	for (int c = 0; c < 3; c++)
		mesh->material->base_color[c] = 0.25f;
	mesh->material->is_phong = 1;
	v3f_set(mesh->material->phong, 0.5f, 2, 0);
	mesh->material->phong_exponent = 40;
	light_at(mesh, &scene, 0, 0, NULL, got);
	/* The half-way vector of (0, 0, 1) and (0.6, 0, 0.8) is at half of their angle: its cosine is sqrt(0.9). */
	const double shine = pow(0.9, 20);
	assert_near((double)got[0], 0.25 * (0.5 + 0.8) + 0.5 * shine, FLOATS);
	assert_near((double)got[1], 0.25 * (0.5 + 0.8) + 2 * shine, FLOATS);
	meshes_free(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_rough_plane_lit_head_on_has_the_light_of_gltf),
		cmocka_unit_test(planes_at_all_angles_follow_the_closed_formula),
		cmocka_unit_test(fresnel_is_4_percent_at_0_degrees_and_all_at_90),
		cmocka_unit_test(a_highlight_on_a_sphere_has_its_place_width_and_peak),
		cmocka_unit_test(surroundings_give_what_their_lights_give),
		cmocka_unit_test(a_spot_is_full_inside_dark_outside_and_smooth_between),
		cmocka_unit_test(obj_s_highlight_is_added_by_the_half_way_angle),
		cmocka_unit_test(normal_maps_tilt_towards_x_and_up),
	};

	return cmocka_run_group_tests_name("source_light", tests, NULL, NULL);
}
