/* The program psr itself ($BUILD/bin/psr), against a server of the test's own on a TCP port. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <cjson/cJSON.h>
#include <fcntl.h>
#include <math.h>
#include <netinet/in.h>
#include <png.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include "proto/proto.h"
#include "psr/render.h"

#define MAX_SIDE 64

static char folder[96], program[512], address[64], out[1 << 16], err[1 << 16];
static int listener;

/* ---- the server: models "cube" (sound), "broken" (frames fail), "flaky" (frames fail after
 * some), "damaged" (wrong hashes), "slow" (built first), "rotten" (cannot be served) ---- */

struct session {
	int fd;
	char model[PSR_WIRE_MAX_NAME + 1];
	struct psr_framer framer;
	uint8_t in[2 * PSR_WIRE_MAX_MESSAGE], out[2 * PSR_WIRE_MAX_MESSAGE];
	struct psr_msg_scene scene;
	struct psr_buf buf;
};

static uint8_t color_at(uint32_t x, uint32_t y, int c)
{
	return (uint8_t)(x * 3 + y * 5 + (uint32_t)c * 70);
}

/* Of any session. */
static pthread_mutex_t last_lock = PTHREAD_MUTEX_INITIALIZER;
static struct psr_msg_scene last_scene;

static void put_frame(struct session *s, uint32_t id, const struct psr_msg_frame *asked)
{
	static const char *const text = "the scene is on fire";
	uint32_t w = asked->width, h = asked->height, n = w * h;
	struct psr_msg_frame_begin begin = { .width = w,
		                                 .height = h,
		                                 .planes = asked->planes,
		                                 .color_codec = asked->color_codec,
		                                 .color_quality = asked->color_quality,
		                                 .depth_format = asked->depth_format,
		                                 .depth_codec = asked->depth_codec,
		                                 .data_codec = asked->data_codec,
		                                 .settings = { .scale = 1, .spacing_px = 1 },
		                                 .camera = asked->camera };
	if (asked->budget == PSR_WIRE_BUDGET_SETTINGS)
		begin.settings = asked->settings;
	struct psr_msg_frame_end end = { .is_final = 1,
		                             .has_hashes = 1,
		                             .planes = asked->planes,
		                             .error_px = 1.5,
		                             .n_entries = 5,
		                             .entry = { { PSR_WIRE_REPORT_WARP, 2000000, 77 },
		                                        { PSR_WIRE_REPORT_TOTAL, 3000000, 2 },
		                                        { PSR_WIRE_REPORT_EFFECTS + PSR_EFFECT_LEVELS, PSR_WHY_RAN, 3 },
		                                        { PSR_WIRE_REPORT_EFFECTS + PSR_EFFECT_SPECULAR, PSR_WHY_NOTHING, 0 },
		                                        { 127, 1, 0 } } };
	uint8_t rgb[3 * MAX_SIDE * MAX_SIDE];
	float depth[MAX_SIDE * MAX_SIDE];
	uint8_t weight[MAX_SIDE * MAX_SIDE];
	uint64_t words[MAX_SIDE * MAX_SIDE];
	const uint8_t *const planes[PSR_N_PLANES] = { rgb, (uint8_t *)depth, NULL, NULL, weight, (uint8_t *)words };
	const struct psr_frame frame = { .width = w, .height = h, .rgb = rgb, .depth = depth, .weight = weight,
		                             .words = words };

	if (strcmp(s->model, "broken") == 0 || (strcmp(s->model, "flaky") == 0 && id > 10) || w > MAX_SIDE
	    || h > MAX_SIDE) {
		struct psr_msg_error msg = { .code = w > MAX_SIDE ? PSR_WIRE_LIMIT : PSR_WIRE_INTERNAL };

		strcpy(msg.text, text);
		psr_msg_error_encode(&s->buf, id, 0, &msg, NULL);
		return;
	}
	for (uint32_t i = 0; i < n; i++) {
		depth[i] = i % 5 == 0 ? INFINITY : 1 + (float)i;
		weight[i] = (uint8_t)(i % 4 * 85);
		words[i] = i % 3 == 0 ? UINT64_C(0x7f800000ffffffff) : UINT64_C(0x3f80000000000000) + i;
		for (int c = 0; c < 3; c++)
			rgb[3 * i + (uint32_t)c] = color_at(i % w, i / w, c);
	}
	psr_msg_frame_begin_encode(&s->buf, id, 0, &begin, NULL);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
		uint32_t bytes = n * psr_plane_pixel_bytes(plane, PSR_WIRE_DEPTH_F32);
		const struct psr_msg_rect rect = { (uint8_t)plane, PSR_CODEC_RAW, 1, 0, 0, (uint16_t)w, (uint16_t)h, bytes, 0,
			                               bytes, planes[plane] };

		if (!(asked->planes >> plane & 1))
			continue;
		end.hash[plane] = psr_frame_hash(&frame, plane) ^ (plane == 0 && strcmp(s->model, "damaged") == 0);
		psr_msg_rect_encode(&s->buf, id, 0, &rect, NULL);
	}
	psr_msg_frame_end_encode(&s->buf, id, 0, &end, NULL);
}

