#include <assert.h>
#include <stdlib.h>
#include "bases.h"
#include "schedule.h"

#define MOST_OF_A_VIEW (SCHEDULE_WINDOW + 1)

struct base *base_create(uint32_t id, uint16_t view, unsigned frame, struct codec_parts *parts)
{
	struct base *base = calloc(1, sizeof *base);

	if (base == NULL) {
		free(parts);
		return NULL;
	}
	*base = (struct base){ .id = id, .view = view, .frame = frame, .n_refs = 1, .parts = parts };
	return base;
}

struct base *base_ref(struct base *base)
{
	base->n_refs++;
	return base;
}

void base_unref(struct base *base)
{
	if (base == NULL)
		return;
	assert(base->n_refs > 0);
	if (--base->n_refs > 0)
		return;
	free(base->parts);
	free(base);
}

static uint64_t bytes_of(const struct base *base)
{
	return codec_parts_bytes(base->parts->width, base->parts->height, base->parts->planes);
}

static void take_out(struct bases *bases, struct base **at)
{
	struct base *base = *at;

	*at = base->next;
	*bases->bytes -= bytes_of(base);
	base_unref(base);
}

void bases_add(struct bases *bases, struct base *base)
{
	unsigned n = 0;

	base->next = bases->first;
	bases->first = base;
	*bases->bytes += bytes_of(base);
	for (struct base **at = &bases->first; *at != NULL;) {
		if ((*at)->view == base->view && ++n > MOST_OF_A_VIEW)
			take_out(bases, at);
		else
			at = &(*at)->next;
	}
}

void bases_acknowledge(struct bases *bases, uint16_t view, uint32_t id, unsigned frame)
{
	struct base *known = bases->first;

	while (known != NULL && (known->view != view || known->id != id || known->frame != frame))
		known = known->next;
	if (known == NULL)
		return;
	known->is_acknowledged = 1;
	for (struct base **at = &known->next; *at != NULL;) {
		if ((*at)->view == view)
			take_out(bases, at);
		else
			at = &(*at)->next;
	}
}

struct base *bases_find(const struct bases *bases, uint16_t view, uint32_t id)
{
	for (struct base *base = bases->first; base != NULL; base = base->next)
		if (base->view == view && base->id == id && base->is_acknowledged)
			return base_ref(base);
	return NULL;
}

void bases_fini(struct bases *bases)
{
	while (bases->first != NULL)
		take_out(bases, &bases->first);
}
