#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include "effects.h"
#include "preset.h"
#include "psr.h"
#include "report.h"
#include "show.h"

#define DEGREE (3.14159265358979323846 / 180)
#define DEFAULT_AMBIENT 0.15

struct shot {
	const char *server, *model, *codec_text, *output, *depth, *report, *lights, *plane_text, *show_text;
	const struct show *show;
	unsigned plane; /* that -o writes, unless `show` does */
	uint32_t size[2];
	struct psr_camera_wish camera;
	struct preset_wish preset;
	double fov, ortho, ambient, spacing;
	int has_fov, has_ortho, has_ambient, hash, effects, is_smooth;
	uint8_t background[3];
	int64_t timeout, passes;
	struct psr_msg_frame frame;
	struct psr_msg_scene scene;
};

static const char footer[] =
	"A light is one of\n"
	"  dir:X,Y,Z[,...]                  X,Y,Z is the direction in which the light travels\n"
	"  point:X,Y,Z[,...]                X,Y,Z is its position\n"
	"  spot:X,Y,Z:TX,TY,TZ:ANGLE[,...]  position, the point it shines at, half the angle of its cone in\n"
	"                                   degrees; the light is full within 0.9 of it\n"
	"  preset:NAME                      a light that came with the model (`psr list --presets`)\n"
	"and, but for the last, followed by any of color=#rrggbb (white), intensity=I (1), shadow, and for\n"
	"point and spot ref=R: the distance at which the intensity holds, falling with its square; without it\n"
	"the light does not fall.\n"
	"Without --light and --ambient there is one white light from the upper left behind the camera, and\n"
	"ambient 0.15.\n"
	"\n"
	SHOW_HELP
	"\n"
	"examples:\n"
	"  psr shot --model teapot --size 1280x720 -o teapot.png\n"
	"  psr shot --model dragon --eye 0,0.2,0.5 --target 0,0.1,0 --light dir:-1,-2,-1 -o dragon.png\n"
	"  psr shot --model dragon --ambient 1 --ortho 0.3 -o flat.png --depth flat.exr --hash\n"
	"  psr shot --model dragon --show levels -o levels.png\n"
	"  psr shot --model dragon --plane normal -o normals.npy\n"
	"\n" PSR_EXIT_CODES;

static int on_light(const char *text, void *userdata, struct psr_error *err)
{
	struct shot *shot = userdata;
	struct psr_msg_scene *scene = &shot->scene;

	if (scene->n_lights == PSR_WIRE_MAX_LIGHTS)
		return psr_fail(err, PSR_ERR_LIMIT, "there are %d lights at most", PSR_WIRE_MAX_LIGHTS);
	shot->preset.light[scene->n_lights] = preset_of_light(text);
	if (shot->preset.light[scene->n_lights] != NULL)
		shot->preset.has_lights = 1;
	else if (psr_light_parse(&scene->light[scene->n_lights], text, err) != PSR_OK)
		return PSR_ERR_ARG;
	scene->n_lights++;
	return PSR_OK;
}

