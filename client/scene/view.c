#include "view.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "preset.h"


static const struct {
	const char *name;
	double azimuth, elevation;
} sides[] = {
	{ "home", PSR_CAMERA_AZIMUTH, PSR_CAMERA_ELEVATION },
	{ "front", 0, 0 },
	{ "right", 90, 0 },
	{ "back", 180, 0 },
	{ "left", 270, 0 },
	{ "top", 0, 90 },
	{ "bottom", 0, -90 },
	{ "iso", 45, 35.264389682754654 },
};

void view_wish_init(struct view_wish *wish)
{
	memset(wish, 0, sizeof *wish);
	for (int i = 0; i < 3; i++) /* so that --help shows no default */
		wish->camera.eye[i] = wish->camera.target[i] = wish->camera.up[i] = NAN;
	wish->camera.azimuth = PSR_CAMERA_AZIMUTH;
	wish->camera.elevation = PSR_CAMERA_ELEVATION;
	wish->camera.zoom = 1;
	wish->fov = 35;
}

static int on_ortho(const char *text, void *userdata, struct psr_error *err)
{
	struct view_wish *wish = userdata;
	double *height = &wish->camera.ortho_height;

	*height = 0;
	if (strcmp(text, "fit") != 0 && (psr_parse_real(text, height, NULL, NULL) != PSR_OK
	                                 || !(*height >= 1 / PSR_WIRE_MAX_LENGTH && *height <= PSR_WIRE_MAX_LENGTH)))
		return psr_fail(err, PSR_ERR_ARG, "a height above 0 or 'fit' is needed, not '%.40s'", text);
	return PSR_OK;
}

void view_add_options(struct optlist *list, struct view_wish *wish)
{
	struct psr_camera_wish *camera = &wish->camera;
	const struct psr_opt opts[] = {
		{ .name = "view", .type = PSR_OPT_STRING, .value = &wish->view, .arg = "SIDE",
		  .words = "front back left right top bottom iso home",
		  .help = "From a side: front, back, left, right, top, bottom, iso (a corner above) or home, the view without "
		          "any of these options. It has perspective unless --ortho is said, too. psr shot draws a picture of "
		          "each of front,left,top." },
		{ .name = "azimuth", .type = PSR_OPT_REAL, .value = &camera->azimuth, .arg = "DEG", .min = -1e6, .max = 1e6,
		  .seen = &wish->has_azimuth,
		  .help = "Degrees around the model: 0 is its front, 90 its right side, 180 its back." },
		{ .name = "elevation", .type = PSR_OPT_REAL, .value = &camera->elevation, .arg = "DEG", .min = -90, .max = 90,
		  .seen = &wish->has_elevation,
		  .help = "Degrees above the horizon: 0 is level, 90 from straight above, -90 from below." },
		{ .name = "roll", .type = PSR_OPT_REAL, .value = &camera->roll, .arg = "DEG", .min = -1e6, .max = 1e6,
		  .seen = &wish->has_roll, .help = "Degrees by which the camera is turned clockwise." },
		{ .name = "zoom", .type = PSR_OPT_REAL, .value = &camera->zoom, .arg = "FACTOR", .min = 1e-6, .max = 1e6,
		  .seen = &wish->has_zoom,
		  .help = "As a zoom lens: 1 shows the whole model, 2 its middle (or --target) twice as large." },
		{ .name = "fov", .type = PSR_OPT_REAL, .value = &wish->fov, .arg = "DEG", .seen = &wish->has_fov,
		  .help = "Angle of view from the top edge to the bottom edge, degrees: smaller is flatter, as from farther "
		          "away." },
		{ .name = "ortho", .type = PSR_OPT_CALL, .value = wish, .arg = "HEIGHT", .call = on_ortho,
		  .seen = &wish->has_ortho,
		  .help = "No perspective: parallel lines stay so. The picture is HEIGHT units of the model high; `fit` shows "
		          "all of it." },
		{ .name = "up", .type = PSR_OPT_VEC3, .value = camera->up, .arg = "X,Y,Z", .seen = &camera->has_up,
		  .help = "The direction that is up in the picture. Without it: that of the model's file, usually 0,1,0, or "
		          "0,0,1 for scans, CAD and clouds. Say it where a model lies on its side." },
		{ .name = "eye", .type = PSR_OPT_VEC3, .value = camera->eye, .arg = "X,Y,Z", .seen = &camera->has_eye,
		  .help = "Where the camera is, in the model's coordinates, instead of the angles above." },
		{ .name = "target", .type = PSR_OPT_VEC3, .value = camera->target, .arg = "X,Y,Z", .seen = &camera->has_target,
		  .help = "The point in the middle of the picture; without it the middle of the model." },
		{ .name = "camera", .type = PSR_OPT_STRING, .value = &wish->preset, .arg = "NAME",
		  .help = "A camera that came with the first model, instead of all of these; `psr list --presets NAME` "
		          "shows them." },
	};

	OPTLIST_ADD(list, opts);
}

