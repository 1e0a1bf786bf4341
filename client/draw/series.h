/* Frames of one scene over one connection, several under way at a time. */
#ifndef PSR_CLIENT_DRAW_SERIES_H
#define PSR_CLIENT_DRAW_SERIES_H

#include "client/scene/scene.h"

struct series {
	struct psr_client *client;
	struct scene *scene;                 /* its key light follows the camera */
	const struct psr_msg_frame *frame;   /* all fields but the camera */
	const struct psr_camera *camera; /* n of them */
	uint32_t n;
	const char *server; /* address, for messages */
	int timeout_ms;     /* longest silence of the server */
	/* Takes whole frames, in any order of k. The pointers of the event are valid during the call. */
	int (*on_frame)(uint32_t k, const struct psr_event *event, void *userdata, struct psr_error *err);
	void *userdata;
};

/* Returns PSR_OK when all frames have come; else the first error of a frame, the connection or on_frame. */
int series_run(struct series *series, struct psr_error *err);

#endif
