/* The warp of leaves by lists, as warp_list.h has it of blocks. */
#ifndef PSR_SIMD_LEAVES_LIST_H
#define PSR_SIMD_LEAVES_LIST_H

#include "cube.h"
#include "warp_list.h"

/* Prepares cubes, and prefetches their normals and offsets where these are needed: by points, for what faces away and to
 * move wide leaves; by splats, always. */
static inline void make_cubes(struct warp_cube *cubes, const struct warp_target *t, const struct bin_entry *entry,
                              uint32_t n, int for_splats)
{
	for (uint32_t i = 0; i < n; i++) {
		struct warp_cube *c = &cubes[i];

		warp_cube_make(c, &t->instance[entry[i].instance], entry[i].slot);
		const int moves = c->offset != NULL && (for_splats || entry[i].is_wide);

		if (for_splats || entry[i].is_mixed || moves)
			__builtin_prefetch(c->normal);
		if (moves)
			__builtin_prefetch(c->offset);
	}
}

/* Cubes come in any order of memory: the lines of later ones are fetched in two steps, since one tells of the next. */
static inline void fetch_cubes(const struct warp_target *t, const struct bin_entry *entry, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++) {
		const struct warp_instance *in = &t->instance[entry[i].instance];

		__builtin_prefetch(&in->cubes->model->cube[entry[i].slot - in->first_slot]);
	}
}

static inline void fetch_codes(const struct warp_target *t, const struct bin_entry *entry, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++) {
		const struct warp_instance *in = &t->instance[entry[i].instance];
		const uint32_t cube = entry[i].slot - in->first_slot;
		const struct psr_cube_level *level = psr_cubes_level(in->cubes->model, cube);

		__builtin_prefetch(level->tree->code + psr_cubes_code(in->cubes->model, level, cube));
	}
}

/* The entries of a batch from `first` on, BLOCKS or what is left of n. */
static inline uint32_t batch_of(uint32_t first, uint32_t n)
{
	return first >= n ? 0 : n - first < BLOCKS ? n - first : BLOCKS;
}

/* Prepares the batch that begins with entry e, and fetches what later ones need. */
static inline void next_cubes(struct warp_cube *cubes, const struct warp_target *t, const struct bin_entry *entry,
                              uint32_t e, uint32_t n, int for_splats)
{
	fetch_cubes(t, entry + e + 2 * BLOCKS, batch_of(e + 2 * BLOCKS, n));
	fetch_codes(t, entry + e + BLOCKS, batch_of(e + BLOCKS, n));
	make_cubes(cubes, t, entry + e, batch_of(e, n), for_splats);
}

/* Lists the words of a cube's leaves, and their cells. */
typedef void list_cube_fn(struct words *words, struct cells *cells, const struct warp_target *t,
                          const struct bin_entry *entry, const struct warp_cube *cube);

/* Prepares the first BLOCKS cubes of *left, or all of them, and takes them away. */
static inline uint32_t make_run(struct warp_cube *cubes, const struct warp_target *t, const struct bin_entry *entry,
                                uint64_t *left)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	uint32_t n = 0;

	for (; *left && n < BLOCKS; *left &= *left - 1)
		warp_cube_make(&cubes[n++], in, entry->slot + (uint32_t)__builtin_ctzll(*left));
	return n;
}

/* The lists of a warp under way. */
struct leaves_lists {
	struct words words;
	struct cells cells;
	uint64_t n_inside;
};

static inline void leaves_begin(struct leaves_lists *lists)
{
	lists->n_inside = lists->words.n = lists->cells.n = lists->cells.level = 0;
}

static inline uint64_t leaves_end(struct leaves_lists *lists, const struct warp_target *t)
{
	lists->n_inside += lists->words.n;
	lower_words(t->word, &lists->words);
	lower_cells(t, &lists->cells);
	return lists->n_inside;
}

/* Makes room for PSR_BLOCK_SAMPLES words, and as many cells of a level. */
static inline void make_room(struct leaves_lists *to, const struct warp_target *t, uint32_t level)
{
	if (to->words.n > LIST - PSR_BLOCK_SAMPLES) {
		to->n_inside += to->words.n;
		lower_words(t->word, &to->words);
	}
	if (level && (level != to->cells.level || to->cells.n > LIST - PSR_BLOCK_SAMPLES)) {
		lower_cells(t, &to->cells);
		to->cells.level = level;
	}
}

/* An entry's cubes follow each other in memory, which the processor foresees; where those of the next one begin, it
 * does not. */
static inline void fetch_run(const struct warp_target *t, const struct bin_entry *entry)
{
	const struct psr_cubes *cubes = t->instance[entry->instance].cubes->model;
	const uint32_t cube = entry->slot - t->instance[entry->instance].first_slot
	                      + (uint32_t)__builtin_ctzll(t->cubes[entry->hit]);
	const struct psr_cube_level *level = psr_cubes_level(cubes, cube);

	__builtin_prefetch(level->tree->code + psr_cubes_code(cubes, level, cube));
	__builtin_prefetch(&cubes->cube[cube + 4]);
}

/* Fetches what entries after this one need first. */
static inline void fetch_next(const struct warp_target *t, const struct bin_entry *entry, uint32_t e, uint32_t n)
{
	if (t->cubes != NULL) {
		if (e + 1 < n)
			fetch_run(t, &entry[e + 1]);
	} else if (e % BLOCKS == 0) {
		fetch_cubes(t, entry + e + 2 * BLOCKS, batch_of(e + 2 * BLOCKS, n));
		fetch_codes(t, entry + e + BLOCKS, batch_of(e + BLOCKS, n));
	}
}

/* The warp, given a function that lists a cube; both lists have room for one at each call. */
static inline __attribute__((always_inline)) uint64_t leaves_by(list_cube_fn *list_cube,
                                                                const struct warp_target *target,
                                                                const struct bin_entry *entry, uint32_t n)
{
	struct leaves_lists lists;
	struct warp_cube cubes[BLOCKS];

	leaves_begin(&lists);
	for (uint32_t e = 0; e < n; e++) {
		fetch_next(target, entry, e, n);
		for (uint64_t left = target->cubes != NULL ? target->cubes[entry[e].hit] : 1; left;) {
			const uint32_t n_cubes = make_run(cubes, target, &entry[e], &left);

			for (uint32_t i = 0; i < n_cubes; i++) {
				make_room(&lists, target, entry[e].level);
				list_cube(&lists.words, &lists.cells, target, &entry[e], &cubes[i]);
			}
		}
	}
	return leaves_end(&lists, target);
}

#endif
