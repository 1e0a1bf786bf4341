#include <stdlib.h>
#include "client/cli/cli.h"
#include "viewer.h"

static const char footer[] =
	SCENE_LIGHT_HELP
	"\n"
	"F1 in the window lists mouse and keys.\n"
	"\n"
	"examples:\n"
	"  psr view --model teapot\n"
	"  psr view scan.ply\n"
	"  psr view --server HOST:7447 --model engine --view front --shadows\n"
	"  psr view --model engine --record way.json; psr view --model engine --play way.json\n"
	"\n"
	"exit codes: 0 done, 2 usage, 3 no display, file or system, 4 bad data, 5 over a limit, 6 an address\n"
	"that is none, 7 a defect of psr";

struct wishes {
	struct viewer_options options;
	const char *server;
	struct scene_wish scene;
	struct quality_wish quality;
	int no_inertia;
};

static void add_options(struct optlist *list, struct wishes *wishes)
{
	struct viewer_options *options = &wishes->options;
	const struct psr_opt server[] = { PSR_OPT_SERVER(wishes->server) };
	const struct psr_opt window[] = {
		{ .name = "bare", .type = PSR_OPT_FLAG, .value = &options->is_bare,
		  .help = "Begins without overlay and panel; Tab and p show them." },
		{ .name = "no-inertia", .type = PSR_OPT_FLAG, .value = &wishes->no_inertia,
		  .help = "What is let go stands still at once." },
		{ .name = "fps", .type = PSR_OPT_REAL, .value = &options->fps, .arg = "N", .min = 1, .max = 1000,
		  .help = "Pictures a second to ask the server for while something moves. The window shows each of them as "
		          "the present camera sees it, at the rate of the display." },
		{ .name = "record", .type = PSR_OPT_STRING, .value = &options->record, .arg = "FILE",
		  .help = "Records the way of the camera into a JSON file, until F5 or the end." },
		{ .name = "play", .type = PSR_OPT_STRING, .value = &options->play, .arg = "FILE",
		  .help = "Plays such a way; Space begins and stops it." },
	};

	optlist_heading(list, "Models and server", NULL);
	scene_add_model_options(list, &wishes->scene);
	OPTLIST_ADD(list, server);
	optlist_heading(list, "Window", NULL);
	OPTLIST_ADD(list, window);
	optlist_heading(list, "Camera", "Where it is at first.");
	view_add_options(list, &options->camera);
	optlist_heading(list, "Light", NULL);
	scene_add_light_options(list, &wishes->scene);
	optlist_heading(list, "Quality", "At rest; while something moves, the network and the server decide.");
	quality_add_options(list, &wishes->quality);
}

static int parse(struct wishes *wishes, int argc, char **argv, struct psr_error *err)
{
	struct psr_msg_frame frame = { .slot = 0 };
	struct optlist list = { .n = 0 };
	const struct psr_cli cli = {
		.usage = "psr view [--model NAME ... | FILE] [--server ADDR] [models, window, camera, light, quality]",
		.summary = "Shows models of a server in a window, to be turned, moved and lit. Without a model the window's "
		           "list shows what the server has. A FILE is built and drawn on this computer, coarse at first; one "
		           "that is dropped on the window, too.",
		.opts = list.opt,
		.footer = footer,
	};
	int n_files = 0, code;

	add_options(&list, wishes);
	code = psr_command_parse("view", &cli, argc, argv, &n_files, err);
	if (code == PSR_OK && n_files > 1)
		code = psr_fail(err, PSR_ERR_ARG, "one file at a time, not %d; psrd --models serves folders", n_files);
	if (code == PSR_OK && n_files == 1 && (wishes->scene.n_instances > 0 || wishes->scene.file != NULL))
		code = psr_fail(err, PSR_ERR_ARG, "a file is viewed alone: leave --model, --instance and --scene out");
	if (code == PSR_OK && (wishes->scene.n_instances > 0 || wishes->scene.file != NULL))
		code = scene_check(&wishes->scene, err);
	if (code == PSR_OK)
		code = view_check(&wishes->options.camera, err);
	if (code == PSR_OK)
		code = quality_apply(&frame, &wishes->quality, err);
	if (code == PSR_OK)
		code = psr_address_check(wishes->server, err);
	if (code == PSR_OK)
		code = subject_init(&wishes->options.subject, &wishes->scene, &frame, err);
	wishes->options.file = n_files == 1 ? argv[1] : NULL;
	wishes->options.address = wishes->server;
	wishes->options.has_inertia = !wishes->no_inertia;
	wishes->options.size[0] = wishes->quality.size[0];
	wishes->options.size[1] = wishes->quality.size[1];
	return code;
}

int main(int argc, char **argv)
{
	static struct wishes wishes; /* large */
	struct psr_error err;
	int code;

	wishes.server = psr_default_server();
	wishes.options.fps = 30;
	scene_wish_init(&wishes.scene);
	view_wish_init(&wishes.options.camera);
	quality_wish_init(&wishes.quality, 1280, 720, "lossless");
	code = parse(&wishes, argc, argv, &err);
	if (code == PSR_OK)
		code = viewer_run(&wishes.options, &err);
	scene_wish_fini(&wishes.scene);
	return code >= 0 ? 0 : psr_cli_fail(VIEWER_NAME, &err);
}