static void put_list(struct session *s, uint32_t id)
{
	const struct psr_msg_list_entry entries[] = { { PSR_ENTRY_LOADED, 2500000, { 0xab }, "cube" },
		                                          { PSR_ENTRY_FAILED, 3000, { 0 }, "rotten" },
		                                          { PSR_ENTRY_SOURCE, 10, { 0 }, "slow" } };

	for (int i = 0; i < 3; i++)
		psr_msg_list_entry_encode(&s->buf, id, &entries[i], NULL);
	psr_msg_list_end_encode(&s->buf, id, &(struct psr_msg_list_end){ 3 }, NULL);
}

static void put_opened(struct session *s, uint32_t id)
{
	static const struct psr_msg_opened opened = { .handle = 1,
		                                          .representations = 2,
		                                          .box_min = { -1, -1, -1 },
		                                          .box_max = { 1, 1, 1 },
		                                          .scale = 1,
		                                          .spacing = 0.125,
		                                          .resolution = 256,
		                                          .n_levels = 1,
		                                          .n_samples = 1000,
		                                          .up = { 0, 1, 0 } };
	struct psr_msg_error missing = { PSR_WIRE_NOT_FOUND, "no model of this name" };
	struct psr_msg_error rotten = { PSR_WIRE_FORMAT, "face 7 has no vertex 8" };

	if (strcmp(s->model, "cube") != 0 && strcmp(s->model, "slow") != 0 && strcmp(s->model, "broken") != 0
	    && strcmp(s->model, "flaky") != 0 && strcmp(s->model, "damaged") != 0) {
		psr_msg_error_encode(&s->buf, id, 0, strcmp(s->model, "rotten") == 0 ? &rotten : &missing, NULL);
		return;
	}
	if (strcmp(s->model, "slow") == 0)
		for (uint64_t i = 0; i <= 4; i++)
			psr_msg_progress_encode(&s->buf, id, &(struct psr_msg_progress){ PSR_PROGRESS_SAMPLE, i, 4 }, NULL);
	psr_msg_opened_encode(&s->buf, id, &opened, NULL);
}

/* Two cameras and two lights; none of model "slow". */
static void put_presets(struct session *s, uint32_t id)
{
	static const struct psr_msg_preset presets[4] = {
		{ .kind = PSR_WIRE_PRESET_CAMERA, .name = "front",
		  .camera = { { 0, 0, 7 }, { 0, 0, 0 }, { 0, 1, 0 }, PSR_CAMERA_PERSPECTIVE, 0.5, 0, 0.25 } },
		{ .kind = PSR_WIRE_PRESET_CAMERA, .name = "plan",
		  .camera = { { 0, 9, 0 }, { 0, 0, 0 }, { 0, 0, -1 }, PSR_CAMERA_ORTHOGRAPHIC, 0, 4, 0 } },
		{ .kind = PSR_WIRE_PRESET_LIGHT, .name = "sun",
		  .light = { .kind = PSR_WIRE_LIGHT_DIRECTIONAL, .color = { 255, 240, 200 }, .intensity = 3,
		             .direction = { 0, -1, 0 } } },
		{ .kind = PSR_WIRE_PRESET_LIGHT, .name = "the lamp",
		  .light = { .kind = PSR_WIRE_LIGHT_POINT, .color = { 255, 255, 255 }, .intensity = 40, .position = { 1, 2, 3 },
		             .reference = 1 } },
	};
	int has_some = strcmp(s->model, "slow") != 0;

	for (int i = 0; i < 4 && has_some; i++)
		psr_msg_preset_encode(&s->buf, id, &presets[i], NULL);
	psr_msg_presets_end_encode(&s->buf, id, &(struct psr_msg_presets_end){ has_some ? 2 : 0, has_some ? 2 : 0 }, NULL);
}

