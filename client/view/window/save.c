/* Screenshots and the ways of cameras. */
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
#include "base/clock.h"
#include "viewer.h"

#define NAMES 10000

/* The first of "psr-view-1.png", ... that is free in the folder where the viewer was started. 0: none is. */
static int free_name(char name[32], const char *ending)
{
	for (int k = 1; k < NAMES; k++) {
		snprintf(name, 32, VIEWER_NAME "-%d.%s", k, ending);
		if (access(name, F_OK) != 0)
			return 1;
	}
	return 0;
}

void save_shot(struct viewer *viewer)
{
	/* A psrd of the window's own is there for nobody else. */
	char *command = viewer->home != NULL
	                        ? subject_command(&viewer->subject, &viewer->hand, NULL, home_file(viewer->home))
	                        : subject_command(&viewer->subject, &viewer->hand, viewer->address, NULL);
	struct psr_error err;
	char name[32];

	viewer->wants_shot = 0;
	if (command == NULL)
		viewer_note(viewer, "no memory for a screenshot");
	else if (!free_name(name, "png"))
		viewer_note(viewer, "psr-view-1.png to psr-view-%d.png are all there; move them away", NAMES - 1);
	else if (psr_image_write(viewer->pixels, name, &err) != PSR_OK)
		viewer_note(viewer, "%s", err.text);
	else {
		viewer_note(viewer, "%s is written; the command that draws it stands on the terminal", name);
		printf("%s -o %s\n", command, name);
		fflush(stdout);
	}
	free(command);
}

static void end_record(struct viewer *viewer)
{
	const char *file = viewer->options.record;
	struct psr_error err;
	char name[32];

	if (file == NULL && free_name(name, "json"))
		file = name;
	if (file == NULL)
		viewer_note(viewer, "psr-view-1.json to psr-view-%d.json are all there; move them away", NAMES - 1);
	else if (path_write(&viewer->path, file, &err) != PSR_OK)
		viewer_note(viewer, "%s", err.text);
	else
		viewer_note(viewer, "%s holds %.1f seconds; --play shows them", file, path_seconds(&viewer->path));
	if (file != NULL)
		printf("%s\n", viewer->note);
	fflush(stdout);
}

void save_toggle_record(struct viewer *viewer)
{
	viewer->is_playing = 0;
	viewer->is_recording = !viewer->is_recording;
	if (!viewer->is_recording) {
		end_record(viewer);
		return;
	}
	path_fini(&viewer->path);
	viewer->path_start_ns = 0;
	viewer_note(viewer, "recording; F5 ends it");
}

void save_toggle_play(struct viewer *viewer)
{
	if (viewer->is_recording || viewer->path.n == 0) {
		viewer_note(viewer, "there is no way of the camera to play: F5 records one");
		return;
	}
	viewer->is_playing = !viewer->is_playing;
	viewer->path_start_ns = 0;
}

/* The clock of a path starts with the first step that has a camera. */
void save_step(struct viewer *viewer, uint64_t now_ns)
{
	struct hand_pose pose;
	struct psr_error err;
	double seconds;

	if (!viewer->has_hand || (!viewer->is_recording && !viewer->is_playing))
		return;
	if (viewer->path_start_ns == 0)
		viewer->path_start_ns = now_ns;
	seconds = (double)(now_ns - viewer->path_start_ns) * 1e-9;
	if (viewer->is_recording) {
		if (path_add(&viewer->path, seconds, &viewer->hand.pose, &err) == PSR_OK)
			return;
		viewer_note(viewer, "%s", err.text);
		save_toggle_record(viewer);
		return;
	}
	path_at(&viewer->path, seconds, &pose);
	hand_set_pose(&viewer->hand, &pose);
	if (seconds >= path_seconds(&viewer->path))
		viewer->is_playing = 0;
}
