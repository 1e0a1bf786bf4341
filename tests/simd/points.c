/* warp_points and the normals of points: groups of 1 to 64 of any words, before, around and behind the eye, in tiles of
 * pictures of any size, by the plain kernel and the others. */
#include <math.h>
#include <string.h>
#include "base/direction.h"
#include "tests/simd/lib/picture.h"

enum numbers { PLAIN, SPOILT };

#define MOST_GROUPS 12

struct scene {
	struct psr_points points;
	struct dpoint_set set;
	struct warp_points to;
	struct warp_instance in;
};

static double plain_or_spoilt(struct check *c, enum numbers numbers, double low, double high)
{
	return numbers == SPOILT && check_one_in(c, 6) ? (double)check_float(c) * (check_one_in(c, 8) ? 0x1p1000 : 1)
	                                               : check_real(c, low, high);
}

/* any: words that no file may have, too. */
static void random_words(struct check *c, struct dpoint_word *word, uint32_t n, enum numbers numbers)
{
	for (uint32_t i = 0; i < n; i++) {
		do
			word[i] = (struct dpoint_word){ check_u64(c), check_u64(c) };
		while (numbers == PLAIN && !dpoint_word_is_valid(&word[i]));
		/* Most are as curved as the model is. */
		if (check_below(c, 8) > 0)
			word[i].place = (word[i].place & ~((uint64_t)127 << DPOINT_LAMBDA_AT)) |
			                (uint64_t)(20 + check_below(c, 40)) << DPOINT_LAMBDA_AT;
	}
}

static struct scene *random_scene(struct check *c, uint32_t n_groups, uint32_t n_points, enum numbers numbers)
{
	struct scene *s = check_in(c, 1, sizeof *s);
	struct dpoint_group *group = check_in(c, n_groups, sizeof *group);
	uint8_t *flags = check_in(c, n_groups, 1);
	struct dpoint_word *word;
	uint8_t (*delta)[2] = NULL;
	uint32_t n = 0;

	memset(s, 0, sizeof *s);
	for (uint32_t i = 0; i < n_groups; i++) {
		struct dpoint_group *g = &group[i];

		*g = (struct dpoint_group){ .first = n, .n = (uint8_t)(n_points ? n_points : 1 + check_below(c, DPOINT_GROUP)) };
		for (int k = 0; k < 3; k++) {
			g->box.low[k] = (float)plain_or_spoilt(c, numbers, -1, 0.9);
			g->box.step[k] = (float)plain_or_spoilt(c, numbers, 0, 0.2 / DPOINT_PLACE_STEPS);
		}
		for (int k = 0; k < 2; k++)
			g->delta[k] = (uint8_t)(n_points ? 16 : check_below(c, DPOINT_DELTA_CLASSES));
		g->flags = (uint8_t)check_below(c, 2);
		flags[i] = g->flags ? PSR_BLOCK_TWO_SIDED : 0;
		n += g->n;
	}
	word = check_in(c, n, sizeof *word);
	random_words(c, word, n, numbers);
	if (check_one_in(c, 3)) {
		delta = check_in(c, n, sizeof *delta);
		for (uint32_t i = 0; i < n; i++)
			for (int k = 0; k < 2; k++)
				delta[i][k] = (uint8_t)(n_points ? 16 : check_below(c, DPOINT_DELTA_CLASSES));
		for (uint32_t i = 0; i < n_groups; i++)
			group[i].delta[0] = group[i].delta[1] = DPOINT_OWN_DELTA;
	}
	s->set = (struct dpoint_set){ .n_groups = n_groups, .n_points = n, .sine = (float)check_real(c, 0.01, 0.3),
		                          .group = group, .word = word, .delta = (const uint8_t (*)[2])delta };
	s->points.groups = (struct psr_blocks){ .n_blocks = n_groups, .n_levels = 1, .flags = flags };
	s->points.set = &s->set;
	return s;
}

