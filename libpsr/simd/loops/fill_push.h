/* Push ([G] 4.7, appendix): finer cells from coarser ones. */
#include "fill_rows.h"

/* Copies n cells, and pads them with whole ones. */
static inline struct fill_row copy_row(struct block_row *to, struct fill_row from, uint32_t n)
{
	copy_weights(to, &from, 0, n);
	copy_values(to->r, from.r, n, 0);
	copy_values(to->g, from.g, n, 0);
	copy_values(to->b, from.b, n, 0);
	return (struct fill_row){ to->r, to->g, to->b, to->weight, to->z, NULL };
}

static inline void copy_back(struct fill_row to, const struct block_row *from, uint32_t n)
{
	memcpy(to.z, from->z, n * sizeof *to.z);
	memcpy(to.weight, from->weight, n * sizeof *to.weight);
	memcpy(to.r, from->r, n * sizeof *to.r);
	memcpy(to.g, from->g, n * sizeof *to.g);
	memcpy(to.b, from->b, n * sizeof *to.b);
}

/* Which parents give to the finer cells on one side: the cells' own parent, counted twice, its neighbour to that side,
 * and its neighbour above or below. Masks; the inverse of the sum of shares; the depths that result. */
struct push_shares {
	uint32_t own[FILL_BLOCK], side[FILL_BLOCK], beside[FILL_BLOCK];
	float inverse[FILL_BLOCK], z[FILL_BLOCK];
};

static inline void share_parents(struct push_shares *to, const float *own, const float *side, const float *beside,
                                 float scale, float offset)
{
	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		const float a = own[x], b = side[x], c = beside[x];
		float nearest = a < INFINITY ? a : INFINITY;

		nearest = b < nearest ? b : nearest;
		nearest = c < nearest ? c : nearest;
		const float limit = nearest * scale + offset;
		const int32_t ua = a <= limit, ub = b <= limit, uc = c <= limit, u = 2 * ua + ub + uc;
		to->own[x] = 0u - (uint32_t)ua;
		to->side[x] = 0u - (uint32_t)ub;
		to->beside[x] = 0u - (uint32_t)uc;
		to->inverse[x] = psr_choose(u == 1, 1.0f, psr_choose(u == 2, 0.5f, psr_choose(u == 3, 1.0f / 3, 0.25f)));
		to->z[x] = ((psr_where(ua, 2 * a) + psr_where(ub, b)) + psr_where(uc, c)) / (float)u;
	}
}

/* Rounds down: sums are below 2^18 and quotients below 2^16, so that quotients err by less than 1/100, and their
 * fractions are quarters or thirds. Adding an eighth never reaches the next whole number. */
static inline uint32_t interpolate(const struct push_shares *s, uint32_t x, uint32_t own, uint32_t side,
                                   uint32_t beside)
{
	const int32_t sum = (int32_t)(2 * (own & s->own[x]) + (side & s->side[x]) + (beside & s->beside[x]));

	return (uint32_t)(int32_t)((float)sum * s->inverse[x] + 0.125f);
}

/* A block whose cells are filled: masks of the cells whose turn it is, and the shares of parents on each side. */
struct push_turn {
	const uint16_t *weight; /* before */
	uint16_t turn[2 * FILL_BLOCK];
	struct push_shares left, right;
};

/* One channel: a share of `weight` in 256 of `was`, and the rest from the parents. */
static inline __attribute__((always_inline)) void push_channel(uint16_t *to, const uint16_t *was, const uint16_t *own,
                                                               const uint16_t *beside, const struct push_turn *p,
                                                               int is_picture)
{
	uint32_t pair[FILL_BLOCK];
	uint16_t both[2 * FILL_BLOCK], value[2 * FILL_BLOCK];

	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		const uint32_t l = interpolate(&p->left, x, own[x], *(own + x - 1), beside[x]);
		const uint32_t r = interpolate(&p->right, x, own[x], own[x + 1], beside[x]);

		pair[x] = l | r << 16;
	}
	memcpy(both, pair, sizeof both);
	for (uint32_t x = 0; x < 2 * FILL_BLOCK; x++) {
		const uint16_t w = p->weight[x], rest = (uint16_t)(GAPS_WHOLE - w);

		value[x] = (uint16_t)((is_picture ? part_of(was[x], w) : was[x]) + (part_of(both[x], rest) & p->turn[x]));
	}
	memcpy(to, value, sizeof value);
}