/* 0: the client is gone. */
static int answer(struct session *s, const struct psr_message *message)
{
	const struct psr_msg_welcome welcome = { .minor = PSR_PROTO_MINOR,
		                                     .capabilities = PSR_CAP_PRESETS | PSR_CAP_WEIGHT | PSR_CAP_WORDS
		                                                     | PSR_CAP_REFINE,
		                                     .max_message = 65536,
		                                     .max_side = 64,
		                                     .max_pixels = 4096,
		                                     .max_instances = 1,
		                                     .max_lights = 4,
		                                     .max_scenes = 1,
		                                     .max_open = 8,
		                                     .max_models = 4,
		                                     .server = "test 1" };
	struct psr_msg_frame frame;
	struct psr_msg_open open;

	switch (message->type) {
	case PSR_MSG_HELLO:
		psr_msg_welcome_encode(&s->buf, &welcome, NULL);
		psr_framer_accept(&s->framer, s->in, sizeof s->in);
		break;
	case PSR_MSG_LIST:
		put_list(s, message->id);
		break;
	case PSR_MSG_OPEN:
		if (psr_msg_open_decode(&open, message->payload, message->n, NULL) != PSR_OK)
			return 0;
		memcpy(s->model, open.name, sizeof s->model);
		put_opened(s, message->id);
		break;
	case PSR_MSG_PRESETS:
		put_presets(s, message->id);
		break;
	case PSR_MSG_SCENE:
		if (psr_msg_scene_decode(&s->scene, message->payload, message->n, NULL) != PSR_OK)
			return 0;
		pthread_mutex_lock(&last_lock);
		last_scene = s->scene;
		pthread_mutex_unlock(&last_lock);
		break;
	case PSR_MSG_FRAME:
		if (psr_msg_frame_decode(&frame, message->payload, message->n, NULL) != PSR_OK)
			return 0;
		put_frame(s, message->id, &frame);
		break;
	default:
		return 0;
	}
	return send(s->fd, s->buf.data, s->buf.size, MSG_NOSIGNAL) == (ssize_t)s->buf.size;
}

static void *serve(void *userdata)
{
	struct session *s = userdata;

	s->buf.data = s->out;
	s->buf.capacity = sizeof s->out;
	psr_framer_init(&s->framer, PSR_CLIENT, s->in, sizeof s->in);
	for (;;) {
		struct psr_message message;
		int got = psr_framer_next(&s->framer, &message, NULL);
		uint8_t *space;
		size_t room;
		ssize_t n;

		s->buf.size = 0;
		if (got < 0 || (got > 0 && !answer(s, &message)))
			break;
		if (got > 0)
			continue;
		space = psr_framer_space(&s->framer, &room);
		n = recv(s->fd, space, room, 0);
		if (n <= 0)
			break;
		psr_framer_filled(&s->framer, (size_t)n);
	}
	close(s->fd);
	free(s);
	return NULL;
}

static void *accept_all(void *userdata)
{
	(void)userdata;
	for (;;) {
		int fd = accept4(listener, NULL, NULL, SOCK_CLOEXEC);
		struct session *s = fd >= 0 ? calloc(1, sizeof *s) : NULL;
		pthread_t thread;

		if (s == NULL)
			return NULL;
		s->fd = fd;
		if (pthread_create(&thread, NULL, serve, s) == 0)
			pthread_detach(thread);
	}
}

/* ---- running psr ---- */

static void read_back(const char *leaf, char *to, size_t size)
{
	char path[160];
	FILE *file;

	snprintf(path, sizeof path, "%s/%s", folder, leaf);
	file = fopen(path, "rb");
	assert_non_null(file);
	to[fread(to, 1, size - 1, file)] = '\0';
	fclose(file);
}

/* Runs `psr ARGS` through the shell in the folder; its exit status. `out` and `err` get what it printed. */
static int psr(const char *args)
{
	char command[1024];
	int status;

	snprintf(command, sizeof command, "cd '%s' && PSR_SERVER=%s timeout 60 '%s' %s >out 2>err", folder, address,
	         program, args);
	status = system(command);
	read_back("out", out, sizeof out);
	read_back("err", err, sizeof err);
	assert_true(WIFEXITED(status));
	return WEXITSTATUS(status);
}

