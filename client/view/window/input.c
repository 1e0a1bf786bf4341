/* Mouse, touchpad and keys. panel.cc lists them for people. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "base/clock.h"
#include "viewer.h"

#define CLICK_PIXELS 3
#define STEP_DEGREES 5.0
#define PI 3.14159265358979323846

static struct hand_cursor cursor(const struct viewer *viewer, int x, int y)
{
	return (struct hand_cursor){ (x + 0.5) * viewer->scale, (y + 0.5) * viewer->scale };
}

static double depth_at(const struct viewer *viewer, struct hand_cursor at)
{
	struct view_probe probe;

	view_show_probe(viewer->show, at.x, at.y, &probe);
	return probe.has_surface ? probe.depth : (double)INFINITY;
}

/* ---- clicks ---- */

static void tell_distance(const struct viewer *viewer)
{
	const double *a = viewer->point[0].probe.point, *b = viewer->point[1].probe.point;

	printf("distance %.9g\n", sqrt((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1])
	                               + (b[2] - a[2]) * (b[2] - a[2])));
}

static void tell_point(const struct viewer *viewer, int k)
{
	const struct viewer_point *point = &viewer->point[k];
	const double *p = point->probe.point, *n = point->normal;

	printf("point %.9g,%.9g,%.9g depth %.9g", p[0], p[1], p[2], point->probe.depth);
	if (point->has_normal)
		printf(" normal %.6f,%.6f,%.6f", n[0], n[1], n[2]);
	printf("\n");
	if (k == 1)
		tell_distance(viewer);
	fflush(stdout);
}

/* Position and depth are read from the picture that is shown; normal and model come from the server. */
static void click(struct viewer *viewer, struct hand_cursor at)
{
	const int is_second = viewer->is_measuring && viewer->point[0].is_set && !viewer->point[1].is_set;
	const uint32_t size[2] = { viewer->hand.width, viewer->hand.height };
	struct viewer_point *point = &viewer->point[is_second];

	*point = (struct viewer_point){ 0 };
	view_show_probe(viewer->show, at.x, at.y, &point->probe);
	point->is_set = point->probe.has_surface;
	if (!is_second)
		viewer->point[1].is_set = 0;
	viewer->probe = 0;
	if (!point->is_set) {
		viewer->picked = -1;
		viewer_note(viewer, "nothing is there");
	} else if (viewer->state.phase == LINK_LIVE) {
		viewer->probe = link_probe(viewer->link, &viewer->hand.camera, size, (const double[2]){ at.x, at.y });
		viewer->probe_point = is_second;
	} else {
		tell_point(viewer, is_second);
	}
}

void input_surface(struct viewer *viewer)
{
	struct viewer_point *point = &viewer->point[viewer->probe_point];
	struct link_surface surface;

	link_probed(viewer->link, &surface);
	if (viewer->probe == 0 || surface.number != viewer->probe)
		return;
	viewer->probe = 0;
	viewer->picked = surface.has_surface ? (int)surface.instance : -1;
	if (!point->is_set)
		return;
	point->has_normal = surface.has_surface;
	memcpy(point->normal, surface.normal, sizeof point->normal);
	tell_point(viewer, viewer->probe_point);
	viewer->frames_due = VIEWER_SETTLE;
}

/* ---- the mouse ---- */

static int flies(const struct viewer *viewer)
{
	for (int i = 0; i < 6; i++)
		if (viewer->fly_keys[i])
			return 1;
	return 0;
}

static enum hand_grip grip_of(const struct viewer *viewer, const SDL_MouseButtonEvent *button)
{
	const SDL_Keymod mod = viewer->mod;

	if (button->button != SDL_BUTTON_LEFT || mod & KMOD_CTRL)
		return HAND_PAN;
	if (flies(viewer))
		return HAND_LOOK;
	if (mod & KMOD_ALT)
		return HAND_ROLL;
	return mod & KMOD_SHIFT ? HAND_TRACKBALL : HAND_ORBIT;
}

static void press(struct viewer *viewer, const SDL_MouseButtonEvent *button)
{
	const struct hand_cursor at = cursor(viewer, button->x, button->y);

	viewer->press = at;
	viewer->is_pressed = viewer->is_click = 1;
	if (button->button == SDL_BUTTON_LEFT && button->clicks == 2) {
		hand_set_pivot(&viewer->hand, at, depth_at(viewer, at));
		viewer_note(viewer, isfinite(depth_at(viewer, at)) ? "turns about this point now" : "nothing is there");
	}
	if (drag_begin(viewer))
		return;
	hand_grab(&viewer->hand, grip_of(viewer, button), at, depth_at(viewer, at), clock_ns());
}