/* Marks the cells that are not whole and whose parents are. Returns whether there are any. */
static inline int find_turn(uint16_t *turn, const uint16_t *weight, const uint16_t *own, const uint16_t *beside)
{
	uint32_t ready[FILL_BLOCK];
	uint16_t any = 0;

	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		const uint32_t both = (own[x] == GAPS_WHOLE) & (beside[x] == GAPS_WHOLE);
		const uint32_t left = both & (*(own + x - 1) == GAPS_WHOLE), right = both & (own[x + 1] == GAPS_WHOLE);

		ready[x] = left * 0xffff | right * 0xffff0000;
	}
	memcpy(turn, ready, sizeof ready);
	for (uint32_t x = 0; x < 2 * FILL_BLOCK; x++) {
		turn[x] &= (uint16_t)-(weight[x] < GAPS_WHOLE);
		any |= turn[x];
	}
	return any != 0;
}

static inline int has_partial(const uint16_t *weight, uint32_t n)
{
	uint16_t rest = 0;

	for (uint32_t x = 0; x < n; x++)
		rest |= weight[x] ^ GAPS_WHOLE;
	return rest != 0;
}

/* The rows of a block. */
struct push_rows {
	struct fill_row to, was, own, beside;
	float scale, offset;
};

/* Returns 0, and writes nothing, if it is no cell's turn. */
static inline __attribute__((always_inline)) int push_block(struct push_turn *p, const struct push_rows *rows,
                                                            int is_picture)
{
	const struct fill_row to = rows->to, was = rows->was, own = rows->own, beside = rows->beside;
	float both[2 * FILL_BLOCK];
	uint16_t weight[2 * FILL_BLOCK];

	if (!find_turn(p->turn, was.weight, own.weight, beside.weight))
		return 0;
	p->weight = was.weight;
	share_parents(&p->left, own.z, own.z - 1, beside.z, rows->scale, rows->offset);
	share_parents(&p->right, own.z, own.z + 1, beside.z, rows->scale, rows->offset);
	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		both[2 * x] = p->left.z[x];
		both[2 * x + 1] = p->right.z[x];
	}
	push_channel(to.r, was.r, own.r, beside.r, p, is_picture);
	push_channel(to.g, was.g, own.g, beside.g, p, is_picture);
	push_channel(to.b, was.b, own.b, beside.b, p, is_picture);
	if (!is_picture) {
		for (uint32_t x = 0; x < 2 * FILL_BLOCK; x++)
			both[x] = psr_choose((was.weight[x] < GAPS_WHOLE / 2) & (p->turn[x] != 0), both[x], was.z[x]);
		for (uint32_t x = 0; x < 2 * FILL_BLOCK; x++)
			weight[x] = (uint16_t)((was.weight[x] & ~p->turn[x]) | (GAPS_WHOLE & p->turn[x]));
		memcpy(to.weight, weight, sizeof weight);
	}
	memcpy(to.z, both, sizeof both);
	return 1;
}

/* Block x of a row; writes to `was` itself if `to` is NULL. */
static inline struct push_rows rows_at(const struct fill_row *to, const struct fill_row *was,
                                       const struct fill_parents *parents, uint32_t x)
{
	const struct fill_row own = row_from(*was, 2 * x);

	return (struct push_rows){ to ? *to : own, own, row_from(parents->own, x), row_from(parents->beside, x),
		                       parents->scale, parents->offset };
}

