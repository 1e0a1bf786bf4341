/* The warp of leaves in full vectors. Cubes are placed one by one, in vectors that their leaves do not fill; the steps
 * after that take leaves of several. */
#ifndef PSR_SIMD_LEAVES_BATCH_H
#define PSR_SIMD_LEAVES_BATCH_H

#include "leaves_list.h"

#define BATCH 192 /* leaves: those of some twelve cubes, and what is known of them stays in L1 */
#define CUBES 8   /* that are listed at once */
#define ROOM (BATCH + CUBES * PSR_BLOCK_SAMPLES + 16)

/* Leaves of which all but their offsets is known of their places. */
struct leaves {
	_Alignas(64) float at[3][ROOM];
	_Alignas(64) uint32_t id[ROOM];
	_Alignas(64) uint16_t normal[ROOM];
	_Alignas(64) uint8_t offset[ROOM];
	uint32_t n;
	/* Of all of them. */
	const struct warp_instance *in;
	const struct warp_octants *octants;
	int level, is_mixed, with_offsets;
};

/* Cubes of a run. */
struct run {
	const struct psr_cube_level *level;
	const struct psr_cube *cube; /* that of bit 0 */
	struct psr_cube_run from;
	uint32_t id;                 /* of its first leaf */
};

/* A cube of a run: its code and first leaf in the tree, and the id of lane 0. */
struct cube_at {
	uint32_t code, leaf, id;
};

static inline struct cube_at cube_at(const struct run *run, uint32_t number)
{
	const struct psr_cube *cube = &run->cube[number];

	return (struct cube_at){ run->from.code + cube->code, run->from.leaf + cube->leaf,
		                     run->id + number * PSR_BLOCK_SAMPLES };
}

/* Some of a run's cubes, in order: their numbers in it, and their middles in the picture. */
struct placed_cubes {
	_Alignas(64) double middle[3][CUBES_RUN];
	_Alignas(64) uint8_t number[CUBES_RUN + 8];
};

/* What a set of instructions has, with vectors of so many lanes, a power of two up to 16. */
struct leaf_vectors {
	uint32_t lanes;
	/* Lists the cubes of a mask, and computes their middles. */
	void (*place)(struct placed_cubes *placed, const struct warp_cubes *to, const struct run *run, uint64_t cubes);
	/* Puts the leaves of n of them, CUBES at most, from `first` on behind the others. */
	void (*list)(struct leaves *l, const struct run *run, const struct placed_cubes *placed, uint32_t first, uint32_t n);
	/* Lists the words and cells of n leaves from leaf i on, or of as many as there are lanes. */
	void (*draw)(struct leaves_lists *to, const struct leaves *l, const struct warp_target *t, uint32_t i, uint32_t n);
};

/* Draws the first n leaves. */
static inline __attribute__((always_inline)) void draw_leaves(struct leaf_vectors by, struct leaves_lists *to,
                                                              const struct leaves *l, const struct warp_target *t,
                                                              uint32_t n)
{
	for (uint32_t first = 0; first < n; first += PSR_BLOCK_SAMPLES) {
		const uint32_t end = n - first < PSR_BLOCK_SAMPLES ? n : first + PSR_BLOCK_SAMPLES;

		make_room(to, t, (uint32_t)l->level);
		for (uint32_t i = first; i < end; i += by.lanes)
			by.draw(to, l, t, i, end - i);
	}
}

/* Draws whole vectors of leaves, and keeps the rest. */
static inline __attribute__((always_inline)) void draw_most(struct leaf_vectors by, struct leaves_lists *to,
                                                            struct leaves *l, const struct warp_target *t)
{
	const uint32_t whole = l->n & ~(by.lanes - 1);

	draw_leaves(by, to, l, t, whole);
	for (int a = 0; a < 3; a++)
		memcpy(l->at[a], l->at[a] + whole, by.lanes * sizeof *l->at[a]);
	memcpy(l->id, l->id + whole, by.lanes * sizeof *l->id);
	memcpy(l->normal, l->normal + whole, by.lanes * sizeof *l->normal);
	memcpy(l->offset, l->offset + whole, by.lanes * sizeof *l->offset);
	l->n -= whole;
}

static inline __attribute__((always_inline)) void list_run(struct leaf_vectors by, struct leaves_lists *to,
                                                           struct leaves *l, const struct warp_target *t,
                                                           const struct bin_entry *entry, uint64_t cubes)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const struct psr_cubes *model = in->cubes->model;
	const uint32_t first = entry->slot - in->first_slot;
	const struct psr_cube_level *level = psr_cubes_level(model, first);
	const struct run run = { level, &model->cube[first], level->run[(first - level->first) / CUBES_RUN],
		                     entry->slot * PSR_BLOCK_SAMPLES };
	const struct warp_octants *octants = &in->cubes->level[level - model->level];
	const int with_offsets = entry->is_wide && level->tree->offset != NULL && level->tree->normal != NULL;
	const uint32_t n_cubes = (uint32_t)__builtin_popcountll(cubes);
	struct placed_cubes placed;

	if (octants != l->octants || entry->level != l->level || entry->is_mixed != l->is_mixed
	    || with_offsets != l->with_offsets) {
		draw_leaves(by, to, l, t, l->n);
		l->n = 0;
		l->in = in;
		l->octants = octants;
		l->level = entry->level;
		l->is_mixed = entry->is_mixed;
		l->with_offsets = with_offsets;
	}
	by.place(&placed, in->cubes, &run, cubes);
	for (uint32_t i = 0; i < n_cubes; i += CUBES) {
		by.list(l, &run, &placed, i, n_cubes - i < CUBES ? n_cubes - i : CUBES);
		if (l->n > BATCH)
			draw_most(by, to, l, t);
	}
}

static inline __attribute__((always_inline)) uint64_t leaves_in(struct leaf_vectors by, const struct warp_target *target,
                                                                const struct bin_entry *entry, uint32_t n)
{
	struct leaves_lists lists;
	struct leaves leaves;

	leaves_begin(&lists);
	memset(leaves.normal, 0, sizeof leaves.normal); /* a vector looks up those behind its last leaf, too */
	leaves.n = 0;
	leaves.octants = NULL;
	leaves.level = leaves.is_mixed = leaves.with_offsets = 0;
	for (uint32_t e = 0; e < n; e++) {
		fetch_next(target, entry, e, n);
		list_run(by, &lists, &leaves, target, &entry[e], target->cubes != NULL ? target->cubes[entry[e].hit] : 1);
	}
	draw_leaves(by, &lists, &leaves, target, leaves.n);
	return leaves_end(&lists, target);
}

#endif
