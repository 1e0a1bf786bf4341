#include "sink.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>
#include "base/outfile.h"
#include "budget.h"
#include "effects.h"
#include "legend.h"
#include "report.h"

static int write_color(struct sink *sink, uint32_t k, const struct psr_event *event, struct psr_error *err)
{
	char path[PATH_MAX];
	int code = PSR_OK;

	if (sink->kind == SINK_NUMBERED)
		code = output_name(path, sink->wish->output, k + 1, err);
	else
		snprintf(path, sizeof path, "%s", sink->wish->output);
	if (code != PSR_OK)
		return code;
	return sink->show != NULL ? show_write(sink->show, event, path, err)
	                          : psr_picture_write_plane(event->picture, sink->plane, path, err);
}

static int write_extra(struct sink *sink, uint32_t k, const struct psr_event *event, struct psr_error *err)
{
	const struct sink_wish *wish = sink->wish;
	char path[PATH_MAX];
	int code = PSR_OK;

	if (wish->depth != NULL) {
		code = sink->depth_numbered ? output_name(path, wish->depth, k + 1, err) : PSR_OK;
		if (code == PSR_OK)
			code = psr_picture_write_depth(event->picture, sink->depth_numbered ? path : wish->depth, err);
	}
	if (code == PSR_OK && wish->report != NULL) {
		struct psr_msg_frame frame = *sink->frame;
		const struct shot_facts facts = { sink->scene, &frame, event, sink->server, sink->start_ns };

		frame.camera = event->begin->camera;
		code = sink->report_numbered ? output_name(path, wish->report, k + 1, err) : PSR_OK;
		if (code == PSR_OK)
			code = report_write(&facts, sink->report_numbered ? path : wish->report, err);
	}
	return code;
}

/* ---- animations take pictures in order ---- */

static int show_picture(struct sink *sink, const struct psr_frame *picture, struct psr_error *err)
{
	int code = PSR_OK;

	if (sink->n_shown == 0)
		code = psr_animation_open(&sink->animation, sink->wish->output, picture, sink->n, sink->wish->seconds / sink->n,
		                          err);
	if (code == PSR_OK)
		code = psr_animation_add(sink->animation, picture, err);
	sink->n_shown++;
	return code;
}

static int hold(struct sink *sink, uint32_t k, const struct psr_frame *picture, struct psr_error *err)
{
	size_t bytes = 3 * (size_t)picture->width * picture->height;

	for (int i = 0; i < SINK_HELD; i++) {
		if (sink->held[i].rgb != NULL)
			continue;
		sink->held[i].rgb = malloc(bytes);
		if (sink->held[i].rgb == NULL)
			break;
		memcpy(sink->held[i].rgb, picture->rgb, bytes);
		sink->held[i].k = k;
		return PSR_OK;
	}
	return psr_fail(err, PSR_ERR_MEMORY, "no memory to hold a picture of %ux%u pixels", picture->width,
	                picture->height);
}

static int animate(struct sink *sink, uint32_t k, const struct psr_frame *picture, struct psr_error *err)
{
	struct psr_frame next = *picture;
	int code = k == sink->n_shown ? show_picture(sink, picture, err) : hold(sink, k, picture, err);

	for (int i = 0; i < SINK_HELD && code == PSR_OK; i++) {
		if (sink->held[i].rgb == NULL || sink->held[i].k != sink->n_shown)
			continue;
		next.rgb = sink->held[i].rgb;
		code = show_picture(sink, &next, err);
		free(sink->held[i].rgb);
		sink->held[i].rgb = NULL;
		i = -1; /* the next picture may stand before this one */
	}
	return code;
}

/* ---- all ---- */

static void print_progress(const struct sink *sink, const struct psr_event *event)
{
	if (!isatty(STDERR_FILENO))
		return;
	if (sink->n > 1)
		fprintf(stderr, "\rpicture %u of %u\x1b[K%s", sink->n_done, sink->n, sink->n_done == sink->n ? "\r\x1b[K" : "");
	else
		fprintf(stderr, "%s: %ux%u, %.1f ms, %.1f kB\n", sink->scene->model[0].name, event->picture->width,
		        event->picture->height, (double)event->latency_ns / 1e6, (double)event->bytes / 1e3);
	fflush(stderr);
}

