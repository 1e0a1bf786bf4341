#include <stdlib.h>
#include "base/clock.h"
#include "client/cli/cli.h"
#include "client/home/home.h"
#include "client/replay/replay.h"
#include "draw.h"
#include "series.h"

void draw_add_options(struct optlist *list, struct draw_wish *wish, const struct psr_opt *files, int n_files)
{
	const struct psr_opt server[] = { PSR_OPT_SERVER(wish->server) }, timeout[] = { PSR_OPT_TIMEOUT(wish->timeout) };

	optlist_heading(list, "Models and server", NULL);
	scene_add_model_options(list, &wish->scene);
	OPTLIST_ADD(list, server);
	optlist_heading(list, "Files", NULL);
	optlist_add(list, files, n_files);
	sink_add_file_options(list, &wish->sink);
	optlist_heading(list, "Camera",
	                "Without any of these the whole model is in the picture, seen from its front, a little "
	                "from the right and from above.");
	view_add_options(list, &wish->view);
	optlist_heading(list, "Light", NULL);
	scene_add_light_options(list, &wish->scene);
	optlist_heading(list, "Quality", NULL);
	quality_add_options(list, &wish->quality);
	quality_add_splats_option(list, &wish->quality);
	quality_add_budget_option(list, &wish->quality);
	quality_add_codec_option(list, &wish->quality);
	optlist_heading(list, "For developers", NULL);
	sink_add_developer_options(list, &wish->sink);
	OPTLIST_ADD(list, timeout);
}

int draw_parse_command(struct draw_wish *wish, const char *command, const struct psr_cli *cli, int argc, char **argv,
                       struct psr_error *err)
{
	int n_files = 0, code = psr_command_parse(command, cli, argc, argv, &n_files, err);

	if (code == PSR_OK && n_files > 1)
		code = psr_fail(err, PSR_ERR_ARG, "one file at a time, not %d; psrd --models serves folders", n_files);
	wish->file = n_files == 1 ? argv[1] : NULL;
	return code;
}

struct job {
	struct draw_wish *wish;
	struct home *home; /* of wish->file */
	struct views views;
	cJSON *replay;
	struct psr_msg_frame frame;
	struct sink sink;
	struct psr_client *client;
	struct scene *scene;
	struct psr_camera *camera; /* sink.n */
};

static int check_replay(struct job *job, struct psr_error *err)
{
	const struct draw_wish *wish = job->wish;
	int code;

	if (wish->file != NULL || wish->scene.n_said || wish->scene.has_ambient || view_is_said(&wish->view) || wish->cameras != NULL
	    || quality_is_said(&wish->quality) || wish->sink.has_sheet)
		return psr_fail(err, PSR_ERR_ARG,
		                "--replay repeats a whole picture; it excludes all options that say what is in "
		                "it");
	code = replay_read(&job->replay, wish->replay, err);
	if (code == PSR_OK)
		code = replay_wish(&job->wish->scene, job->replay, err);
	return code == PSR_OK ? replay_frame(&job->frame, job->replay, err) : code;
}

/* A file alone is the model; beside other options it is there for them. */
static int check_file(struct job *job, struct psr_error *err)
{
	struct scene_wish *scene = &job->wish->scene;
	int code;

	if (job->wish->file == NULL)
		return PSR_OK;
	code = home_create(&job->home, job->wish->file, err);
	if (code == PSR_ERR_NOT_FOUND)
		return psr_fail(err, code, "%s: no such file; --model %s names a model of a server", job->wish->file,
		                job->wish->file);
	if (code == PSR_OK && scene->n_instances == 0 && scene->file == NULL)
		code = scene_add_model(scene, home_model(job->home), err);
	return code;
}

