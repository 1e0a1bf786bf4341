/* Lights and instances dragged: L or G is held. */
#include <math.h>
#include "viewer.h"

#define PI 3.14159265358979323846
#define PIXELS_TO_DOUBLE 300.0 /* a drag of so many pixels doubles or halves an instance */

int drag_begin(struct viewer *viewer)
{
	viewer->drag = DRAG_NONE;
	if (viewer->holds_light) {
		subject_fix_light(&viewer->subject, &viewer->hand.camera);
		viewer->drag = viewer->subject.n_lights > 0 ? DRAG_LIGHT : DRAG_NOTHING;
	} else if (viewer->holds_model) {
		if (viewer->picked >= (int)viewer->subject.n_instances)
			viewer->picked = -1;
		if (viewer->picked < 0 && viewer->subject.n_instances == 1)
			viewer->picked = 0;
		viewer->drag = viewer->picked >= 0 ? DRAG_INSTANCE : DRAG_NOTHING;
		if (viewer->picked < 0)
			viewer_note(viewer, "click a model first: G moves that one");
	}
	return viewer->drag != DRAG_NONE;
}

static void drag_light(struct viewer *viewer, const struct lens *lens, double right, double down)
{
	const uint32_t k = viewer->light < viewer->subject.n_lights ? viewer->light : 0;
	const int is_shifted = (viewer->mod & KMOD_SHIFT) != 0;
	const double turn = PI / viewer->hand.height, sideways[3] = { right, down, 0 }, nearer[3] = { 0, 0, down };

	switch (viewer->subject.light[k].light.kind) {
	case PSR_WIRE_LIGHT_DIRECTIONAL:
		subject_turn_light(&viewer->subject, k, lens, -turn * right, -turn * down);
		break;
	case PSR_WIRE_LIGHT_SPOT:
		if (is_shifted)
			subject_turn_light(&viewer->subject, k, lens, -turn * right, -turn * down);
		else
			subject_move_light(&viewer->subject, k, lens, sideways);
		break;
	default:
		subject_move_light(&viewer->subject, k, lens, is_shifted ? nearer : sideways);
	}
}

static void drag_instance(struct viewer *viewer, const struct lens *lens, double right, double down)
{
	const SDL_Keymod mod = viewer->mod;
	const double turn = PI / viewer->hand.height, by[2] = { right, down }, turns[2] = { turn * right, turn * down };
	const uint32_t k = (uint32_t)viewer->picked;
	struct psr_error err;
	int code;

	if (mod & KMOD_SHIFT)
		code = subject_turn_instance(&viewer->subject, viewer->scene, k, lens, turns, &err);
	else if (mod & KMOD_CTRL)
		code = subject_scale_instance(&viewer->subject, viewer->scene, k, exp2(-down / PIXELS_TO_DOUBLE), &err);
	else
		code = subject_move_instance(&viewer->subject, viewer->scene, k, lens, by, &err);
	if (code != PSR_OK)
		viewer_note(viewer, "%s", err.text);
}

void drag_move(struct viewer *viewer, double right, double down)
{
	struct lens lens;

	lens_init(&lens, &viewer->hand.camera, viewer->hand.width, viewer->hand.height);
	if (viewer->drag == DRAG_LIGHT)
		drag_light(viewer, &lens, right, down);
	else if (viewer->drag == DRAG_INSTANCE && (uint32_t)viewer->picked < viewer->subject.n_instances)
		drag_instance(viewer, &lens, right, down);
}
