/* What stands on top of the picture: overlay, panel, list, marks. Texts are for people who have not read a manual. */
#include "gui.h"
#include <cmath>
#include <cstdio>
#include <cstring>
#include <imgui.h>
extern "C" {
#include "viewer.h"
#include "base/clock.h"
}

static const ImGuiWindowFlags on_top = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize
                                       | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing
                                       | ImGuiWindowFlags_NoNav | ImGuiWindowFlags_NoInputs;

static float points(const struct viewer *viewer, double n)
{
	return (float)(n * viewer->scale);
}

/* ---- overlay ---- */

static uint64_t entry(const struct psr_msg_frame_end *end, uint16_t id)
{
	for (uint16_t i = 0; i < end->n_entries; i++)
		if (end->entry[i].id == id)
			return end->entry[i].ns;
	return 0;
}

static void codec_text(char text[32], const struct psr_msg_frame_begin *begin)
{
	static const char *const names[] = { "raw", "jpeg", "zstd", "png" };

	if (begin->color_codec == PSR_CODEC_JPEG)
		snprintf(text, 32, "jpeg %u", begin->color_quality);
	else
		snprintf(text, 32, "%s (lossless)", names[begin->color_codec & 3]);
}

static void draw_stages(const struct psr_msg_frame_end *end)
{
	static const struct { uint16_t id; const char *name; } stages[] = {
		{ PSR_WIRE_REPORT_SHADOW, "shadow" }, { PSR_WIRE_REPORT_CULL, "cull" }, { PSR_WIRE_REPORT_WARP, "warp" },
		{ PSR_WIRE_REPORT_GAPS, "gaps" }, { PSR_WIRE_REPORT_RESOLVE, "resolve" }, { PSR_WIRE_REPORT_SHADE, "shade" },
		{ PSR_WIRE_REPORT_FILL, "fill" }, { PSR_WIRE_REPORT_SMOOTH, "smooth" }, { PSR_WIRE_REPORT_ENCODE, "code" },
		{ PSR_WIRE_REPORT_QUEUE, "wait" },
	};
	char text[300] = "ms";
	size_t n = 2;

	for (const auto &stage : stages)
		if (entry(end, stage.id) >= 10000 && n < sizeof text - 40)
			n += (size_t)snprintf(text + n, sizeof text - n, "  %s %.2f", stage.name,
			                      (double)entry(end, stage.id) * 1e-6);
	ImGui::TextUnformatted(text);
}

static void draw_picture_lines(const struct viewer *viewer, const struct link_picture *picture)
{
	const struct psr_msg_settings *settings = &picture->begin.settings;
	char codec[32];

	codec_text(codec, &picture->begin);
	ImGui::Text("latency %.0f ms   decode %.1f ms   join %.1f ms   warp %.1f ms",
	            (double)(picture->came_ns - picture->asked_ns) * 1e-6, (double)picture->decode_ns * 1e-6,
	            viewer->shown.take_ms, viewer->shown.warp.ms);
	ImGui::Text("%ux%u / %u   spacing %g%s%s   %s   %.1f kB   error %.2f px", picture->frame.width,
	            picture->frame.height, settings->scale, settings->spacing_px, settings->smooth ? "   smooth" : "",
	            settings->splats ? "   splats" : "", codec, (double)picture->bytes * 1e-3, picture->end.error_px);
	draw_stages(&picture->end);
	if (viewer->shown.is_exact)
		ImGui::Text("%s", !picture->is_sharp       ? "as received"
		                  : picture->begin.refine > 0 ? "sharp and refined"
		                  : viewer->state.is_refining ? "sharp, of the coarse model"
		                                           : "sharp: the true picture");
	else
		ImGui::Text("warped: %.1f %% of the picture filled", 100 * viewer->shown.warp.filled);
}

static void draw_overlay(const struct viewer *viewer)
{
	const struct link_picture *picture = view_show_picture(viewer->show);

	ImGui::SetNextWindowPos(ImVec2(points(viewer, 8), points(viewer, 8)));
	ImGui::SetNextWindowBgAlpha(0.55f);
	if (ImGui::Begin("overlay", nullptr, on_top)) {
		ImGui::Text("%.0f shown/s   %.0f received/s   %.1f kB/s", viewer->drawn.per_second, viewer->received.per_second,
		            viewer->bytes_per_second * 1e-3);
		if (picture != nullptr)
			draw_picture_lines(viewer, picture);
		ImGui::TextDisabled("F1: keys   p: panel   Tab: this");
	}
	ImGui::End();
}

/* ---- state and notes: always there while they have something to say ---- */

