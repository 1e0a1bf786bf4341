/* One orthographic projection of the object, sampled through all of its layers on the equilateral lattice
 * ([G] 4.4, 5.1).
 *
 * [G] keeps the first hit of each ray. Here every hit that faces the projection is kept, so that hidden
 * surfaces are sampled from their own best sides, too. The hits of a lattice block form patches of at most one hit a
 * lattice point: each may become a block of the model. */
#ifndef PSR_SAMPLE_PROJECT_SHEET_H
#define PSR_SAMPLE_PROJECT_SHEET_H

#include <stdint.h>
#include "model/blocks.h"
#include "ray/ray.h"
#include "sampling.h"

#define SHEET_NONE UINT32_MAX

/* Cosine of the steepest angle of hits: 72 degrees. */
#define SHEET_LEAST_COSINE 0.3f

/* Neighbours on the lattice whose depths differ by more steps are two surfaces. */
#define SHEET_STEPS 2.5f

/* Sheets of a lattice block share a patch while it is not deeper than this many steps: thrice as deep as it is wide.
 * */
#define SHEET_PATCH_STEPS 24

struct sheet_sample {
	float z;          /* along the projection's z, inner units */
	uint32_t surface; /* a side: surface.h */
};

/* First the members that searches read. */
struct patch {
	uint32_t next;      /* next patch of the same lattice block; SHEET_NONE ends */
	float low, high;    /* bound z of the hits */
	int16_t col, row;   /* in blocks */
	uint64_t mask;      /* hits; */
	uint64_t kept;      /* hits that the model keeps: sheets_keep() */
	uint64_t first;     /* first hits of their rays, but for sheer ones: nothing hides them */
	uint64_t moved;     /* hits that no ray found: sheets_add() */
	uint16_t n_wanted;  /* uncovered places that it could cover: sheets_want() */
	uint8_t two_sided;  /* sampling_is_sheet(), equal for all hits */
};

/* Puts a hit into a patch that has none at s yet. */
static inline void patch_put(struct patch *patch, unsigned s, float z)
{
	patch->low = patch->mask == 0 || z < patch->low ? z : patch->low;
	patch->high = patch->mask == 0 || z > patch->high ? z : patch->high;
	patch->mask |= UINT64_C(1) << s;
}

struct sheets {
	struct psr_projection projection; /* spacing: this level's */
	int reach;                        /* lattice blocks on each side of the origin, along rows and columns */
	uint32_t *head;                   /* (2 reach)^2: first patch of a lattice block, SHEET_NONE */
	uint32_t n_patches, capacity;
	struct patch *patch;
	struct sheet_sample (*sample)[PSR_BLOCK_SAMPLES];
	uint64_t n_rays, n_hits; /* n_rays: 0 of the projection that looks from behind */
};

/* Traces a lattice of projection->spacing. behind: gets the projection from the other side, of axes -x, y, -z and the
 * same rays; or NULL. The same bytes whatever the number of threads. MEMORY. */
int sheets_trace(struct sheets *sheets, struct sheets *behind, const struct sampling *sampling,
                 const struct psr_projection *projection);
void sheets_fini(struct sheets *sheets);

/* Projection space x and y of lattice point (row, column). */
static inline void sheets_point(const struct sheets *sheets, int row, int col, double *x, double *y)
{
	double spacing = (double)sheets->projection.spacing;

	*x = (col + (row & 1) / 2.0) * spacing;
	*y = row * 0.86602540378443864676 * spacing;
}

/* Makes the ray through x, y; z = SHEET_START - t. */
#define SHEET_START 2.0
void sheets_ray(const struct psr_projection *projection, double x, double y, struct ray *ray);

/* Rows and columns of the lattice triangle that holds projection space x, y. */
struct lattice_point {
	int row, col;
};
void sheets_triangle(const struct sheets *sheets, double x, double y, struct lattice_point corner[3]);

struct sheet_ref {
	uint32_t patch; /* SHEET_NONE: there is none */
	uint32_t sample;
};

/* Finds the hit at a lattice point nearest in depth to z, within reach. */
struct sheet_ref sheets_find(const struct sheets *sheets, struct lattice_point at, float z, float reach);

/* Finds such hits at the corners of a lattice triangle. */
void sheets_find_corners(const struct sheets *sheets, const struct lattice_point at[3], float z, float reach,
                         struct sheet_ref found[3]);

/* A patch with kept samples, of these sides and not far from this depth, that has nothing at a lattice point; or
 * none. */
struct sheet_ref sheets_room(const struct sheets *sheets, struct lattice_point at, float z, int two_sided);

/* Adds a hit that no ray found at a lattice point, to a patch with room or a new one. MEMORY. */
int sheets_add(struct sheets *sheets, struct lattice_point at, float z, uint32_t surface, int two_sided,
               struct sheet_ref *out);

/* Puts a new patch into the list of its lattice block. */
void sheets_link(struct sheets *sheets, uint32_t patch);

static inline void sheets_keep(struct sheets *sheets, struct sheet_ref ref)
{
	sheets->patch[ref.patch].kept |= UINT64_C(1) << ref.sample;
}

static inline int sheets_is_kept(const struct sheets *sheets, struct sheet_ref ref)
{
	return (int)(sheets->patch[ref.patch].kept >> ref.sample & 1);
}

static inline void sheets_want(struct sheets *sheets, uint32_t patch)
{
	sheets->patch[patch].n_wanted += sheets->patch[patch].n_wanted != UINT16_MAX;
}

void sheets_position(const struct sheets *sheets, struct sheet_ref ref, float position[3]);

/* A sample of one of the projections of a level. */
struct sample_ref {
	unsigned projection;
	struct sheet_ref at;
};

#endif
