#include <math.h>
#include <stdlib.h>
#include "price.h"

#define MOST_DB 60 /* of a row of the table; less than half a code */

static const struct ladder_row *row_of(const struct price *price, uint32_t view, uint32_t setting)
{
	return &price->row[(size_t)view * price->set.n + setting];
}

/* The rows of a setting, of views of a kind. */
static struct ladder_point join_kind(const struct price *price, uint32_t setting, enum ladder_kind kind)
{
	struct ladder_row row[PRICE_MOST_VIEWS];
	uint32_t n = 0;

	for (uint32_t v = 0; v < price->options->n_views; v++)
		if (price->view[v].kind == kind)
			row[n++] = *row_of(price, v, setting);
	return n > 0 ? ladder_join(row, 1, n) : (struct ladder_point){ NAN, NAN };
}

static void judge_setting(struct price *price, uint32_t setting)
{
	const uint32_t n = price->options->n_views;
	double *ratio = price->ratio[setting];

	price->point[setting] = ladder_join(&price->row[setting], price->set.n, n);
	for (int k = 0; k < LADDER_N_KINDS; k++)
		price->of_kind[k][setting] = join_kind(price, setting, (enum ladder_kind)k);
	price->is_same[setting] = 1;
	ratio[0] = ratio[1] = ratio[2] = price->bytes[setting] = 0;
	for (uint32_t v = 0; v < n; v++) {
		const struct ladder_row *row = row_of(price, v, setting);

		price->is_same[setting] &= row->is_same != 0;
		price->bytes[setting] += (double)row->n_bytes / n;
		ratio[0] += row->ratio / n;
		ratio[1] += row->ratio_low / n;
		ratio[2] += row->ratio_high / n;
	}
}

/* The points of all choices, as an array of their own. */
static void take_choices(struct ladder_point point[PRICE_MOST_SETTINGS], const struct price *price)
{
	for (uint32_t i = 0; i < price->n_choices; i++)
		point[i] = price->point[price->choice[i]];
}

static void find_unbeaten(struct price *price)
{
	struct ladder_point point[PRICE_MOST_SETTINGS];
	uint8_t is_unbeaten[PRICE_MOST_SETTINGS];

	take_choices(point, price);
	ladder_unbeaten(is_unbeaten, point, price->n_choices);
	price->n_unbeaten = 0;
	for (uint32_t i = 0; i < price->n_choices; i++) {
		uint32_t at = price->n_unbeaten;

		if (!is_unbeaten[i])
			continue;
		for (; at > 0 && price->point[price->unbeaten[at - 1]].ms > point[i].ms; at--)
			price->unbeaten[at] = price->unbeaten[at - 1];
		price->unbeaten[at] = price->choice[i];
		price->is_unbeaten[price->choice[i]] = 1;
		price->n_unbeaten++;
	}
}

void price_judge(struct price *price)
{
	price->n_choices = 0;
	for (uint32_t i = 0; i < price->set.n; i++) {
		judge_setting(price, i);
		price->is_unbeaten[i] = 0;
		if (price->set.setting[i].is_choice && (i == 0 || !price->is_same[i] || price->ratio[i][2] < 1))
			price->choice[price->n_choices++] = i;
	}
	find_unbeaten(price);
}

uint32_t price_best_within(const struct price *price, double ms)
{
	struct ladder_point point[PRICE_MOST_SETTINGS];

	take_choices(point, price);
	const uint32_t i = ladder_best_within(point, price->n_choices, ms);
	return i < price->n_choices ? price->choice[i] : price->set.n;
}

uint32_t price_cheapest_within(const struct price *price, double rmse)
{
	struct ladder_point point[PRICE_MOST_SETTINGS];

	take_choices(point, price);
	const uint32_t i = ladder_cheapest_within(point, price->n_choices, rmse);
	return i < price->n_choices ? price->choice[i] : price->set.n;
}

void price_equal_times(const struct price *price, const struct price_rows *rows)
{
	const double most = price->point[price->unbeaten[price->n_unbeaten - 1]].ms;
	uint32_t before = price->set.n;

	/* Times of two figures, so that people can say them. */
	const double first = price->point[price->unbeaten[0]].ms, scale = pow(10, 1 - floor(log10(first)));
	for (double ms = ceil(first * scale) / scale;; ms *= M_SQRT2) {
		const uint32_t best = price_best_within(price, ms);

		if (best != before)
			rows->row(ms, best, rows->userdata);
		before = best;
		if (ms >= most)
			return;
	}
}

void price_equal_errors(const struct price *price, const struct price_rows *rows)
{
	const double worst = price->point[price->unbeaten[0]].rmse;
	const double best = price->point[price->unbeaten[price->n_unbeaten - 1]].rmse;
	const double most = best > 0 ? ladder_psnr(best) : MOST_DB;
	uint32_t before = price->set.n;

	for (double db = 2 * floor(ladder_psnr(worst) / 2); db <= most; db += 2) {
		const uint32_t cheapest = price_cheapest_within(price, 255 * pow(10, -db / 20));

		if (cheapest != before && cheapest < price->set.n)
			rows->row(db, cheapest, rows->userdata);
		before = cheapest;
	}
}
