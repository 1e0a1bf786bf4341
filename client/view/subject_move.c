/* Lights and instances by hand. Each change goes through the text that `psr shot` takes, so that it draws the same. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "base/maths.h"
#include "base/vec.h"
#include "subject.h"

static void turn(double v[3], const double axis[3], double angle)
{
	double cross[3], along = v3d_dot(axis, v), s = sin(angle), c = cos(angle);

	v3d_cross(cross, axis, v);
	for (int i = 0; i < 3; i++)
		v[i] = c * v[i] + s * cross[i] + (1 - c) * along * axis[i];
}

/* To the right and down, in pixels at the depth of this point; before a perspective eye at least. */
static void add_pixels(double to[3], const struct lens *lens, const double at[3], double right, double down)
{
	double arm[3], depth, pixel;

	v3d_sub(arm, at, lens->eye);
	depth = v3d_dot(arm, lens->forward);
	if (!(depth > 0)) /* behind the eye: as far away, but before it */
		depth = sqrt(v3d_dot(arm, arm));
	pixel = lens_pixel(lens, depth);
	v3d_add_scaled(to, to, right * pixel, lens->right);
	v3d_add_scaled(to, to, -down * pixel, lens->up);
}

/* ---- lights ---- */

void subject_turn_light(struct subject *subject, uint32_t k, const struct lens *lens, double right, double down)
{
	struct psr_msg_light light = subject->light[k].light;

	if (light.kind != PSR_WIRE_LIGHT_DIRECTIONAL && light.kind != PSR_WIRE_LIGHT_SPOT)
		return;
	turn(light.direction, lens->up, right);
	turn(light.direction, lens->right, down);
	v3d_normalize(light.direction, light.direction);
	subject_set_light(subject, k, &light);
}

void subject_move_light(struct subject *subject, uint32_t k, const struct lens *lens, const double by[3])
{
	struct psr_msg_light light = subject->light[k].light;
	double arm[3];

	if (light.kind != PSR_WIRE_LIGHT_POINT && light.kind != PSR_WIRE_LIGHT_SPOT)
		return;
	v3d_sub(arm, light.position, lens->eye);
	add_pixels(light.position, lens, subject->light[k].light.position, by[0], by[1]);
	v3d_add_scaled(light.position, light.position, -by[2] * lens_pixel(lens, sqrt(v3d_dot(arm, arm))), lens->forward);
	subject_set_light(subject, k, &light);
}

/* ---- instances ---- */

int subject_instance_box(double corner[8][3], const struct subject *subject, const struct link_scene *scene, uint32_t k)
{
	const struct link_instance *at = &subject->instance[k].link;
	struct psr_msg_instance place = { .scale = at->scale };

	memcpy(place.rotation, at->rotation, sizeof place.rotation);
	memcpy(place.translation, at->translation, sizeof place.translation);
	for (uint32_t m = 0; scene != NULL && m < scene->n_models; m++) {
		if (strcmp(scene->model[m].name, at->model) != 0)
			continue;
		for (int c = 0; c < 8; c++) {
			double p[3];

			for (int i = 0; i < 3; i++)
				p[i] = c >> i & 1 ? scene->model[m].opened.box_max[i] : scene->model[m].opened.box_min[i];
			instance_apply(corner[c], &place, p);
		}
		return 1;
	}
	return 0;
}

static int middle_of(double middle[3], const struct subject *subject, const struct link_scene *scene, uint32_t k)
{
	double corner[8][3];

	if (!subject_instance_box(corner, subject, scene, k))
		return 0;
	for (int i = 0; i < 3; i++)
		middle[i] = (corner[0][i] + corner[7][i]) / 2;
	return 1;
}

static int set_place(struct subject *subject, uint32_t k, const struct link_instance *to, struct psr_error *err)
{
	const double *q = to->rotation, sine = sqrt(v3d_dot(q, q));
	char text[SUBJECT_TEXT + PSR_WIRE_MAX_NAME];
	size_t n = (size_t)snprintf(text, sizeof text, "%s,at=%.17g,%.17g,%.17g", to->model, to->translation[0],
	                            to->translation[1], to->translation[2]);
	struct instance_wish wish;

	if (sine > 0)
		n += (size_t)snprintf(text + n, sizeof text - n, ",rotate=%.17g,%.17g,%.17g:%.17g", q[0] / sine, q[1] / sine,
		                      q[2] / sine, 2 * atan2(sine, q[3]) / PSR_DEGREE);
	if (to->scale != 1)
		snprintf(text + n, sizeof text - n, ",scale=%.17g", to->scale);
	if (instance_parse(&wish, text, err) != PSR_OK)
		return err->code;
	if (strcmp(wish.model, to->model) != 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%.80s: a model with such a name can stand only where its file puts it",
		                to->model);
	return subject_place(subject, k, text, err);
}

/* Turns by a quaternion and scales, about a point, and then moves. */
struct motion { double turn[4], scale, about[3], by[3]; };

static int apply(struct subject *subject, uint32_t k, const struct motion *motion, struct psr_error *err)
{
	const double *a = subject->instance[k].link.rotation, *b = motion->turn;
	struct psr_msg_instance about = { .scale = motion->scale };
	struct link_instance to = subject->instance[k].link;
	double cross[3], arm[3];

	memcpy(about.rotation, motion->turn, sizeof about.rotation);
	v3d_add_scaled(about.translation, motion->about, 1, motion->by);
	v3d_sub(arm, to.translation, motion->about);
	instance_apply(to.translation, &about, arm);
	v3d_cross(cross, b, a);
	to.rotation[3] = b[3] * a[3] - v3d_dot(b, a);
	for (int i = 0; i < 3; i++)
		to.rotation[i] = b[3] * subject->instance[k].link.rotation[i] + subject->instance[k].link.rotation[3] * b[i]
		                 + cross[i];
	to.scale *= motion->scale;
	return set_place(subject, k, &to, err);
}

int subject_move_instance(struct subject *subject, const struct link_scene *scene, uint32_t k, const struct lens *lens,
                          const double by[2], struct psr_error *err)
{
	struct motion motion = { .turn = { 0, 0, 0, 1 }, .scale = 1 };

	if (!middle_of(motion.about, subject, scene, k))
		return PSR_OK;
	add_pixels(motion.by, lens, motion.about, by[0], by[1]);
	return apply(subject, k, &motion, err);
}

int subject_turn_instance(struct subject *subject, const struct link_scene *scene, uint32_t k, const struct lens *lens,
                          const double by[2], struct psr_error *err)
{
	const double angle = hypot(by[0], by[1]);
	struct motion motion = { .scale = 1 };

	if (!(angle > 0) || !middle_of(motion.about, subject, scene, k))
		return PSR_OK;
	for (int i = 0; i < 3; i++)
		motion.turn[i] = (by[0] * lens->up[i] + by[1] * lens->right[i]) / angle * sin(angle / 2);
	motion.turn[3] = cos(angle / 2);
	return apply(subject, k, &motion, err);
}

int subject_scale_instance(struct subject *subject, const struct link_scene *scene, uint32_t k, double factor,
                           struct psr_error *err)
{
	struct motion motion = { .turn = { 0, 0, 0, 1 }, .scale = factor };

	return middle_of(motion.about, subject, scene, k) ? apply(subject, k, &motion, err) : PSR_OK;
}
