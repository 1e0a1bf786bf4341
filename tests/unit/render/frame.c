/* The five stages on analytic models: what is drawn is where the truth is, in the right colour, and always the same. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "base/vec.h"
#include "render/stages.h"
#include "tests/unit/lib/shapes.h"
#include "tests/unit/lib/threads.h"

struct picture { /* owns its planes */
	struct psr_frame frame;
};

static const struct shape_options GREY = { .resolution = 128, .diffuse = 0x6090c0, .scale = 1 };

static struct psr_instance place(const struct psr_model *model)
{
	return (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
}

static struct psr_camera perspective(double x, double y, double z, double fov_degrees)
{
	return (struct psr_camera){ .eye = { x, y, z }, .up = { 0, 1, 0 }, .fov_y = fov_degrees * 3.14159265358979 / 180 };
}

static struct psr_camera orthographic(double x, double y, double z, double height)
{
	return (struct psr_camera){ .eye = { x, y, z },
		                        .up = { 0, 1, 0 },
		                        .kind = PSR_CAMERA_ORTHOGRAPHIC,
		                        .ortho_height = height };
}

static void draw(struct picture *p, const struct psr_scene *scene, uint32_t w, uint32_t h, int n_threads)
{
	struct psr_renderer *renderer;
	struct render_settings settings;
	struct psr_pool *pool = NULL;
	struct psr_error err;
	render_settings_default(&settings, w, h);
	p->frame = (struct psr_frame){ .width = w, .height = h, .rgb = malloc(3 * w * h), .depth = malloc(4 * w * h) };
	assert_int_equal(psr_renderer_create(&renderer, NULL), 0);
	if (n_threads > 1)
		assert_int_equal(psr_pool_create(&pool, n_threads, NULL), PSR_OK);
	if (renderer_draw(renderer, scene, &settings, pool, &p->frame, &err))
		fail_msg("%s", err.text);
	psr_pool_destroy(pool);
	psr_renderer_destroy(renderer);
}

static void release(struct picture *p)
{
	free(p->frame.rgb);
	free(p->frame.depth);
}

static uint32_t pixel(const struct picture *p, uint32_t x, uint32_t y)
{
	const uint8_t *c = p->frame.rgb + 3 * (y * p->frame.width + x);
	return c[0] | (uint32_t)c[1] << 8 | (uint32_t)c[2] << 16;
}

static int same(const struct picture *a, const struct picture *b)
{
	size_t n = (size_t)a->frame.width * a->frame.height;
	return !memcmp(a->frame.rgb, b->frame.rgb, 3 * n) && !memcmp(a->frame.depth, b->frame.depth, 4 * n);
}

/* z' where the ray through a pixel's point (u, v) meets the unit sphere of radius r about the origin; inf outside. */
static double sphere_depth(const struct psr_camera *camera, double u, double v, uint32_t w, uint32_t h, double r)
{
	double distance = camera->eye[2]; /* the tests look along -z */
	if (camera->kind == PSR_CAMERA_ORTHOGRAPHIC) {
		double x = (u - w / 2.0) * camera->ortho_height / h, y = (v - h / 2.0) * camera->ortho_height / h;
		double d = r * r - x * x - y * y;
		return d >= 0 ? distance - sqrt(d) : INFINITY;
	}
	double f = h / 2.0 / tan(camera->fov_y / 2), x = (u - w / 2.0) / f, y = (v - h / 2.0) / f;
	double a = x * x + y * y + 1, d = distance * distance - a * (distance * distance - r * r);
	return d >= 0 ? (distance - sqrt(d)) / a : INFINITY;
}

/* Every pixel whose truth is there all over itself and `reach` pixels around must be drawn, within the range of the
 * depths there, grown by `slack`; every pixel with no truth in that neighbourhood must be empty. */
static void check_sphere(const struct psr_camera *camera, uint32_t side, double reach, double slack)
{
	struct psr_model *model = shape_build(&GREY, 0.95);
	struct psr_instance instance = place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 }, .camera = *camera };
	struct picture p;
	draw(&p, &scene, side, side, 1);
	unsigned holes = 0, stray = 0, wrong = 0;
	for (uint32_t y = 0; y < side; y++)
		for (uint32_t x = 0; x < side; x++) {
			double low = INFINITY, high = -INFINITY;
			for (int i = 0; i < 64; i++) {
				double u = x - reach + (1 + 2 * reach) * (i % 8) / 7, v = y - reach + (1 + 2 * reach) * (i / 8) / 7;
				double t = sphere_depth(camera, u, v, side, side, 0.95);
				low = fmin(low, t);
				high = fmax(high, t);
			}
			double z = (double)p.frame.depth[y * side + x];
			if (isinf(low))
				stray += !isinf(z);
			else if (!isinf(high) && isinf(z))
				holes++;
			else if (!isinf(high) && (z < low - slack || z > high + slack))
				wrong++;
		}
	if (holes || stray || wrong)
		fail_msg("%u holes, %u stray pixels, %u wrong depths", holes, stray, wrong);
	release(&p);
	psr_model_unref(model);
}

