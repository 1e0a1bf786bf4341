/* The terminal that a viewer runs in: its keys one by one, its screen as it was at the end, however that comes. */
#ifndef PSR_CLIENT_VIEW_TERM_TTY_H
#define PSR_CLIENT_VIEW_TERM_TTY_H

#include <stdint.h>
#include "input.h"
#include "psr/error.h"

struct tty {
	int cols, rows;          /* cells of the screen, at least 1 */
	int cell_w, cell_h;      /* pixels of one; 0: the terminal does not say */
	int has_sixel, has_kitty; /* as it says of itself */
	char in[8192];
	size_t n_in;
};

/* Takes the terminal of standard input and output, and asks it what it can do, for a second at most. IO: they are
 * none. */
int tty_open(struct tty *tty, struct psr_error *err);
void tty_close(void);        /* also what signals do that end the program; twice is fine */

void tty_measure(struct tty *tty);
/* Reads what is there. 0: the terminal is gone. */
int tty_read(struct tty *tty);
/* 1: *event is the next one; 0: there is none. is_late: nothing has come for a while. */
int tty_next(struct tty *tty, struct input_event *event, int is_late);
void tty_write(const char *bytes, size_t n);

/* 1: SIGINT, SIGTERM or SIGHUP came. They, and SIGWINCH, end a poll(). */
int tty_is_ended(void);

#endif
