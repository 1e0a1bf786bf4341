/* What a link tells of the surface at a place: the plane *normal* of a frame, and the instance. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/vec.h"
#include "daemon.h"

static struct link_instance instance[2];
static struct link_wish wish;

static void ask(struct link_surface *surface, double x, double y)
{
	const uint32_t size[2] = { wish.width, wish.height };
	const uint64_t number = link_probe(link_, &wish.camera, size, (const double[2]){ x, y });
	const int64_t end = clock_ms() + PATIENCE_MS;

	for (;;) {
		link_probed(link_, surface);
		if (surface->number == number)
			return;
		if (clock_ms() > end)
			fail_msg("no answer for the place %g,%g", x, y);
		wait_news(20);
	}
}

/* Of a smooth surface, seen by the same camera in full: neighbouring samples differ by some degrees at most. */
static void is_the_normal_of_the_frame(enum psr_camera_kind kind)
{
	unsigned n_samples = 0, n_compared = 0, n_close = 0;
	struct psr_frame here;

	wish_default(&wish, instance, "teapot");
	wish.camera.kind = kind;
	wish.camera.ortho_height = kind == PSR_CAMERA_ORTHOGRAPHIC ? 8 : 0;
	if (kind == PSR_CAMERA_ORTHOGRAPHIC)
		wish.camera.fov_y = 0;
	open_link(address);
	say_wish(&wish);
	link_release(wait_sharp());
	wish.planes = 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_NORMAL | 1u << PSR_PLANE_ID;
	wish.is_smooth = 0;
	draw_here(&here, &wish);
	for (size_t i = 0; i < (size_t)wish.width * wish.height; i++) {
		struct link_surface surface;
		double normal[3];

		if (here.id[i] == UINT32_MAX || n_samples++ % 53 != 0)
			continue;
		ask(&surface, (double)(i % wish.width) + 0.5, (double)(i / wish.width) + 0.5);
		assert_int_equal(surface.has_surface, 1);
		assert_int_equal(surface.instance, 0);
		for (size_t c = 0; c < 3; c++)
			normal[c] = here.normal[3 * i + c];
		v3d_normalize(normal, normal);
		n_compared++;
		n_close += v3d_dot(normal, surface.normal) > 0.97;
	}
	assert_true(n_compared >= 10);
	assert_true(n_close >= n_compared * 9 / 10); /* others are at edges, where a pixel decides */
	psr_frame_free(&here);
	link_close(link_);
}

static void a_normal_is_that_of_the_frame(void **state)
{
	(void)state;
	is_the_normal_of_the_frame(PSR_CAMERA_PERSPECTIVE);
}

static void so_it_is_without_perspective(void **state)
{
	(void)state;
	is_the_normal_of_the_frame(PSR_CAMERA_ORTHOGRAPHIC);
}

static void nothing_is_where_nothing_is(void **state)
{
	struct link_surface surface;

	(void)state;
	wish_default(&wish, instance, "teapot");
	open_link(address);
	say_wish(&wish);
	link_release(wait_sharp());
	ask(&surface, 2.5, 2.5);
	assert_int_equal(surface.has_surface, 0);
	link_close(link_);
}

/* Two of them, one before the other. */
static void the_instance_is_the_one_in_front(void **state)
{
	struct link_surface surface;

	(void)state;
	wish_default(&wish, instance, "teapot");
	instance[1] = instance[0];
	instance[1].translation[2] = 5;
	wish.n_instances = 2;
	open_link(address);
	say_wish(&wish);
	link_release(wait_sharp());
	ask(&surface, 160.5, 120.5);
	assert_int_equal(surface.has_surface, 1);
	assert_int_equal(surface.instance, 1);
	instance[1].translation[2] = -5;
	say_wish(&wish);
	link_release(wait_sharp()); /* a probe asks about what was drawn last */
	ask(&surface, 160.5, 120.5);
	assert_int_equal(surface.instance, 0);
	link_close(link_);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_normal_is_that_of_the_frame),
		cmocka_unit_test(so_it_is_without_perspective),
		cmocka_unit_test(nothing_is_where_nothing_is),
		cmocka_unit_test(the_instance_is_the_one_in_front),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