static void sphere_at_magnification_one_has_no_holes(void **state)
{
	(void)state;
	/* No level but the picture itself is in use: samples are where they are, and depth is off by its quantisation. */
	struct psr_camera camera = orthographic(0, 0, 4, 2);
	check_sphere(&camera, 128, 0.25, 0.0001);
	camera = perspective(0, 0, 5, 30);
	check_sphere(&camera, 128, 0.25, 0.0001);
}

static void magnified_sphere_is_filled(void **state)
{
	(void)state;
	/* At level k a cell has 2^k pixels: edges grow by so much at most ([G] 4.6), and a filled pixel's depth is that of
	 * samples within two cells. */
	struct psr_camera camera = orthographic(0, 0, 4, 2);
	check_sphere(&camera, 200, 2, 0.02);
	check_sphere(&camera, 512, 4, 0.02);
	camera = perspective(0, 0, 5, 24);
	check_sphere(&camera, 128, 2, 0.02);
	camera = perspective(0, 0, 3, 40);
	check_sphere(&camera, 700, 8, 0.02);
}

static void ambient_one_gives_the_flat_diffuse_colour(void **state)
{
	(void)state;
	struct psr_model *model = shape_build(&GREY, 0.95);
	struct psr_instance instance = place(model);
	struct psr_scene scene = { .instance = &instance,
		                       .n_instances = 1,
		                       .ambient = { 1, 1, 1 },
		                       .background = { 1, 0, 0 },
		                       .camera = perspective(0, 0, 5, 24) };
	struct picture p;
	draw(&p, &scene, 300, 200, 1);
	assert_int_equal(pixel(&p, 150, 100), GREY.diffuse);
	assert_int_equal(pixel(&p, 150, 60), GREY.diffuse);
	assert_int_equal(pixel(&p, 0, 0), 0x0000ff);
	assert_true(p.frame.report.n_covered > 10000);
	assert_int_equal(p.frame.report.count[PSR_STAGE_RESOLVE], p.frame.report.n_covered);
	release(&p);
	psr_model_unref(model);
}

static void every_diffuse_code_survives(void **state)
{
	(void)state;
	for (uint32_t code = 0; code < 256; code += 5) {
		struct shape_options o = GREY;
		o.resolution = 16;
		o.diffuse = code | (255 - code) << 8 | (code ^ 0x55) << 16;
		struct psr_model *model = shape_build(&o, 0);
		struct psr_instance instance = place(model);
		struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 },
			                       .camera = orthographic(0, 0, 3, 2) };
		struct picture p;
		draw(&p, &scene, 16, 16, 1);
		assert_int_equal(pixel(&p, 8, 8), o.diffuse);
		release(&p);
		psr_model_unref(model);
	}
}