int view_is_said(const struct view_wish *wish)
{
	return wish->preset != NULL || wish->view != NULL || wish->camera.has_eye || wish->camera.has_target
	       || wish->camera.has_up || wish->has_fov || wish->has_ortho || wish->has_azimuth || wish->has_elevation
	       || wish->has_roll || wish->has_zoom;
}

static int check_ranges(const struct view_wish *wish, struct psr_error *err)
{
	const struct psr_camera_wish *camera = &wish->camera;

	if (!(wish->fov >= 0.001 && wish->fov < 180))
		return psr_fail(err, PSR_ERR_ARG, "--fov: %g is out of range; it takes 0.001 to less than 180 degrees",
		                wish->fov);
	for (int i = 0; i < 3; i++)
		if (fabs(camera->eye[i]) > PSR_WIRE_MAX_LENGTH || fabs(camera->target[i]) > PSR_WIRE_MAX_LENGTH
		    || fabs(camera->up[i]) > PSR_WIRE_MAX_LENGTH)
			return psr_fail(err, PSR_ERR_ARG, "--eye, --target, --up: coordinates are at most 1e30");
	return PSR_OK;
}

int view_side(const char *name, double angles[2])
{
	for (size_t i = 0; i < sizeof sides / sizeof sides[0]; i++) {
		if (strcmp(sides[i].name, name) != 0)
			continue;
		angles[0] = sides[i].azimuth;
		angles[1] = sides[i].elevation;
		return 1;
	}
	return 0;
}

static int find_side(struct view_wish *wish, struct psr_error *err)
{
	double angles[2];

	if (!view_side(wish->view, angles))
		return psr_fail(err, PSR_ERR_ARG,
		                "--view takes front, back, left, right, top, bottom, iso or home, not '%.40s'", wish->view);
	wish->camera.azimuth = angles[0];
	wish->camera.elevation = angles[1];
	return PSR_OK;
}

int view_check(struct view_wish *wish, struct psr_error *err)
{
	struct view_wish others = *wish;
	int has_angle = wish->has_azimuth || wish->has_elevation;

	others.preset = NULL;
	if (wish->preset != NULL && view_is_said(&others))
		return psr_fail(err, PSR_ERR_ARG,
		                "--camera is a whole camera; it excludes --eye, --target, --up, --fov, --ortho, "
		                "--view, --azimuth, --elevation, --roll and --zoom");
	if (wish->view != NULL && (has_angle || wish->camera.has_eye))
		return psr_fail(err, PSR_ERR_ARG,
		                "--view excludes --azimuth, --elevation and --eye: it says where the camera is");
	if (wish->camera.has_eye && has_angle)
		return psr_fail(err, PSR_ERR_ARG, "--eye excludes --azimuth and --elevation: both say where the camera is");
	if (wish->has_fov && wish->has_ortho)
		return psr_fail(err, PSR_ERR_ARG, "--fov and --ortho exclude each other");
	if (wish->view != NULL && find_side(wish, err) != PSR_OK)
		return PSR_ERR_ARG;
	wish->camera.has_angles =
		!wish->camera.has_eye
		&& (has_angle || wish->has_roll || (wish->view != NULL && strcmp(wish->view, "home") != 0));
	wish->camera.fov_y = wish->has_ortho ? 0 : wish->fov * PSR_DEGREE;
	return check_ranges(wish, err);
}

/* ---- several ---- */

struct reader {
	struct views *views;
	struct view_wish line, base;
};