static int set_up(void **state)
{
	struct sockaddr_in at = { .sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK) };
	const char *root = getenv("TMPDIR"), *build = getenv("BUILD");
	socklen_t size = sizeof at;
	pthread_t thread;

	(void)state;
	signal(SIGPIPE, SIG_IGN);
	snprintf(program, sizeof program, "%s/bin/psr", build != NULL ? build : "build/release");
	snprintf(folder, sizeof folder, "%s/psr-program-XXXXXX", root != NULL && strlen(root) < 60 ? root : "/tmp");
	listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	if (mkdtemp(folder) == NULL || bind(listener, (struct sockaddr *)&at, sizeof at) != 0 || listen(listener, 16) != 0
	    || getsockname(listener, (struct sockaddr *)&at, &size) != 0)
		return 1;
	snprintf(address, sizeof address, "127.0.0.1:%d", ntohs(at.sin_port));
	if (pthread_create(&thread, NULL, accept_all, NULL) != 0)
		return 1;
	pthread_detach(thread);
	return access(program, X_OK);
}

static int tear_down(void **state)
{
	char command[160];

	(void)state;
	snprintf(command, sizeof command, "rm -rf '%s'", folder);
	return system(command);
}

static void list_prints_a_table_and_json(void **state)
{
	cJSON *list;

	(void)state;
	assert_int_equal(psr("list"), 0);
	assert_non_null(strstr(out, "name    state           MB\n"));
	assert_non_null(strstr(out, "cube    loaded        2.50\n"));
	assert_non_null(strstr(out, "rotten  failed        0.00  face 7 has no vertex 8\n"));
	assert_string_equal(err, "");
	assert_int_equal(psr("list --json"), 0);
	list = cJSON_Parse(out);
	assert_int_equal(cJSON_GetArraySize(list), 3);
	assert_string_equal(cJSON_GetObjectItem(cJSON_GetArrayItem(list, 2), "state")->valuestring, "source");
	assert_string_equal(cJSON_GetObjectItem(cJSON_GetArrayItem(list, 1), "error")->valuestring, "face 7 has no vertex "
	                                                                                            "8");
	assert_true(cJSON_GetObjectItem(cJSON_GetArrayItem(list, 0), "bytes")->valuedouble == 2500000);
	cJSON_Delete(list);
}

static void list_prints_cameras_and_lights_of_a_model(void **state)
{
	cJSON *list;

	(void)state;
	assert_int_equal(psr("list --presets cube"), 0);
	assert_string_equal(out, "camera  perspective   front\ncamera  orthographic  plan\n"
	                         "light   directional   sun\nlight   point         the lamp\n");
	assert_int_equal(psr("list --presets cube --json"), 0);
	list = cJSON_Parse(out);
	assert_int_equal(cJSON_GetArraySize(list), 4);
	assert_string_equal(cJSON_GetObjectItem(cJSON_GetArrayItem(list, 3), "name")->valuestring, "the lamp");
	assert_string_equal(cJSON_GetObjectItem(cJSON_GetArrayItem(list, 3), "kind")->valuestring, "light");
	assert_string_equal(cJSON_GetObjectItem(cJSON_GetArrayItem(list, 3), "type")->valuestring, "point");
	cJSON_Delete(list);
	assert_int_equal(psr("list --presets slow"), 0);
	assert_string_equal(out, "");
}

/* `psr ARGS` draws; the scene that it sent, and its camera by the report. */
static cJSON *draw_for_camera(const char *args, struct psr_msg_scene *scene)
{
	static char text[1 << 16];
	cJSON *report;

	assert_int_equal(psr(args), 0);
	pthread_mutex_lock(&last_lock);
	*scene = last_scene;
	pthread_mutex_unlock(&last_lock);
	read_back("p.json", text, sizeof text);
	report = cJSON_Parse(text);
	assert_non_null(report);
	return report;
}

