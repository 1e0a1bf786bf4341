/* The look of a kept point: the mean of what it covers, not that of the cell in its middle alone. */
#include <string.h>
#include "choice.h"
#include "rectangle.h"

struct mean {
	double sum[LOOK_CHANNELS], area;
	struct look_range range;
};

static void add(struct mean *mean, const struct dpoint_cell *cell, const uint8_t own[LOOK_CHANNELS], int looks)
{
	const double area = (double)cell_area(cell);
	struct look_range look;

	look_range_of(&look, cell->attr);
	if (look_range_distance(&look, own) > looks) /* what mends covers its cell whatever that looks like */
		return;
	look_range_join(&mean->range, &look);
	for (int k = 0; k < LOOK_CHANNELS; k++)
		mean->sum[k] += area * look.low[k];
	mean->area += area;
}

/* Each channel within `looks` of all cells that count. */
static uint64_t look_of_mean(const struct mean *mean, int looks)
{
	uint64_t attr = 0;

	for (int k = 0; k < LOOK_CHANNELS; k++) {
		const int least = mean->range.high[k] - looks, most = mean->range.low[k] + looks, step = look_channel[k].step;
		const int rounded = (int)(mean->sum[k] / mean->area + 0.5 * step) / step * step;

		attr |= (uint64_t)((rounded < least ? least : rounded > most ? most : rounded) / step) << look_channel[k].at;
	}
	return attr;
}

/* Whether the candidate covers a cell of another look than its own. */
static int is_mixed(const struct dpoint_candidate *c, const struct dpoint_surface *surface,
                    const struct dpoint_cover *cover, uint32_t i)
{
	for (uint32_t k = 0; k < cover->n[i]; k++) {
		const struct cell_node *node = &cover->tree->node[cover->list[i][k]];

		for (uint32_t e = node->begin; e < node->end; e++)
			if (((surface->cell[cover->tree->order[e]].attr ^ c->point.attr) & ~(uint64_t)LOOK_NORMAL) != 0)
				return 1;
	}
	return 0;
}

static void paint_one(struct dpoint_candidate *c, const struct dpoint_surface *surface, const struct dpoint_cover *cover,
                      uint32_t i, int looks)
{
	struct mean mean = { .area = 0 };
	uint8_t own[LOOK_CHANNELS];

	look_of(own, c->point.attr);
	memcpy(mean.range.low, own, sizeof own);
	memcpy(mean.range.high, own, sizeof own);
	for (uint32_t k = 0; k < cover->n[i]; k++) {
		const struct cell_node *node = &cover->tree->node[cover->list[i][k]];

		for (uint32_t e = node->begin; e < node->end; e++)
			add(&mean, &surface->cell[cover->tree->order[e]], own, looks);
	}
	if (mean.area > 0 && look_range_width(&mean.range) > 0)
		c->point.attr = look_of_mean(&mean, looks) | (c->point.attr & LOOK_NORMAL);
}

void paint(struct dpoint_surface *surface, const struct dpoint_choice *choice, const struct dpoint_cover *cover,
           const struct dpoint_cover_options *options)
{
	for (uint32_t i = 0; i < cover->n_candidates; i++)
		if (choice->is_kept[i] && is_mixed(&surface->candidate[i], surface, cover, i))
			paint_one(&surface->candidate[i], surface, cover, i, options->looks);
}
