#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "reproject_inside.h"

#define FADE 8        /* pixels over which the colour of a gap's end becomes the mean of as many beyond it */
#define PROBES 64     /* places on the way between both ends of a gap where background is looked for */
#define RIM 2         /* pixels of the received picture: a surface so near to its rim goes on beyond it */

static int is_covered(const struct reproject_line *line, uint32_t i)
{
	return line->key[i * line->step] > REPROJECT_EMPTY;
}

static void place_of(int32_t place[2], const struct reproject_line *line, uint32_t i)
{
	const uint32_t at = line->at[i * line->step];

	place[0] = (int32_t)((at & 0xffff) >> line->bits);
	place[1] = (int32_t)(at >> 16 >> line->bits);
}

/* Whether the received picture shows background between the places of two pixels. */
static int sees_background(const struct reproject_line *line, uint32_t a, uint32_t b)
{
	int32_t from[2], to[2];
	int32_t steps, probes;

	place_of(from, line, a);
	place_of(to, line, b);
	steps = abs(to[0] - from[0]) > abs(to[1] - from[1]) ? abs(to[0] - from[0]) : abs(to[1] - from[1]);
	probes = steps < PROBES ? steps : PROBES;
	for (int32_t i = 1; i < probes; i++) {
		const int32_t x = from[0] + (to[0] - from[0]) * i / probes, y = from[1] + (to[1] - from[1]) * i / probes;

		if (!(line->source->d[(size_t)y * line->source->stride + (size_t)x] > 0))
			return 1;
	}
	return 0;
}

static int is_at_rim(const struct reproject_line *line, uint32_t i)
{
	int32_t place[2];

	place_of(place, line, i);
	return place[0] < RIM || place[0] >= (int32_t)line->source->width - RIM || place[1] < RIM
	       || place[1] >= (int32_t)line->source->height - RIM;
}

/* Whether two pixels may be one surface. */
static int is_one(const struct reproject_line *line, uint32_t a, uint32_t b)
{
	const float ka = line->key[a * line->step], kb = line->key[b * line->step];
	const float most = fabsf(ka) > fabsf(kb) ? fabsf(ka) : fabsf(kb);

	return fabsf(ka - kb) <= line->surface.scale * most + line->surface.offset;
}

/* The colour of a gap at one of its ends, and the mean of the surface beyond it. */
struct gap_end {
	uint32_t i;
	int32_t own[3], mean[3];
};

static struct gap_end end_at(const struct reproject_line *line, uint32_t i, int away)
{
	struct gap_end end = { .i = i };
	int32_t n = 0;

	for (uint32_t k = i; n < FADE && k < line->n && is_covered(line, k) && is_one(line, i, k); k += (uint32_t)away, n++)
		for (int c = 0; c < 3; c++)
			end.mean[c] += line->rgb[k * line->rgb_step + (size_t)c];
	for (int c = 0; c < 3; c++) {
		end.own[c] = line->rgb[i * line->rgb_step + (size_t)c];
		end.mean[c] /= n;
	}
	return end;
}

/* Pixels first .. last - 1 go on from an end. */
static void fill_from(const struct reproject_line *line, uint32_t first, uint32_t last, const struct gap_end *end)
{
	for (uint32_t i = first; i < last; i++) {
		const uint32_t away = i > end->i ? i - end->i : end->i - i;
		const int32_t part = away < FADE ? (int32_t)away : FADE;

		for (int c = 0; c < 3; c++)
			line->rgb[i * line->rgb_step + (size_t)c] =
				(uint8_t)(end->own[c] + (end->mean[c] - end->own[c]) * part / FADE);
	}
}

/* Between both ends, which are one surface. */
static void fill_between(const struct reproject_line *line, uint32_t first, uint32_t last)
{
	const uint8_t *before = line->rgb + (first - 1) * line->rgb_step, *after = line->rgb + last * line->rgb_step;
	const int32_t all = (int32_t)(last - first) + 1;

	for (uint32_t i = first; i < last; i++) {
		const int32_t part = (int32_t)(i - first) + 1;

		for (int c = 0; c < 3; c++)
			line->rgb[i * line->rgb_step + (size_t)c] = (uint8_t)(before[c] + (after[c] - before[c]) * part / all);
	}
}

/* Returns whether it was a gap. */
static int fill_gap(const struct reproject_line *line, uint32_t first, uint32_t last)
{
	const int has_before = first > 0, has_after = last < line->n;
	struct gap_end end;

	if (has_before && has_after) {
		if (sees_background(line, first - 1, last))
			return 0;
		if (is_one(line, first - 1, last)) {
			fill_between(line, first, last);
			return 1;
		}
		/* The smaller key is the farther one. */
		end = line->key[(first - 1) * line->step] < line->key[last * line->step] ? end_at(line, first - 1, -1)
		                                                                        : end_at(line, last, 1);
	} else if (has_before && is_at_rim(line, first - 1)) {
		end = end_at(line, first - 1, -1);
	} else if (has_after && is_at_rim(line, last)) {
		end = end_at(line, last, 1);
	} else {
		return 0;
	}
	fill_from(line, first, last, &end);
	return 1;
}

void reproject_fill(const struct reproject_line *line, struct reproject_counts *counts)
{
	const float *key = line->key;
	const size_t step = line->step;
	const uint32_t n = line->n;
	uint32_t i = 0;

	while (i < n) {
		const uint32_t first = i;

		while (i < n && key[i * step] > REPROJECT_EMPTY)
			i++;
		counts->covered += i - first;
		const uint32_t gap = i;

		while (i < n && !(key[i * step] > REPROJECT_EMPTY))
			i++;
		if (i > gap && fill_gap(line, gap, i))
			counts->filled += i - gap;
	}
}
