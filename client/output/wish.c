#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "sink.h"

void sink_add_file_options(struct optlist *list, struct sink_wish *wish)
{
	const struct psr_opt opts[] = {
		{ .name = "sheet", .type = PSR_OPT_SIZE, .value = wish->sheet, .arg = "COLSxROWS", .seen = &wish->has_sheet,
		  .help = "All pictures on one contact sheet, row by row; --size is the size of each." },
		{ .name = "depth", .type = PSR_OPT_STRING, .value = &wish->depth, .arg = "FILE",
		  .help = "How far each pixel is from the camera, along its view, in the model's units; +inf where nothing is. "
		          ".pfm, .exr or .tif." },
		{ .name = "no-legend", .type = PSR_OPT_FLAG, .value = &wish->has_no_legend,
		  .help = "Leave out the legend of --color-by, which tells in the picture's lower left corner what its colours "
		          "stand for." },
		{ .name = "report", .type = PSR_OPT_STRING, .value = &wish->report, .arg = "FILE",
		  .help = "All about the picture as JSON: request, times, counts, hashes. - is standard output." },
	};

	OPTLIST_ADD(list, opts);
}

void sink_add_developer_options(struct optlist *list, struct sink_wish *wish)
{
	const struct psr_opt opts[] = {
		{ .name = "plane", .type = PSR_OPT_STRING, .value = &wish->plane_text, .arg = "PLANE",
		  .words = "color depth normal id weight words block bound",
		  .help = "What -o writes: color, depth, normal, id (of instances), weight, words (depth and sample id), "
		          "block (levels, facing) or bound (of the geometric error). All go to .npy; color, normal and weight "
		          "to pictures, depth as with --depth." },
		{ .name = "show", .type = PSR_OPT_STRING, .value = &wish->show_text, .arg = "STAGE",
		  .words = "blocks samples cull levels normals weights holes depth",
		  .help = "What -o writes is a picture of a stage instead, see below: blocks, samples, cull, levels, normals, "
		          "weights, holes or depth." },
		{ .name = "hash", .type = PSR_OPT_FLAG, .value = &wish->hash,
		  .help = "Print the hash of each plane as it was drawn, before its codec: `color 0123456789abcdef`." },
		{ .name = "effects", .type = PSR_OPT_FLAG, .value = &wish->effects,
		  .help = "Print what the frame ran, and what it left out and why: `fill left out: no pixel's weight is below "
		          "1`." },
	};

	OPTLIST_ADD(list, opts);
}

static int is_stdout(const char *name)
{
	return name != NULL && strcmp(name, OUTPUT_STDOUT) == 0;
}

static int check_stdout(const struct sink_wish *wish, struct psr_error *err)
{
	int n = is_stdout(wish->output) + is_stdout(wish->depth) + is_stdout(wish->report);

	if (n > 1)
		return psr_fail(err, PSR_ERR_ARG,
		                "-o -, --depth - and --report - exclude each other: there is one standard output");
	if (n > 0 && (wish->hash || wish->effects))
		return psr_fail(err, PSR_ERR_ARG, "--hash and --effects print on standard output, where - sends a file");
	if ((is_stdout(wish->output) || is_stdout(wish->depth)) && isatty(STDOUT_FILENO))
		return psr_fail(err, PSR_ERR_ARG,
		                "-: standard output is a terminal, which cannot show a picture's bytes; send them "
		                "to a file or a program");
	return PSR_OK;
}

static int check_plane(struct sink *sink, struct psr_error *err)
{
	const struct sink_wish *wish = sink->wish;

	if (wish->plane_text != NULL && wish->show_text != NULL)
		return psr_fail(err, PSR_ERR_ARG, "--plane and --show exclude each other: both decide what -o writes");
	if (wish->output == NULL && wish->show_text != NULL)
		return psr_fail(err, PSR_ERR_ARG, "--show paints a picture; -o FILE says where");
	while (wish->plane_text != NULL && strcmp(psr_plane_name(sink->plane), wish->plane_text) != 0)
		if (++sink->plane == PSR_N_PLANES)
			return psr_fail(err, PSR_ERR_ARG,
			                "--plane takes color, depth, normal, id, weight, words, block or bound, not '%.40s'",
			                wish->plane_text);
	if (wish->show_text != NULL) {
		sink->show = show_find(wish->show_text, err);
		return sink->show == NULL ? PSR_ERR_ARG : PSR_OK;
	}
	return PSR_OK;
}