/* The model is about as large as the tile, and before the eye or on both sides of it. */
static void place_scene(struct check *c, struct scene *s, const struct warp_target *t, enum numbers numbers)
{
	const double distance = check_real(c, check_one_in(c, 4) ? -0.5 : 1.5, 3), focal = t->x1 - t->x0 + t->y1 - t->y0 + 4.0;
	double q[4], size = 0, m[3][3];

	for (int k = 0; k < 4; k++) {
		q[k] = check_real(c, -1, 1);
		size += q[k] * q[k];
	}
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++) {
			const int a = 3 - i - k;
			const double across = i == k ? 0 : ((k - i + 3) % 3 == 1 ? -1 : 1) * q[a] * q[3];

			m[i][k] = (i == k ? 1 : 0) + 2 * ((i == k ? q[i] * q[i] - size + q[3] * q[3] : q[i] * q[k] + across) / size);
		}
	s->to = (struct warp_points){ .model = &s->points, .tables = dpoint_tables(), .direction = psr_direction_table(),
		                          .graze = check_one_in(c, 2) ? (float)check_real(c, 0, 0x1p-8) : 0 };
	for (int a = 0; a < 3; a++) {
		s->to.origin[a] = a < 2 ? 0 : distance;
		for (int k = 0; k < 3; k++)
			s->to.axis[a][k] = (a < 2 ? focal : 1) * plain_or_spoilt(c, numbers, m[a][k], m[a][k]);
		s->to.eye[a] = -plain_or_spoilt(c, numbers, m[2][a] * distance, m[2][a] * distance);
		s->to.right[a] = (float)(m[0][a] / focal);
		s->to.down[a] = (float)(m[1][a] / focal);
		s->to.forward[a] = (float)m[2][a];
	}
	s->to.center[0] = (float)check_real(c, t->x0, t->x1);
	s->to.center[1] = (float)check_real(c, t->y0, t->y1);
	s->in = (struct warp_instance){ .blocks = &s->points.groups, .points = &s->to,
		                            .first_slot = check_below(c, (1u << 26) - 1 - s->set.n_groups) };
	for (int a = 0; a < 3; a++)
		for (int k = 0; k < 3; k++)
			s->in.turn[a][k] = (float)m[a][k];
}

static void points(struct check *c, struct picture *p, uint32_t n_entries, uint32_t n_points, enum numbers numbers)
{
	struct warp_target *t = &p->target;
	struct scene *s = random_scene(c, 1 + check_below(c, MOST_GROUPS), n_points, numbers);
	struct bin_entry *entry = check_in(c, n_entries, sizeof *entry);

	t->perspective = check_one_in(c, 4) ? 0 : 1;
	t->near_z = 0x1p-14f;
	if (check_one_in(c, 3)) {
		t->above = (int32_t)check_below(c, TILE_HEIGHT);
		t->below = (int32_t)check_below(c, TILE_HEIGHT);
	}
	place_scene(c, s, t, numbers);
	t->instance = &s->in;
	for (uint32_t e = 0; e < n_entries; e++) {
		const uint32_t group = check_below(c, s->set.n_groups);

		entry[e] = (struct bin_entry){ .slot = s->in.first_slot + group };
		entry[e].is_mixed = !(s->points.groups.flags[group] & PSR_BLOCK_TWO_SIDED);
	}
	check_units(c, (uint64_t)n_entries * n_points);
	while (check_next(c))
		check_result(c, c->simd->warp_points(t, entry, n_entries));
}

static void random_points(struct check *c)
{
	struct picture p;

	picture_random(c, &p);
	points(c, &p, check_below(c, 12), 0, PLAIN);
}

static void spoilt_numbers(struct check *c)
{
	struct picture p;

	picture_random(c, &p);
	points(c, &p, 1 + check_below(c, 6), 0, SPOILT);
}

static void narrow_tiles(struct check *c)
{
	struct picture p;
	const uint32_t w = check_one_in(c, 2) ? 1 + check_below(c, 17) : TILE_WIDTH + 1 + check_below(c, 17);

	picture_make(c, &p, w, check_one_in(c, 2) ? 1 : TILE_HEIGHT + 1, check_u32(c));
	points(c, &p, 1 + check_below(c, 6), 0, PLAIN);
}

static void bench_small(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	points(c, &p, 100, DPOINT_GROUP, PLAIN);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "warp_points: random groups, tiles and sides", random_points, 400, NULL },
		{ "warp_points: infinite, huge, denormal and no numbers", spoilt_numbers, 400, NULL },
		{ "warp_points: tiles narrower than a vector", narrow_tiles, 200, NULL },
		{ "warp_points, rectangles of some pixels", bench_small, 0, "point" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