static void threads_draw_the_same_bytes(void **state)
{
	(void)state;
	struct psr_model *model = shape_build(&GREY, 0.95);
	struct psr_instance instance[3] = { place(model), place(model), place(model) };
	instance[1].translation[0] = 1.3;
	instance[1].scale = 0.7;
	instance[2].translation[2] = 2;
	instance[2].rotation[1] = sin(0.3);
	instance[2].rotation[3] = cos(0.3);
	struct psr_light light[2] = {
		{ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -1, -1, -1 }, .color = { 0.7, 0.7, 0.7 } },
		{ .kind = PSR_LIGHT_SPOT,
		  .position = { 3, 3, 3 },
		  .direction = { -1, -1, -1 },
		  .color = { 1, 1, 0 },
		  .inner = 0.2,
		  .outer = 0.4 },
	};
	struct psr_scene scene = { .instance = instance, .n_instances = 3, .light = light, .n_lights = 2,
		                       .camera = perspective(0.5, 1, 6, 40) };
	struct picture one, many;
	draw(&one, &scene, 700, 500, 1);
	for (int n = 2; n <= 5; n++) {
		draw(&many, &scene, 700, 500, n);
		assert_true(same(&one, &many));
		release(&many);
	}
	release(&one);
	psr_model_unref(model);
}

static void scaling_the_world_by_a_power_of_two_changes_no_colour(void **state)
{
	(void)state;
	static const int exponents[] = { -60, -7, 5, 60 };
	struct psr_light light = { .kind = PSR_LIGHT_POINT, .position = { 3, 2, 4 }, .color = { 1, 1, 1 }, .reference = 2 };
	struct picture unit = { 0 };
	for (int i = -1; i < 4; i++) {
		double s = i < 0 ? 1 : ldexp(1, exponents[i]);
		struct shape_options o = GREY;
		o.scale = s;
		o.origin[0] = 0.25 * s;
		o.metallic = 15;
		o.roughness = 80;
		struct psr_model *model = shape_build(&o, 0.95);
		struct psr_instance instance = place(model);
		struct psr_light here = light;
		struct psr_camera camera = perspective(0, s, 5 * s, 30);
		for (int k = 0; k < 3; k++)
			here.position[k] *= s;
		here.reference *= s;
		struct psr_scene scene = { .instance = &instance,
			                       .n_instances = 1,
			                       .light = &here,
			                       .n_lights = 1,
			                       .camera = camera };
		struct picture p;
		draw(&p, &scene, 200, 150, 1);
		if (i < 0) {
			unit = p;
		} else {
			assert_memory_equal(p.frame.rgb, unit.frame.rgb, 3 * 200 * 150);
			for (int k = 0; k < 200 * 150; k++)
				assert_true(p.frame.depth[k] == ldexpf(unit.frame.depth[k], exponents[i]));
			release(&p);
		}
		psr_model_unref(model);
	}
	release(&unit);
}

static void survey_coordinates_lose_nothing(void **state)
{
	(void)state;
	/* The origin of a model in survey coordinates; powers of two apart from it, so that the subtraction is exact. */
	static const double far[3] = { 4194304, 262144, -8388608 };
	struct picture near_by, away;
	for (int i = 0; i < 2; i++) {
		struct shape_options o = GREY;
		struct psr_camera camera = perspective(0, 1, 5, 30);
		for (int k = 0; k < 3; k++) {
			o.origin[k] = i * far[k];
			camera.eye[k] += i * far[k];
			camera.target[k] = i * far[k];
		}
		struct psr_model *model = shape_build(&o, 0.95);
		struct psr_instance instance = place(model);
		struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 }, .camera = camera };
		draw(i ? &away : &near_by, &scene, 200, 150, 1);
		psr_model_unref(model);
	}
	assert_true(same(&near_by, &away));
	release(&near_by);
	release(&away);
}