static void shot_takes_cameras_and_lights_of_the_model(void **state)
{
	static struct psr_msg_scene scene;
	cJSON *report, *camera;

	(void)state;
	report = draw_for_camera("shot --model cube --size 20x10 --camera front --report p.json --light dir:0,0,-1 "
	                         "--light 'preset:the lamp'", &scene);
	camera = cJSON_GetObjectItem(report, "camera");
	assert_true(cJSON_GetArrayItem(cJSON_GetObjectItem(camera, "eye"), 2)->valuedouble == 7);
	assert_string_equal(cJSON_GetObjectItem(camera, "kind")->valuestring, "perspective");
	cJSON_Delete(report);
	assert_int_equal(scene.n_lights, 2);
	assert_int_equal(scene.light[0].kind, PSR_WIRE_LIGHT_DIRECTIONAL);
	assert_int_equal(scene.light[1].kind, PSR_WIRE_LIGHT_POINT);
	assert_true(scene.light[1].intensity == 40 && scene.light[1].position[1] == 2);

	report = draw_for_camera("shot --model cube --size 20x10 --camera plan --report p.json --lights model", &scene);
	camera = cJSON_GetObjectItem(report, "camera");
	assert_string_equal(cJSON_GetObjectItem(camera, "kind")->valuestring, "orthographic");
	assert_true(cJSON_GetObjectItem(camera, "height")->valuedouble == 4);
	cJSON_Delete(report);
	assert_int_equal(scene.n_lights, 2);
	assert_memory_equal(scene.light[0].color, ((const uint8_t[]){ 255, 240, 200 }), 3);
	assert_true(scene.light[0].intensity == 3 && scene.light[1].reference == 1);

	/* A camera alone: the light is that of every picture for which nobody asked for one. */
	report = draw_for_camera("shot --model cube --size 20x10 --camera front --report p.json", &scene);
	cJSON_Delete(report);
	assert_int_equal(scene.n_lights, 1);
	assert_int_equal(scene.light[0].kind, PSR_WIRE_LIGHT_DIRECTIONAL);
	assert_true(scene.light[0].intensity == 1);
}

static void cameras_and_lights_of_a_model_move_with_it(void **state)
{
	static const double lamp[3] = { 4, 4, 2 }, eye[3] = { 8, 2, 3 };
	static struct psr_msg_scene scene;
	cJSON *report, *camera;

	(void)state;
	report = draw_for_camera("shot --instance cube,rotate=Y:90,at=1,2,3 --size 20x10 --camera front --report p.json "
	                         "--light 'preset:the lamp'", &scene);
	camera = cJSON_GetObjectItem(report, "camera");
	for (int i = 0; i < 3; i++) { /* turned, 1,2,3 is 3,2,-1 and 0,0,7 is 7,0,0; some roundings of 8 * 2^-53 */
		assert_true(fabs(scene.light[0].position[i] - lamp[i]) < 1e-14);
		assert_true(fabs(cJSON_GetArrayItem(cJSON_GetObjectItem(camera, "eye"), i)->valuedouble - eye[i]) < 1e-14);
	}
	cJSON_Delete(report);
}

static void shot_writes_what_was_asked_for_and_prints_nothing(void **state)
{
	png_image image = { .version = PNG_IMAGE_VERSION };
	uint8_t rgb[3 * 20 * 10];
	char path[160];

	(void)state;
	assert_int_equal(psr("shot --model slow --size 20x10 -o a.png --depth a.pfm --report a.json"), 0);
	assert_string_equal(out, "");
	assert_string_equal(err, "");
	snprintf(path, sizeof path, "%s/a.png", folder);
	assert_true(png_image_begin_read_from_file(&image, path));
	assert_true(image.width == 20 && image.height == 10);
	image.format = PNG_FORMAT_RGB;
	assert_true(png_image_finish_read(&image, NULL, rgb, 0, NULL));
	for (uint32_t i = 0; i < sizeof rgb; i++)
		assert_int_equal(rgb[i], color_at(i / 3 % 20, i / 60, (int)(i % 3)));
}

