/* The panel: models, camera, light, quality, what a frame ran. */
#include "gui.h"
#include <cstdio>
#include <cstring>
#include <imgui.h>
extern "C" {
#include "viewer.h"
}

static const char *state_text(uint8_t state)
{
	return state == PSR_ENTRY_SOURCE ? " (builds first)" : state == PSR_ENTRY_FAILED ? " (failed)" : "";
}

static void draw_models(struct viewer *viewer)
{
	static char filter[64];

	ImGui::InputTextWithHint("##filter", "search", filter, sizeof filter);
	ImGui::SameLine();
	if (ImGui::SmallButton("again"))
		link_list_ask(viewer->link);
	ImGui::BeginChild("list", ImVec2(0, 7 * ImGui::GetTextLineHeightWithSpacing()), true);
	for (uint32_t i = 0; i < viewer->n_list; i++) {
		const struct psr_msg_list_entry *entry = &viewer->list[i];
		char text[PSR_WIRE_MAX_NAME + 40];

		if (strstr(entry->name, filter) == nullptr)
			continue;
		snprintf(text, sizeof text, "%s%s##%u", entry->name, state_text(entry->state), i);
		ImGui::PushID((int)i);
		if (ImGui::SmallButton("+"))
			viewer_add_model(viewer, entry->name);
		ImGui::SameLine();
		if (ImGui::Selectable(text, viewer->subject.n_instances == 1
		                                && strcmp(entry->name, viewer->subject.instance[0].link.model) == 0))
			viewer_show_model(viewer, entry->name);
		ImGui::PopID();
	}
	ImGui::EndChild();
}

/* Where the instance is, to be dragged. */
static void draw_place(struct viewer *viewer, uint32_t k)
{
	struct subject *subject = &viewer->subject;
	const struct link_instance *link = &subject->instance[k].link;
	double corner[8][3];
	float by[2] = { 0, 0 }, turn[2] = { 0, 0 }, scale = (float)link->scale;
	struct psr_error err;
	struct lens lens;
	int code = PSR_OK;

	if (!viewer->has_hand || !subject_instance_box(corner, subject, viewer->scene, k))
		return;
	lens_init(&lens, &viewer->hand.camera, viewer->hand.width, viewer->hand.height);
	if (ImGui::DragFloat2("move", by, 1, 0, 0, "drag")) {
		const double pixels[2] = { (double)by[0], (double)by[1] };

		code = subject_move_instance(subject, viewer->scene, k, &lens, pixels, &err);
	}
	if (ImGui::DragFloat2("turn", turn, 0.01f, 0, 0, "drag")) {
		const double radians[2] = { (double)turn[0], (double)turn[1] };

		code = subject_turn_instance(subject, viewer->scene, k, &lens, radians, &err);
	}
	if (ImGui::DragFloat("scale", &scale, 0.01f * scale, 1e-6f, 1e6f, "%.4g") && scale > 0)
		code = subject_scale_instance(subject, viewer->scene, k, (double)scale / link->scale, &err);
	if (code != PSR_OK)
		viewer_note(viewer, "%s", err.text);
}

/* The text is what psr shot takes, so a place that is typed here is the same there. */
static void draw_instances(struct viewer *viewer)
{
	struct subject *subject = &viewer->subject;

	for (uint32_t k = 0; k < subject->n_instances; k++) {
		char text[SUBJECT_TEXT];
		struct psr_error err;

		snprintf(text, sizeof text, "%s", subject->instance[k].text);
		ImGui::PushID((int)k);
		if (ImGui::RadioButton("##pick", viewer->picked == (int)k))
			viewer->picked = (int)k;
		ImGui::SameLine();
		if (ImGui::InputText("##place", text, sizeof text, ImGuiInputTextFlags_EnterReturnsTrue)
		    && subject_place(subject, k, text, &err) != PSR_OK)
			viewer_note(viewer, "%s", err.text);
		if (subject->n_instances > 1)
			ImGui::SameLine();
		if (subject->n_instances > 1 && ImGui::SmallButton("-")) {
			memmove(&subject->instance[k], &subject->instance[k + 1],
			        (subject->n_instances - k - 1) * sizeof subject->instance[0]);
			subject->n_instances--;
			viewer->picked = -1;
		}
		ImGui::PopID();
	}
	ImGui::TextDisabled("NAME,at=X,Y,Z,rotate=Y:90,scale=2");
	if (viewer->picked >= 0 && (uint32_t)viewer->picked < subject->n_instances)
		draw_place(viewer, (uint32_t)viewer->picked);
	ImGui::TextDisabled("G drag moves; Shift turns, Ctrl scales");
}