static int check(struct job *job, struct psr_error *err)
{
	struct draw_wish *wish = job->wish;
	int code;

	if (wish->replay != NULL) {
		code = check_replay(job, err);
	} else {
		code = check_file(job, err);
		if (code == PSR_OK)
			code = scene_check(&wish->scene, err);
		if (code == PSR_OK)
			code = views_make(&job->views, &wish->view, wish->cameras, err);
		if (code == PSR_OK)
			code = quality_apply(&job->frame, &wish->quality, err);
		if (code == PSR_OK && wish->sink.n_turn > 0 && job->views.n != 1)
			code = psr_fail(err, PSR_ERR_ARG, "--view: a turntable has one view, not %u", job->views.n);
	}
	if (code == PSR_OK)
		code = sink_check(&job->sink, &wish->sink,
		                  wish->sink.n_turn > 0 ? (uint32_t)wish->sink.n_turn : wish->replay ? 1 : job->views.n,
		                  wish->quality.size, err);
	return code == PSR_OK ? psr_address_check(wish->server, err) : code;
}

static int place_cameras(struct job *job, struct psr_error *err)
{
	const double aspect = (double)job->frame.width / job->frame.height;

	job->camera = calloc(job->sink.n, sizeof *job->camera);
	if (job->camera == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u cameras", job->sink.n);
	if (job->replay == NULL)
		return views_place(job->camera, &job->views, job->scene, aspect, (uint32_t)job->wish->sink.n_turn, err);
	job->camera[0] = job->frame.camera;
	return PSR_OK;
}

static int run(struct job *job, struct psr_error *err)
{
	struct draw_wish *wish = job->wish;
	struct sink *sink = &job->sink;
	int timeout_ms = (int)wish->timeout * 1000, code;
	uint64_t start_ns = clock_ns();
	struct series series;

	if (job->home != NULL) {
		code = home_start(job->home, err);
		if (code != PSR_OK)
			return code;
		wish->server = home_address(job->home);
	}
	wish->scene.pixels = job->frame.width > job->frame.height ? job->frame.width : job->frame.height;
	code = psr_client_connect(&job->client, wish->server, PSR_PROGRAM, wish->scene.instance[0].model, timeout_ms, err);
	if (code == PSR_OK)
		code = scene_open(&job->scene, &wish->scene, job->client, timeout_ms, err);
	if (code == PSR_OK && job->replay != NULL)
		code = replay_scene(job->scene, job->replay, err);
	if (code == PSR_OK)
		code = place_cameras(job, err);
	if (code != PSR_OK)
		return code;
	if (job->replay == NULL || wish->sink.output != NULL || wish->sink.depth != NULL)
		job->frame.planes |= sink_planes(sink);
	if (job->replay == NULL)
		quality_settle(&job->frame, &wish->quality, psr_client_welcome(job->client)->capabilities);
	quality_choose_codecs(&job->frame);
	sink->scene = job->scene;
	sink->frame = &job->frame;
	sink->server = psr_client_welcome(job->client)->server;
	sink->start_ns = start_ns;
	series = (struct series){ job->client, job->scene, &job->frame, job->camera, sink->n, wish->server, timeout_ms,
		                      sink_take, sink };
	return series_run(&series, err);
}

static int draw(struct draw_wish *wish, struct psr_error *err)
{
	struct job *job = calloc(1, sizeof *job);
	int code;

	if (job == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory");
	job->wish = wish;
	code = check(job, err);
	if (code == PSR_OK)
		code = sink_finish(&job->sink, run(job, err), err);
	else
		free(job->sink.hashes);
	psr_client_close(job->client);
	scene_close(job->scene);
	views_fini(&job->views);
	home_close(job->home);
	cJSON_Delete(job->replay);
	free(job->camera);
	free(job);
	return code;
}

int draw_main(const char *program, draw_parse *parse, int argc, char **argv)
{
	struct draw_wish wish = { .sink.program = program, .server = psr_default_server(), .timeout = PSR_DEFAULT_TIMEOUT };
	struct psr_error err;
	int code;

	scene_wish_init(&wish.scene);
	view_wish_init(&wish.view);
	quality_wish_init(&wish.quality, 800, 600, "fine", "lossless");
	code = parse(&wish, argc, argv, &err);
	if (code == PSR_OK)
		code = draw(&wish, &err);
	scene_wish_fini(&wish.scene);
	return code >= 0 ? 0 : psr_cli_fail(program, &err);
}