static int parse(struct shot *shot, int argc, char **argv, struct psr_error *err)
{
	const struct psr_opt opts[] = {
		PSR_OPT_SERVER(shot->server),
		{ "model", 'm', PSR_OPT_STRING, &shot->model, "NAME", "The model, by its name in `psr list`.", 0, 0, NULL,
		  NULL },
		{ "size", 0, PSR_OPT_SIZE, shot->size, "WxH", "Pixels.", 0, 0, NULL, NULL },
		{ "eye", 0, PSR_OPT_VEC3, shot->camera.eye, "X,Y,Z",
		  "Where the camera is, in the coordinates of the source file. Without a camera the whole model is in the "
		  "picture.",
		  0, 0, NULL, &shot->camera.has_eye },
		{ "target", 0, PSR_OPT_VEC3, shot->camera.target, "X,Y,Z", "What it looks at; else the middle of the model.", 0,
		  0, NULL, &shot->camera.has_target },
		{ "up", 0, PSR_OPT_VEC3, shot->camera.up, "X,Y,Z",
		  "What is up in the picture; else 0,1,0, or 0,0,-1 for a view along it.", 0, 0, NULL, &shot->camera.has_up },
		{ "fov", 0, PSR_OPT_REAL, &shot->fov, "DEG", "Perspective, with this vertical angle of view.", 0, 0, NULL,
		  &shot->has_fov },
		{ "ortho", 0, PSR_OPT_REAL, &shot->ortho, "HEIGHT",
		  "Orthographic instead, with a picture of this height in the units of the source file.", 0, 0, NULL,
		  &shot->has_ortho },
		{ "camera", 0, PSR_OPT_STRING, &shot->preset.camera, "NAME",
		  "A camera that came with the model, in the place of all of these; `psr list --presets` shows them.", 0, 0,
		  NULL, NULL },
		{ "light", 'l', PSR_OPT_CALL, shot, "LIGHT", "A light, see below; repeatable.", 0, 0, on_light, NULL },
		{ "lights", 0, PSR_OPT_STRING, &shot->lights, "model", "All lights that came with the model.", 0, 0, NULL,
		  NULL },
		{ "ambient", 0, PSR_OPT_REAL, &shot->ambient, "A",
		  "Light from everywhere; 1 without a --light shows the flat diffuse colour.", 0, PSR_WIRE_MAX_INTENSITY, NULL,
		  &shot->has_ambient },
		{ "background", 0, PSR_OPT_COLOR, shot->background, "#rrggbb", "The colour where nothing is.", 0, 0, NULL,
		  NULL },
		{ "spacing", 0, PSR_OPT_REAL, &shot->spacing, "PX",
		  "The greatest distance between neighbouring samples that is good enough, pixels: less is finer and slower.",
		  0, 0, NULL, NULL },
		{ "smooth", 0, PSR_OPT_FLAG, &shot->is_smooth, NULL,
		  "Anti-aliasing for about a quarter of a frame's time: edges are blended with what is behind them, and pixels "
		  "with their neighbours of the same surface.",
		  0, 0, NULL, NULL },
		{ "codec", 0, PSR_OPT_STRING, &shot->codec_text, "CODEC",
		  "How colour travels: jpeg:Q (quality of 1 to 100), lossless, or raw.", 0, 0, NULL, NULL },
		{ "passes", 0, PSR_OPT_INT, &shot->passes, "N",
		  "Anti-aliasing: refine the picture in N passes, of 2x2, 4x4, ... sub-pixels a pixel; servers may stop "
		  "earlier.",
		  0, 16, NULL, NULL },
		{ "output", 'o', PSR_OPT_STRING, &shot->output, "FILE",
		  "The picture; its ending is the format: .png, .ppm, or any that OpenImageIO writes.", 0, 0, NULL, NULL },
		{ "plane", 0, PSR_OPT_STRING, &shot->plane_text, "PLANE",
		  "What -o writes: color, depth, normal, id (of instances), weight, words (depth and sample id) or block "
		  "(levels, facing). All go to .npy; color, normal and weight to pictures, depth as with --depth.",
		  0, 0, NULL, NULL },
		{ "show", 0, PSR_OPT_STRING, &shot->show_text, "STAGE",
		  "What -o writes is a picture of a stage instead, see below: blocks, samples, cull, levels, normals, weights, "
		  "holes or depth.",
		  0, 0, NULL, NULL },
		{ "depth", 0, PSR_OPT_STRING, &shot->depth, "FILE",
		  "Depth along the view axis in the units of the source file, +inf where nothing is: .pfm, .exr or .tif.", 0, 0,
		  NULL, NULL },
		{ "report", 0, PSR_OPT_STRING, &shot->report, "FILE",
		  "Times, counts, bytes, error bound, camera and model as JSON.", 0, 0, NULL, NULL },
		{ "hash", 0, PSR_OPT_FLAG, &shot->hash, NULL,
		  "Print the XXH64 of each plane as it was drawn, before its codec: `color 0123456789abcdef`.", 0, 0, NULL,
		  NULL },
		{ "effects", 0, PSR_OPT_FLAG, &shot->effects, NULL,
		  "Print what the frame ran, and what it left out and why: `fill left out: no pixel's weight is below 1`.", 0,
		  0, NULL, NULL },
		PSR_OPT_TIMEOUT(shot->timeout),
		{ NULL, 0, PSR_OPT_FLAG, NULL, NULL, NULL, 0, 0, NULL, NULL },
	};
	const struct psr_cli cli = {
		"psr shot --model NAME [--server ADDR] [--size WxH] [camera, lights] -o FILE [--plane PLANE | --show STAGE] "
		"[--depth FILE] "
		"[--report FILE] [--hash] [--effects]",
		"Asks a server for one picture of a model and writes it to a file. Prints nothing but what was asked for.",
		opts,
		footer,
	};

	return psr_cli_parse(&cli, argc, argv, NULL, err);
}

