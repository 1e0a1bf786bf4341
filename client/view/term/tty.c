#include "tty.h"
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>
#include "base/clock.h"

#define ASK_NS UINT64_C(1000000000)

/* The other screen, no cursor, the mouse with buttons held, in cells without bound; and back. */
static const char enter[] = "\033[?1049h\033[?25l\033[?1002h\033[?1006h\033[2J";
static const char leave[] = "\033[0m\033[?1006l\033[?1002l\033[?25h\033[?1049l";
/* Pixels of a cell; whether it shows pictures in kitty's way; and what every terminal answers, last. */
static const char questions[] = "\033[16t\033_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\033\\\033[c";

static struct termios before;
static volatile sig_atomic_t is_taken, is_ended;

void tty_write(const char *bytes, size_t n)
{
	while (n > 0 && !is_ended) {
		const ssize_t written = write(STDOUT_FILENO, bytes, n);
		struct pollfd waits = { .fd = STDOUT_FILENO, .events = POLLOUT };

		if (written > 0) {
			bytes += written;
			n -= (size_t)written;
		} else if (errno == EAGAIN) {
			poll(&waits, 1, 100);
		} else if (errno != EINTR) {
			is_ended = 1;
		}
	}
}

/* Nothing but system calls: a signal may have come anywhere. */
void tty_close(void)
{
	if (!is_taken)
		return;
	is_taken = 0;
	if (write(STDOUT_FILENO, leave, sizeof leave - 1) < 0)
		is_ended = 1;
	tcsetattr(STDIN_FILENO, TCSANOW, &before);
}

static void on_end(int number)
{
	(void)number;
	is_ended = 1;
}

static void on_change(int number)
{
	(void)number;
}

static void on_crash(int number)
{
	tty_close();
	signal(number, SIG_DFL);
	raise(number);
}

int tty_is_ended(void)
{
	return is_ended;
}

static void catch_signals(void)
{
	static const int ends[] = { SIGINT, SIGTERM, SIGHUP }, crashes[] = { SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT };
	struct sigaction action = { .sa_handler = on_end };

	for (size_t i = 0; i < sizeof ends / sizeof ends[0]; i++)
		sigaction(ends[i], &action, NULL);
	action.sa_handler = on_change;
	sigaction(SIGWINCH, &action, NULL);
	action.sa_handler = on_crash;
	for (size_t i = 0; i < sizeof crashes / sizeof crashes[0]; i++)
		sigaction(crashes[i], &action, NULL);
	signal(SIGPIPE, SIG_IGN);
}

void tty_measure(struct tty *tty)
{
	struct winsize size = { 0 };

	if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) {
		size.ws_col = 80;
		size.ws_row = 24;
	}
	tty->cols = size.ws_col;
	tty->rows = size.ws_row;
	if (size.ws_xpixel / size.ws_col > 0 && size.ws_ypixel / size.ws_row > 0) {
		tty->cell_w = size.ws_xpixel / size.ws_col;
		tty->cell_h = size.ws_ypixel / size.ws_row;
	}
}

int tty_read(struct tty *tty)
{
	ssize_t n;

	if (tty->n_in == sizeof tty->in) /* none of it is an event */
		tty->n_in = 0;
	n = read(STDIN_FILENO, tty->in + tty->n_in, sizeof tty->in - tty->n_in);
	if (n > 0)
		tty->n_in += (size_t)n;
	return n > 0 || (n < 0 && (errno == EINTR || errno == EAGAIN));
}

int tty_next(struct tty *tty, struct input_event *event, int is_late)
{
	size_t used;

	do {
		used = input_next(event, tty->in, tty->n_in, is_late);
		tty->n_in -= used;
		memmove(tty->in, tty->in + used, tty->n_in);
	} while (used > 0 && event->kind == INPUT_NONE);
	return used > 0;
}

/* Keys that are pressed meanwhile are lost. */
static void ask(struct tty *tty)
{
	const uint64_t end_ns = clock_ns() + ASK_NS;
	struct pollfd waits = { .fd = STDIN_FILENO, .events = POLLIN };
	struct input_event event;

	tty_write(questions, sizeof questions - 1);
	for (uint64_t now_ns; (now_ns = clock_ns()) < end_ns && !is_ended;) {
		if (poll(&waits, 1, (int)((end_ns - now_ns) / 1000000 + 1)) <= 0 || !tty_read(tty))
			continue;
		while (tty_next(tty, &event, 0)) {
			if (event.kind == INPUT_CELL && event.x > 0 && event.y > 0) {
				tty->cell_w = event.x;
				tty->cell_h = event.y;
			}
			if (event.kind == INPUT_KITTY)
				tty->has_kitty = event.is_ok;
			if (event.kind == INPUT_DEVICE) {
				tty->has_sixel = event.has_sixel;
				return;
			}
		}
	}
}

int tty_open(struct tty *tty, struct psr_error *err)
{
	struct termios raw;

	memset(tty, 0, sizeof *tty);
	if (!isatty(STDIN_FILENO) || !isatty(STDOUT_FILENO) || tcgetattr(STDIN_FILENO, &before) != 0)
		return psr_fail(err, PSR_ERR_IO, "standard input and output are no terminal: run it in one, or let `psr shot` "
		                                 "write a picture into a file");
	raw = before;
	raw.c_iflag &= ~(tcflag_t)(IGNBRK | BRKINT | PARMRK | ISTRIP | INLCR | IGNCR | ICRNL | IXON);
	raw.c_lflag &= ~(tcflag_t)(ECHO | ECHONL | ICANON | ISIG | IEXTEN);
	raw.c_cc[VMIN] = 1;
	raw.c_cc[VTIME] = 0;
	catch_signals();
	is_taken = 1;
	atexit(tty_close);
	tcsetattr(STDIN_FILENO, TCSANOW, &raw);
	tty_write(enter, sizeof enter - 1);
	tty_measure(tty);
	ask(tty);
	return PSR_OK;
}
