/* The warp of leaves by lists, as warp_list.h has it of blocks. */
#ifndef PSR_SIMD_LEAVES_LIST_H
#define PSR_SIMD_LEAVES_LIST_H

#include "cube.h"
#include "warp_list.h"

/* Prepares cubes, and prefetches their normals and offsets. */
static inline void make_cubes(struct warp_cube *cubes, const struct warp_target *t, const struct bin_entry *entry,
                              uint32_t n)
{
	for (uint32_t i = 0; i < n; i++) {
		struct warp_cube *c = &cubes[i];

		warp_cube_make(c, &t->instance[entry[i].instance], entry[i].slot);
		__builtin_prefetch(c->normal);
		if (c->offset != NULL)
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
                              uint32_t e, uint32_t n)
{
	fetch_cubes(t, entry + e + 2 * BLOCKS, batch_of(e + 2 * BLOCKS, n));
	fetch_codes(t, entry + e + BLOCKS, batch_of(e + BLOCKS, n));
	make_cubes(cubes, t, entry + e, batch_of(e, n));
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

/* Cubes of an entry of a run follow each other in memory, but runs do not, and are too short for the processor to
 * foresee. Their lines are fetched in two steps, since cubes tell where codes are. */
struct run_ahead {
	const struct psr_cubes *cubes;
	uint32_t first, n; /* cubes, from the first to the last one that is drawn */
};

static inline struct run_ahead run_of(const struct warp_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const uint64_t mask = t->cubes[entry->hit];
	const uint32_t first = (uint32_t)__builtin_ctzll(mask), last = 63 - (uint32_t)__builtin_clzll(mask);

	return (struct run_ahead){ in->cubes->model, entry->slot - in->first_slot + first, last - first + 1 };
}

#define LINE 64      /* of the cache */
#define CUBE_CODES 3 /* of a cube and its children, of most clouds; more of a surface's are foreseen */

static inline void fetch_run_cubes(const struct warp_target *t, const struct bin_entry *entry)
{
	const struct run_ahead run = run_of(t, entry);

	for (uint32_t i = 0; i < run.n; i += LINE / sizeof *run.cubes->cube)
		__builtin_prefetch(&run.cubes->cube[run.first + i]);
}

static inline void fetch_run_codes(const struct warp_target *t, const struct bin_entry *entry)
{
	const struct run_ahead run = run_of(t, entry);
	const struct psr_cube_level *level = psr_cubes_level(run.cubes, run.first);
	const uint8_t *code = level->tree->code + psr_cubes_code(run.cubes, level, run.first);

	for (uint32_t i = 0; i < CUBE_CODES * run.n; i += LINE)
		__builtin_prefetch(code + i);
}

/* Fetches what entries after this one need first. */
static inline void fetch_next(const struct warp_target *t, const struct bin_entry *entry, uint32_t e, uint32_t n)
{
	if (t->cubes != NULL) {
		if (e + 2 < n)
			fetch_run_cubes(t, &entry[e + 2]);
		if (e + 1 < n)
			fetch_run_codes(t, &entry[e + 1]);
	} else if (e % BLOCKS == 0) {
		fetch_cubes(t, entry + e + 2 * BLOCKS, batch_of(e + 2 * BLOCKS, n));
		fetch_codes(t, entry + e + BLOCKS, batch_of(e + BLOCKS, n));
	}
}

#endif