static void nearer_instances_hide_what_is_behind(void **state)
{
	(void)state;
	struct shape_options red = GREY, blue = GREY;
	red.diffuse = 0x0000ff;
	blue.diffuse = 0xff0000;
	struct psr_model *a = shape_build(&red, 0.95), *b = shape_build(&blue, 0.95);
	struct psr_instance instance[2] = { place(a), place(b) };
	for (int nearer = 0; nearer < 2; nearer++) {
		instance[nearer].translation[2] = 1;
		instance[!nearer].translation[2] = -1;
		/* From far to so close that every level is in use: nothing of the far one may shine through. */
		for (double z = 9; z > 2.2; z -= 1.3) {
			struct psr_scene scene = { .instance = instance, .n_instances = 2, .ambient = { 1, 1, 1 },
				                       .camera = perspective(0, 0, z, 20) };
			struct picture p;
			draw(&p, &scene, 160, 160, 2);
			for (uint32_t y = 60; y < 100; y++)
				for (uint32_t x = 60; x < 100; x++)
					assert_int_equal(pixel(&p, x, y), nearer ? 0xff0000 : 0x0000ff);
			release(&p);
		}
	}
	psr_model_unref(a);
	psr_model_unref(b);
}

static void one_sided_squares_have_no_back_and_two_sided_ones_do(void **state)
{
	(void)state;
	struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0, 0, 1 }, .color = { 1, 1, 1 } };
	for (int two_sided = 0; two_sided < 2; two_sided++) {
		struct shape_options o = GREY;
		o.two_sided = two_sided;
		struct psr_model *model = shape_build(&o, 0);
		struct psr_instance instance = place(model);
		struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
			                       .camera = perspective(0, 0, -4, 24) };
		struct picture p;
		draw(&p, &scene, 128, 128, 1);
		/* Seen from behind, lit from behind: the two-sided one has its normals turned and shows its colour. */
		if (two_sided) {
			uint32_t c = pixel(&p, 64, 64);
			for (int k = 0; k < 24; k += 8) /* the normal is quantised: cos 0.7 degrees of the light is left at least */
				assert_in_range((c >> k & 255) + 1, GREY.diffuse >> k & 255, (GREY.diffuse >> k & 255) + 1);
		} else {
			assert_int_equal(pixel(&p, 64, 64), 0);
			assert_int_equal(p.frame.report.n_covered, 0);
		}
		release(&p);
		psr_model_unref(model);
	}
}

static void cones_cull_the_back_of_a_solid_and_change_no_pixel(void **state)
{
	(void)state;
	for (int i = 0; i < 4; i++) {
		struct picture without, with;
		for (int cones = 0; cones < 2; cones++) {
			struct shape_options o = GREY;
			o.cones = cones;
			struct psr_model *model = shape_build(&o, 0.95);
			struct psr_instance instance = place(model);
			struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL,
				                       .direction = { -1, -1, -1 },
				                       .color = { 1, 1, 1 } };
			struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
				                       .camera = i % 2 ? orthographic(0, i, 4, 2) : perspective(1, 2 - i, 5, 30) };
			draw(cones ? &with : &without, &scene, 128, 128, 1);
			psr_model_unref(model);
		}
		assert_true(same(&without, &with));
		assert_int_equal(without.frame.report.n_blocks_drawn, without.frame.report.n_blocks);
		assert_in_range(with.frame.report.n_blocks_drawn, with.frame.report.n_blocks * 2 / 5,
		                with.frame.report.n_blocks * 3 / 4);
		release(&without);
		release(&with);
	}
}

static void one_sided_squares_are_seen_through_from_behind(void **state)
{
	(void)state;
	struct shape_options red = GREY, blue = GREY;
	red.cones = blue.cones = 1;
	red.diffuse = 0x0000ff;
	blue.diffuse = 0xff0000;
	struct psr_model *square = shape_build(&red, 0), *ball = shape_build(&blue, 0.5);
	struct psr_instance instance[2] = { place(square), place(ball) };
	instance[0].translation[2] = -1; /* its back is to the camera, the ball behind it */
	struct psr_scene scene = { .instance = instance, .n_instances = 2, .ambient = { 1, 1, 1 },
		                       .camera = perspective(0, 0, -4, 24) };
	struct picture p;
	draw(&p, &scene, 128, 128, 1);
	assert_int_equal(pixel(&p, 64, 64), 0xff0000);
	assert_int_equal(pixel(&p, 20, 64), 0);
	release(&p);
	psr_model_unref(square);
	psr_model_unref(ball);
}