static bool say_state(char text[PSR_ERROR_TEXT + 200], const struct viewer *viewer)
{
	const struct link_state *state = &viewer->state;
	const size_t size = PSR_ERROR_TEXT + 200;
	const uint64_t now_ns = clock_ns();
	const double wait = state->retry_ns > now_ns ? (double)(state->retry_ns - now_ns) * 1e-9 : 0;

	switch (state->phase) {
	case LINK_CONNECTING:
		snprintf(text, size, "connecting to %s", viewer->address);
		return true;
	case LINK_OPENING:
		snprintf(text, size, "building %s", state->model);
		return true;
	case LINK_LOST:
		snprintf(text, size, "the connection is lost: %s\nthis is the last picture; the next try is in %.1f s",
		         state->error.text, wait);
		return true;
	case LINK_REFUSED:
		snprintf(text, size, "%s", state->error.text);
		return true;
	default:
		if (state->is_refining)
			snprintf(text, size, "a finer model of %s is being built", state->model);
		return state->is_refining != 0;
	}
}

static void draw_progress(const struct viewer *viewer)
{
	const struct psr_msg_progress *progress = &viewer->state.progress;

	if (viewer->state.phase != LINK_OPENING && !viewer->state.is_refining)
		return;
	if (progress->total > 0)
		ImGui::ProgressBar((float)((double)progress->done / (double)progress->total), ImVec2(points(viewer, 260), 0));
}

static void draw_state(const struct viewer *viewer)
{
	const bool is_bad = viewer->state.phase == LINK_LOST || viewer->state.phase == LINK_REFUSED;
	const bool has_note = viewer->note_ns > clock_ns();
	char text[PSR_ERROR_TEXT + 200] = "";
	const bool has_state = say_state(text, viewer);

	if (!has_state && !has_note)
		return;
	ImGui::SetNextWindowPos(ImVec2(ImGui::GetIO().DisplaySize.x / 2, ImGui::GetIO().DisplaySize.y - points(viewer, 12)),
	                        ImGuiCond_Always, ImVec2(0.5f, 1));
	ImGui::SetNextWindowBgAlpha(0.8f);
	if (is_bad)
		ImGui::PushStyleColor(ImGuiCol_WindowBg, IM_COL32(120, 30, 20, 255));
	if (ImGui::Begin("state", nullptr, on_top)) {
		ImGui::PushTextWrapPos(0.8f * ImGui::GetIO().DisplaySize.x);
		if (has_state)
			ImGui::TextUnformatted(text);
		draw_progress(viewer);
		if (has_note)
			ImGui::TextUnformatted(viewer->note);
		ImGui::PopTextWrapPos();
	}
	ImGui::End();
	if (is_bad)
		ImGui::PopStyleColor();
}

static void draw_help(struct viewer *viewer)
{
	static const char *const lines[][2] = {
		{ "drag", "turn; with Shift freely, with Alt roll" },
		{ "right drag, Ctrl drag", "move the model" },
		{ "wheel, + -", "zoom to the cursor" },
		{ "double click", "turn about this point" },
		{ "click", "position, depth and normal" },
		{ "arrows, [ ]", "turn, roll by 5 degrees" },
		{ "w s a d e f", "fly; drag looks around" },
		{ "h   1 2 3 4 5 6 7", "home; front back left right top bottom iso" },
		{ "c   o   i", "the file's cameras; no perspective; inertia" },
		{ "L drag   k", "move the light, Shift turns a spot; let it go with the camera" },
		{ "click, G drag", "choose a model, move it; Shift turns, Ctrl scales" },
		{ "x   n   r", "shadows; smoothing; octrees as splats" },
		{ ", .   PgUp PgDn   b", "spacing; ambient; background" },
		{ "v", "colours by intensity, class, height, return, as far as the model has them" },
		{ "t   m", "pictures of stages; measure" },
		{ "F2   F5   Space", "screenshot; record a way; play it" },
		{ "Tab   p   F11   Esc", "overlay; panel; full screen; end" },
	};
	bool is_open = true;

	ImGui::SetNextWindowPos(ImVec2(ImGui::GetIO().DisplaySize.x / 2, ImGui::GetIO().DisplaySize.y / 2),
	                        ImGuiCond_Appearing, ImVec2(0.5f, 0.5f));
	if (ImGui::Begin("Keys", &is_open, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse)
	    && ImGui::BeginTable("keys", 2)) {
		for (const auto &line : lines) {
			ImGui::TableNextColumn();
			ImGui::TextUnformatted(line[0]);
			ImGui::TableNextColumn();
			ImGui::TextUnformatted(line[1]);
		}
		ImGui::EndTable();
	}
	ImGui::End();
	viewer->has_help = is_open;
}

/* ---- marks in the picture ---- */

