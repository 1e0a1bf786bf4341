/* Whether rays to a cell slip through between lids: what seal.c asks of each. */
#ifndef PSR_DPOINT_SEALED_H
#define PSR_DPOINT_SEALED_H

#include "lid.h"

#define AROUND 8  /* directions of a slant */
#define AROUND_GRAZING (2 * AROUND) /* odd ones are those of a slant */

struct sealing {
	const struct dpoint_surface *surface;
	const struct dpoint_cover_options *options;
	struct lid *lid;
	uint32_t *over;        /* by cell: a lid that covers it, or UINT32_MAX; NULL: not known */
	struct cell_tree tree; /* of the lids' corners */
	uint8_t *is_open;      /* by cell */
	float around[AROUND_GRAZING][2], behind;
	int is_failed;
};

/* Lids around a cell. */
struct near_lid {
	const struct lid *lid;
	float place[3]; /* that is looked at, in the lid's frame */
};

struct nearby {
	struct near_lid *near;
	size_t n, room;
	int is_failed;
};

/* Whether the lids stop all rays that are looked at to a cell (seal.h). nearby: room, kept from cell to cell; is_failed:
 * no memory. */
int is_sealed(const struct sealing *s, struct nearby *nearby, uint32_t at);

#endif
