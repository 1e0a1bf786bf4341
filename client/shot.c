#include "client/cli/cli.h"
#include "client/draw/draw.h"
#include "commands.h"

static const char footer[] =
	SCENE_LIGHT_HELP
	"\n"
	SHOW_HELP
	"\n"
	"examples:\n"
	"  psr shot scan.ply -o scan.png\n"
	"  psr shot --model teapot --size 1280x720 --shadows -o teapot.png\n"
	"  psr shot --model dragon --azimuth 60 --elevation 10 --zoom 2 --quality best -o dragon.png\n"
	"  psr shot --model plate --view front,left,top,iso --ortho fit --sheet 2x2 -o sheet.png\n"
	"  psr shot --model teapot --instance dragon,at=4,0,0,rotate=Y:90,scale=12 -o both.png\n"
	"  psr shot --model dragon --ambient 1 --ortho 0.3 -o flat.png --depth flat.exr --hash\n"
	"  psr shot --model dragon --report dragon.json -o a.png && psr shot --replay dragon.json -o b.png\n"
	"\n" PSR_EXIT_CODES;

static int parse(struct draw_wish *wish, int argc, char **argv, struct psr_error *err)
{
	struct optlist list = { .n = 0 };
	const struct psr_opt files[] = {
		{ .name = "output", .letter = 'o', .type = PSR_OPT_STRING, .value = &wish->sink.output, .arg = "FILE",
		  .help = "The picture. Its ending is the format: .png, .ppm, or any that OpenImageIO writes. - is standard "
		          "output, as PNG. Several pictures are numbered by %d or %03d in the name." },
		{ .name = "cameras", .type = PSR_OPT_STRING, .value = &wish->cameras, .arg = "FILE",
		  .help = "A picture for each line of a text file of words such as azimuth=30 elevation=20 zoom=2: the options "
		          "of a camera without dashes. # begins a comment." },
		{ .name = "replay", .type = PSR_OPT_STRING, .value = &wish->replay, .arg = "REPORT",
		  .help = "The picture that wrote this report, with the same bytes; only files are to be named." },
	};
	const struct psr_cli cli = {
		.usage = "psr shot FILE | --model NAME [--server ADDR] [--size WxH] [models, camera, light, quality] -o FILE",
		.summary = "Asks a server for a picture of a model, or of several, and writes it to a file. --view "
		           "front,left,... and --cameras draw several pictures. A FILE (a mesh, a scan or a .psr) needs no "
		           "server: it is served by a psrd of this command's own, and built models stay in the cache.",
		.opts = list.opt,
		.footer = footer,
	};

	draw_add_options(&list, wish, files, sizeof files / sizeof files[0]);
	return draw_parse_command(wish, "shot", &cli, argc, argv, err);
}

int psr_shot_main(int argc, char **argv)
{
	return draw_main("psr shot", parse, argc, argv);
}
