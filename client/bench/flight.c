#include "flight.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/outfile.h"
#include "base/random.h"
#include "client/view/path.h"

#define A_TURN 120       /* requests of a turn, and of a way near and back */
#define NEAREST 8        /* of a zoom: so many times as near as at its start */
#define FLICK 60         /* requests of a flick: */
#define FLICK_HAND 8     /* so many are the hand's */
#define FLICK_DEGREES 50 /* which turns by that */
#define FLICK_GLIDE 25   /* and lets it run on by that, slower and slower */
#define PATH_RATE 30     /* pictures for a second of a recorded path */

static const char *const names[] = { "orbit", "zoom", "flick", "random" };

static int find_kind(const char *path)
{
	for (int i = 0; i < FLIGHT_LIST; i++)
		if (strcmp(path, names[i]) == 0)
			return i;
	return FLIGHT_LIST;
}

int flight_check(const char *path, const struct view_wish *view, struct psr_error *err)
{
	if (path[0] == '\0')
		return psr_fail(err, PSR_ERR_ARG, "--path takes orbit, zoom, flick, random or a file");
	if (find_kind(path) == FLIGHT_RANDOM && (view->camera.has_eye || view->preset != NULL))
		return psr_fail(err, PSR_ERR_ARG, "--path random says where the camera is; it excludes --eye and --camera");
	return PSR_OK;
}

static int room(struct flight *flight, size_t n, struct psr_error *err)
{
	flight->list = calloc(n, sizeof *flight->list);
	return flight->list != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory for %zu cameras", n);
}

static int read_recording(struct flight *flight, const char *file, struct psr_error *err)
{
	struct path path;
	int code = path_read(&path, file, err);
	uint32_t n;

	if (code != PSR_OK)
		return code;
	n = (uint32_t)fmin(floor(path_seconds(&path) * PATH_RATE) + 1, VIEWS_MAX);
	code = room(flight, n, err);
	for (uint32_t k = 0; code == PSR_OK && k < n; k++) {
		struct psr_camera *camera = &flight->list[k];
		struct hand_pose pose;

		path_at(&path, (double)k / PATH_RATE, &pose);
		camera->kind = pose.fov > 0 ? PSR_CAMERA_PERSPECTIVE : PSR_CAMERA_ORTHOGRAPHIC;
		memcpy(camera->eye, pose.eye, sizeof pose.eye);
		memcpy(camera->target, pose.target, sizeof pose.target);
		memcpy(camera->up, pose.up, sizeof pose.up);
		*(pose.fov > 0 ? &camera->fov_y : &camera->ortho_height) =
			pose.fov > 0 ? pose.fov * PSR_DEGREE : pose.ortho_height;
		flight->n_list++;
	}
	path_fini(&path);
	return code;
}

static int read_cameras(struct flight *flight, const char *file, struct psr_error *err)
{
	struct views views;
	int code = views_make(&views, &flight->view, file, err);

	if (code == PSR_OK)
		code = room(flight, views.n, err);
	for (uint32_t k = 0; code == PSR_OK && k < views.n; k++) {
		code = view_place(&flight->list[k], &views.wish[k], flight->scene, flight->aspect, 0, err);
		flight->n_list += code == PSR_OK;
	}
	views_fini(&views);
	return code;
}

int flight_make(struct flight *flight, const char *path, const struct view_wish *view, const struct scene *scene,
                double aspect, struct psr_error *err)
{
	const char *ending = outfile_ending(path);
	int code;

	*flight = (struct flight){ .kind = find_kind(path), .aspect = aspect, .view = *view, .scene = scene };
	view_up(flight->up, view, scene);
	code = view_place(&flight->start, view, scene, aspect, A_TURN, err);
	if (code != PSR_OK || flight->kind != FLIGHT_LIST)
		return code;
	return strcmp(ending, "json") == 0 ? read_recording(flight, path, err) : read_cameras(flight, path, err);
}

void flight_fini(struct flight *flight)
{
	free(flight->list);
	memset(flight, 0, sizeof *flight);
}

static void turn(struct psr_camera *camera, const struct flight *flight, double degrees)
{
	psr_camera_turn(camera, flight->up, degrees, flight->scene->box_min, flight->scene->box_max);
}

/* The server chooses where the picture begins: nearer than at the start. */
static void approach(struct psr_camera *camera, double factor)
{
	camera->near_z = 0;
	if (camera->kind == PSR_CAMERA_ORTHOGRAPHIC)
		camera->ortho_height /= factor;
	else
		for (int i = 0; i < 3; i++)
			camera->eye[i] = camera->target[i] + (camera->eye[i] - camera->target[i]) / factor;
}

/* Degrees since the start after k requests. */
static double flicked(uint64_t k)
{
	const double step = (double)(k % FLICK);
	const double hand = FLICK_DEGREES * fmin(step / FLICK_HAND, 1);
	const double glide = step > FLICK_HAND ? FLICK_GLIDE * (1 - exp((FLICK_HAND - step) / 10)) : 0;

	return (double)(k / FLICK) * (FLICK_DEGREES + FLICK_GLIDE) + hand + glide;
}

static void place_randomly(struct psr_camera *camera, const struct flight *flight, uint64_t random)
{
	struct view_wish view = flight->view;

	view.camera.has_angles = 1;
	view.camera.azimuth = random_in(&random, 0, 360);
	view.camera.elevation = random_in(&random, -60, 60);
	view.camera.zoom *= random_in(&random, 1, 4);
	if (view_place(camera, &view, flight->scene, flight->aspect, 0, NULL) != PSR_OK)
		*camera = flight->start;
}

void flight_at(struct psr_camera *camera, const struct flight *flight, uint64_t k, double part, uint64_t random)
{
	*camera = flight->start;
	switch (flight->kind) {
	case FLIGHT_ORBIT:
		turn(camera, flight, 360 * ((double)(k % A_TURN) / A_TURN + part));
		break;
	case FLIGHT_ZOOM:
		approach(camera, pow(NEAREST, 0.5 - 0.5 * cos(360 * PSR_DEGREE * ((double)(k % A_TURN) / A_TURN + part))));
		break;
	case FLIGHT_FLICK:
		turn(camera, flight, 360 * part + flicked(k));
		break;
	case FLIGHT_RANDOM:
		place_randomly(camera, flight, random + k * 0x9e3779b97f4a7c15u);
		break;
	case FLIGHT_LIST:
		*camera = flight->list[(k + (uint64_t)(part * flight->n_list)) % flight->n_list];
		break;
	}
}
