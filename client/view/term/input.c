#include "input.h"
#include <stdlib.h>
#include <string.h>

#define MOST_NUMBERS 16
#define MOST_SEQUENCE 4096 /* longer ones are none */

/* CSI: numbers apart by ; or :, behind one of <?=> perhaps, and a last byte of @ to ~. */
struct sequence {
	char lead, last;
	int number[MOST_NUMBERS], n;
};

static size_t read_sequence(struct sequence *sequence, const char *bytes, size_t n)
{
	size_t at = 2;

	memset(sequence, 0, sizeof *sequence);
	if (at < n && strchr("<?=>", bytes[at]) != NULL)
		sequence->lead = bytes[at++];
	for (; at < n; at++) {
		const char c = bytes[at];

		if (c >= '0' && c <= '9') {
			int *number;

			if (sequence->n == 0)
				sequence->n = 1;
			number = &sequence->number[sequence->n - 1];
			if (*number < 100000)
				*number = 10 * *number + (c - '0');
		} else if (c == ';' || c == ':') {
			sequence->n += sequence->n == 0;
			sequence->n += sequence->n < MOST_NUMBERS;
		} else if (c >= '@' && c <= '~') {
			sequence->last = c;
			return at + 1;
		} else if (c < ' ' || at > MOST_SEQUENCE) {
			return at + 1;
		}
	}
	return 0;
}

static void take_mouse(struct input_event *event, const struct sequence *sequence)
{
	const int code = sequence->number[0];

	event->x = sequence->number[1] - 1;
	event->y = sequence->number[2] - 1;
	event->mods = (code & 4 ? INPUT_SHIFT : 0) | (code & 8 ? INPUT_ALT : 0) | (code & 16 ? INPUT_CTRL : 0);
	event->button = code & 3;
	if (code & 64) {
		event->kind = (code & 3) < 2 ? INPUT_WHEEL : INPUT_NONE;
		event->steps = (code & 3) == 0 ? 1 : -1;
	} else if (code & 32) {
		event->kind = event->button < 3 ? INPUT_MOVE : INPUT_NONE;
	} else {
		event->kind = sequence->last == 'M' ? INPUT_PRESS : INPUT_RELEASE;
	}
}

static void take_sequence(struct input_event *event, const struct sequence *sequence)
{
	static const char letters[] = "ABCDHF";
	const char *letter = sequence->last != '\0' ? strchr(letters, sequence->last) : NULL;

	if (sequence->lead == '<' && sequence->n >= 3 && (sequence->last == 'M' || sequence->last == 'm')) {
		take_mouse(event, sequence);
	} else if (sequence->lead == '?' && sequence->last == 'c') {
		event->kind = INPUT_DEVICE;
		for (int i = 1; i < sequence->n; i++)
			event->has_sixel |= sequence->number[i] == 4;
	} else if (sequence->lead == '\0' && sequence->last == 't' && sequence->n >= 3 && sequence->number[0] == 6) {
		event->kind = INPUT_CELL;
		event->y = sequence->number[1];
		event->x = sequence->number[2];
	} else if (sequence->lead == '\0' && letter != NULL) {
		event->kind = INPUT_KEY;
		event->key = INPUT_UP + (int)(letter - letters);
	}
}

/* ESC _ or ESC P ... ESC \, of which the answers of the kitty protocol begin with G. */
static size_t take_string(struct input_event *event, const char *bytes, size_t n)
{
	for (size_t at = 2; at < n; at++) {
		if (bytes[at] == '\033' && at + 1 == n)
			return 0;
		if (bytes[at] != '\033' && at < MOST_SEQUENCE)
			continue;
		if (n > 2 && bytes[1] == '_' && bytes[2] == 'G') {
			event->kind = INPUT_KITTY;
			event->is_ok = at >= 5 && memcmp(bytes + at - 3, ";OK", 3) == 0;
		}
		return bytes[at] == '\033' ? at + 2 : at;
	}
	return 0;
}

size_t input_next(struct input_event *event, const char *bytes, size_t n, int is_all)
{
	struct sequence sequence;
	size_t used = 0;

	memset(event, 0, sizeof *event);
	if (n == 0)
		return 0;
	if (bytes[0] != '\033') {
		event->kind = INPUT_KEY;
		event->key = (unsigned char)bytes[0];
		return 1;
	}
	if (n >= 2 && (bytes[1] == '[' || bytes[1] == 'O')) {
		used = read_sequence(&sequence, bytes, n);
		if (used > 0)
			take_sequence(event, &sequence);
	} else if (n >= 2 && (bytes[1] == '_' || bytes[1] == 'P')) {
		used = take_string(event, bytes, n);
	} else if (n >= 2) { /* ESC, and then something else */
		is_all = 1;
	}
	if (used > 0 || !is_all)
		return used;
	event->kind = INPUT_KEY;
	event->key = INPUT_ESCAPE;
	return 1;
}
