#include "client/cli/cli.h"
#include "client/draw/draw.h"
#include "commands.h"

#define DEFAULT_FRAMES 12
#define MAX_FRAMES 3600
#define MAX_SECONDS_A_FRAME 65 /* of a PNG: 16 bits of milliseconds */

static const char footer[] =
	SCENE_LIGHT_HELP
	"\n"
	"examples:\n"
	"  psr turntable scan.ply -o scan.gif\n"
	"  psr turntable --model dragon --frames 48 -o dragon.png\n"
	"  psr turntable --model dragon --elevation 30 --shadows -o 'dragon_%02d.png'\n"
	"  psr turntable --model dragon --size 320x240 --sheet 4x3 -o sheet.png\n"
	"\n" PSR_EXIT_CODES;

static int parse(struct draw_wish *wish, int argc, char **argv, struct psr_error *err)
{
	struct optlist list = { .n = 0 };
	struct sink_wish *sink = &wish->sink;
	int has_frames = 0, code;
	const struct psr_opt files[] = {
		{ .name = "output", .letter = 'o', .type = PSR_OPT_STRING, .value = &sink->output, .arg = "FILE",
		  .help = "'a_%02d.png': a file each picture, numbered from 1. a.png, a.gif or - (standard output): one "
		          "animation, which browsers play. With --sheet: one picture." },
		{ .name = "frames", .letter = 'n', .type = PSR_OPT_INT, .value = &sink->n_turn, .arg = "N", .min = 1,
		  .max = MAX_FRAMES, .seen = &has_frames,
		  .help = "Pictures a turn: 48 or more for an animation that moves evenly. A contact sheet has as many as "
		          "fit." },
		{ .name = "seconds", .type = PSR_OPT_REAL, .value = &sink->seconds, .arg = "S", .min = 0.02, .max = 3600,
		  .help = "How long a turn of an animation takes." },
	};
	const struct psr_cli cli = {
		.usage = "psr turntable FILE | --model NAME [--server ADDR] [--frames N] [camera, light, quality] -o FILE",
		.summary = "Draws a model from all sides: the camera goes once around it, to its right at first, and the "
		           "model stays in the picture. The camera's options say where it begins. Lights of --light stay with "
		           "the model; the one that is there without stays with the camera. A FILE needs no server, as with psr shot.",
		.opts = list.opt,
		.footer = footer,
	};

	sink->n_turn = DEFAULT_FRAMES;
	sink->seconds = 4;
	draw_add_options(&list, wish, files, sizeof files / sizeof files[0]);
	code = draw_parse_command(wish, "turntable", &cli, argc, argv, err);
	if (code != PSR_OK)
		return code;
	if (sink->has_sheet && !has_frames && (uint64_t)sink->sheet[0] * sink->sheet[1] <= MAX_FRAMES)
		sink->n_turn = (int64_t)sink->sheet[0] * sink->sheet[1];
	if (sink->n_turn == 0) /* sink_check() says why */
		sink->n_turn = 1;
	if (sink->seconds / (double)sink->n_turn > MAX_SECONDS_A_FRAME)
		return psr_fail(err, PSR_ERR_ARG, "--seconds: a picture of an animation stays for %d seconds at most",
		                MAX_SECONDS_A_FRAME);
	return PSR_OK;
}

int psr_turntable_main(int argc, char **argv)
{
	return draw_main("psr turntable", parse, argc, argv);
}