static void draw_camera(struct viewer *viewer)
{
	static const char *const sides[] = { "front", "back", "left", "right", "top", "bottom", "iso" };
	bool is_ortho = viewer->hand.pose.fov == 0, has_inertia = viewer->hand.has_inertia != 0;

	if (ImGui::SmallButton("home"))
		hand_home(&viewer->hand);
	for (const char *side : sides) {
		double angles[2];

		if (side != sides[3])
			ImGui::SameLine();
		if (ImGui::SmallButton(side) && view_side(side, angles))
			hand_look_from(&viewer->hand, angles[0], angles[1]);
	}
	ImGui::SameLine();
	if (ImGui::SmallButton("the file's"))
		input_next_camera(viewer);
	if (ImGui::Checkbox("no perspective", &is_ortho))
		hand_toggle_ortho(&viewer->hand);
	ImGui::SameLine();
	if (ImGui::Checkbox("inertia", &has_inertia))
		viewer->hand.has_inertia = has_inertia;
}

static void draw_light(struct viewer *viewer, uint32_t k)
{
	struct psr_msg_light light = viewer->subject.light[k].light;
	float color[3], intensity = (float)light.intensity;
	char text[SUBJECT_TEXT];
	struct psr_error err;
	bool has_changed;

	for (int i = 0; i < 3; i++)
		color[i] = (float)light.color[i] / 255;
	ImGui::PushID((int)k);
	if (ImGui::RadioButton("##drag", viewer->light == k))
		viewer->light = k;
	ImGui::SameLine();
	has_changed = ImGui::ColorEdit3("##color", color, ImGuiColorEditFlags_NoInputs);
	ImGui::SameLine();
	has_changed |= ImGui::SliderFloat("##intensity", &intensity, 0, 4, "%.2f");
	for (int i = 0; i < 3; i++)
		light.color[i] = (uint8_t)(color[i] * 255 + 0.5f);
	light.intensity = (double)intensity;
	if (has_changed && light.kind != 0)
		subject_set_light(&viewer->subject, k, &light);
	snprintf(text, sizeof text, "%s", viewer->subject.light[k].text);
	if (ImGui::InputText("##light", text, sizeof text, ImGuiInputTextFlags_EnterReturnsTrue)
	    && subject_read_light(&viewer->subject, k, text, &err) != PSR_OK)
		viewer_note(viewer, "%s", err.text);
	ImGui::PopID();
}

static void draw_lights(struct viewer *viewer)
{
	struct subject *subject = &viewer->subject;
	bool has_key = subject->has_key_light != 0, is_shadowed = subject->is_shadowed != 0;
	float ambient = (float)subject->ambient, background[3];

	if (ImGui::Checkbox("one light moves with the camera", &has_key)) {
		if (has_key)
			subject->n_lights = 0;
		else
			subject_fix_light(subject, &viewer->hand.camera);
		subject->has_key_light = has_key;
	}
	for (uint32_t k = 0; k < subject->n_lights && !has_key; k++)
		draw_light(viewer, k);
	if (subject->n_lights > 0 && !has_key) {
		ImGui::TextDisabled("dir:X,Y,Z  point:X,Y,Z");
		ImGui::TextDisabled("spot:X,Y,Z:TX,TY,TZ:DEG");
	}
	ImGui::TextDisabled("L drag; Shift: turn a spot, point nearer");
	if (ImGui::Checkbox("shadows", &is_shadowed))
		subject->is_shadowed = is_shadowed;
	if (ImGui::SliderFloat("ambient", &ambient, 0, 1, "%.2f"))
		subject->ambient = (int)(ambient * 100 + 0.5f) / 100.0;
	for (int i = 0; i < 3; i++)
		background[i] = (float)subject->background[i] / 255;
	if (ImGui::ColorEdit3("background", background, ImGuiColorEditFlags_NoInputs))
		for (int i = 0; i < 3; i++)
			subject->background[i] = (uint8_t)(background[i] * 255 + 0.5f);
}

