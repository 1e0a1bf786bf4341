#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/json.h"
#include "base/maths.h"
#include "base/outfile.h"
#include "base/view.h"
#include "client/replay/replay.h"
#include "budget.h"
#include "effects.h"
#include "report.h"


static void add_model(cJSON *to, const struct shot_facts *facts)
{
	static const char *const representations[] = { "", "blocks", "octree", "dpoint" };
	const struct scene_model *first = &facts->scene->model[0];
	const struct psr_msg_opened *opened = &first->opened;
	cJSON *model = cJSON_AddObjectToObject(to, "model"), *list;
	char id[JSON_ID_TEXT];

	cJSON_AddStringToObject(model, "name", first->name);
	cJSON_AddStringToObject(model, "content_id", json_id(id, opened->content_id));
	cJSON_AddNumberToObject(model, "samples", (double)opened->n_samples);
	cJSON_AddNumberToObject(model, "blocks", (double)opened->n_blocks);
	cJSON_AddNumberToObject(model, "levels", opened->n_levels);
	cJSON_AddNumberToObject(model, "bytes", (double)opened->bytes);
	if (opened->octree_levels > 0) {
		cJSON_AddNumberToObject(model, "octree_levels", opened->octree_levels);
		cJSON_AddNumberToObject(model, "of_levels", opened->of_levels);
	}
	json_add_number(model, "spacing", opened->spacing);
	cJSON_AddNumberToObject(model, "resolution", opened->resolution);
	json_add_number(model, "scale", opened->scale);
	json_add_numbers(model, "origin", opened->origin, 3);
	json_add_numbers(model, "box_min", opened->box_min, 3);
	json_add_numbers(model, "box_max", opened->box_max, 3);
	list = cJSON_AddArrayToObject(model, "representations");
	for (unsigned r = 1; r < 4; r++)
		if (opened->representations >> r & 1)
			cJSON_AddItemToArray(list, cJSON_CreateString(representations[r]));
}

static void add_camera(cJSON *to, const struct psr_camera *from)
{
	cJSON *camera = cJSON_AddObjectToObject(to, "camera");
	int is_perspective = from->kind == PSR_CAMERA_PERSPECTIVE;

	cJSON_AddStringToObject(camera, "kind", view_camera_kinds[from->kind]);
	json_add_numbers(camera, "eye", from->eye, 3);
	json_add_numbers(camera, "target", from->target, 3);
	json_add_numbers(camera, "up", from->up, 3);
	json_add_number(camera, is_perspective ? "fov_deg" : "height",
	                is_perspective ? from->fov_y / PSR_DEGREE : from->ortho_height);
	json_add_number(camera, "near", from->near_z);
}

static void add_stages(cJSON *to, const struct psr_msg_frame_end *end)
{
	static const char *const stages[] = { "",      "plan", "cull",   "warp",  "gaps", "resolve",
		                                  "shade", "fill", "encode", "queue", "total", "shadow", "smooth", "cores" };
	static const char *const values[] = { "samples_warped", "blocks_drawn", "blocks",       "pixels_covered",
		                                  "pixels_filled",  "samples",      "depth_levels", "lights",
		                                  "shadow_maps",    "shadow_maps_drawn" };
	cJSON *times = cJSON_AddObjectToObject(to, "stages"), *counts = cJSON_AddObjectToObject(to, "counts");

	for (unsigned i = 0; i < end->n_entries; i++) {
		const struct psr_msg_report_entry *entry = &end->entry[i];

		if (entry->id >= PSR_WIRE_REPORT_PLAN && entry->id <= PSR_WIRE_REPORT_CORES) {
			cJSON *stage = cJSON_AddObjectToObject(times, stages[entry->id]);

			cJSON_AddNumberToObject(stage, "ms", (double)entry->ns / 1e6);
			cJSON_AddNumberToObject(stage, "count", (double)entry->count);
		} else if (entry->id >= PSR_WIRE_REPORT_SAMPLES_WARPED && entry->id <= PSR_WIRE_REPORT_SHADOW_MAPS_DRAWN) {
			cJSON_AddNumberToObject(counts, values[entry->id - PSR_WIRE_REPORT_SAMPLES_WARPED], (double)entry->count);
		}
	}
}

