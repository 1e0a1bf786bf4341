/* What is at a place of the screen: of a plane drawn by hand, seen by the camera of the picture and by others. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "client/view/lens.h"
#include "client/view/link_inside.h"
#include "client/view/show.h"

#define WIDTH 160
#define HEIGHT 120

static const struct psr_camera camera = { .eye = { 0, 0, 5 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_PERSPECTIVE,
	                                      .fov_y = 0.6, .near_z = 0.1 };
static const double normal[3] = { 0.6, 0, 0.8 };

/* The plane through 0,0,0 with that normal; nothing is in the upper third. */
static struct link_picture *draw_plane(void)
{
	struct link_pictures *pictures;
	struct link_picture *picture;
	struct lens lens;

	assert_int_equal(link_pictures_create(&pictures), PSR_OK);
	picture = link_pictures_get(pictures, WIDTH, HEIGHT, 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH);
	link_pictures_unref(pictures);
	assert_non_null(picture);
	picture->camera = picture->begin.camera = camera;
	lens_init(&lens, &camera, WIDTH, HEIGHT);
	for (int i = 0; i < WIDTH * HEIGHT; i++) {
		double point[3], way[3];

		lens_point(&lens, i % WIDTH + 0.5, i / WIDTH + 0.5, 1, point);
		v3d_sub(way, point, camera.eye);
		picture->frame.depth[i] = i / WIDTH < HEIGHT / 3
		                              ? INFINITY
		                              : (float)(-v3d_dot(normal, camera.eye) / v3d_dot(normal, way));
		memset(picture->frame.rgb + 3 * i, i % 251, 3);
	}
	return picture;
}

static struct view_show *show_plane(const struct psr_camera *as)
{
	struct view_show *show;
	struct view_shown shown;

	assert_int_equal(view_show_create(&show, 1, NULL), PSR_OK);
	assert_int_equal(view_show_take(show, draw_plane(), NULL, NULL), PSR_OK);
	assert_non_null(view_show_draw(show, as, WIDTH, HEIGHT, &shown, NULL));
	assert_int_equal(shown.is_exact, as == &camera);
	return show;
}

static void at_rest_the_screen_is_the_picture(void **unused)
{
	struct view_show *show;
	struct view_shown shown;
	const struct psr_frame *frame;

	(void)unused;
	show = show_plane(&camera);
	frame = view_show_draw(show, &camera, WIDTH, HEIGHT, &shown, NULL);
	assert_memory_equal(frame->rgb, view_show_picture(show)->frame.rgb, 3 * WIDTH * HEIGHT);
	view_show_destroy(show);
}

/* Depth is a float: half of its last bit is 3e-8 of it, and the plane is leant by 37 degrees at most 45 against it. */
static void a_probe_finds_the_plane(void **unused)
{
	struct psr_camera turned = camera;

	(void)unused;
	turned.eye[0] = 0.4;
	turned.eye[1] = 0.2;
	for (int k = 0; k < 2; k++) {
		struct view_show *show = show_plane(k ? &turned : &camera);

		for (int y = HEIGHT / 2; y < HEIGHT - 20; y += 7) {
			for (int x = 20; x < WIDTH - 20; x += 11) {
				struct view_probe probe;
				struct lens lens;
				double at[2], depth;

				view_show_probe(show, x + 0.5, y + 0.5, &probe);
				assert_true(probe.has_surface);
				lens_init(&lens, k ? &turned : &camera, WIDTH, HEIGHT);
				assert_true(lens_project(&lens, probe.point, at, &depth));
				assert_true(fabs(depth / probe.depth - 1) < 1e-12);
				/* Of another camera: the pixel of the picture that is seen there, which is a pixel wide. */
				assert_true(fabs(at[0] - x - 0.5) < (k ? 1 : 1e-9) && fabs(at[1] - y - 0.5) < (k ? 1 : 1e-9));
				assert_true(fabs(v3d_dot(probe.point, normal)) < (k ? 0.03 : 1e-6));
			}
		}
		view_show_destroy(show);
	}
}

static void nothing_is_where_nothing_is(void **unused)
{
	struct view_show *show = show_plane(&camera);
	struct view_probe probe;

	(void)unused;
	view_show_probe(show, 80, 10, &probe);
	assert_int_equal(probe.has_surface, 0);
	view_show_probe(show, -3, 1000, &probe);
	assert_int_equal(probe.has_surface, 0);
	view_show_destroy(show);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(at_rest_the_screen_is_the_picture),
		cmocka_unit_test(a_probe_finds_the_plane),
		cmocka_unit_test(nothing_is_where_nothing_is),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
