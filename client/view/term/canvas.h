/* A picture as the bytes that make a terminal show it, by chafa. */
#ifndef PSR_CLIENT_VIEW_TERM_CANVAS_H
#define PSR_CLIENT_VIEW_TERM_CANVAS_H

#include "psr/frame.h"
#include "tty.h"

enum canvas_way { CANVAS_AUTO, CANVAS_KITTY, CANVAS_SIXEL, CANVAS_SYMBOLS };

struct canvas {
	enum canvas_way way;     /* not AUTO */
	int cols, rows;          /* cells that the picture covers, from the top left */
	int cell_w, cell_h;      /* pixels of one: those of the terminal, or what symbols are chosen by */
	uint32_t width, height;  /* pixels of the picture */
	void *info, *canvas;     /* chafa's */
};

/* For all of the screen but its last row. AUTO: the best way that the terminal knows. MEMORY. */
int canvas_open(struct canvas *canvas, const struct tty *tty, enum canvas_way way, struct psr_error *err);
void canvas_close(struct canvas *canvas);

/* Writes the colours of a frame of width x height to the terminal. */
void canvas_draw(struct canvas *canvas, const struct psr_frame *frame);

#endif