struct facet {
	double base, metallic, reflectance, open, roughness;
};

/* GGX, Smith and Schlick over Lambert as published, of light along l seen from (0, 0, 1); and that of ambient light by
 * the fit of surface/lobe.h. */
static double reflected(const struct facet *f, const double n[3], const double l[3])
{
	const double nl = v3d_dot(n, l), nv = n[2], alpha2 = fmax(pow(f->roughness, 4), 4e-6);
	const double mirrors = f->metallic > 0 || f->reflectance > 0;
	const double f0 = f->reflectance * (1 - f->metallic) + f->base * f->metallic;
	double h[3] = { l[0], l[1], l[2] + 1 };

	v3d_normalize(h, h);
	const double nh = v3d_dot(n, h), schlick = mirrors * pow(1 - h[2], 5);
	const double d = mirrors * alpha2 / pow(nh * nh * (alpha2 - 1) + 1, 2); /* times pi */
	const double v = 0.5 / (nl * sqrt(alpha2 + (1 - alpha2) * nv * nv) + nv * sqrt(alpha2 + (1 - alpha2) * nl * nl));
	const double diffuse = f->base * (1 - f->metallic) * (1 - f->reflectance) * (1 - schlick);
	return nl > 0 ? nl * (diffuse + d * v * (f0 + (1 - f0) * schlick)) : 0;
}

static double reflected_ambient(const struct facet *f, const double n[3])
{
	const double v = n[2], w = f->roughness * f->roughness, s = 1 - f->roughness;
	const double f0 = f->reflectance * (1 - f->metallic) + f->base * f->metallic;
	const double grazing = f0 > 0 ? s * pow(1 - v, 3) * (0.27 + 0.8 * s * s * (1 - v) * (1 - v)) : 0;
	const double whole = 1 / (1 + w * (0.42 + 1.05 * v - 1.87 * v * v) + w * w * (-0.45 + 1.83 * v + 1.17 * v * v));

	return f->open * (f->base * (1 - f->metallic) * (1 - f->reflectance) + f0 * (whole - grazing) + grazing);
}

