/* Keys and mouse. The man page lists them. */
#include <math.h>
#include <stdio.h>
#include "base/clock.h"
#include "viewer.h"

#define STEP_DEGREES 5.0
#define CTRL_C 3

static struct hand_cursor cursor(const struct viewer *viewer, const struct input_event *event)
{
	return (struct hand_cursor){ (event->x + 0.5) * viewer->canvas.cell_w, (event->y + 0.5) * viewer->canvas.cell_h };
}

static double depth_at(const struct viewer *viewer, struct hand_cursor at)
{
	struct view_probe probe;

	view_show_probe(viewer->show, at.x, at.y, &probe);
	return probe.has_surface ? probe.depth : (double)INFINITY;
}

static void press(struct viewer *viewer, const struct input_event *event)
{
	const struct hand_cursor at = cursor(viewer, event);
	enum hand_grip grip = HAND_ORBIT;

	if (event->button > 0 || event->mods & INPUT_CTRL)
		grip = HAND_PAN;
	else if (event->mods & INPUT_ALT)
		grip = HAND_TRACKBALL;
	viewer->is_pressed = 1;
	hand_grab(&viewer->hand, grip, at, depth_at(viewer, at), clock_ns());
}

static void mouse(struct viewer *viewer, const struct input_event *event)
{
	const struct hand_cursor at = cursor(viewer, event);

	if (event->kind == INPUT_PRESS)
		press(viewer, event);
	else if (event->kind == INPUT_WHEEL)
		hand_zoom(&viewer->hand, at, depth_at(viewer, at), event->steps);
	else if (viewer->is_pressed && event->kind == INPUT_MOVE)
		hand_drag(&viewer->hand, at, clock_ns());
	else if (viewer->is_pressed && event->kind == INPUT_RELEASE) {
		hand_release(&viewer->hand, clock_ns());
		viewer->is_pressed = 0;
	}
}

static void zoom(struct viewer *viewer, double steps)
{
	const struct hand_cursor middle = { viewer->hand.width / 2.0, viewer->hand.height / 2.0 };

	hand_zoom(&viewer->hand, middle, (double)INFINITY, steps);
}

static void toggle(struct viewer *viewer, const char *what, int *is)
{
	*is = !*is;
	snprintf(viewer->note, sizeof viewer->note, "%s %s", what, *is ? "on" : "off");
}

/* 0: no key of a camera. */
static int camera_key(struct viewer *viewer, int key)
{
	static const char *const sides[] = { "front", "back", "left", "right", "top", "bottom" };
	struct hand *hand = &viewer->hand;
	double angles[2];

	switch (key) {
	case INPUT_LEFT: hand_turn(hand, -STEP_DEGREES, 0); return 1;
	case INPUT_RIGHT: hand_turn(hand, STEP_DEGREES, 0); return 1;
	case INPUT_UP: hand_turn(hand, 0, STEP_DEGREES); return 1;
	case INPUT_DOWN: hand_turn(hand, 0, -STEP_DEGREES); return 1;
	case '+': case '=': zoom(viewer, 1); return 1;
	case '-': zoom(viewer, -1); return 1;
	case ',': hand_roll(hand, -STEP_DEGREES); return 1;
	case '.': hand_roll(hand, STEP_DEGREES); return 1;
	case 'h': case INPUT_HOME: hand_home(hand); return 1;
	case 'o': hand_toggle_ortho(hand); return 1;
	case ' ': hand_stop(hand); return 1;
	}
	if (key < '1' || key > '6' || !view_side(sides[key - '1'], angles))
		return 0;
	hand_look_from(hand, angles[0], angles[1]);
	return 1;
}

void keys_event(struct viewer *viewer, const struct input_event *event)
{
	viewer->must_draw = 1;
	if (event->kind == INPUT_KEY && (event->key == 'q' || event->key == CTRL_C || event->key == INPUT_ESCAPE)) {
		viewer->is_over = 1;
		return;
	}
	if (!viewer->has_hand)
		return;
	if (event->kind != INPUT_KEY) {
		mouse(viewer, event);
		return;
	}
	viewer->note[0] = '\0';
	if (camera_key(viewer, event->key))
		return;
	if (event->key == 's')
		toggle(viewer, "shadows", &viewer->subject.is_shadowed);
	else if (event->key == 'a')
		toggle(viewer, "smoothing", &viewer->subject.is_smooth);
	else if (event->key == 'i')
		toggle(viewer, "inertia", &viewer->hand.has_inertia);
	else if (event->key == 'v')
		subject_next_color(&viewer->subject, viewer->scene, viewer->note, sizeof viewer->note);
	else if (event->key == 'r')
		subject_toggle_splats(&viewer->subject, viewer->scene, viewer->note, sizeof viewer->note);
	else if (event->key == '?')
		snprintf(viewer->note, sizeof viewer->note, "drag: turn, ctrl-drag: move, wheel +-: zoom, arrows, "
		         "1-6 sides, h home, o ortho, s shadows, a smooth, r splats, v colours, q quit");
}
