#include <math.h>
#include "ladder.h"

double ladder_psnr(double rmse)
{
	return rmse > 0 ? 20 * log10(255 / rmse) : INFINITY;
}

struct ladder_point ladder_join(const struct ladder_row *row, uint32_t stride, uint32_t n)
{
	struct ladder_point sum = { 0, 0 };

	for (uint32_t i = 0; i < n; i++) {
		const struct ladder_row *r = &row[(size_t)i * stride];

		sum.ms += r->ms;
		sum.rmse += r->rmse * r->rmse;
	}
	return (struct ladder_point){ sum.ms / n, sqrt(sum.rmse / n) };
}

static int beats(const struct ladder_point *a, const struct ladder_point *b)
{
	return a->ms <= b->ms && a->rmse <= b->rmse && (a->ms < b->ms || a->rmse < b->rmse);
}

static int equals(const struct ladder_point *a, const struct ladder_point *b)
{
	return a->ms == b->ms && a->rmse == b->rmse;
}

void ladder_unbeaten(uint8_t *is_unbeaten, const struct ladder_point *point, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++) {
		is_unbeaten[i] = 1;
		for (uint32_t k = 0; k < n && is_unbeaten[i]; k++)
			is_unbeaten[i] = !(beats(&point[k], &point[i]) || (k < i && equals(&point[k], &point[i])));
	}
}

uint32_t ladder_best_within(const struct ladder_point *point, uint32_t n, double ms)
{
	uint32_t best = n;

	for (uint32_t i = 0; i < n; i++)
		if (point[i].ms <= ms && (best == n || point[i].rmse < point[best].rmse || beats(&point[i], &point[best])))
			best = i;
	return best;
}

uint32_t ladder_cheapest_within(const struct ladder_point *point, uint32_t n, double rmse)
{
	uint32_t best = n;

	for (uint32_t i = 0; i < n; i++)
		if (point[i].rmse <= rmse && (best == n || point[i].ms < point[best].ms || beats(&point[i], &point[best])))
			best = i;
	return best;
}