static bool place(const struct viewer *viewer, const double point[3], ImVec2 *at)
{
	struct hand_cursor is;

	if (!hand_project(&viewer->hand, point, &is, nullptr))
		return false;
	*at = ImVec2((float)is.x, (float)is.y);
	return true;
}

/* Words on a dark plate: the picture behind may have any colour. */
static void label(const struct viewer *viewer, ImVec2 at, ImU32 color, const char *text)
{
	ImDrawList *list = ImGui::GetBackgroundDrawList();
	const ImVec2 size = ImGui::CalcTextSize(text);
	const float edge = points(viewer, 3);

	list->AddRectFilled(ImVec2(at.x - edge, at.y - edge), ImVec2(at.x + size.x + edge, at.y + size.y + edge),
	                    IM_COL32(16, 18, 22, 200), edge);
	list->AddText(at, color, text);
}

static void draw_point(const struct viewer *viewer, const struct viewer_point *point)
{
	const struct view_probe *probe = &point->probe;
	ImDrawList *list = ImGui::GetBackgroundDrawList();
	char text[200];
	ImVec2 at;
	int n;

	if (!place(viewer, probe->point, &at))
		return;
	n = snprintf(text, sizeof text, "%.6g, %.6g, %.6g\ndepth %.6g", probe->point[0], probe->point[1], probe->point[2],
	             probe->depth);
	if (point->has_normal)
		snprintf(text + n, sizeof text - (size_t)n, "\nnormal %.3f, %.3f, %.3f", point->normal[0], point->normal[1],
		         point->normal[2]);
	list->AddCircle(at, points(viewer, 4), IM_COL32(0, 0, 0, 255), 0, points(viewer, 3));
	list->AddCircle(at, points(viewer, 4), IM_COL32(255, 210, 60, 255), 0, points(viewer, 1.5));
	at.x += points(viewer, 12);
	at.y += points(viewer, 7);
	label(viewer, at, IM_COL32(255, 230, 150, 255), text);
}

/* The box of the instance that was clicked, where there is another one that it could be. */
static void draw_picked(const struct viewer *viewer)
{
	ImDrawList *list = ImGui::GetBackgroundDrawList();
	double corner[8][3];

	if (viewer->picked < 0 || (uint32_t)viewer->picked >= viewer->subject.n_instances
	    || (viewer->subject.n_instances == 1 && viewer->drag != DRAG_INSTANCE)
	    || !subject_instance_box(corner, &viewer->subject, viewer->scene, (uint32_t)viewer->picked))
		return;
	for (int c = 0; c < 8; c++)
		for (int i = 0; i < 3; i++) {
			ImVec2 from, to;

			if (!(c >> i & 1) && place(viewer, corner[c], &from) && place(viewer, corner[c | 1 << i], &to))
				list->AddLine(from, to, IM_COL32(120, 200, 255, 160), points(viewer, 1));
		}
}

static void draw_distance(const struct viewer *viewer)
{
	const double *a = viewer->point[0].probe.point, *b = viewer->point[1].probe.point;
	ImDrawList *list = ImGui::GetBackgroundDrawList();
	char text[64];
	ImVec2 from, to, middle;

	if (!place(viewer, a, &from) || !place(viewer, b, &to))
		return;
	middle = ImVec2((from.x + to.x) / 2, (from.y + to.y) / 2);
	snprintf(text, sizeof text, "%.6g", std::hypot(std::hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]));
	list->AddLine(from, to, IM_COL32(0, 0, 0, 255), points(viewer, 3));
	list->AddLine(from, to, IM_COL32(255, 210, 60, 255), points(viewer, 1.5));
	label(viewer, middle, IM_COL32(255, 255, 255, 255), text);
}

static void draw_marks(const struct viewer *viewer)
{
	ImVec2 at;

	if (!viewer->has_hand)
		return;
	if ((viewer->hand.grip == HAND_ORBIT || viewer->hand.grip == HAND_TRACKBALL) && !viewer->is_click
	    && place(viewer, viewer->hand.pivot, &at))
		ImGui::GetBackgroundDrawList()->AddCircleFilled(at, points(viewer, 3), IM_COL32(120, 200, 255, 200));
	draw_picked(viewer);
	if (viewer->point[0].is_set && viewer->point[1].is_set)
		draw_distance(viewer);
	for (const auto &point : viewer->point)
		if (point.is_set)
			draw_point(viewer, &point);
}

extern "C" void panel_draw(struct viewer *viewer)
{
	draw_marks(viewer);
	if (viewer->has_overlay)
		draw_overlay(viewer);
	draw_state(viewer);
	if (viewer->has_panel)
		settings_draw(viewer);
	if (viewer->has_help)
		draw_help(viewer);
}
