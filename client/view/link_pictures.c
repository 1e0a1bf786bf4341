#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include "link_inside.h"

#define MOST 6 /* four that the user holds, the newest one, and the one that is being filled */

struct slot {
	struct link_picture picture; /* first: link_release() finds the slot by it */
	struct link_pictures *pictures;
	unsigned planes;
	int is_held;
};

struct link_pictures {
	pthread_mutex_t lock;
	unsigned n_refs;
	struct slot slot[MOST];
};

int link_pictures_create(struct link_pictures **out)
{
	struct link_pictures *pictures = calloc(1, sizeof *pictures);

	if (pictures == NULL)
		return PSR_ERR_MEMORY;
	if (pthread_mutex_init(&pictures->lock, NULL) != 0) {
		free(pictures);
		return PSR_ERR_MEMORY;
	}
	pictures->n_refs = 1;
	*out = pictures;
	return PSR_OK;
}

/* With the lock held, which it gives up. */
static void unref(struct link_pictures *pictures)
{
	const int is_last = --pictures->n_refs == 0;

	pthread_mutex_unlock(&pictures->lock);
	if (!is_last)
		return;
	for (unsigned i = 0; i < MOST; i++)
		psr_frame_free(&pictures->slot[i].picture.frame);
	pthread_mutex_destroy(&pictures->lock);
	free(pictures);
}

void link_pictures_unref(struct link_pictures *pictures)
{
	if (pictures == NULL)
		return;
	pthread_mutex_lock(&pictures->lock);
	unref(pictures);
}

static int fits(const struct slot *slot, uint32_t width, uint32_t height, unsigned planes)
{
	const struct psr_frame *frame = &slot->picture.frame;

	return frame->width == width && frame->height == height && slot->planes == planes;
}

/* One that fits, or else any that is free. */
static struct slot *find_free(struct link_pictures *pictures, uint32_t width, uint32_t height, unsigned planes)
{
	struct slot *any = NULL;

	for (unsigned i = 0; i < MOST; i++) {
		struct slot *slot = &pictures->slot[i];

		if (slot->is_held)
			continue;
		if (fits(slot, width, height, planes))
			return slot;
		any = slot;
	}
	return any;
}

struct link_picture *link_pictures_get(struct link_pictures *pictures, uint32_t width, uint32_t height,
                                       unsigned planes)
{
	struct slot *slot;

	pthread_mutex_lock(&pictures->lock);
	slot = find_free(pictures, width, height, planes);
	if (slot != NULL && !fits(slot, width, height, planes)) {
		psr_frame_free(&slot->picture.frame);
		slot->planes = planes;
		if (psr_frame_alloc(&slot->picture.frame, width, height, planes, NULL) != PSR_OK)
			slot = NULL;
	}
	if (slot != NULL) {
		slot->is_held = 1;
		slot->pictures = pictures;
		pictures->n_refs++;
	}
	pthread_mutex_unlock(&pictures->lock);
	return slot != NULL ? &slot->picture : NULL;
}

void link_release(struct link_picture *picture)
{
	struct slot *slot = (struct slot *)picture;

	if (picture == NULL)
		return;
	pthread_mutex_lock(&slot->pictures->lock);
	slot->is_held = 0;
	unref(slot->pictures);
}