static void add_planes(cJSON *to, const struct psr_event *event)
{
	cJSON *planes = cJSON_AddArrayToObject(to, "planes"), *hashes = cJSON_AddObjectToObject(to, "hashes");
	cJSON *checked = cJSON_AddArrayToObject(to, "checked");

	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
		char hash[17];

		if (!(event->end->planes >> plane & 1))
			continue;
		snprintf(hash, sizeof hash, "%016" PRIx64, event->end->hash[plane]);
		cJSON_AddItemToArray(planes, cJSON_CreateString(psr_plane_name(plane)));
		cJSON_AddStringToObject(hashes, psr_plane_name(plane), hash);
		if (event->checked >> plane & 1)
			cJSON_AddItemToArray(checked, cJSON_CreateString(psr_plane_name(plane)));
	}
}

static double server_ms(const struct psr_msg_frame_end *end)
{
	for (unsigned i = 0; i < end->n_entries; i++)
		if (end->entry[i].id == PSR_WIRE_REPORT_TOTAL)
			return (double)end->entry[i].ns / 1e6;
	return 0;
}

/* What was chosen for a budget draws the same frame again. */
static void add_replay(cJSON *report, const struct shot_facts *facts)
{
	struct psr_msg_frame frame = *facts->frame;

	if (budget_is_said(&frame)) {
		frame.budget = PSR_WIRE_BUDGET_SETTINGS;
		frame.settings = facts->event->begin->settings;
	}
	replay_add(report, facts->scene, &frame);
}

static cJSON *make_report(const struct shot_facts *facts)
{
	static const char *const status[] = { "ok", "late", "coarse" };
	const struct psr_event *event = facts->event;
	const double size[2] = { event->picture->width, event->picture->height };
	cJSON *report = cJSON_CreateObject(), *ms;

	cJSON_AddStringToObject(report, "server", facts->server);
	add_model(report, facts);
	cJSON_AddItemToObject(report, "size", cJSON_CreateDoubleArray(size, 2));
	add_camera(report, &event->begin->camera);
	cJSON_AddNumberToObject(report, "scale", event->begin->settings.scale);
	cJSON_AddNumberToObject(report, "spacing_px", event->begin->settings.spacing_px);
	cJSON_AddBoolToObject(report, "smooth", event->begin->settings.smooth);
	cJSON_AddBoolToObject(report, "fine", event->begin->settings.smooth == PSR_SMOOTH_FINE);
	cJSON_AddBoolToObject(report, "splats", event->begin->settings.splats);
	cJSON_AddNumberToObject(report, "pass", event->begin->pass);
	cJSON_AddStringToObject(report, "status", status[event->end->status < 3 ? event->end->status : 0]);
	cJSON_AddNumberToObject(report, "error_px", event->end->error_px);
	cJSON_AddNumberToObject(report, "bytes", (double)event->bytes);
	ms = cJSON_AddObjectToObject(report, "ms");
	cJSON_AddNumberToObject(ms, "server", server_ms(event->end));
	cJSON_AddNumberToObject(ms, "frame", (double)event->latency_ns / 1e6);
	cJSON_AddNumberToObject(ms, "total", (double)(clock_ns() - facts->start_ns) / 1e6);
	add_stages(report, event->end);
	drawn_as_add(report, event->end);
	effects_add(report, event->end);
	add_planes(report, event);
	if (event->end->planes >> PSR_PLANE_DEPTH & 1) {
		const double range[2] = { event->end->depth_min, event->end->depth_max };

		cJSON_AddItemToObject(report, "depth_range", cJSON_CreateDoubleArray(range, 2));
	}
	budget_add(report, facts->frame, event);
	add_replay(report, facts);
	return report;
}

int report_write(const struct shot_facts *facts, const char *path, struct psr_error *err)
{
	char *text = json_text(make_report(facts));
	int code;

	if (text == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the report");
	code = outfile_save(path, OUTFILE_PLAIN, text, strlen(text), err);
	free(text);
	return code;
}
