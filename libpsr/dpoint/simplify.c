/* The order of the steps. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/random.h"
#include "choice.h"
#include "lean.h"
#include "seal.h"

#define CHOICE 48       /* candidates of the first turn in a rectangle; decision 0112 */
#define MOST_SPARSE 256
#define THIN 12         /* one of so many candidates comes second where one of the first alone is; decision 0163 */

/* Brings the candidates that `is_first` is set for to the front, from `first` on, in their order. Returns their end. */
static size_t bring_forward(struct dpoint_surface *surface, size_t first, size_t n, const uint8_t *is_first,
                            struct dpoint_candidate *rest)
{
	size_t end = first, n_rest = 0;

	for (size_t i = first; i < n; i++) {
		if (is_first[i])
			surface->candidate[end++] = surface->candidate[i];
		else
			rest[n_rest++] = surface->candidate[i];
	}
	memcpy(surface->candidate + end, rest, n_rest * sizeof *rest);
	return end;
}

/* What a cell has of a cover's candidates. */
enum { ENOUGH, ONE, NONE };

/* above: candidates that have a node above this one in their lists. */
static void mark_below(uint8_t *has, const struct tally *tally, size_t i, uint32_t above)
{
	const struct cell_tree *tree = tally->cover->tree;

	if (above + tally->least[i] > 1)
		return;
	if (cell_node_is_leaf(&tree->node[i])) {
		has[tree->order[tree->node[i].begin]] = above + tally->least[i] > 0 ? ONE : NONE;
		return;
	}
	mark_below(has, tally, 2 * i + 1, above + tally->own[i]);
	mark_below(has, tally, 2 * i + 2, above + tally->own[i]);
}

static int mark_cells(uint8_t *has, const struct dpoint_cover *cover)
{
	struct tally tally;
	int rc = tally_init(&tally, cover);

	memset(has, ENOUGH, cover->n_cells);
	if (rc == PSR_OK) {
		tally_add_all(&tally);
		mark_below(has, &tally, 0, 0);
	}
	tally_fini(&tally);
	return rc;
}

static int turn(struct dpoint_surface *surface, struct dpoint_cover *cover, size_t n,
                const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	const size_t first = surface->n_candidates;
	int rc;

	surface->n_candidates = n;
	rc = fit_candidates(surface, cover->tree, first, options, work);
	return rc == PSR_OK ? cover_candidates(cover, surface, options, work) : rc;
}

/* One of how many candidates like this one comes first: `sparse`, or more where its rectangle is many cells wide:
 * CHOICE are enough to choose from. */
static uint32_t sparsity(const struct dpoint_surface *surface, const struct dpoint_candidate *candidate,
                         const struct dpoint_cover_options *options, uint32_t sparse)
{
	struct rectangle r;
	float n;

	rectangle_of(&r, candidate, options);
	n = 4 * r.extent[0] * r.extent[1] / (CHOICE * cell_area(&surface->cell[candidate->cell]));
	return sparse > 1 && n > (float)sparse ? (uint32_t)fminf(n, MOST_SPARSE) : sparse;
}

static int two_turns(struct dpoint_surface *surface, struct dpoint_cover *cover, uint32_t sparse,
                     const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	const size_t n = surface->n_candidates;
	struct dpoint_candidate *rest = malloc((n + 1) * sizeof *rest);
	uint8_t *is_first = malloc(n + 1), *has = malloc(cover->n_cells + 1);
	uint64_t seed = 1;
	size_t end;
	int rc = rest != NULL && is_first != NULL && has != NULL ? PSR_OK : PSR_ERR_MEMORY;

	for (size_t i = 0; i < n && rc == PSR_OK; i++)
		is_first[i] = random_below(&seed, sparsity(surface, &surface->candidate[i], options, sparse)) == 0;
	surface->n_candidates = 0;
	if (rc == PSR_OK)
		rc = turn(surface, cover, bring_forward(surface, 0, n, is_first, rest), options, work);
	if (rc == PSR_OK && surface->n_candidates < n)
		rc = mark_cells(has, cover);
	if (rc == PSR_OK && surface->n_candidates < n) {
		for (size_t i = surface->n_candidates; i < n; i++) {
			const uint8_t has_some = has[surface->candidate[i].cell];

			is_first[i] = has_some == NONE || (has_some == ONE && random_below(&seed, THIN) == 0);
		}
		end = bring_forward(surface, surface->n_candidates, n, is_first, rest);
		rc = turn(surface, cover, end, options, work);
	}
	free(rest);
	free(is_first);
	free(has);
	return rc;
}

int dpoint_simplify(struct dpoint_choice *choice, struct dpoint_cover *cover, struct dpoint_surface *surface,
                    const struct dpoint_cover_options *options, uint32_t sparse, struct psr_pool *pool,
                    const struct psr_cancel *cancel)
{
	const struct dpoint_work work = { pool, cancel };
	const size_t n = surface->n_candidates;
	uint8_t *is_tiled = NULL; /* by cell; only where there are faces to tile */
	int rc;

	memset(choice, 0, sizeof *choice);
	surface->n_candidates = 0;
	rc = dpoint_cover_init(cover, surface, options, pool, cancel);
	surface->n_candidates = n;
	if (rc == PSR_OK && cover->tree != NULL)
		rc = two_turns(surface, cover, sparse, options, &work);
	if (rc == PSR_OK)
		rc = dpoint_mend(surface, cover, options, pool, cancel);
	if (rc == PSR_OK)
		rc = dpoint_choose(choice, cover);
	if (rc == PSR_OK && psr_is_cancelled(cancel))
		rc = PSR_ERR_CANCELLED;
	if (rc == PSR_OK && surface->n_faces > 0) {
		is_tiled = calloc(surface->n_cells, 1);
		rc = is_tiled == NULL ? PSR_ERR_MEMORY : tile_faces(is_tiled, surface, choice, cover, options, &work);
	}
	if (rc == PSR_OK)
		rc = seal(surface, choice, cover, is_tiled, options, &work);
	free(is_tiled);
	if (rc == PSR_OK)
		paint(surface, choice, cover, options);
	return rc;
}
