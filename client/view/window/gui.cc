#include "gui.h"
#include <imgui.h>
#include <backends/imgui_impl_sdl.h>
#include <new>

struct gui {
	SDL_Renderer *renderer;
	SDL_Texture *font;
	double scale;
	bool has_window;
};

/* Debian's library has no backend for an SDL renderer, which takes triangles just as ImGui gives them. */
static void render(struct gui *gui, const ImDrawData *data)
{
	for (int k = 0; k < data->CmdListsCount; k++) {
		const ImDrawList *list = data->CmdLists[k];
		const ImDrawVert *vertex = list->VtxBuffer.Data;

		for (const ImDrawCmd &command : list->CmdBuffer) {
			const ImVec4 &clip = command.ClipRect;
			const SDL_Rect rect = { (int)clip.x, (int)clip.y, (int)(clip.z - clip.x), (int)(clip.w - clip.y) };
			const ImDrawVert *first = vertex + command.VtxOffset;

			if (command.UserCallback != nullptr || rect.w <= 0 || rect.h <= 0)
				continue;
			SDL_RenderSetClipRect(gui->renderer, &rect);
			SDL_RenderGeometryRaw(gui->renderer, (SDL_Texture *)command.TextureId, &first->pos.x, sizeof *first,
			                      (const SDL_Color *)&first->col, sizeof *first, &first->uv.x, sizeof *first,
			                      list->VtxBuffer.Size - (int)command.VtxOffset,
			                      list->IdxBuffer.Data + command.IdxOffset, (int)command.ElemCount,
			                      sizeof(ImDrawIdx));
		}
	}
	SDL_RenderSetClipRect(gui->renderer, nullptr);
}

static bool make_font(struct gui *gui)
{
	ImGuiIO &io = ImGui::GetIO();
	ImFontConfig config;
	unsigned char *pixels;
	int width, height;

	config.SizePixels = (float)(int)(13 * gui->scale);
	io.Fonts->AddFontDefault(&config);
	io.Fonts->GetTexDataAsRGBA32(&pixels, &width, &height);
	gui->font = SDL_CreateTexture(gui->renderer, SDL_PIXELFORMAT_ABGR8888, SDL_TEXTUREACCESS_STATIC, width, height);
	if (gui->font == nullptr || SDL_UpdateTexture(gui->font, nullptr, pixels, 4 * width) != 0)
		return false;
	SDL_SetTextureBlendMode(gui->font, SDL_BLENDMODE_BLEND);
	io.Fonts->SetTexID((ImTextureID)gui->font);
	return true;
}

extern "C" struct gui *gui_create(SDL_Window *window, SDL_Renderer *renderer, double scale)
{
	struct gui *gui = nullptr;

	try {
		gui = new struct gui();
		gui->renderer = renderer;
		gui->scale = scale;
		ImGui::CreateContext();
		ImGui::StyleColorsDark();
		ImGui::GetStyle().ScaleAllSizes((float)scale);
		ImGui::GetStyle().WindowRounding = ImGui::GetStyle().FrameRounding = 4 * (float)scale;
		ImGui::GetIO().IniFilename = nullptr; /* nothing is written beside the user's files */
		gui->has_window = ImGui_ImplSDL2_InitForSDLRenderer(window);
		if (gui->has_window && make_font(gui))
			return gui;
	} catch (const std::bad_alloc &) {
	}
	gui_destroy(gui);
	return nullptr;
}

extern "C" void gui_destroy(struct gui *gui)
{
	if (gui == nullptr)
		return;
	if (gui->font != nullptr)
		SDL_DestroyTexture(gui->font);
	if (gui->has_window)
		ImGui_ImplSDL2_Shutdown();
	ImGui::DestroyContext();
	delete gui;
}

extern "C" int gui_event(struct gui *gui, const SDL_Event *event)
{
	const ImGuiIO &io = ImGui::GetIO();

	(void)gui;
	ImGui_ImplSDL2_ProcessEvent(event);
	switch (event->type) {
	case SDL_MOUSEBUTTONDOWN:
	case SDL_MOUSEWHEEL:
		return io.WantCaptureMouse;
	case SDL_KEYDOWN:
	case SDL_TEXTINPUT:
		return io.WantTextInput;
	default:
		return 0; /* what lets go is for all */
	}
}

extern "C" void gui_draw(struct gui *gui, struct viewer *viewer)
{
	ImGui_ImplSDL2_NewFrame();
	/* The cursor is told in points; everything here is in pixels. */
	ImGuiIO &io = ImGui::GetIO();
	int width, height;
	SDL_GetRendererOutputSize(gui->renderer, &width, &height);
	if (io.MousePos.x > -1e6f) {
		io.MousePos.x *= (float)width / io.DisplaySize.x;
		io.MousePos.y *= (float)height / io.DisplaySize.y;
	}
	io.DisplaySize = ImVec2((float)width, (float)height);
	io.DisplayFramebufferScale = ImVec2(1, 1);
	ImGui::NewFrame();
	panel_draw(viewer);
	ImGui::Render();
	render(gui, ImGui::GetDrawData());
}
