#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include "bound.h"
#include "surface.h"

#define CHUNK 256     /* candidates */
#define LEAST 1e-5
#define STEPS 4       /* of halving a factor of two */
/* Of the worst distance that is known: points that bound_holds() is 1 for at so much come out below it. Its 0 is wrong
 * by 3 % at most, and halving ends 1/16 above a 0: 1.03 * 1.0625 = 1.095 times as far as the point is at most. */
#define SAFE (1 / 1.15)

struct measuring {
	const struct dpoint_surface *surface;
	const struct dpoint_choice *choice;
	const struct dpoint_cover_options *options;
	struct dpoint_bounds *of_chunk;
	/* Of the chunks that are measured so far: what is certainly below it is not measured. Which these are depends on
	 * threads, the result does not: the worst chunk is never below another one. */
	_Atomic double worst;
	int n_chunks;
	int is_failed;
};

/* Raises the worst of its chunk, if the candidate is further off. */
static void look(struct dpoint_bounds *bounds, struct bound_view *view, const struct measuring *m,
                 const struct dpoint_candidate *c)
{
	const struct facets *facets = &m->surface->facets;
	const double before = bounds->worst, asked = (double)m->options->error;
	double low, high;
	float extent[2];
	int is_over;

	dpoint_candidate_extent(extent, c, m->options->sine);
	high = bound_least(view, facets, &c->point, extent, before);
	low = fmax(high / 2, before);
	for (int i = 0; i < STEPS && high > before; i++) {
		const double middle = 0.5 * (low + high);

		if (bound_holds(view, extent, middle, NULL))
			high = middle;
		else
			low = middle;
	}
	is_over = asked > 0 && high > asked && bound_least(view, facets, &c->point, extent, asked) > asked;
	bounds->n_over += is_over;
	bounds->worst = asked > 0 && !is_over ? fmax(before, fmin(high, asked)) : high;
}

static void raise_worst(struct measuring *m, double to)
{
	double worst = m->worst;

	while (worst < to && !atomic_compare_exchange_weak(&m->worst, &worst, to))
		;
}

/* What a point is off decides nothing where it is less than another one, and than what was asked for: all that are over
 * it are counted. */
static int is_less(struct bound_view *view, const struct measuring *m, const struct dpoint_candidate *c)
{
	const double asked = (double)m->options->error, worst = m->worst;
	const double certain = SAFE * (asked > 0 ? fmin(asked, worst) : worst);
	float extent[2];

	dpoint_candidate_extent(extent, c, m->options->sine);
	return bound_look(view, &m->surface->facets, &c->point, extent, certain) == PSR_OK &&
	       bound_likely_holds(view, extent, certain);
}

static int is_chunk_less(struct bound_view *view, const struct measuring *m, size_t begin, size_t end)
{
	if (m->options->error > 0)
		return 0;
	for (size_t i = begin; i < end; i++)
		if (m->choice->is_kept[i] && !is_less(view, m, &m->surface->candidate[i]))
			return 0;
	return 1;
}

/* From the last on, where points that mend are, which may be far off. */
static void measure_chunk(int i, void *userdata)
{
	struct measuring *m = userdata;
	const int chunk = m->n_chunks - 1 - i;
	struct dpoint_bounds *bounds = &m->of_chunk[chunk];
	struct bound_view view = { .seen = NULL };
	const size_t begin = (size_t)chunk * CHUNK, n = m->surface->n_candidates;
	const size_t end = begin + CHUNK < n ? begin + CHUNK : n;

	*bounds = (struct dpoint_bounds){ 0, LEAST };
	if (!is_chunk_less(&view, m, begin, end))
		for (size_t c = begin; c < end && !view.is_failed; c++)
			if (m->choice->is_kept[c])
				look(bounds, &view, m, &m->surface->candidate[c]);
	raise_worst(m, bounds->worst);
	if (view.is_failed)
		__atomic_store_n(&m->is_failed, 1, __ATOMIC_RELAXED);
	bound_view_fini(&view);
}

int dpoint_bounds_measure(struct dpoint_bounds *bounds, const struct dpoint_surface *surface,
                          const struct dpoint_choice *choice, const struct dpoint_cover_options *options,
                          struct psr_pool *pool)
{
	const int n_chunks = (int)((surface->n_candidates + CHUNK - 1) / CHUNK);
	struct measuring m = { .surface = surface, .choice = choice, .options = options, .worst = LEAST,
		                   .n_chunks = n_chunks };

	*bounds = (struct dpoint_bounds){ 0, 0 };
	if (surface->facets.n == 0)
		return PSR_OK;
	m.of_chunk = calloc((size_t)n_chunks + 1, sizeof *m.of_chunk);
	if (m.of_chunk == NULL)
		return PSR_ERR_MEMORY;
	psr_pool_for(pool, n_chunks, measure_chunk, &m);
	for (int i = 0; i < n_chunks; i++) {
		bounds->n_over += m.of_chunk[i].n_over;
		bounds->worst = fmax(bounds->worst, m.of_chunk[i].worst);
	}
	free(m.of_chunk);
	return m.is_failed ? PSR_ERR_MEMORY : PSR_OK;
}
