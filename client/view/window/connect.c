#include <stdlib.h>
#include <string.h>
#include "client/cli/cli.h"
#include "viewer.h"

static void leave(struct viewer *viewer)
{
	bell_destroy(viewer->bell);
	link_close(viewer->link);
	link_scene_free(viewer->scene);
	free(viewer->list);
	viewer->bell = NULL;
	viewer->link = NULL;
	viewer->scene = NULL;
	viewer->list = NULL;
	viewer->n_list = 0;
}

int connect_to(struct viewer *viewer, const char *address, struct psr_error *err)
{
	struct link *link = NULL;
	struct bell *bell = NULL;
	int code = link_open(&link, address, PSR_PROGRAM, err);

	if (code == PSR_OK)
		code = bell_create(&bell, link_fd(link), viewer->bell_event, err);
	if (code != PSR_OK) {
		link_close(link);
		return code;
	}
	leave(viewer);
	viewer->link = link;
	viewer->bell = bell;
	viewer->address = address;
	viewer->wish = viewer->bytes_since = viewer->seen_pictures = 0;
	memset(&viewer->state, 0, sizeof viewer->state);
	link_list_ask(link);
	return PSR_OK;
}

int connect_file(struct viewer *viewer, const char *path, struct psr_error *err)
{
	struct home *home = NULL;
	int code = home_open(&home, path, err);

	if (code == PSR_OK)
		code = connect_to(viewer, home_address(home), err);
	if (code != PSR_OK) {
		home_close(home);
		return code;
	}
	home_close(viewer->home);
	viewer->home = home;
	viewer_show_model(viewer, home_model(home));
	return PSR_OK;
}

void connect_end(struct viewer *viewer)
{
	leave(viewer);
	home_close(viewer->home);
	viewer->home = NULL;
}
