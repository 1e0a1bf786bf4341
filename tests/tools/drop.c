/* drop WINDOW FILE: drops a file on an X11 window, as a file manager does (XDND, version 5). Exits 0 once the window
 * has taken it. */
#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <limits.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PATIENCE_MS 5000

struct drag {
	Display *display;
	Window source, target;
	char uri[PATH_MAX + 16];
};

static Atom atom(const struct drag *drag, const char *name)
{
	return XInternAtom(drag->display, name, False);
}

static void send(const struct drag *drag, const char *type, const long word[4])
{
	XEvent event = { .xclient = { .type = ClientMessage, .window = drag->target, .format = 32 } };

	event.xclient.message_type = atom(drag, type);
	event.xclient.data.l[0] = (long)drag->source;
	for (int i = 0; i < 4; i++)
		event.xclient.data.l[i + 1] = word[i];
	XSendEvent(drag->display, drag->target, False, NoEventMask, &event);
	XFlush(drag->display);
}

static void answer(const struct drag *drag, const XSelectionRequestEvent *request)
{
	XEvent event = { .xselection = { .type = SelectionNotify, .requestor = request->requestor,
		                             .selection = request->selection, .target = request->target,
		                             .property = request->property, .time = request->time } };

	XChangeProperty(drag->display, request->requestor, request->property, request->target, 8, PropModeReplace,
	                (const unsigned char *)drag->uri, (int)strlen(drag->uri));
	XSendEvent(drag->display, request->requestor, False, NoEventMask, &event);
	XFlush(drag->display);
}

/* Serves the selection until this message comes. 0: it does not. */
static int wait_for(const struct drag *drag, const char *type)
{
	const Atom wanted = atom(drag, type);
	struct pollfd polled = { .fd = ConnectionNumber(drag->display), .events = POLLIN };

	for (;;) {
		XEvent event;

		if (XPending(drag->display) == 0 && poll(&polled, 1, PATIENCE_MS) != 1)
			return 0;
		if (XPending(drag->display) == 0)
			continue;
		XNextEvent(drag->display, &event);
		if (event.type == SelectionRequest)
			answer(drag, &event.xselectionrequest);
		else if (event.type == ClientMessage && event.xclient.message_type == wanted)
			return 1;
	}
}

int main(int argc, char **argv)
{
	struct drag drag = { .display = argc == 3 ? XOpenDisplay(NULL) : NULL };
	int x = 0, y = 0;
	Window child;

	if (drag.display == NULL) {
		fprintf(stderr, "usage: drop WINDOW FILE (an absolute path), with a DISPLAY\n");
		return 2;
	}
	drag.target = strtoul(argv[1], NULL, 0);
	snprintf(drag.uri, sizeof drag.uri, "file://%s\r\n", argv[2]);
	drag.source = XCreateSimpleWindow(drag.display, DefaultRootWindow(drag.display), 0, 0, 1, 1, 0, 0, 0);
	XSetSelectionOwner(drag.display, atom(&drag, "XdndSelection"), drag.source, CurrentTime);
	XTranslateCoordinates(drag.display, drag.target, DefaultRootWindow(drag.display), 10, 10, &x, &y, &child);
	send(&drag, "XdndEnter", (long[4]){ 5L << 24, (long)atom(&drag, "text/uri-list"), 0, 0 });
	send(&drag, "XdndPosition", (long[4]){ 0, (long)x << 16 | y, CurrentTime, (long)atom(&drag, "XdndActionCopy") });
	if (!wait_for(&drag, "XdndStatus")) {
		fprintf(stderr, "drop: the window takes nothing\n");
		return 1;
	}
	send(&drag, "XdndDrop", (long[4]){ 0, CurrentTime, 0, 0 });
	if (!wait_for(&drag, "XdndFinished")) {
		fprintf(stderr, "drop: the window did not finish\n");
		return 1;
	}
	XCloseDisplay(drag.display);
	return 0;
}
