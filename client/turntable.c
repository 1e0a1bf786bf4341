#include "draw.h"
#include "psr.h"

#define DEFAULT_FRAMES 12
#define MAX_FRAMES 3600
#define MAX_SECONDS_A_FRAME 65 /* of a PNG: 16 bits of milliseconds */

static const char footer[] =
	SCENE_LIGHT_HELP
	"\n"
	"examples:\n"
	"  psr turntable --model dragon --frames 48 -o dragon.png\n"
	"  psr turntable --model dragon --elevation 30 --shadows -o 'dragon_%02d.png'\n"
	"  psr turntable --model dragon --size 320x240 --sheet 4x3 -o sheet.png\n"
	"\n" PSR_EXIT_CODES;

static int parse(struct draw_wish *wish, int64_t *n_frames, int argc, char **argv, struct psr_error *err)
{
	struct optlist list = { .n = 0 };
	int has_frames = 0, code;
	const struct psr_opt opts[] = {
		{ "output", 'o', PSR_OPT_STRING, &wish->output, "FILE",
		  "'a_%02d.png': a file each picture, numbered from 1. a.png, a.gif or - (standard output): one animation, "
		  "which browsers play. With --sheet: one picture.",
		  0, 0, NULL, NULL },
		{ "frames", 'n', PSR_OPT_INT, n_frames, "N",
		  "Pictures a turn: 48 or more for an animation that moves evenly. A contact sheet has as many as fit.", 1,
		  MAX_FRAMES, NULL, &has_frames },
		{ "seconds", 0, PSR_OPT_REAL, &wish->seconds, "S", "How long a turn of an animation takes.", 0.02, 3600, NULL,
		  NULL },
	};
	const struct psr_cli cli = {
		"psr turntable --model NAME [--server ADDR] [--frames N] [models, camera, light, quality] -o FILE",
		"Draws a model from all sides: the camera goes once around it, to its right at first, and the model stays in "
		"the picture. The camera's options say where it begins. Lights of --light stay with the model; the one that is "
		"there without stays with the camera.",
		list.opt,
		footer,
	};

	draw_add_model_options(&list, wish);
	optlist_heading(&list, "Files", NULL);
	OPTLIST_ADD(&list, opts);
	draw_add_file_options(&list, wish);
	draw_add_picture_options(&list, wish);
	draw_add_developer_options(&list, wish);
	code = psr_cli_parse(&cli, argc, argv, NULL, err);
	if (code != PSR_OK)
		return code;
	if (wish->has_sheet && !has_frames && (uint64_t)wish->sheet[0] * wish->sheet[1] <= MAX_FRAMES)
		*n_frames = (int64_t)wish->sheet[0] * wish->sheet[1];
	if (*n_frames == 0) /* sink_check says why */
		*n_frames = 1;
	if (wish->seconds / (double)*n_frames > MAX_SECONDS_A_FRAME)
		return psr_fail(err, PSR_ERR_ARG, "--seconds: a picture of an animation stays for %d seconds at most",
		                MAX_SECONDS_A_FRAME);
	wish->n_turn = *n_frames;
	return PSR_OK;
}

int psr_turntable_main(int argc, char **argv)
{
	int64_t n_frames = DEFAULT_FRAMES;
	struct draw_wish wish;
	struct psr_error err;
	int code;

	draw_wish_init(&wish, "psr turntable");
	wish.seconds = 4;
	code = parse(&wish, &n_frames, argc, argv, &err);
	if (code == PSR_OK)
		code = draw(&wish, &err);
	draw_wish_fini(&wish);
	return code >= 0 ? 0 : psr_cli_fail("psr turntable", &err);
}
