/* What a terminal sends: keys, the mouse (SGR mode), answers to questions. Pure: bytes in, events out. */
#ifndef PSR_CLIENT_VIEW_TERM_INPUT_H
#define PSR_CLIENT_VIEW_TERM_INPUT_H

#include <stddef.h>

enum input_kind {
	INPUT_NONE,      /* bytes that mean nothing here */
	INPUT_KEY,
	INPUT_PRESS, INPUT_MOVE, INPUT_RELEASE, /* of a button; MOVE: with one held */
	INPUT_WHEEL,
	INPUT_CELL,      /* answer to CSI 16 t: x, y are pixels of a cell */
	INPUT_DEVICE,    /* answer to CSI c, which every terminal gives */
	INPUT_KITTY,     /* answer to a question in the kitty protocol */
};

enum { INPUT_UP = 0x100, INPUT_DOWN, INPUT_RIGHT, INPUT_LEFT, INPUT_HOME, INPUT_END, INPUT_ESCAPE };
enum { INPUT_SHIFT = 1, INPUT_ALT = 2, INPUT_CTRL = 4 };

struct input_event {
	enum input_kind kind;
	int key;         /* KEY: a byte, or as above */
	int button;      /* 0 left, 1 middle, 2 right */
	int mods;        /* mouse: held with it */
	int x, y;        /* mouse: cells from 0; WHEEL also */
	int steps;       /* WHEEL: 1 up, -1 down */
	int has_sixel, is_ok; /* DEVICE, KITTY */
};

/* The bytes of the first event; 0: more must come. is_all: nothing more comes soon, so ESC is a key. */
size_t input_next(struct input_event *event, const char *bytes, size_t n, int is_all);

#endif
