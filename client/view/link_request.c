#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "client/lib/camera.h"
#include "link_inside.h"

#define OTHER_PLANES (~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH))

/* The range of depth when the eye is inside of the scene begins so near, in parts of its far end. Steps of 1/z stay
 * even: what is shown of a surface moves by less than a tenth of a pixel, wherever it is. */
#define NEAR_PART 1e-3

static uint32_t grow(uint32_t side, double overscan)
{
	const double wide = ceil(side * overscan / 4) * 4;

	return wide > PSR_WIRE_MAX_SIDE ? PSR_WIRE_MAX_SIDE : (uint32_t)wide;
}

void link_pace_wish(struct pace_wish *out, const struct link_wish *wish, uint64_t capabilities)
{
	*out = (struct pace_wish){
		.fps = wish->fps, .width = grow(wish->width, wish->overscan), .height = grow(wish->height, wish->overscan),
		.least_quality = wish->least_quality, .most_quality = wish->most_quality,
		.most_scale = capabilities & PSR_CAP_SETTINGS ? wish->most_scale : 1,
	};
	if (capabilities & PSR_CAP_REFINE && !(wish->planes & OTHER_PLANES))
		out->pass_limit = wish->pass_limit;
}

/* A pixel keeps its size. */
void link_frame_view(struct psr_msg_frame *frame, const struct link_wish *wish, int is_rest)
{
	struct psr_camera *camera = &frame->camera;
	double part;

	frame->width = wish->width;
	frame->height = wish->height;
	*camera = wish->camera;
	if (is_rest)
		return;
	frame->width = grow(wish->width, wish->overscan);
	frame->height = grow(wish->height, wish->overscan);
	part = (double)frame->height / wish->height;
	if (part == 1)
		return;
	if (camera->kind == PSR_CAMERA_ORTHOGRAPHIC)
		camera->ortho_height *= part;
	else
		camera->fov_y = 2 * atan(tan(camera->fov_y / 2) * part);
}

/* Of the box, from the camera; greater by a little, so that rounding leaves nothing out. */
static void find_depths(struct psr_msg_frame *frame, const double box_min[3], const double box_max[3])
{
	const struct psr_camera *camera = &frame->camera;
	double forward[3], low = INFINITY, high = -INFINITY, pad;

	v3d_sub(forward, camera->target, camera->eye);
	v3d_normalize(forward, forward);
	for (int corner = 0; corner < 8; corner++) {
		double to[3], z;

		for (int a = 0; a < 3; a++)
			to[a] = (corner >> a & 1 ? box_max[a] : box_min[a]) - camera->eye[a];
		z = v3d_dot(to, forward);
		low = fmin(low, z);
		high = fmax(high, z);
	}
	pad = 1e-3 * (high - low) + 1e-6 * fabs(high);
	low -= pad;
	high += pad;
	if (camera->kind == PSR_CAMERA_PERSPECTIVE)
		low = fmax(low, fmax(camera->near_z, NEAR_PART * high));
	if (!(high > low) || !(low > 0 || camera->kind == PSR_CAMERA_ORTHOGRAPHIC)) { /* all of it is behind the eye */
		low = 1;
		high = 2;
	}
	frame->depth_min = low;
	frame->depth_max = high;
}

/* At rest depth is exact: places are read from it. */
static void choose_depth(struct psr_msg_frame *frame, const double box_min[3], const double box_max[3], int is_rest)
{
	frame->depth_format = PSR_WIRE_DEPTH_F32;
	frame->depth_codec = PSR_CODEC_ZSTD;
	if (is_rest)
		return;
	frame->depth_format = PSR_WIRE_DEPTH_U16_HALF;
	find_depths(frame, box_min, box_max);
}

void link_frame(struct psr_msg_frame *frame, struct pace_request *request, const struct link_wish *wish,
                const double box_min[3], const double box_max[3], int is_direct)
{
	struct psr_msg_settings *settings = &request->settings;

	memset(frame, 0, sizeof *frame);
	frame->planes = wish->planes;
	frame->budget = PSR_WIRE_BUDGET_SETTINGS;
	frame->flags = PSR_WIRE_FRAME_NO_HASHES;
	link_frame_view(frame, wish, request->is_sharp);
	while (frame->width % settings->scale != 0 || frame->height % settings->scale != 0)
		settings->scale /= 2;
	settings->spacing_px = wish->spacing_px;
	frame->pass_limit = request->pass_limit;
	if (wish->planes >> PSR_PLANE_COLOR & 1) {
		frame->color_codec = request->color_codec;
		frame->color_quality = request->color_quality;
	}
	if (request->is_sharp && (is_direct || !wish->is_smooth)) {
		settings->scale = 1;
		settings->smooth = wish->is_smooth != 0;
		frame->color_codec = wish->planes >> PSR_PLANE_COLOR & 1 ? PSR_CODEC_ZSTD : 0;
		frame->color_quality = 0;
	} else if (request->is_sharp) {
		frame->flags |= PSR_WIRE_FRAME_SHARP;
	}
	if (wish->planes >> PSR_PLANE_DEPTH & 1)
		choose_depth(frame, box_min, box_max, request->is_sharp);
	if (wish->planes & OTHER_PLANES)
		frame->data_codec = PSR_CODEC_ZSTD;
	frame->settings = *settings;
}

uint8_t link_color_by(const struct link_wish *wish)
{
	for (uint32_t i = 1; i < wish->n_instances; i++)
		if (wish->instance[i].color_by != wish->instance[0].color_by)
			return PSR_WIRE_COLOR_OWN;
	return wish->n_instances > 0 ? wish->instance[0].color_by : PSR_WIRE_COLOR_OWN;
}

void link_scene_message(struct psr_msg_scene *scene, const struct link_wish *wish, const struct link_place *place,
                        uint32_t n, const struct psr_camera *camera)
{
	memset(scene, 0, sizeof *scene);
	scene->ambient = wish->ambient;
	memcpy(scene->background, wish->background, sizeof scene->background);
	scene->n_instances = (uint16_t)n;
	for (uint32_t i = 0; i < n; i++) {
		const struct link_instance *from = &wish->instance[place[i].index];
		struct psr_msg_instance *to = &scene->instance[i];

		to->handle = place[i].handle;
		to->representation = from->representation;
		to->color_by = from->color_by;
		memcpy(to->rotation, from->rotation, sizeof to->rotation);
		memcpy(to->translation, from->translation, sizeof to->translation);
		to->scale = from->scale;
	}
	scene->n_lights = (uint16_t)wish->n_lights;
	memcpy(scene->light, wish->light, wish->n_lights * sizeof scene->light[0]);
	if (wish->has_key_light) {
		client_light_key(&scene->light[0], camera);
		scene->light[0].flags = wish->light[0].flags;
	}
}