static void draw_colors(struct viewer *viewer)
{
	struct subject *subject = &viewer->subject;
	const char *const now = subject->color_by != PSR_WIRE_COLOR_OWN ? scene_colors[subject->color_by] : "none";

	if (!ImGui::BeginCombo("colour by", now))
		return;
	if (ImGui::Selectable("none", subject->color_by == PSR_WIRE_COLOR_OWN))
		subject->color_by = PSR_WIRE_COLOR_OWN;
	for (uint8_t by = PSR_WIRE_COLOR_OWN + 1; by <= PSR_WIRE_COLOR_RETURN; by++)
		if (viewer->scene != nullptr && subject_has_color(viewer->scene, by)
		    && ImGui::Selectable(scene_colors[by], subject->color_by == by))
			subject->color_by = by;
	ImGui::EndCombo();
}

static void draw_quality(struct viewer *viewer)
{
	struct subject *subject = &viewer->subject;
	const bool has_octree = subject_has_octree(subject, viewer->scene) != 0;
	bool is_smooth = subject->is_smooth != 0, with_splats = subject->with_splats != 0;
	int passes = subject->passes;
	float spacing = (float)subject->spacing;

	if (ImGui::SliderFloat("spacing", &spacing, 0.25f, 8, "%.2f px", ImGuiSliderFlags_Logarithmic))
		subject->spacing = (double)spacing;
	if (ImGui::Checkbox("smooth", &is_smooth))
		subject->is_smooth = is_smooth;
	ImGui::SameLine();
	ImGui::BeginDisabled(!has_octree);
	if (ImGui::Checkbox("splats", &with_splats))
		subject->with_splats = with_splats;
	ImGui::EndDisabled();
	if (ImGui::SliderInt("passes", &passes, 0, PSR_MAX_PASS))
		subject->passes = (uint16_t)passes;
	draw_colors(viewer);
	if (ImGui::BeginCombo("show", subject->stage != nullptr ? subject->stage_name : "colours")) {
		if (ImGui::Selectable("colours", subject->stage == nullptr))
			viewer_set_stage(viewer, nullptr);
		for (unsigned k = 0; show_name(k) != nullptr; k++)
			if (ImGui::Selectable(show_name(k)))
				viewer_set_stage(viewer, show_name(k));
		ImGui::EndCombo();
	}
}

static void draw_effects(const struct viewer *viewer)
{
	const struct link_picture *picture = view_show_picture(viewer->show);

	for (uint16_t i = 0; picture != nullptr && i < picture->end.n_entries; i++) {
		const struct psr_msg_report_entry *entry = &picture->end.entry[i];
		const unsigned number = entry->id - (unsigned)PSR_WIRE_REPORT_EFFECTS;
		const auto effect = (enum psr_effect)number;

		if (entry->id < PSR_WIRE_REPORT_EFFECTS || number >= PSR_N_EFFECTS || entry->ns > PSR_WHY_COST)
			continue;
		if (entry->ns == PSR_WHY_RAN)
			ImGui::Text("%s: %llu %s", psr_effect_name(effect), (unsigned long long)entry->count,
			            psr_effect_counts(effect));
		else
			ImGui::TextDisabled("%s left out: %s", psr_effect_name(effect), psr_effect_why(effect, (enum psr_why)entry->ns));
	}
}

extern "C" void settings_draw(struct viewer *viewer)
{
	const float width = (float)(300 * viewer->scale), gap = (float)(8 * viewer->scale);
	bool is_open = true;

	ImGui::SetNextWindowPos(ImVec2(ImGui::GetIO().DisplaySize.x - width - gap, gap), ImGuiCond_Appearing);
	ImGui::SetNextWindowSize(ImVec2(width, ImGui::GetIO().DisplaySize.y - 2 * gap), ImGuiCond_Appearing);
	if (ImGui::Begin("psr-view", &is_open, ImGuiWindowFlags_NoSavedSettings)) {
		if (ImGui::CollapsingHeader("Models", ImGuiTreeNodeFlags_DefaultOpen)) {
			draw_models(viewer);
			draw_instances(viewer);
		}
		if (viewer->has_hand) {
			if (ImGui::CollapsingHeader("Camera", ImGuiTreeNodeFlags_DefaultOpen))
				draw_camera(viewer);
			if (ImGui::CollapsingHeader("Light", ImGuiTreeNodeFlags_DefaultOpen))
				draw_lights(viewer);
			if (ImGui::CollapsingHeader("Quality", ImGuiTreeNodeFlags_DefaultOpen))
				draw_quality(viewer);
			if (ImGui::CollapsingHeader("What this picture ran"))
				draw_effects(viewer);
		}
	}
	ImGui::End();
	viewer->has_panel = is_open;
}