/* Sends a picture to its file. */
static int send(struct sink *sink, uint32_t k, const struct psr_event *event, struct psr_error *err)
{
	if (sink->kind == SINK_FILE || sink->kind == SINK_NUMBERED)
		return write_color(sink, k, event, err);
	if (sink->kind == SINK_SHEET)
		return sheet_add(&sink->sheet, k, event->picture, sink->scene->msg.background, err);
	return sink->kind == SINK_ANIMATION ? animate(sink, k, event->picture, err) : PSR_OK;
}

/* Of files whose colours are read as numbers. */
static int is_data(const char *name)
{
	static const char *const endings[] = { "npy", "exr", "hdr" };

	for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++)
		if (strcasecmp(outfile_ending(name), endings[i]) == 0)
			return 1;
	return 0;
}

/* The same with a legend, if the picture is to have one: in a copy, since reports are of the server's picture. */
static int send_with_legend(struct sink *sink, uint32_t k, const struct psr_event *event, struct psr_error *err)
{
	const int is_plain = sink->kind != SINK_NONE && sink->show == NULL && sink->wish->plane_text == NULL
	                     && !is_data(sink->wish->output);
	const size_t bytes = 3 * (size_t)event->picture->width * event->picture->height;
	struct psr_frame picture = *event->picture;
	struct psr_event copy = *event;
	struct legend legend;
	int code;

	if (!is_plain || sink->wish->has_no_legend || !legend_find(&legend, sink->scene, event->end))
		return send(sink, k, event, err);
	picture.rgb = malloc(bytes);
	if (picture.rgb == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a legend on %ux%u pixels", picture.width, picture.height);
	memcpy(picture.rgb, event->picture->rgb, bytes);
	legend_draw(&legend, picture.rgb, picture.width, picture.height);
	copy.picture = &picture;
	code = send(sink, k, &copy, err);
	free(picture.rgb);
	return code;
}

int sink_take(uint32_t k, const struct psr_event *event, void *userdata, struct psr_error *err)
{
	struct sink *sink = userdata;
	int code = send_with_legend(sink, k, event, err);

	if (code == PSR_OK)
		code = write_extra(sink, k, event, err);
	if (code != PSR_OK)
		return code;
	notes_add(&sink->notes, sink->scene, sink->frame, event);
	sink->hashes[k].planes = event->end->planes;
	memcpy(sink->hashes[k].hash, event->end->hash, sizeof sink->hashes[k].hash);
	sink->end = *event->end;
	sink->n_done++;
	print_progress(sink, event);
	return PSR_OK;
}

static int print_facts(const struct sink *sink, struct psr_error *err)
{
	for (uint32_t k = 0; k < sink->n && sink->wish->hash; k++) {
		for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
			if (!(sink->hashes[k].planes >> plane & 1))
				continue;
			if (sink->n > 1)
				printf("%u ", k + 1);
			printf("%s %016" PRIx64 "\n", psr_plane_name(plane), sink->hashes[k].hash[plane]);
		}
	}
	if (sink->wish->effects)
		effects_print(&sink->end);
	if (sink->n == 1 && budget_is_said(sink->frame))
		budget_print(sink->wish->program, sink->frame, &sink->end);
	return outfile_flush_stdout(err);
}

int sink_finish(struct sink *sink, int code, struct psr_error *err)
{
	if (code == PSR_OK && sink->kind == SINK_SHEET)
		code = psr_picture_write_color(&sink->sheet.picture, sink->wish->output, err);
	code = psr_animation_close(sink->animation, code, err);
	for (int i = 0; i < SINK_HELD; i++)
		free(sink->held[i].rgb);
	sheet_fini(&sink->sheet);
	if (code == PSR_OK)
		code = print_facts(sink, err);
	if (code == PSR_OK)
		notes_print(&sink->notes, sink->wish->program, sink->frame);
	free(sink->hashes);
	return code;
}
