/* Simplification in [K]'s own order (4.2): redundancy first. */
#include <math.h>
#include <stdlib.h>
#include "base/vec.h"
#include "study_dpoint.h"

/* 1 for points of equal curvatures and directions, towards 0 for others. */
static float likeness(const struct dpoint *a, const struct dpoint *b)
{
	const float la = fabsf(a->lambda_u) + 1e-6f, lb = fabsf(b->lambda_u) + 1e-6f;
	const float size = la < lb ? la / lb : lb / la, direction = fabsf(v3f_dot(a->u, b->u));
	/* Where the curvatures are nearly one, any direction is as good. */
	const float round = fminf(fabsf(a->rho), fabsf(b->rho));

	return size * (1 - 0.5f * fabsf(a->rho - b->rho)) * (direction + (1 - direction) * round);
}

/* Neighbours: the nearest candidates of the cells where the nodes of a candidate's list begin. */
struct nearest {
	uint32_t *candidate;
	float *distance;
};

static uint32_t first_cell(const struct dpoint_cover *cover, uint32_t i, uint32_t k)
{
	return cover->tree->order[cover->tree->node[cover->list[i][k]].begin];
}

static float redundancy(const struct dpoint_surface *surface, const struct dpoint_cover *cover,
                        const struct nearest *nearest, const uint8_t *is_kept, uint32_t i)
{
	float sum = 0;

	for (uint32_t k = 0; k < cover->n[i]; k++) {
		const uint32_t other = nearest->candidate[first_cell(cover, i, k)];

		if (other != i && is_kept[other])
			sum += likeness(&surface->candidate[i].point, &surface->candidate[other].point);
	}
	return cover->n[i] > 0 ? sum / (float)cover->n[i] : 1;
}

static int find_nearest(struct nearest *nearest, const struct dpoint_surface *surface,
                        const struct dpoint_cover *cover)
{
	nearest->candidate = calloc(cover->n_cells + 1, sizeof *nearest->candidate);
	nearest->distance = malloc((cover->n_cells + 1) * sizeof *nearest->distance);
	if (nearest->candidate == NULL || nearest->distance == NULL)
		return PSR_ERR_MEMORY;
	for (size_t c = 0; c < cover->n_cells; c++)
		nearest->distance[c] = INFINITY;
	for (uint32_t i = 0; i < cover->n_candidates; i++)
		for (uint32_t k = 0; k < cover->n[i]; k++) {
			const uint32_t cell = first_cell(cover, i, k);
			float away[3];

			v3f_sub(away, surface->cell[cell].corner[0], surface->candidate[i].point.at);
			if (v3f_dot(away, away) < nearest->distance[cell]) {
				nearest->distance[cell] = v3f_dot(away, away);
				nearest->candidate[cell] = i;
			}
		}
	return PSR_OK;
}

static void prune(struct dpoint_choice *choice, const struct dpoint_surface *surface, struct heap *heap,
                  struct tally *tally, const struct nearest *nearest)
{
	const struct dpoint_cover *cover = tally->cover;

	for (uint32_t i = 0; i < cover->n_candidates; i++) {
		choice->is_kept[i] = 1;
		tally_add(tally, i, 1);
	}
	for (uint32_t i = 0; i < cover->n_candidates; i++)
		heap->entry[heap->n++] = (struct heap_entry){ redundancy(surface, cover, nearest, choice->is_kept, i), i };
	heap_make(heap);
	/* Redundancies only fall, as neighbours go. */
	while (heap->n > 0) {
		const uint32_t i = heap->entry[0].candidate;
		const float key = redundancy(surface, cover, nearest, choice->is_kept, i);

		if (key < heap->entry[0].key) {
			heap_lower(heap, key);
			continue;
		}
		heap_pop(heap);
		if (tally_has(tally, i, 2)) {
			choice->is_kept[i] = 0;
			tally_add(tally, i, -1);
		}
	}
}

int study_dpoint_prune(struct dpoint_choice *choice, const struct dpoint_surface *surface,
                       const struct dpoint_cover *cover)
{
	struct nearest nearest = { NULL, NULL };
	struct heap heap;
	struct tally tally;
	int rc = choice_init(choice, &heap, &tally, cover);

	if (rc == PSR_OK)
		rc = find_nearest(&nearest, surface, cover);
	if (rc == PSR_OK) {
		prune(choice, surface, &heap, &tally, &nearest);
		choice_finish(choice, &tally);
	}
	free(nearest.candidate);
	free(nearest.distance);
	choice_fini(&heap, &tally);
	return rc;
}
