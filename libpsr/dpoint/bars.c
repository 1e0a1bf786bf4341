#include "bars.h"

#include <math.h>
#include <string.h>
#include "base/array.h"

static inline float lesser(float a, float b)
{
	return b < a ? b : a;
}

static inline float greater(float a, float b)
{
	return b > a ? b : a;
}

struct bar bar_of(const float corner[4][3], const float above[4], float height)
{
	const float nearest = lesser(lesser(above[0], above[1]), lesser(above[2], above[3]));
	struct bar bar;

	for (int k = 0; k < 2; k++) {
		float low = INFINITY, high = -INFINITY;

		for (int c = 0; c < 4; c++) {
			if (above[c] > nearest + height)
				continue;
			low = lesser(low, corner[c][k]);
			high = greater(high, corner[c][k]);
		}
		bar.at[k] = low > 0 ? low : high < 0 ? -high : 0;
		bar.side[k] = low + high < 0 ? -1 : 1;
	}
	return bar;
}

/* Returns the first bar that is not nearer than u. */
static size_t find_bar(const struct bars *bars, float u)
{
	size_t low = 0, high = bars->n;

	while (low < high) {
		const size_t middle = (low + high) / 2;

		if (bars->bar[middle].at[0] < u)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

int bars_is_behind(const struct bars *bars, float u, float v)
{
	const size_t at = bars->n > 0 ? find_bar(bars, u) : 0;

	return (at < bars->n && bars->bar[at].at[0] == u && bars->bar[at].at[1] <= v) ||
	       (at > 0 && bars->bar[at - 1].at[1] <= v);
}

int bars_are_within(const struct bars *bars, const float extent[2])
{
	const size_t at = find_bar(bars, extent[0]);

	return at > 0 && bars->bar[at - 1].at[1] < extent[1];
}

void bars_put(struct bars *bars, const struct bar *bar)
{
	size_t at, end;

	if (bars_is_behind(bars, bar->at[0], bar->at[1]))
		return;
	if (!ARRAY_ROOM(bars->bar, bars->n, bars->room)) {
		bars->is_failed = 1;
		return;
	}
	at = end = find_bar(bars, bar->at[0]);
	while (end < bars->n && bars->bar[end].at[1] >= bar->at[1])
		end++;
	memmove(&bars->bar[at + 1], &bars->bar[end], (bars->n - end) * sizeof *bar);
	bars->bar[at] = *bar;
	bars->n += 1 + at - end;
}

/* What a rectangle is worth: its area without a margin, so that slivers, which cover no cell, are worth nothing. */
static float worth(float u, float v, const float margin[2])
{
	return fmaxf(u - margin[0], 0) * fmaxf(v - margin[1], 0);
}

/* Nothing ends a rectangle that is as narrow as the overhang, so that it is worth nothing either. */
static float margin_of(float extent, float overhang)
{
	return fmaxf(fminf(2 * overhang, extent / 4), fminf(overhang, extent / 2));
}

void bars_end(float extent[2], const struct bars *bars, const float free_one[2], float overhang)
{
	const float margin[2] = { margin_of(extent[0], overhang), margin_of(extent[1], overhang) };
	float v = extent[1], best[2] = { free_one[0], free_one[1] };

	for (size_t i = 0; i <= bars->n; i++) {
		const float u = i < bars->n ? bars->bar[i].at[0] : extent[0];

		if (u >= free_one[0] && v >= free_one[1] && worth(u, v, margin) > worth(best[0], best[1], margin)) {
			best[0] = u;
			best[1] = v;
		}
		if (i < bars->n)
			v = fminf(v, bars->bar[i].at[1]);
	}
	extent[0] = best[0];
	extent[1] = best[1];
}

float bars_side(const struct bars *bars, const float extent[2], int k)
{
	for (size_t i = 0; i < bars->n; i++)
		if (bars->bar[i].at[k] == extent[k] && bars->bar[i].at[1 - k] < extent[1 - k] * 1.01f)
			return bars->bar[i].side[k];
	return 0;
}
