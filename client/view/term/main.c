#include <string.h>
#include "client/cli/cli.h"
#include "client/view/home.h"
#include "viewer.h"

static const char footer[] =
	SCENE_LIGHT_HELP
	"\n"
	"Drag turns, ctrl-drag moves, the wheel zooms; ? lists the keys, q ends it.\n"
	"\n"
	"examples:\n"
	"  psr view --term scan.ply\n"
	"  psr view --term --server HOST:7447 --model engine --view front --shadows\n"
	"\n"
	"exit codes: 0 done, 2 usage, 3 no terminal, file or system, 4 bad data, 5 over a limit, 6 server or\n"
	"connection, 7 a defect of psr";

struct wishes {
	struct viewer_options options;
	const char *server, *way;
	struct scene_wish scene;
	struct quality_wish quality;
	struct home *home;
};

static void add_options(struct optlist *list, struct wishes *wishes)
{
	const struct psr_opt server[] = { PSR_OPT_SERVER(wishes->server) };
	const struct psr_opt terminal[] = {
		{ .name = "pixels", .type = PSR_OPT_STRING, .value = &wishes->way, .arg = "WAY",
		  .words = "auto kitty sixel symbols",
		  .help = "How the terminal shows pictures: kitty, sixel, or symbols, which any can; auto: the best of them "
		          "that it says it knows." },
		{ .name = "fps", .type = PSR_OPT_REAL, .value = &wishes->options.fps, .arg = "N", .min = 1, .max = 1000,
		  .help = "Pictures a second to ask the server for while something moves." },
	};

	optlist_heading(list, "Models and server", NULL);
	scene_add_model_options(list, &wishes->scene);
	OPTLIST_ADD(list, server);
	optlist_heading(list, "Terminal", NULL);
	OPTLIST_ADD(list, terminal);
	optlist_heading(list, "Camera", "Where it is at first.");
	view_add_options(list, &wishes->options.camera);
	optlist_heading(list, "Light", NULL);
	scene_add_light_options(list, &wishes->scene);
	optlist_heading(list, "Quality", "At rest; while something moves, the network and the server decide. The size is "
	                                 "the terminal's.");
	quality_add_options(list, &wishes->quality);
}

static int choose_way(struct wishes *wishes, struct psr_error *err)
{
	static const char *const names[] = { [CANVAS_AUTO] = "auto", [CANVAS_KITTY] = "kitty", [CANVAS_SIXEL] = "sixel",
		                                 [CANVAS_SYMBOLS] = "symbols" };

	for (int i = 0; i < 4; i++)
		if (strcmp(wishes->way, names[i]) == 0) {
			wishes->options.way = (enum canvas_way)i;
			return PSR_OK;
		}
	return psr_fail(err, PSR_ERR_ARG, "--pixels %.40s: there are auto, kitty, sixel and symbols", wishes->way);
}

static int parse(struct wishes *wishes, char **file, int argc, char **argv, struct psr_error *err)
{
	struct psr_msg_frame frame = { .slot = 0 };
	struct optlist list = { .n = 0 };
	const struct psr_cli cli = {
		.usage = "psr view --term FILE | --model NAME ... [--server ADDR] [camera, light, quality]",
		.summary = "Shows models of a server, or a file, in a terminal, to be turned, moved and lit.",
		.opts = list.opt,
		.footer = footer,
	};
	int n_operands = 0, code;

	add_options(&list, wishes);
	code = psr_command_parse("view", &cli, argc, argv, &n_operands, err);
	if (code != PSR_OK)
		return code;
	if (n_operands > 1 || (n_operands == 1 && wishes->scene.n_instances + (wishes->scene.file != NULL) > 0))
		return psr_fail(err, PSR_ERR_ARG, "it shows one file, or models of a server");
	*file = n_operands == 1 ? argv[1] : NULL;
	if (*file == NULL)
		code = scene_check(&wishes->scene, err);
	if (code == PSR_OK)
		code = view_check(&wishes->options.camera, err);
	if (code == PSR_OK)
		code = quality_apply(&frame, &wishes->quality, err);
	if (code == PSR_OK)
		code = choose_way(wishes, err);
	if (code == PSR_OK)
		code = psr_address_check(wishes->server, err);
	if (code == PSR_OK)
		code = subject_init(&wishes->options.subject, &wishes->scene, &frame, err);
	wishes->options.address = wishes->server;
	return code;
}

static int open_file(struct wishes *wishes, const char *file, struct psr_error *err)
{
	const int code = home_open(&wishes->home, file, err);

	if (code != PSR_OK)
		return code;
	wishes->options.address = home_address(wishes->home);
	wishes->options.coarse_pixels = HOME_COARSE_PIXELS;
	return subject_set_model(&wishes->options.subject, home_model(wishes->home), err);
}

int main(int argc, char **argv)
{
	static struct wishes wishes; /* large */
	struct psr_error err;
	char *file = NULL;
	int code;

	wishes.server = psr_default_server();
	wishes.way = "auto";
	wishes.options.fps = 15;
	scene_wish_init(&wishes.scene);
	view_wish_init(&wishes.options.camera);
	quality_wish_init(&wishes.quality, 640, 480, "lossless");
	code = parse(&wishes, &file, argc, argv, &err);
	if (code == PSR_OK && file != NULL)
		code = open_file(&wishes, file, &err);
	if (code == PSR_OK)
		code = viewer_run(&wishes.options, &err);
	home_close(wishes.home);
	scene_wish_fini(&wishes.scene);
	return code >= 0 ? 0 : psr_cli_fail(VIEWER_NAME, &err);
}