/* The square's middle against that. */
static void draw_lit(const struct shape_options *o)
{
	struct psr_model *model = shape_build(o, 0);
	struct psr_instance instance = place(model);
	static const struct psr_light lights[] = {
		{ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -1, 0, -2 }, .color = { 0.3, 0.3, 0.3 } },
		{ .kind = PSR_LIGHT_POINT, .position = { 1, 1, 3 }, .color = { 0.3, 0.3, 0.3 } },
		{ .kind = PSR_LIGHT_POINT, .position = { 1, 1, 3 }, .color = { 0.3, 0.3, 0.3 }, .reference = 2 },
		{ .kind = PSR_LIGHT_SPOT, .position = { 0, 1, 2 }, .direction = { 0, -1, -2 }, .color = { 0.3, 0.3, 0.3 },
		  .inner = 0.3, .outer = 0.5 },
		{ .kind = PSR_LIGHT_SPOT, .position = { 0, 1, 2 }, .direction = { 0, 0, -1 }, .color = { 0.3, 0.3, 0.3 },
		  .inner = 0.3, .outer = 0.4 },
		{ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0, 0, 1 }, .color = { 1, 1, 1 } },
	};
	for (unsigned i = 0; i < sizeof lights / sizeof *lights; i++) {
		const struct psr_light *l = &lights[i];
		struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = l, .n_lights = 1,
			                       .ambient = { 0.1, 0.1, 0.1 }, .camera = perspective(0, 0, 5, 16) };
		struct picture p;
		draw(&p, &scene, 101, 101, 1); /* the middle of pixel (50, 50) is the square's */
		double L[3], length = 0, amount = 1;
		for (int k = 0; k < 3; k++) {
			L[k] = l->kind == PSR_LIGHT_DIRECTIONAL ? -l->direction[k] : l->position[k];
			length += L[k] * L[k];
		}
		length = sqrt(length);
		for (int k = 0; k < 3; k++)
			L[k] /= length;
		if (l->reference > 0)
			amount = l->reference * l->reference / (length * length);
		if (i == 4) /* 26.6 degrees off the axis, beyond 0.4 radians */
			amount = 0;
		const struct facet facet = { (double)psr_srgb_to_linear[o->diffuse & 255], o->metallic / 31.0,
			                         o->reflectance * o->reflectance / 900.0, 1 - o->shut / 63.0, o->roughness / 255.0 };
		/* The stored normal is off by up to 0.7 degrees, and the sample by a pixel: the range of light over normals that
		 * are off by so much; half a code at the end. */
		double low = INFINITY, high = 0, got = (double)psr_srgb_to_linear[pixel(&p, 50, 50) & 255];
		for (int turn = 0; turn < 17; turn++) {
			const double off = turn ? 0.0125 : 0, n[3] = { off * cos(turn * 0.3927), off * sin(turn * 0.3927), 1 };
			const double light = 0.3 * amount * reflected(&facet, n, L) + 0.1 * reflected_ambient(&facet, n);

			low = fmin(low, light);
			high = fmax(high, light);
		}
		if (got < low - 0.002 - 0.01 * low || got > high + 0.002 + 0.01 * high)
			fail_msg("light %u: %g, expected %g to %g", i, got, low, high);
		release(&p);
	}
	psr_model_unref(model);
}

static void lights_follow_the_lobe(void **state)
{
	(void)state;
	struct shape_options o = GREY;
	o.diffuse = 0x404040;
	draw_lit(&o);
	o.reflectance = 6;
	o.roughness = 100;
	draw_lit(&o);
	o.metallic = 31;
	o.roughness = 180;
	draw_lit(&o);
	o.metallic = 11;
	o.reflectance = 14;
	o.shut = 40;
	draw_lit(&o);
}

/* Head on, rough white is 0.96 + 0.04 / 4 of its light, and grey of 0.5 is 0.48 + 0.01. */
static void rough_surfaces_add_no_light(void **state)
{
	(void)state;
	static const struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0, 0, -1 },
		                                    .color = { 1, 1, 1 } };
	struct shape_options o = GREY;
	o.reflectance = 6;
	o.roughness = 255;
	for (int i = 0; i < 2; i++) {
		const uint32_t code = i ? 255 : 188;
		const double expected = (double)psr_srgb_to_linear[code] * 0.96 + 0.01;

		o.diffuse = code * 0x10101;
		struct psr_model *model = shape_build(&o, 0);
		struct psr_instance instance = place(model);
		struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
			                       .camera = perspective(0, 0, 5, 16) };
		struct picture p;
		draw(&p, &scene, 101, 101, 1);
		/* A code at most; the stored normal takes a cosine of 0.7 degrees, 1e-4. */
		assert_in_range((pixel(&p, 50, 50) & 255) + 1, psr_linear_to_srgb((float)expected),
		                psr_linear_to_srgb((float)expected) + 2u);
		release(&p);
		psr_model_unref(model);
	}
}

