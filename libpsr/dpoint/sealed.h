/* Whether rays to a cell slip through between lids: what seal.c and lean.c ask of each. */
#ifndef PSR_DPOINT_SEALED_H
#define PSR_DPOINT_SEALED_H

#include "lid.h"

#define AROUND 8  /* directions of a slant */
#define AROUND_GRAZING (2 * AROUND) /* odd ones are those of a slant */
#define GRAZING 0.07f /* cosine to a plane's normal of rays that graze it */

/* Lids around a cell. */
struct near_lid {
	const struct lid *lid;
	float place[3]; /* that is looked at, in the lid's frame */
	int is_over;    /* the place is within its sides */
};

struct nearby {
	struct near_lid *near;
	size_t n, room;
	int is_failed;
};

struct sealing {
	const struct dpoint_surface *surface;
	const struct dpoint_cover_options *options;
	struct lid *lid;
	uint32_t *over;        /* by cell: a lid that covers it, or UINT32_MAX; NULL: not known */
	struct cell_tree tree; /* of the lids' corners */
	uint8_t *is_open;      /* by cell */
	float around[AROUND_GRAZING][2], behind;
	/* What is asked of a cell. nearby: room, kept from cell to cell; is_failed: no memory. */
	int (*is_closed)(const struct sealing *s, struct nearby *nearby, uint32_t at);
	int is_failed;
};

/* is_open is NULL: the caller's to make, and to free. */
void sealing_init(struct sealing *s, const struct dpoint_surface *surface, const struct dpoint_cover_options *options);

/* Of the cells that is_open is set for, clears it for those that the kept candidates close. MEMORY, CANCELLED. */
int sealing_look(struct sealing *s, const struct dpoint_choice *choice, const struct dpoint_work *work);

/* Adds the lids, of the tree's node i and below, whose balls meet the ball around a place. */
void nearby_gather(struct nearby *nearby, const struct sealing *s, size_t i, const float middle[3], float radius);

/* The axes of a cell's plane, its normal last. Returns 0 of a cell without an area. */
int rays_axis(float axis[3][3], const struct dpoint_cell *cell);

/* Where AROUND_GRAZING rays come from that graze a plane. */
void rays_graze(float (*from)[3], const struct sealing *s, const float axis[3][3]);

/* Lists n rays to a place, all of them open, by their directions. Returns n. */
int rays_open(uint8_t *open, int n);

/* Leaves out those of the open rays to the place `at` that the lid stops, `behind` after it at most; grazing ones of
 * is_sealed() some more. p: the place in the lid's frame. Returns how many are left. */
int rays_stop(uint8_t *open, int n_open, const struct lid *lid, const float at[3], const float p[3],
              const float (*from)[3], float behind);

/* The same of all lids nearby. */
int rays_stop_by(uint8_t *open, int n_open, const struct nearby *nearby, const float at[3], const float (*from)[3],
                 float behind);

/* Whether the lids stop all rays that are looked at to a cell (seal.h). */
int is_sealed(const struct sealing *s, struct nearby *nearby, uint32_t at);

#endif