static void move(struct viewer *viewer, const SDL_MouseMotionEvent *motion)
{
	const struct hand_cursor at = cursor(viewer, motion->x, motion->y);

	if (!viewer->is_pressed)
		return;
	if (hypot(at.x - viewer->press.x, at.y - viewer->press.y) > CLICK_PIXELS * viewer->scale)
		viewer->is_click = 0;
	if (viewer->drag != DRAG_NONE)
		drag_move(viewer, motion->xrel * viewer->scale, motion->yrel * viewer->scale);
	else if (!viewer->is_click)
		hand_drag(&viewer->hand, at, clock_ns());
}

static void release(struct viewer *viewer, const SDL_MouseButtonEvent *button)
{
	if (!viewer->is_pressed)
		return;
	hand_release(&viewer->hand, clock_ns());
	if (viewer->is_click && viewer->drag == DRAG_NONE && button->button == SDL_BUTTON_LEFT && button->clicks == 1)
		click(viewer, viewer->press);
	viewer->is_pressed = 0;
	viewer->drag = DRAG_NONE;
}

static void scroll(struct viewer *viewer, const SDL_MouseWheelEvent *wheel)
{
	const double sign = wheel->direction == SDL_MOUSEWHEEL_FLIPPED ? -1 : 1;
	struct hand_cursor at;
	int x, y;

	SDL_GetMouseState(&x, &y);
	at = cursor(viewer, x, y);
	hand_zoom(&viewer->hand, at, depth_at(viewer, at), sign * (double)wheel->preciseY);
}

static void pinch(struct viewer *viewer, const SDL_MultiGestureEvent *gesture)
{
	const struct hand_cursor at = { (double)gesture->x * viewer->hand.width, (double)gesture->y * viewer->hand.height };

	hand_zoom(&viewer->hand, at, depth_at(viewer, at), 40 * (double)gesture->dDist);
	hand_roll(&viewer->hand, -(double)gesture->dTheta * 180 / PI);
}

/* ---- keys ---- */

void input_next_camera(struct viewer *viewer)
{
	const uint32_t n = viewer->scene != NULL ? viewer->scene->model[0].n_presets : 0;
	struct psr_msg_preset preset;

	for (uint32_t i = 0; i < n; i++) {
		const uint32_t k = (viewer->camera_of_file + i) % n;

		if (!subject_preset(&viewer->subject, viewer->scene, k, &preset) || preset.kind != PSR_WIRE_PRESET_CAMERA)
			continue;
		hand_set_camera(&viewer->hand, &preset.camera);
		viewer->camera_of_file = k + 1;
		viewer_note(viewer, "camera %s", preset.name);
		return;
	}
	viewer_note(viewer, "no camera came with this model");
}

/* Colours, and then each stage. */
static void next_stage(struct viewer *viewer)
{
	const char *now = viewer->subject.stage != NULL ? viewer->subject.stage_name : NULL;
	unsigned k = 0;

	while (now != NULL && strcmp(show_name(k++), now) != 0)
		;
	viewer_set_stage(viewer, show_name(k));
	viewer_note(viewer, "%s", viewer->subject.stage != NULL ? viewer->subject.stage_name : "colours");
}

static void change(struct viewer *viewer,
                   void (*how)(struct subject *subject, const struct link_scene *scene, char *note, size_t note_size))
{
	char note[64];

	how(&viewer->subject, viewer->scene, note, sizeof note);
	viewer_note(viewer, "%s", note);
}

static void next_background(struct viewer *viewer)
{
	static const uint8_t colors[][3] = { { 0x20, 0x24, 0x28 }, { 255, 255, 255 }, { 128, 128, 128 }, { 0, 0, 0 } };
	const size_t n = sizeof colors / sizeof colors[0];
	size_t k = 0;

	while (k < n && memcmp(colors[k], viewer->subject.background, 3) != 0)
		k++;
	memcpy(viewer->subject.background, colors[(k + 1) % n], 3);
}