static void shot_writes_planes_and_paints_stages(void **state)
{
	static uint8_t bytes[1 << 16];

	(void)state;
	assert_int_equal(psr("shot --model cube --size 20x10 --plane words -o w.npy --hash"), 0);
	assert_true(strncmp(out, "words ", 6) == 0 && strlen(out) == 23);
	read_back("w.npy", (char *)bytes, sizeof bytes);
	for (uint32_t i = 0; i < 200; i++) {
		uint64_t word;

		memcpy(&word, bytes + 128 + 8 * i, 8);
		assert_true(word == (i % 3 == 0 ? UINT64_C(0x7f800000ffffffff) : UINT64_C(0x3f80000000000000) + i));
	}
	assert_int_equal(psr("shot --model cube --size 20x10 --plane weight -o w.ppm --report r.json --codec jpeg:50"), 0);
	assert_string_equal(out, "");
	read_back("w.ppm", (char *)bytes, sizeof bytes);
	for (uint32_t i = 0; i < 200; i++)
		assert_int_equal(bytes[13 + 3 * i], i % 4 * 85);
	read_back("r.json", (char *)bytes, sizeof bytes);
	assert_non_null(strstr((char *)bytes, "\"planes\":\t[\"weight\"]"));

	/* Weight 0 is red without a sample, else yellow; other weights are grey with a sample, blue without. */
	assert_int_equal(psr("shot --model cube --size 20x10 --show weights -o s.ppm --hash"), 0);
	assert_true(strncmp(out, "weight ", 7) == 0 && strncmp(out + 24, "words ", 6) == 0 && strlen(out) == 24 + 23);
	read_back("s.ppm", (char *)bytes, sizeof bytes);
	for (uint32_t i = 0; i < 200; i++) {
		const uint8_t *c = bytes + 13 + 3 * i, weight = (uint8_t)(i % 4 * 85);

		if (weight == 0)
			assert_true(c[0] > 200 && c[2] < 100 && (i % 3 == 0 ? c[1] < 100 : c[1] > 200));
		else if (i % 3 == 0)
			assert_true(c[0] == 0 && c[1] <= c[2] && c[2] == 255 - weight);
		else
			assert_true(c[0] == weight && c[1] == weight && c[2] == weight);
	}
	assert_int_equal(psr("shot --model cube --size 20x10 --show depth -o s.ppm --depth d.pfm"), 0);
	assert_int_equal(psr("shot --model cube --size 20x10 --show holes -o s.png"), 0);
}

static void report_has_the_numbers_of_the_frame(void **state)
{
	static char text[1 << 16];
	cJSON *report, *stage;

	(void)state;
	assert_int_equal(psr("shot --model cube --size 20x10 --ortho 3 --eye 0,0,9 --depth a.pfm --report r.json --hash"),
	                 0);
	read_back("r.json", text, sizeof text);
	report = cJSON_Parse(text);
	assert_non_null(report);
	assert_string_equal(cJSON_GetObjectItem(cJSON_GetObjectItem(report, "model"), "name")->valuestring, "cube");
	assert_true(cJSON_GetObjectItem(cJSON_GetObjectItem(report, "model"), "spacing")->valuedouble == 0.125);
	assert_true(cJSON_GetArrayItem(cJSON_GetObjectItem(report, "size"), 0)->valueint == 20);
	assert_string_equal(cJSON_GetObjectItem(cJSON_GetObjectItem(report, "camera"), "kind")->valuestring, "orthographi"
	                                                                                                     "c");
	assert_true(cJSON_GetObjectItem(cJSON_GetObjectItem(report, "camera"), "height")->valuedouble == 3);
	assert_true(cJSON_GetObjectItem(report, "error_px")->valuedouble == 1.5);
	stage = cJSON_GetObjectItem(cJSON_GetObjectItem(report, "stages"), "warp");
	assert_true(cJSON_GetObjectItem(stage, "ms")->valuedouble == 2
	            && cJSON_GetObjectItem(stage, "count")->valueint == 77);
	assert_true(cJSON_GetObjectItem(cJSON_GetObjectItem(report, "ms"), "server")->valuedouble == 3);
	assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(report, "checked")), 2);
	assert_true(strncmp(out, "color ", 6) == 0 && strlen(out) == 2 * 23 && strncmp(out + 23, "depth ", 6) == 0);
	assert_memory_equal(out + 6, cJSON_GetObjectItem(cJSON_GetObjectItem(report, "hashes"), "color")->valuestring, 16);
	cJSON_Delete(report);
}

static void report_says_which_effects_ran_and_why_others_did_not(void **state)
{
	static char text[1 << 16];
	cJSON *report, *effects;

	(void)state;
	assert_int_equal(psr("shot --model cube --size 20x10 --spacing 0.5 --smooth --report r.json --effects"), 0);
	assert_string_equal(out, "levels     ran: 3 depth buffers in addition to the picture's\n"
	                         "specular   left out: no sample in view mirrors light\n");
	read_back("r.json", text, sizeof text);
	report = cJSON_Parse(text);
	assert_true(cJSON_GetObjectItem(report, "spacing_px")->valuedouble == 0.5);
	assert_true(cJSON_IsTrue(cJSON_GetObjectItem(report, "smooth")));
	effects = cJSON_GetObjectItem(report, "effects");
	assert_int_equal(cJSON_GetArraySize(effects), 2);
	assert_true(cJSON_IsTrue(cJSON_GetObjectItem(cJSON_GetObjectItem(effects, "levels"), "ran")));
	assert_int_equal(cJSON_GetObjectItem(cJSON_GetObjectItem(effects, "levels"), "count")->valueint, 3);
	assert_true(cJSON_IsFalse(cJSON_GetObjectItem(cJSON_GetObjectItem(effects, "specular"), "ran")));
	assert_string_equal(cJSON_GetObjectItem(cJSON_GetObjectItem(effects, "specular"), "why")->valuestring,
	                    "no sample in view mirrors light");
	cJSON_Delete(report);
}