static int add_view(struct views *views, const struct view_wish *wish, struct psr_error *err)
{
	struct view_wish *grown = views->wish;
	int code;

	if (views->n == VIEWS_MAX)
		return psr_fail(err, PSR_ERR_LIMIT, "there are more than %d cameras", VIEWS_MAX);
	if ((views->n & (views->n - 1)) == 0)
		grown = realloc(views->wish, (views->n == 0 ? 1 : 2 * (size_t)views->n) * sizeof *grown);
	if (grown == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u cameras", views->n);
	views->wish = grown;
	grown[views->n] = *wish;
	code = view_check(&grown[views->n], err);
	views->n += code == PSR_OK;
	return code;
}

static int on_line(void *userdata, struct psr_error *err)
{
	struct reader *reader = userdata;
	struct view_wish wish = reader->line;

	reader->line = reader->base;
	return add_view(reader->views, &wish, err);
}

static int read_file(struct views *views, const struct view_wish *wish, const char *file, struct psr_error *err)
{
	struct reader reader = { views, *wish, *wish };
	struct optlist list = { .n = 0 };
	const struct psr_cli cli = { .opts = list.opt };
	struct wordfile words = { .path = file, .cli = &cli, .on_line = on_line, .userdata = &reader };
	int code;

	view_add_options(&list, &reader.line);
	code = wordfile_read(&words, &views->text, err);
	if (code == PSR_OK && views->n == 0)
		code = psr_fail(err, PSR_ERR_ARG, "%.300s has no camera; a line is one, such as azimuth=30 elevation=20", file);
	return code;
}

/* --view front,left */
static int split_view(struct views *views, const struct view_wish *wish, struct psr_error *err)
{
	struct view_wish one = *wish;
	int code = PSR_OK;
	char *rest;

	views->text = rest = strdup(wish->view);
	if (rest == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the views");
	while (code == PSR_OK && (one.view = strsep(&rest, ",")) != NULL)
		code = add_view(views, &one, err);
	return code;
}

int views_make(struct views *views, const struct view_wish *wish, const char *file, struct psr_error *err)
{
	memset(views, 0, sizeof *views);
	if (file != NULL)
		return read_file(views, wish, file, err);
	return wish->view != NULL ? split_view(views, wish, err) : add_view(views, wish, err);
}

void views_fini(struct views *views)
{
	free(views->wish);
	free(views->text);
	memset(views, 0, sizeof *views);
}

/* ---- in a scene ---- */

void view_up(double up[3], const struct view_wish *wish, const struct scene *scene)
{
	memcpy(up, wish->camera.has_up ? wish->camera.up : scene->up, sizeof scene->up);
}

int view_place(struct psr_camera *camera, const struct view_wish *wish, const struct scene *scene, double aspect,
               uint32_t n_turn, struct psr_error *err)
{
	struct psr_camera_wish placed = wish->camera;
	const struct psr_msg_preset *preset;
	int code;

	if (wish->preset != NULL) {
		code = preset_find(&preset, scene, PSR_WIRE_PRESET_CAMERA, wish->preset, err);
		if (code == PSR_OK)
			*camera = preset->camera;
		return code;
	}
	memcpy(placed.natural_up, scene->up, sizeof placed.natural_up);
	if (n_turn > 1 && !placed.has_eye) {
		placed.has_angles = 1;
		placed.n_turn = n_turn;
	}
	return psr_camera_complete(camera, &placed, scene->box_min, scene->box_max, aspect, err);
}

int views_place(struct psr_camera *camera, const struct views *views, const struct scene *scene, double aspect,
                uint32_t n_turn, struct psr_error *err)
{
	double up[3];
	int code = PSR_OK;

	for (uint32_t k = 0; k < views->n && code == PSR_OK; k++)
		code = view_place(&camera[k], &views->wish[k], scene, aspect, n_turn, err);
	if (code != PSR_OK || n_turn == 0)
		return code;
	view_up(up, &views->wish[0], scene);
	for (uint32_t k = 1; k < n_turn; k++) {
		camera[k] = camera[0];
		psr_camera_turn(&camera[k], up, 360.0 * k / n_turn, scene->box_min, scene->box_max);
	}
	return PSR_OK;
}