static void set_spacing(struct viewer *viewer, double factor)
{
	viewer->subject.spacing = fmin(fmax(viewer->subject.spacing * factor, 1.0 / 64), 64);
	viewer_note(viewer, "spacing %g pixels", viewer->subject.spacing);
}

static void set_ambient(struct viewer *viewer, double by)
{
	viewer->subject.ambient = fmax(round((viewer->subject.ambient + by) * 100) / 100, 0);
	viewer_note(viewer, "ambient %g", viewer->subject.ambient);
}

static void toggle(struct viewer *viewer, int *what, const char *name)
{
	*what = !*what;
	viewer_note(viewer, "%s %s", name, *what ? "on" : "off");
}

static int key_of_sides(struct viewer *viewer, SDL_Keycode key)
{
	static const char *const sides[] = { "front", "back", "left", "right", "top", "bottom", "iso" };
	double angles[2];

	if (key < SDLK_1 || key > SDLK_7 || !view_side(sides[key - SDLK_1], angles))
		return 0;
	hand_look_from(&viewer->hand, angles[0], angles[1]);
	viewer_note(viewer, "%s", sides[key - SDLK_1]);
	return 1;
}

static int key_of_hand(struct viewer *viewer, SDL_Keycode key)
{
	const struct hand_cursor middle = { viewer->hand.width / 2.0, viewer->hand.height / 2.0 };
	struct hand *hand = &viewer->hand;

	switch (key) {
	case SDLK_LEFT: hand_turn(hand, -STEP_DEGREES, 0); break;
	case SDLK_RIGHT: hand_turn(hand, STEP_DEGREES, 0); break;
	case SDLK_UP: hand_turn(hand, 0, STEP_DEGREES); break;
	case SDLK_DOWN: hand_turn(hand, 0, -STEP_DEGREES); break;
	case SDLK_PLUS: case SDLK_EQUALS: case SDLK_KP_PLUS: hand_zoom(hand, middle, INFINITY, 1); break;
	case SDLK_MINUS: case SDLK_KP_MINUS: hand_zoom(hand, middle, INFINITY, -1); break;
	case SDLK_LEFTBRACKET: hand_roll(hand, -STEP_DEGREES); break;
	case SDLK_RIGHTBRACKET: hand_roll(hand, STEP_DEGREES); break;
	case SDLK_h: case SDLK_HOME: hand_home(hand); break;
	case SDLK_c: input_next_camera(viewer); break;
	case SDLK_o: hand_toggle_ortho(hand); break;
	case SDLK_i: toggle(viewer, &hand->has_inertia, "inertia"); break;
	default: return key_of_sides(viewer, key);
	}
	return 1;
}

static int key_of_light(struct viewer *viewer, SDL_Keycode key)
{
	switch (key) {
	case SDLK_x: toggle(viewer, &viewer->subject.is_shadowed, "shadows"); break;
	case SDLK_n: toggle(viewer, &viewer->subject.is_smooth, "smoothing"); break;
	case SDLK_COMMA: set_spacing(viewer, 0.5); break;
	case SDLK_PERIOD: set_spacing(viewer, 2); break;
	case SDLK_PAGEUP: set_ambient(viewer, 0.05); break;
	case SDLK_PAGEDOWN: set_ambient(viewer, -0.05); break;
	case SDLK_b: next_background(viewer); break;
	case SDLK_t: next_stage(viewer); break;
	case SDLK_v: change(viewer, subject_next_color); break;
	case SDLK_r: change(viewer, subject_toggle_splats); break;
	case SDLK_k:
		viewer->subject.has_key_light = 1;
		viewer->subject.n_lights = 0;
		viewer_note(viewer, "the light moves with the camera");
		break;
	default: return 0;
	}
	return 1;
}

static void toggle_measuring(struct viewer *viewer)
{
	viewer->point[0].is_set = viewer->point[1].is_set = 0;
	viewer->is_measuring = !viewer->is_measuring;
	viewer_note(viewer, viewer->is_measuring ? "click two points to measure between them" : "measuring off");
}