static void failures_have_their_exit_status_and_leave_no_file(void **state)
{
	static const struct {
		const char *args;
		int status;
		const char *says;
	} cases[] = {
		{ "", 2, "list" },
		{ "paint", 2, "paint" },
		{ "shot -o x.png", 2, "--model" },
		{ "shot --model cube", 2, "nothing was asked for" },
		{ "shot --model cube -o x.png --size 0x10", 2, "0x10" },
		{ "shot --model cube -o x.png --size 100000x100000", 5, "100000x100000" },
		{ "shot --model cube -o x.png --eye nan,0,0", 2, "--eye" },
		{ "shot --model cube -o x.png --eye 0,0,0", 2, "at the target" },
		{ "shot --model cube -o x.png --light sun", 2, "sun" },
		{ "shot --model cube -o x.png --codec jpeg:200", 2, "jpeg:200" },
		{ "shot --model cube -o x.png --fov 30 --ortho 2", 2, "exclude" },
		{ "shot --model cube -o x --size 8x8", 2, "ending" },
		{ "shot --model cube -o x.png --camera front --eye 1,2,3", 2, "excludes --eye" },
		{ "shot --model cube -o x.png --camera front --fov 30", 2, "excludes --eye" },
		{ "shot --model cube -o x.png --camera back", 3,
		  "the model has no camera 'back'; it has 'front', 'plan'" },
		{ "shot --model cube -o x.png --light preset:moon", 3, "no light 'moon'; it has 'sun', 'the lamp'" },
		{ "shot --model slow -o x.png --camera front", 3, "the model has no cameras" },
		{ "shot --model slow -o x.png --lights model", 3, "the model has no lights" },
		{ "shot --model cube -o x.png --lights all", 2, "takes 'model', not 'all'" },
		{ "list --presets nothing", 3, "no model of this name" },
		{ "shot --model cube -o no/x.png --size 8x8", 3, "no/x.png" },
		{ "shot --model cube -o x.png --light dir:0,-1,0,shadow", 4, "no shadows" },
		{ "shot --model nothing -o x.png", 3, "no model of this name" },
		{ "shot --model cbue -o x.png", 3, "there is no model cbue; did you mean 'cube'?" },
		{ "shot --instance rotten,at=1,2,3 -o x.png", 4, "face 7" },
		{ "shot --model cube --instance cube,at=1,2,3 -o x.png", 5, "there are 2 instances; the server takes 1" },
		{ "shot --model cube -o x.png --passes 5", 2, "--passes: '5' is out of range; it takes 0 to 4" },
		{ "shot --model cube -o x.png --quality finest", 2, "draft, good, fine or best, not 'finest'" },
		{ "shot --model cube -o x.png --smooth --no-smooth", 2, "exclude each other" },
		{ "shot --model cube -o x.png --sheet 0x2", 2, "no place" },
		{ "shot --model cube --sheet 2x2 --hash", 2, "-o FILE says where" },
		{ "turntable --model cube --frames 2 --effects", 2, "--effects is about one picture" },
		{ "turntable --model cube -o x.png --seconds 3600", 2, "65 seconds at most" },
		{ "shot --model broken -o x.png --size 8x8", 7, "on fire" },
		{ "shot --model cube -o x.png --size 65x8", 5, "on fire" },
		{ "shot --model damaged -o x.png --size 8x8", 4, "damaged" },
		{ "shot --server 127.0.0.1:1 --model cube -o x.png", 6, "127.0.0.1:1" },
		{ "list --server nowhere", 2, "nowhere" },
		{ "shot --model cube -o x.png --plane color --show holes", 2, "exclude each other" },
		{ "shot --model cube --show holes --hash", 2, "-o FILE" },
		{ "shot --model cube -o x.png --show pixels", 2, "not 'pixels'" },
		{ "shot --model cube -o x.png --plane pixels", 2, "not 'pixels'" },
		{ "shot --model cube -o x.png --plane words", 2, "the words plane is written as .npy only" },
		{ "shot --model cube -o x.png --plane normal", 4, "does not send the normal plane" },
		{ "shot --model cube -o x.png --show cull", 4, "does not send the normal plane" },
	};
	char path[160];

	(void)state;
	snprintf(path, sizeof path, "%s/x.png", folder);
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		int status = psr(cases[i].args);

		if (status != cases[i].status || strstr(err, cases[i].says) == NULL || out[0] != '\0')
			fail_msg("psr %s: status %d, '%s' '%s'", cases[i].args, status, out, err);
		assert_true(strchr(err, '\n') == err + strlen(err) - 1); /* one line */
		assert_int_equal(access(path, F_OK), -1);
	}
}

