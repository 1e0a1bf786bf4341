/* Shared by the files of the greedy modeller (greedy.h). */
#ifndef MODELS_STUDIES_GREEDY_PARTS_H
#define MODELS_STUDIES_GREEDY_PARTS_H

#include "greedy.h"
#include "base/direction.h"

/* ---- greedy.c ---- */

/* Fills in all of the result but the times and the first pass. */
void greedy_count(const struct greedy *greedy, struct greedy_result *result);

/* ---- views.c ---- */

/* Frames and spacing of all views, and how many they are. */
void greedy_make_views(struct greedy *greedy);

/* ---- scan.c ---- */

/* Traces a view, which must be empty; or only one in `stride` rows and columns of its 8x8 blocks. MEMORY. */
int greedy_trace(struct greedy *greedy, int view, int stride);
void greedy_forget(struct greedy_view *view); /* its samples and blocks */

/* Distance of the lattice's rows, as a part of its spacing. */
double greedy_row_pitch(enum greedy_lattice lattice);
/* By how much of the spacing a row stands to the right. */
double greedy_shift(enum greedy_lattice lattice, int row);

/* ---- blocks.c ---- */

/* Orders a view's samples into blocks of this side; none is kept. MEMORY. */
int greedy_divide(struct greedy_view *view, int side);

/* ---- look.c: S of [G] 5.2, warped orthographically at the target resolution ---- */

/* A pixel grid laid over a view, turned about z and shifted, that holds the whole unit sphere. */
struct greedy_grid {
	float cosine, sine, shift[2]; /* cosine and sine times pixels a unit; shift includes the middle */
	uint32_t side;                /* pixels, of a square */
};

/* Test 0 <= test < n_rotations * n_shifts of the sixteen of [G] 5.2; n_shifts by n_shifts count as shifts of a test. */
void greedy_grid_init(struct greedy_grid *grid, int test, int n_shifts, double ds);

static inline uint32_t greedy_pixel(const struct greedy_grid *grid, const struct trials_seen *p)
{
	uint32_t u = (uint32_t)(grid->cosine * p->x + grid->sine * p->y + grid->shift[0]);
	uint32_t v = (uint32_t)(grid->cosine * p->y - grid->sine * p->x + grid->shift[1]);

	return v * grid->side + u;
}

/* Returns for each of the quantised normals whether it is turned to the viewer of this frame. */
struct greedy_facing {
	uint64_t bit[PSR_DIRECTIONS / 64];
};
void greedy_facing_init(struct greedy_facing *facing, const float axis[3][3]);

static inline int greedy_counts(const struct greedy_facing *facing, const struct greedy_sample *sample)
{
	uint32_t n = PSR_ATTR_NORMAL(sample->attr);

	return sample->two_sided || (facing->bit[n / 64] >> n % 64 & 1) != 0;
}

/* Which samples of a view may choose blocks. */
struct greedy_strictness {
	float least_cosine;  /* only samples seen at this cosine or more */
	float lenient_below; /* samples seen at less are forgiven half a pixel */
	int kept_only;       /* only samples of kept blocks */
};

/* Marks in is_missed the blocks of a view that have a sample that the kept samples of all other views, and of none of
 * this one, lack in one of the first n_tests tests. MEMORY. */
int greedy_find_missed(const struct greedy *greedy, int view, const struct greedy_select_options *options,
                       struct greedy_strictness strictness, int n_tests, uint8_t *is_missed);

/* ---- prune.c ---- */

/* Goes through the kept blocks or single samples, from the worst seen to the best, and drops each that no test of any
 * view needs. MEMORY. */
int greedy_prune(struct greedy *greedy, const struct greedy_select_options *options, int is_by_sample);

#endif
