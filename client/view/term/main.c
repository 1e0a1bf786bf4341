#include <string.h>
#include "client/home/home.h"
#include "client/view/wishes.h"
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

static int choose_way(enum canvas_way *way, const char *text, struct psr_error *err)
{
	static const char *const names[] = { [CANVAS_AUTO] = "auto", [CANVAS_KITTY] = "kitty", [CANVAS_SIXEL] = "sixel",
		                                 [CANVAS_SYMBOLS] = "symbols" };

	for (int i = 0; i < 4; i++)
		if (strcmp(text, names[i]) == 0) {
			*way = (enum canvas_way)i;
			return PSR_OK;
		}
	return psr_fail(err, PSR_ERR_ARG, "--pixels %.40s: there are auto, kitty, sixel and symbols", text);
}

static int open_file(struct viewer_options *options, struct home **home, const char *file, struct psr_error *err)
{
	const int code = home_open(home, file, err);

	if (code != PSR_OK)
		return code;
	options->address = home_address(*home);
	options->coarse_pixels = HOME_COARSE_PIXELS;
	return subject_set_model(&options->subject, home_model(*home), err);
}

int main(int argc, char **argv)
{
	static struct wishes wishes; /* large */
	static struct viewer_options options;
	const char *way = "auto";
	const struct psr_opt terminal[] = {
		{ .name = "pixels", .type = PSR_OPT_STRING, .value = &way, .arg = "WAY",
		  .words = "auto kitty sixel symbols",
		  .help = "How the terminal shows pictures: kitty, sixel, or symbols, which any can; auto: the best of them "
		          "that it says it knows." },
	};
	const struct wishes_own own = { "Terminal", "At rest; while something moves, the network and the server decide. The "
		                                        "size is the terminal's.", terminal, 1 };
	struct optlist list = { .n = 0 };
	const struct psr_cli cli = {
		.usage = "psr view --term FILE | --model NAME ... [--server ADDR] [camera, light, quality]",
		.summary = "Shows models of a server, or a file, in a terminal, to be turned, moved and lit.",
		.opts = list.opt,
		.footer = footer,
	};
	struct home *home = NULL;
	struct psr_error err;
	int code;

	wishes_init(&wishes, 640, 480, 15);
	wishes_add_options(&list, &wishes, &own);
	code = wishes_parse(&wishes, &cli, argc, argv, 1, &err);
	options.address = wishes.server;
	options.subject = wishes.subject;
	options.camera = wishes.camera;
	options.fps = wishes.fps;
	if (code == PSR_OK)
		code = choose_way(&options.way, way, &err);
	if (code == PSR_OK && wishes.file != NULL)
		code = open_file(&options, &home, wishes.file, &err);
	if (code == PSR_OK)
		code = viewer_run(&options, &err);
	home_close(home);
	wishes_fini(&wishes);
	return code >= 0 ? 0 : psr_cli_fail(VIEWER_NAME, &err);
}
