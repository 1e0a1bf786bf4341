#include <stdlib.h>
#include "cubes_make.h"

#define CODES 65536 /* of intensity */
#define OUTSIDE 50  /* one of so many leaves is left out at either end of the range */

/* Returns the code that more than n leaves reach, counted from `code` on in this direction. */
static uint16_t find_code(const uint64_t *count, int code, int step, uint64_t n)
{
	uint64_t sum = count[code];

	while (sum <= n)
		sum += count[code += step];
	return (uint16_t)code;
}

int cubes_survey_scan(struct psr_scan *scan, const struct octree *tree, struct psr_error *err)
{
	const struct octree_scan *from = &tree->scan;

	*scan = (struct psr_scan){ .has_intensity = from->intensity != NULL, .has_class = from->class != NULL,
		                       .has_return = from->returns != NULL };
	for (uint64_t i = 0; from->class != NULL && i < tree->n_leaves; i++)
		scan->classes[from->class[i] / 64] |= UINT64_C(1) << from->class[i] % 64;
	for (uint64_t i = 0; from->returns != NULL && i < tree->n_leaves; i++)
		scan->orders |= 1u << psr_return_order(from->returns[i]);
	if (from->intensity == NULL)
		return PSR_OK;
	uint64_t *const count = calloc(CODES, sizeof *count);
	if (count == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the range of an octree's intensities");
	for (uint64_t i = 0; i < tree->n_leaves; i++)
		count[from->intensity[i]]++;
	scan->low = find_code(count, 0, 1, tree->n_leaves / OUTSIDE);
	scan->high = find_code(count, CODES - 1, -1, tree->n_leaves / OUTSIDE);
	free(count);
	return PSR_OK;
}
