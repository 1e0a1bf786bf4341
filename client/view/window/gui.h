/* Dear ImGui (text, panel) on an SDL renderer. */
#ifndef PSR_CLIENT_VIEW_WINDOW_GUI_H
#define PSR_CLIENT_VIEW_WINDOW_GUI_H

#include <SDL.h>

#ifdef __cplusplus
extern "C" {
#endif

struct gui;
struct viewer;

struct gui *gui_create(SDL_Window *window, SDL_Renderer *renderer, double scale); /* NULL: no memory */
void gui_destroy(struct gui *gui); /* NULL is fine */
/* 1: the event was for the panel, and for nobody else. */
int gui_event(struct gui *gui, const SDL_Event *event);
/* Overlay, panel and marks of this moment, drawn on top of what the renderer has. */
void gui_draw(struct gui *gui, struct viewer *viewer);

/* ---- panel.cc ---- */

void panel_draw(struct viewer *viewer);

/* ---- settings.cc ---- */

void settings_draw(struct viewer *viewer);

#ifdef __cplusplus
}
#endif
#endif
