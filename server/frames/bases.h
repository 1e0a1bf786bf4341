/* Frames that clients hold, and that later frames of the view can come as changes to (PROTOCOL.md, "Base"). They belong
 * to the loop's thread; a job that codes a frame reads the parts of a base to which it has a reference. */
#ifndef PSRD_BASES_H
#define PSRD_BASES_H

#include "codec_parts.h"

struct base {
	struct base *next;
	uint32_t id;
	uint16_t view;
	unsigned frame;
	int is_acknowledged;
	unsigned n_refs;
	struct codec_parts *parts;
};

struct bases { /* one a connection */
	struct base *first; /* head of the list, the newest first */
	uint64_t *bytes;    /* the user's counter for all connections */
};

/* Takes the parts, even when it fails: NULL without memory. */
struct base *base_create(uint32_t id, uint16_t view, unsigned frame, struct codec_parts *parts);
struct base *base_ref(struct base *base);
void base_unref(struct base *base); /* NULL is fine */

/* The frame was sent: takes the caller's reference. Of a view it keeps the last frames that can be unacknowledged, and
 * one before them. */
void bases_add(struct bases *bases, struct base *base);
/* Older frames of the view are no bases any more. */
void bases_acknowledge(struct bases *bases, uint16_t view, uint32_t id, unsigned frame);
/* Returns a reference to the last acknowledged frame of `id`, or NULL. */
struct base *bases_find(const struct bases *bases, uint16_t view, uint32_t id);
void bases_fini(struct bases *bases);

#endif