/* Chooses how -o takes n pictures. */
static int choose_kind(struct sink *sink, struct psr_error *err)
{
	const struct sink_wish *wish = sink->wish;
	int is_numbered = 0, is_plain = sink->show == NULL && sink->plane == PSR_PLANE_COLOR;

	if (wish->has_sheet && wish->output == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--sheet makes one picture of several; -o FILE says where");
	if (wish->output == NULL)
		return PSR_OK;
	sink->kind = SINK_FILE;
	if (wish->has_sheet) {
		sink->kind = SINK_SHEET;
		sink->sheet.columns = wish->sheet[0];
		sink->sheet.rows = wish->sheet[1];
	} else if (sink->n > 1 || wish->n_turn > 0) {
		if (output_is_numbered(&is_numbered, wish->output, err) != PSR_OK)
			return PSR_ERR_ARG;
		sink->kind = is_numbered ? SINK_NUMBERED : wish->n_turn > 0 ? SINK_ANIMATION : SINK_FILE;
	}
	if (sink->kind == SINK_FILE && sink->n > 1)
		return psr_fail(err, PSR_ERR_ARG,
		                "'%.200s' is one file for %u pictures; number them, as in 'a_%%02d.png', or put "
		                "them on a contact sheet with --sheet COLSxROWS",
		                wish->output, sink->n);
	if ((sink->kind == SINK_SHEET || sink->kind == SINK_ANIMATION) && !is_plain)
		return psr_fail(err, PSR_ERR_ARG,
		                "--plane and --show write pictures of their own: number them, as in 'a_%%02d.png'");
	return PSR_OK;
}

static int check_numbered(int *is_numbered, const struct sink *sink, const char *option, const char *name,
                          struct psr_error *err)
{
	*is_numbered = 0;
	if (name == NULL || (sink->n == 1 && sink->wish->n_turn == 0))
		return PSR_OK;
	if (output_is_numbered(is_numbered, name, err) != PSR_OK)
		return PSR_ERR_ARG;
	if (!*is_numbered && sink->n > 1)
		return psr_fail(err, PSR_ERR_ARG, "%s '%.200s' is one file for %u pictures; number them, as in 'a_%%02d%s'",
		                option, name, sink->n, strcmp(option, "--depth") == 0 ? ".exr" : ".json");
	return PSR_OK;
}

static int check_endings(const struct sink *sink, struct psr_error *err)
{
	const struct sink_wish *wish = sink->wish;
	int code = PSR_OK;

	if (sink->kind == SINK_ANIMATION)
		code = psr_animation_check(wish->output, err);
	else if (sink->kind != SINK_NONE)
		code = sink->show != NULL ? psr_picture_check_color(wish->output, err)
		                          : psr_picture_check_plane(sink->plane, wish->output, err);
	return code == PSR_OK && wish->depth != NULL ? psr_picture_check_depth(wish->depth, err) : code;
}

int sink_check(struct sink *sink, const struct sink_wish *wish, uint32_t n, const uint32_t size[2],
               struct psr_error *err)
{
	int code;

	memset(sink, 0, sizeof *sink);
	sink->wish = wish;
	sink->n = n;
	if (wish->output == NULL && wish->depth == NULL && wish->report == NULL && !wish->hash && !wish->effects)
		return psr_fail(err, PSR_ERR_ARG, "nothing was asked for; say -o FILE, --depth, --report, --hash or --effects");
	if (wish->effects && n > 1)
		return psr_fail(err, PSR_ERR_ARG, "--effects is about one picture, and there are %u", n);
	code = check_plane(sink, err);
	if (code == PSR_OK)
		code = choose_kind(sink, err);
	if (code == PSR_OK)
		code = check_numbered(&sink->depth_numbered, sink, "--depth", wish->depth, err);
	if (code == PSR_OK)
		code = check_numbered(&sink->report_numbered, sink, "--report", wish->report, err);
	if (code == PSR_OK)
		code = check_endings(sink, err);
	if (code == PSR_OK && sink->kind == SINK_SHEET)
		code = sheet_check(&sink->sheet, n, size[0], size[1], err);
	if (code == PSR_OK)
		code = check_stdout(wish, err);
	if (code == PSR_OK && (sink->hashes = calloc(n, sizeof *sink->hashes)) == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for %u pictures", n);
	return code;
}

uint32_t sink_planes(const struct sink *sink)
{
	uint32_t planes = sink->show != NULL ? show_planes(sink->show) : 1u << sink->plane;

	return sink->wish->depth != NULL ? planes | 1 << PSR_PLANE_DEPTH : planes;
}
