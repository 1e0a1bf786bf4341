#include "mix.h"
#include <stdlib.h>
#include <string.h>
#include "flight.h"

void mix_line_init(struct mix_line *line)
{
	memset(line, 0, sizeof *line);
	scene_wish_init(&line->scene);
	view_wish_init(&line->view);
	quality_wish_init(&line->quality, 512, 512, "good", "jpeg:85");
	line->scene.is_quiet = 1;
	line->path = "orbit";
	line->weight = 1;
}

void mix_add_options(struct optlist *list, struct mix_line *line)
{
	const struct psr_opt opts[] = {
		{ .name = "path", .type = PSR_OPT_STRING, .value = &line->path, .arg = "PATH",
		  .help = "The way of each camera from its view on: orbit, 120 pictures a turn; zoom, to 8 times as near and "
		          "back; flick, quick turns by 50 degrees that run out; random, anywhere around; or a file: cameras as "
		          "of psr shot --cameras, or a .json that psr view --record wrote, 30 pictures for each second of it." },
	};

	scene_add_model_options(list, &line->scene);
	view_add_options(list, &line->view);
	OPTLIST_ADD(list, opts);
	scene_add_light_options(list, &line->scene);
	quality_add_options(list, &line->quality);
	quality_add_splats_option(list, &line->quality);
	quality_add_budget_option(list, &line->quality);
	quality_add_codec_option(list, &line->quality);
}

static int check_line(struct mix_line *line, struct psr_error *err)
{
	struct views views = { .n = 0 };
	int code = scene_check(&line->scene, err);

	if (code == PSR_OK)
		code = views_make(&views, &line->view, NULL, err);
	if (code == PSR_OK && views.n == 1)
		line->view = views.wish[0];
	else if (code == PSR_OK)
		code = psr_fail(err, PSR_ERR_ARG, "--view: a path begins at one view, not at %u", views.n);
	line->view.view = NULL; /* the wish holds the view's angles now */
	views_fini(&views);
	if (code == PSR_OK)
		code = flight_check(line->path, &line->view, err);
	line->frame.planes = 1 << PSR_PLANE_COLOR;
	if (code == PSR_OK)
		code = quality_apply(&line->frame, &line->quality, err);
	line->scene.pixels = line->frame.width > line->frame.height ? line->frame.width : line->frame.height;
	return code;
}

struct reader {
	struct mix *mix;
	struct mix_line line;
	const struct mix_line *said;
};

static void begin_line(struct reader *reader)
{
	mix_line_init(&reader->line);
	reader->line.view = reader->said->view;
	reader->line.quality = reader->said->quality;
	reader->line.path = reader->said->path;
}

static int on_line(void *userdata, struct psr_error *err)
{
	struct reader *reader = userdata;
	struct mix *mix = reader->mix;

	if (mix->n == MIX_MAX)
		return psr_fail(err, PSR_ERR_LIMIT, "a mix has at most %d lines", MIX_MAX);
	mix->line[mix->n] = reader->line;
	begin_line(reader);
	return check_line(&mix->line[mix->n++], err);
}

static int read_file(struct mix *mix, const struct mix_line *said, const char *file, struct psr_error *err)
{
	struct reader reader = { .mix = mix, .said = said };
	struct optlist list = { .n = 0 };
	const struct psr_cli cli = { .opts = list.opt };
	struct wordfile words = { .path = file, .cli = &cli, .on_line = on_line, .userdata = &reader };
	const struct psr_opt weight[] = {
		{ .name = "weight", .type = PSR_OPT_REAL, .value = &reader.line.weight, .arg = "W", .min = 1e-6, .max = 1e6 },
	};
	int code;

	begin_line(&reader);
	mix_add_options(&list, &reader.line);
	OPTLIST_ADD(&list, weight);
	code = wordfile_read(&words, &mix->text, err);
	scene_wish_fini(&reader.line.scene); /* of a line that an error has cut short */
	if (code == PSR_OK && mix->n == 0)
		code = psr_fail(err, PSR_ERR_ARG, "%.300s has no line; a line is such as weight=2 model=engine size=640x480",
		                file);
	return code;
}

int mix_make(struct mix *mix, struct mix_line *said, const char *file, struct psr_error *err)
{
	if (file == NULL) {
		mix->line[mix->n++] = *said;
		scene_wish_init(&said->scene);
		return check_line(&mix->line[0], err);
	}
	if (said->scene.n_said > 0 || said->scene.has_ambient)
		return psr_fail(err, PSR_ERR_ARG, "--mix: its lines say which models and lights there are, not the command line");
	return read_file(mix, said, file, err);
}

void mix_fini(struct mix *mix)
{
	for (uint32_t i = 0; i < mix->n; i++)
		scene_wish_fini(&mix->line[i].scene);
	free(mix->text);
	memset(mix, 0, sizeof *mix);
}