static int check_output(struct shot *shot, struct psr_error *err)
{
	if (shot->plane_text != NULL && shot->show_text != NULL)
		return psr_fail(err, PSR_ERR_ARG, "--plane and --show exclude each other: both say what -o writes");
	if (shot->output == NULL && shot->show_text != NULL)
		return psr_fail(err, PSR_ERR_ARG, "--show paints a picture; -o FILE says where");
	for (shot->plane = 0; shot->plane_text != NULL && strcmp(psr_plane_name(shot->plane), shot->plane_text) != 0;)
		if (++shot->plane == PSR_WIRE_PLANES)
			return psr_fail(err, PSR_ERR_ARG,
			                "--plane takes color, depth, normal, id, weight, words or block, not '%.40s'",
			                shot->plane_text);
	if (shot->show_text != NULL) {
		shot->show = show_find(shot->show_text, err);
		return shot->show == NULL ? PSR_ERR_ARG : psr_picture_check_color(shot->output, err);
	}
	return shot->output == NULL ? PSR_OK : psr_picture_check_plane(shot->plane, shot->output, err);
}

static int check(struct shot *shot, struct psr_error *err)
{
	uint32_t w = shot->size[0], h = shot->size[1];
	int code;

	if (shot->model == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--model NAME is missing; `psr list` shows the names");
	if (shot->output == NULL && shot->depth == NULL && shot->report == NULL && !shot->hash && !shot->effects)
		return psr_fail(err, PSR_ERR_ARG, "nothing was asked for; say -o FILE, --depth, --report, --hash or --effects");
	if (w == 0 || h == 0)
		return psr_fail(err, PSR_ERR_ARG, "--size: a picture of %ux%u has no pixels", w, h);
	if (w > PSR_WIRE_MAX_SIDE || h > PSR_WIRE_MAX_SIDE || (uint64_t)w * h > PSR_WIRE_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "--size: %ux%u is too large; a side has at most %d pixels, a picture %u", w,
		                h, PSR_WIRE_MAX_SIDE, PSR_WIRE_MAX_PIXELS);
	if (shot->preset.camera != NULL && (shot->camera.has_eye || shot->camera.has_target || shot->camera.has_up
	                                    || shot->has_fov || shot->has_ortho))
		return psr_fail(err, PSR_ERR_ARG,
		                "--camera is a whole camera; it excludes --eye, --target, --up, --fov and --ortho");
	if (shot->lights != NULL && strcmp(shot->lights, "model") != 0)
		return psr_fail(err, PSR_ERR_ARG, "--lights takes 'model', not '%.40s'; --light is for one light",
		                shot->lights);
	shot->preset.all_lights = shot->lights != NULL;
	if (shot->has_fov && shot->has_ortho)
		return psr_fail(err, PSR_ERR_ARG, "--fov and --ortho exclude each other");
	if (!(shot->fov >= 0.001 && shot->fov < 180))
		return psr_fail(err, PSR_ERR_ARG, "--fov: %g is out of range; it takes 0.001 to less than 180 degrees",
		                shot->fov);
	if (shot->has_ortho && !(shot->ortho >= 1 / PSR_WIRE_MAX_LENGTH && shot->ortho <= PSR_WIRE_MAX_LENGTH))
		return psr_fail(err, PSR_ERR_ARG, "--ortho: a height above 0 is needed, not %g", shot->ortho);
	for (int i = 0; i < 3; i++)
		if (fabs(shot->camera.eye[i]) > PSR_WIRE_MAX_LENGTH || fabs(shot->camera.target[i]) > PSR_WIRE_MAX_LENGTH
		    || fabs(shot->camera.up[i]) > PSR_WIRE_MAX_LENGTH)
			return psr_fail(err, PSR_ERR_ARG, "--eye, --target, --up: coordinates are at most 1e30");
	if (!(shot->spacing >= 1.0 / 64 && shot->spacing <= 64))
		return psr_fail(err, PSR_ERR_ARG, "--spacing: %g is out of range; it takes 1/64 to 64 pixels", shot->spacing);
	if (psr_codec_parse(&shot->frame.color_codec, &shot->frame.color_quality, shot->codec_text, err) != PSR_OK)
		return PSR_ERR_ARG;
	code = check_output(shot, err);
	if (code == PSR_OK && shot->depth != NULL)
		code = psr_picture_check_depth(shot->depth, err);
	return code == PSR_OK ? psr_address_check(shot->server, err) : code;
}

static int prepare(struct shot *shot, struct psr_client *client, const struct psr_msg_opened *opened,
                   struct psr_error *err)
{
	struct psr_msg_scene *scene = &shot->scene;
	struct psr_msg_frame *frame = &shot->frame;
	int code;

	shot->camera.fov_y = shot->has_ortho ? 0 : shot->fov * DEGREE;
	shot->camera.ortho_height = shot->has_ortho ? shot->ortho : 0;
	code = psr_camera_complete(&frame->camera, &shot->camera, opened->box_min, opened->box_max,
	                           (double)shot->size[0] / shot->size[1], err);
	if (code == PSR_OK)
		code =
			preset_apply(&shot->preset, client, opened->handle, &frame->camera, scene, (int)shot->timeout * 1000, err);
	if (code != PSR_OK)
		return code;
	if (shot->spacing != 1 || shot->is_smooth) {
		frame->budget = PSR_WIRE_BUDGET_SETTINGS;
		frame->settings.scale = 1;
		frame->settings.is_smooth = shot->is_smooth != 0;
		frame->settings.spacing_px = shot->spacing;
	}
	frame->width = shot->size[0];
	frame->height = shot->size[1];
	frame->pass_limit = (uint16_t)shot->passes;
	frame->planes = shot->show != NULL ? show_planes(shot->show) : 1u << shot->plane;
	if (shot->depth != NULL)
		frame->planes |= 1 << PSR_WIRE_PLANE_DEPTH;
	if (!(frame->planes & 1 << PSR_WIRE_PLANE_COLOR))
		frame->color_codec = frame->color_quality = 0;
	if (frame->planes & 1 << PSR_WIRE_PLANE_DEPTH) {
		frame->depth_format = PSR_WIRE_DEPTH_F32;
		frame->depth_codec = PSR_CODEC_ZSTD;
	}
	if (frame->planes & ~(1u << PSR_WIRE_PLANE_COLOR | 1u << PSR_WIRE_PLANE_DEPTH))
		frame->data_codec = PSR_CODEC_ZSTD;
	if (scene->n_lights == 0 && !shot->has_ambient)
		psr_light_key(&scene->light[scene->n_lights++], &frame->camera);
	scene->ambient = shot->ambient;
	memcpy(scene->background, shot->background, sizeof scene->background);
	scene->n_instances = 1;
	scene->instance[0] = (struct psr_msg_instance){ .handle = opened->handle, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	return PSR_OK;
}

static int write_files(const struct shot *shot, const struct shot_facts *facts, struct psr_error *err)
{
	const struct psr_event *event = facts->event;
	int code = PSR_OK;

	if (shot->show != NULL)
		code = show_write(shot->show, event, shot->output, err);
	else if (shot->output != NULL)
		code = psr_picture_write_plane(event->picture, shot->plane, shot->output, err);
	if (code == PSR_OK && shot->depth != NULL)
		code = psr_picture_write_depth(event->picture, shot->depth, err);
	if (code == PSR_OK && shot->report != NULL)
		code = report_write(facts, shot->report, err);
	if (code == PSR_OK && shot->hash) {
		for (unsigned plane = 0; plane < PSR_WIRE_PLANES; plane++)
			if (event->end->planes >> plane & 1)
				printf("%s %016" PRIx64 "\n", psr_plane_name(plane), event->end->hash[plane]);
		code = psr_flush_output(err);
	}
	if (code == PSR_OK && shot->effects) {
		effects_print(event->end);
		code = psr_flush_output(err);
	}
	if (code == PSR_OK && isatty(STDERR_FILENO))
		fprintf(stderr, "%s: %ux%u, %.1f ms, %.1f kB, error bound %.1f px\n", shot->model, shot->size[0], shot->size[1],
		        (double)event->latency_ns / 1e6, (double)event->bytes / 1e3, event->end->error_px);
	return code;
}

static int draw(struct shot *shot, struct psr_client *client, struct shot_facts *facts, struct psr_error *err)
{
	struct psr_progress_line line = { 0 };
	struct psr_msg_opened opened;
	struct psr_event event;
	struct timespec start, end;
	int timeout_ms = (int)shot->timeout * 1000, code;
	uint32_t id;

	clock_gettime(CLOCK_MONOTONIC, &start);
	psr_client_set_resolution(client, shot->size[0] > shot->size[1] ? shot->size[0] : shot->size[1]);
	code = psr_client_open(client, shot->model, psr_progress_draw, &line, timeout_ms, &opened, err);
	psr_progress_end(&line);
	if (code == PSR_OK)
		code = prepare(shot, client, &opened, err);
	if (code == PSR_OK)
		code = psr_client_scene(client, &shot->scene, NULL, err);
	if (code == PSR_OK)
		code = psr_client_frame(client, &shot->frame, &id, err);
	if (code != PSR_OK)
		return code;
	do
		code = psr_client_wait(client, timeout_ms, &event, err);
	while (code > 0 && event.type == PSR_EVENT_FRAME && !event.end->is_final);
	if (code < 0)
		return code;
	if (code == 0)
		return psr_fail(err, PSR_ERR_CONNECTION, "%s: no frame within %d s; --timeout waits longer", shot->server,
		                timeout_ms / 1000);
	if (event.type == PSR_EVENT_FAILED)
		return psr_fail(err, event.error.code, "%s", event.error.text);
	clock_gettime(CLOCK_MONOTONIC, &end);
	facts->opened = &opened;
	facts->event = &event;
	facts->server = psr_client_welcome(client)->server;
	facts->total_ns =
		(uint64_t)(end.tv_sec - start.tv_sec) * 1000000000u + (uint64_t)end.tv_nsec - (uint64_t)start.tv_nsec;
	return write_files(shot, facts, err);
}

int psr_shot_main(int argc, char **argv)
{
	struct shot *shot = calloc(1, sizeof *shot);
	struct psr_client *client = NULL;
	struct psr_error err;
	int code;

	if (shot == NULL) {
		psr_fail(&err, PSR_ERR_MEMORY, "no memory");
		return psr_cli_fail("psr shot", &err);
	}
	shot->server = psr_default_server();
	shot->codec_text = "lossless";
	shot->size[0] = 800;
	shot->size[1] = 600;
	for (int i = 0; i < 3; i++)
		shot->camera.eye[i] = shot->camera.target[i] = shot->camera.up[i] = NAN; /* so that --help shows no default */
	shot->fov = 35;
	shot->ortho = NAN;
	shot->spacing = 1;
	shot->ambient = DEFAULT_AMBIENT;
	memcpy(shot->background, "\x20\x24\x28", 3);
	shot->timeout = PSR_DEFAULT_TIMEOUT;
	code = parse(shot, argc, argv, &err);
	if (code == PSR_OK)
		code = check(shot, &err);
	if (code == PSR_OK)
		code = psr_client_connect(&client, shot->server, PSR_PROGRAM, shot->model, (int)shot->timeout * 1000, &err);
	if (code == PSR_OK) {
		struct shot_facts facts = { .model = shot->model, .codec = shot->codec_text };

		code = draw(shot, client, &facts, &err);
	}
	psr_client_close(client);
	free(shot);
	return code >= 0 ? 0 : psr_cli_fail("psr shot", &err);
}