static void key_of_window(struct viewer *viewer, SDL_Keycode key, SDL_Keymod mod)
{
	const Uint32 full = SDL_GetWindowFlags(viewer->window) & SDL_WINDOW_FULLSCREEN_DESKTOP;

	switch (key) {
	case SDLK_m: toggle_measuring(viewer); break;
	case SDLK_TAB: viewer->has_overlay = !viewer->has_overlay; break;
	case SDLK_p: viewer->has_panel = !viewer->has_panel; break;
	case SDLK_F1: viewer->has_help = !viewer->has_help; break;
	case SDLK_F2: viewer->wants_shot = 1; break;
	case SDLK_F5: save_toggle_record(viewer); break;
	case SDLK_SPACE: save_toggle_play(viewer); break;
	case SDLK_F11: SDL_SetWindowFullscreen(viewer->window, full ? 0 : SDL_WINDOW_FULLSCREEN_DESKTOP); break;
	case SDLK_ESCAPE: viewer->is_over = 1; break;
	case SDLK_q: viewer->is_over |= (mod & KMOD_CTRL) != 0; break;
	default: break;
	}
}

/* w a s d, e and f fly while they are held. 1: it was one of them. */
static int key_of_flight(struct viewer *viewer, SDL_Scancode code, int is_down)
{
	static const SDL_Scancode keys[6] = { SDL_SCANCODE_D, SDL_SCANCODE_A, SDL_SCANCODE_E, SDL_SCANCODE_F,
		                                  SDL_SCANCODE_W, SDL_SCANCODE_S };
	int is_one = 0;
	double way[3];

	for (int i = 0; i < 6; i++) {
		if (keys[i] != code)
			continue;
		viewer->fly_keys[i] = is_down;
		is_one = 1;
	}
	for (int i = 0; i < 3; i++)
		way[i] = viewer->fly_keys[2 * i] - viewer->fly_keys[2 * i + 1];
	if (is_one)
		hand_fly(&viewer->hand, way);
	return is_one;
}

static void note_keys(struct viewer *viewer, const SDL_KeyboardEvent *key)
{
	viewer->mod = (SDL_Keymod)key->keysym.mod;
	if (key->keysym.scancode == SDL_SCANCODE_L)
		viewer->holds_light = key->type == SDL_KEYDOWN;
	if (key->keysym.scancode == SDL_SCANCODE_G)
		viewer->holds_model = key->type == SDL_KEYDOWN;
}

static void let_go(struct viewer *viewer)
{
	static const double nowhere[3] = { 0, 0, 0 };

	memset(viewer->fly_keys, 0, sizeof viewer->fly_keys);
	viewer->mod = KMOD_NONE;
	viewer->holds_light = viewer->holds_model = 0;
	hand_fly(&viewer->hand, nowhere);
}

void input_event(struct viewer *viewer, const SDL_Event *event)
{
	const int is_plain = event->type == SDL_KEYDOWN && !(event->key.keysym.mod & (KMOD_CTRL | KMOD_ALT | KMOD_GUI));
	const SDL_Keycode key = event->type == SDL_KEYDOWN ? event->key.keysym.sym : SDLK_UNKNOWN;

	if (event->type == SDL_KEYDOWN || event->type == SDL_KEYUP)
		note_keys(viewer, &event->key);
	if (event->type == SDL_KEYDOWN || event->type == SDL_MOUSEBUTTONDOWN)
		viewer->note_ns = 0; /* it was read */
	if (viewer->has_hand && event->type == SDL_MOUSEBUTTONDOWN)
		press(viewer, &event->button);
	else if (viewer->has_hand && event->type == SDL_MOUSEMOTION)
		move(viewer, &event->motion);
	else if (viewer->has_hand && event->type == SDL_MOUSEBUTTONUP)
		release(viewer, &event->button);
	else if (viewer->has_hand && event->type == SDL_MOUSEWHEEL)
		scroll(viewer, &event->wheel);
	else if (viewer->has_hand && event->type == SDL_MULTIGESTURE)
		pinch(viewer, &event->mgesture);
	else if (event->type == SDL_KEYUP)
		key_of_flight(viewer, event->key.keysym.scancode, 0);
	else if (event->type == SDL_WINDOWEVENT && event->window.event == SDL_WINDOWEVENT_FOCUS_LOST)
		let_go(viewer); /* the key goes up somewhere else */
	else if (is_plain && viewer->has_hand
	         && (key_of_flight(viewer, event->key.keysym.scancode, 1) || key_of_hand(viewer, key)
	             || key_of_light(viewer, key)))
		return;
	else if (event->type == SDL_KEYDOWN)
		key_of_window(viewer, key, event->key.keysym.mod);
}