static void a_server_that_stops_at_an_earlier_pass_is_told_of(void **state)
{
	(void)state;
	assert_int_equal(psr("shot --model cube --size 20x10 --passes 2 --hash"), 0);
	assert_string_equal(err, "psr shot: the server stopped at pass 0 of 2: the picture is less smooth than asked "
	                         "for\n");
	assert_int_equal(psr("turntable --frames 3 --model cube --size 20x10 --passes 2 --hash"), 0);
	assert_string_equal(err, "psr turntable: the server stopped at pass 0 of 2: the picture is less smooth than asked "
	                         "for\n");
}

static void bench_counts_frames_and_fails_if_one_failed(void **state)
{
	cJSON *json;

	(void)state;
	assert_int_equal(psr("bench --model cube --clients 3 --inflight 2 --seconds 1 --size 16x16 --codec raw --json"), 0);
	json = cJSON_Parse(out);
	assert_non_null(json);
	assert_true(cJSON_GetObjectItem(json, "frames")->valuedouble > 10);
	assert_true(cJSON_GetObjectItem(json, "frames_per_s")->valuedouble
	            == cJSON_GetObjectItem(json, "frames")->valuedouble);
	assert_true(cJSON_GetObjectItem(json, "failed")->valuedouble == 0);
	assert_true(cJSON_GetObjectItem(cJSON_GetObjectItem(json, "latency_ms"), "p50")->valuedouble
	            <= cJSON_GetObjectItem(cJSON_GetObjectItem(json, "latency_ms"), "max")->valuedouble);
	cJSON_Delete(json);
	assert_int_equal(psr("bench --model broken --clients 2 --seconds 1 --size 16x16 --codec raw"), 1);
	assert_int_equal(psr("bench --model flaky --clients 2 --seconds 1 --size 16x16 --codec raw"), 1);
	assert_non_null(strstr(out, "the first failure: "));
	assert_non_null(strstr(out, "on fire"));
	assert_int_equal(psr("bench --model cube --clients 2 --inflight 9 --seconds 1"), 5);
	assert_non_null(strstr(err, "--inflight 9: the server lets a client open 8 requests"));
}

static void help_and_version_work_without_a_server(void **state)
{
	static const char *const all[] = { "--help",           "list --help",  "shot --help",
		                               "turntable --help", "bench --help", "--version" };

	(void)state;
	for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
		assert_int_equal(psr(all[i]), 0);
		assert_string_equal(err, "");
		assert_true(strlen(out) > 5);
	}
	assert_true(strncmp(out, "psr 0.", 6) == 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(list_prints_a_table_and_json),
		cmocka_unit_test(list_prints_cameras_and_lights_of_a_model),
		cmocka_unit_test(shot_takes_cameras_and_lights_of_the_model),
		cmocka_unit_test(cameras_and_lights_of_a_model_move_with_it),
		cmocka_unit_test(shot_writes_what_was_asked_for_and_prints_nothing),
		cmocka_unit_test(shot_writes_planes_and_paints_stages),
		cmocka_unit_test(report_has_the_numbers_of_the_frame),
		cmocka_unit_test(a_server_that_stops_at_an_earlier_pass_is_told_of),
		cmocka_unit_test(report_says_which_effects_ran_and_why_others_did_not),
		cmocka_unit_test(failures_have_their_exit_status_and_leave_no_file),
		cmocka_unit_test(bench_counts_frames_and_fails_if_one_failed),
		cmocka_unit_test(help_and_version_work_without_a_server),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