static void hard_cameras_draw_something_or_nothing(void **state)
{
	(void)state;
	struct psr_model *model = shape_build(&GREY, 0.95);
	struct psr_instance instance = place(model);
	const struct psr_camera cameras[] = {
		perspective(0, 0, 0.1, 179), perspective(0, 0, 1e12, 0.001), perspective(0, 0, 1e-12, 90),
		perspective(0, 0, 0.9500001, 60), orthographic(0, 0, 0.1, 1e-6), orthographic(0, 0, 1e9, 1e12),
	};
	static const uint32_t sizes[][2] = { { 1, 1 }, { 3, 500 }, { 257, 129 }, { 2000, 2 } };
	for (unsigned i = 0; i < sizeof cameras / sizeof *cameras; i++)
		for (unsigned k = 0; k < 4; k++) {
			struct psr_scene scene = { .instance = &instance,
				                       .n_instances = 1,
				                       .ambient = { 1, 1, 1 },
				                       .camera = cameras[i] };
			struct picture p;
			draw(&p, &scene, sizes[k][0], sizes[k][1], 1);
			for (uint32_t at = 0; at < sizes[k][0] * sizes[k][1]; at++)
				assert_true(p.frame.depth[at] > 0);
			release(&p);
		}
	psr_model_unref(model);
}

static void an_empty_scene_is_background(void **state)
{
	(void)state;
	struct psr_scene scene = { .background = { 0, 0, 1 }, .camera = perspective(0, 0, 5, 24) };
	struct picture p;
	draw(&p, &scene, 33, 9, 1);
	for (uint32_t i = 0; i < 33 * 9; i++) {
		assert_int_equal(pixel(&p, i % 33, i / 33), 0xff0000);
		assert_true(isinf(p.frame.depth[i]));
	}
	release(&p);
}

static void the_door_refuses_what_is_out_of_range(void **state)
{
	(void)state;
	struct psr_model *model = shape_build(&GREY, 0);
	struct psr_instance instance = place(model);
	struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0, 0, -1 }, .color = { 1, 1, 1 } };
	const struct psr_scene good = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
		                            .camera = perspective(0, 0, 5, 24) };
	struct psr_error err;
	assert_int_equal(psr_scene_validate(&good, &err), 0);
	struct psr_scene bad = good;
	bad.camera.eye[1] = NAN;
	assert_int_equal(psr_scene_validate(&bad, &err), PSR_ERR_ARG);
	bad = good;
	bad.camera.eye[2] = 0;
	assert_int_equal(psr_scene_validate(&bad, &err), PSR_ERR_ARG);
	bad = good;
	memcpy(bad.camera.up, (double[]){ 0, 0, 3 }, sizeof bad.camera.up);
	assert_int_equal(psr_scene_validate(&bad, &err), PSR_ERR_ARG);
	bad = good;
	bad.camera.fov_y = 3.2;
	assert_int_equal(psr_scene_validate(&bad, &err), PSR_ERR_ARG);
	bad = good;
	bad.n_lights = PSR_MAX_LIGHTS + 1;
	assert_int_equal(psr_scene_validate(&bad, &err), PSR_ERR_LIMIT);
	bad = good;
	light.direction[2] = 0;
	assert_int_equal(psr_scene_validate(&bad, &err), PSR_ERR_ARG);
	light.direction[2] = -1;
	light.color[0] = INFINITY;
	assert_int_equal(psr_scene_validate(&bad, &err), PSR_ERR_ARG);
	light.color[0] = 1;
	instance.rotation[3] = 2;
	assert_int_equal(psr_scene_validate(&bad, &err), PSR_ERR_ARG);
	instance.rotation[3] = 1;
	instance.scale = 0;
	assert_int_equal(psr_scene_validate(&bad, &err), PSR_ERR_ARG);
	instance.scale = 1;

	struct psr_renderer *renderer;
	struct render_settings settings;
	struct psr_frame frame = { .width = 0 };
	assert_int_equal(psr_renderer_create(&renderer, NULL), 0);
	render_settings_default(&settings, 0, 10);
	assert_int_equal(renderer_draw(renderer, &good, &settings, NULL, &frame, &err), PSR_ERR_ARG);
	render_settings_default(&settings, 100000, 100000);
	assert_int_equal(renderer_draw(renderer, &good, &settings, NULL, &frame, &err), PSR_ERR_LIMIT);
	render_settings_default(&settings, 10, 10);
	settings.spacing_px = 0;
	assert_int_equal(renderer_draw(renderer, &good, &settings, NULL, &frame, &err), PSR_ERR_ARG);
	render_settings_default(&settings, 10, 10);
	settings.gap_method = (enum psr_gap_method)7;
	assert_int_equal(renderer_draw(renderer, &good, &settings, NULL, &frame, &err), PSR_ERR_ARG);
	psr_renderer_destroy(renderer);
	psr_model_unref(model);
}