/* Replaces the rows of the last n < FILL_BLOCK parents by padded copies. */
static inline void copy_rows(struct push_rows *rows, struct block_row copy[3], uint32_t n)
{
	rows->was = copy_row(&copy[0], rows->was, 2 * n);
	rows->own = row_from(copy_row(&copy[1], row_from(rows->own, -1), n + 2), 1);
	rows->beside = copy_row(&copy[2], rows->beside, n);
}

static inline void fill_push(const struct fill_row *to, const struct fill_parents *parents)
{
	const uint32_t n = parents->n;
	struct push_turn turn;
	uint32_t x = 0;

	for (; n - x >= FILL_BLOCK; x += FILL_BLOCK) {
		const struct push_rows rows = rows_at(NULL, to, parents, x);

		if (has_partial(rows.was.weight, 2 * FILL_BLOCK))
			push_block(&turn, &rows, 0);
	}
	if (x < n && has_partial(to->weight + 2 * x, 2 * (n - x))) {
		struct push_rows rows = rows_at(NULL, to, parents, x);
		struct block_row copy[3];

		copy_rows(&rows, copy, n - x);
		rows.to = rows.was;
		if (push_block(&turn, &rows, 0))
			copy_back(row_from(*to, 2 * x), &copy[0], 2 * (n - x));
	}
}

/* The list under way, and the blocks that have pixels left. */
struct listing {
	struct fill_places *places;
	uint32_t n;
	uint32_t *left, bit;
};

/* Lists the pixels of a block whose turn it is, n of them from pixel `first` of the row on, and makes them whole. */
static inline void list_block(struct listing *list, const struct push_turn *p, uint16_t *weight,
                              const struct block_row *row, uint32_t first, uint32_t n)
{
	struct fill_places *places = list->places;
	const uint32_t n_places = list->n;
	uint16_t *at = places->at + n_places;
	uint32_t n_turn = 0, n_partial = 0;

	for (uint32_t x = 0; x < n; x++) {
		at[n_turn] = (uint16_t)x;
		n_turn += p->turn[x] & 1;
		n_partial += weight[x] < GAPS_WHOLE;
	}
	*list->left &= ~(n_turn == n_partial ? list->bit : 0);
	for (uint32_t i = 0; i < n_turn; i++) {
		const uint32_t x = at[i], to = n_places + i;

		places->at[to] = (uint16_t)(first + x);
		places->weight[to] = weight[x];
		places->r[to] = row->r[x];
		places->g[to] = row->g[x];
		places->b[to] = row->b[x];
		places->z[to] = row->z[x];
		places->n_filled += (weight[x] == 0) & (row->z[x] < INFINITY);
		weight[x] = GAPS_WHOLE;
	}
	list->n = n_places + n_turn;
}

static inline uint32_t fill_push_picture(struct fill_places *places, uint32_t *left, uint32_t bit,
                                         const struct fill_row *was, const struct fill_parents *parents)
{
	const struct fill_row pixels = *was;
	struct block_row row;
	const struct fill_row to = { row.r, row.g, row.b, NULL, row.z, NULL };
	struct push_turn turn;
	struct listing list = { places, 0, left, bit };

	places->n_filled = 0;
	for (uint32_t x = 0; x < parents->n; x += FILL_BLOCK, list.left++) {
		const uint32_t n = parents->n - x < FILL_BLOCK ? parents->n - x : FILL_BLOCK;
		uint16_t *weight = pixels.weight + 2 * x;

		if (!(*list.left & bit))
			continue;
		if (!has_partial(weight, 2 * n)) {
			*list.left &= ~bit;
			continue;
		}
		struct push_rows rows = rows_at(&to, &pixels, parents, x);
		int is_turn;
		if (n == FILL_BLOCK) {
			is_turn = push_block(&turn, &rows, 1);
		} else {
			struct block_row copy[3];

			copy_rows(&rows, copy, n);
			is_turn = push_block(&turn, &rows, 1);
		}
		if (is_turn)
			list_block(&list, &turn, weight, &row, 2 * x, 2 * n);
	}
	return list.n;
}
