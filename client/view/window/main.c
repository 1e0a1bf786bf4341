#include <string.h>
#include "client/view/wishes.h"
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

int main(int argc, char **argv)
{
	static struct wishes wishes; /* large */
	struct viewer_options options = { .has_inertia = 1 };
	int no_inertia = 0, code;
	const struct psr_opt window[] = {
		{ .name = "bare", .type = PSR_OPT_FLAG, .value = &options.is_bare,
		  .help = "Begins without overlay and panel; Tab and p show them." },
		{ .name = "no-inertia", .type = PSR_OPT_FLAG, .value = &no_inertia,
		  .help = "What is let go stands still at once." },
		{ .name = "record", .type = PSR_OPT_STRING, .value = &options.record, .arg = "FILE",
		  .help = "Records the way of the camera into a JSON file, until F5 or the end." },
		{ .name = "play", .type = PSR_OPT_STRING, .value = &options.play, .arg = "FILE",
		  .help = "Plays such a way; Space begins and stops it." },
	};
	const struct wishes_own own = { "Window", "At rest; while something moves, the network and the server decide.",
		                            window, sizeof window / sizeof window[0] };
	struct optlist list = { .n = 0 };
	const struct psr_cli cli = {
		.usage = "psr view [--model NAME ... | FILE] [--server ADDR] [models, window, camera, light, quality]",
		.summary = "Shows models of a server in a window, to be turned, moved and lit. Without a model the window's "
		           "list shows what the server has. A FILE is built and drawn on this computer, coarse at first; one "
		           "that is dropped on the window, too.",
		.opts = list.opt,
		.footer = footer,
	};
	struct psr_error err;

	wishes_init(&wishes, 1280, 720, 30);
	wishes_add_options(&list, &wishes, &own);
	code = wishes_parse(&wishes, &cli, argc, argv, 0, &err);
	if (code == PSR_OK) {
		options.address = wishes.server;
		options.file = wishes.file;
		options.subject = wishes.subject;
		options.camera = wishes.camera;
		options.fps = wishes.fps;
		options.has_inertia = !no_inertia;
		memcpy(options.size, wishes.quality.size, sizeof options.size);
		code = viewer_run(&options, &err);
	}
	wishes_fini(&wishes);
	return code >= 0 ? 0 : psr_cli_fail(VIEWER_NAME, &err);
}