static void framing_shows_the_whole_box(void **state)
{
	(void)state;
	static const double low[3] = { 10, 20, 30 }, high[3] = { 14, 21, 33 };
	static const double aspects[] = { 0.3, 1, 2.5 };
	static const double ups[][3] = { { 0, 1, 0 }, { 0, 0, 1 }, { 2, 0, 0 }, { 0, -3, 0 }, { 0.3, -0.5, 0.7 } };
	for (int i = 0; i < 30; i++) {
		struct psr_camera c;
		const double aspect = aspects[i / 2 % 3], fov = i % 2 ? 0.6 : 0;
		psr_camera_frame(&c, low, high, ups[i / 6], fov, aspect);
		double forward[3], right[3], down[3];
		v3d_sub(forward, c.target, c.eye);
		v3d_normalize(forward, forward);
		v3d_cross(right, forward, c.up);
		v3d_normalize(right, right);
		v3d_cross(down, forward, right);
		for (int corner = 0; corner < 8; corner++) {
			double p[3];
			for (int k = 0; k < 3; k++)
				p[k] = (corner >> k & 1 ? high : low)[k] - c.eye[k];
			const double z = v3d_dot(p, forward), reach = fov > 0 ? tan(fov / 2) * z : c.ortho_height / 2;
			assert_true(z > c.near_z);
			assert_true(fabs(v3d_dot(p, down)) <= reach * (1 + 1e-12));
			assert_true(fabs(v3d_dot(p, right)) <= reach * aspect * (1 + 1e-12));
		}
	}
}

static void views_from_the_front_are_what_formats_call_it(void **state)
{
	(void)state;
	/* glTF looks at +z with +y up; CAD and surveys at -y with +z up. */
	static const double up[2][3] = { { 0, 5, 0 }, { 0, 0, 0.1 } }, front[2][3] = { { 0, 0, 1 }, { 0, -1, 0 } };
	for (int i = 0; i < 2; i++) {
		double axes[3][3];
		psr_camera_axes(axes, up[i]);
		for (int k = 0; k < 3; k++) {
			assert_true(axes[0][k] == (k == 0));
			assert_true(axes[2][k] == front[i][k]);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sphere_at_magnification_one_has_no_holes),
		cmocka_unit_test(magnified_sphere_is_filled),
		cmocka_unit_test(ambient_one_gives_the_flat_diffuse_colour),
		cmocka_unit_test(every_diffuse_code_survives),
		cmocka_unit_test(threads_draw_the_same_bytes),
		cmocka_unit_test(scaling_the_world_by_a_power_of_two_changes_no_colour),
		cmocka_unit_test(survey_coordinates_lose_nothing),
		cmocka_unit_test(nearer_instances_hide_what_is_behind),
		cmocka_unit_test(one_sided_squares_have_no_back_and_two_sided_ones_do),
		cmocka_unit_test(cones_cull_the_back_of_a_solid_and_change_no_pixel),
		cmocka_unit_test(one_sided_squares_are_seen_through_from_behind),
		cmocka_unit_test(lights_follow_the_lobe),
		cmocka_unit_test(rough_surfaces_add_no_light),
		cmocka_unit_test(hard_cameras_draw_something_or_nothing),
		cmocka_unit_test(an_empty_scene_is_background),
		cmocka_unit_test(the_door_refuses_what_is_out_of_range),
		cmocka_unit_test(framing_shows_the_whole_box),
		cmocka_unit_test(views_from_the_front_are_what_formats_call_it),
	};
	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}
