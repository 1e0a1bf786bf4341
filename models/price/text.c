#include <math.h>
#include "price.h"

void price_print_db(FILE *to, double rmse)
{
	if (isnan(rmse))
		fprintf(to, "%7s", "-");
	else if (rmse > 0)
		fprintf(to, "%7.2f", ladder_psnr(rmse));
	else
		fprintf(to, "%7s", "exact");
}

static void print_setting(FILE *to, const struct price *price, uint32_t i)
{
	const double *ratio = price->ratio[i];

	fprintf(to, "%c%c %-22s %9.3f %6.2f %6.2f-%-6.2f ", price->is_unbeaten[i] ? '*' : ' ', price->is_same[i] ? '=' : ' ',
	        price->set.setting[i].name, price->point[i].ms, ratio[0], ratio[1], ratio[2]);
	price_print_db(to, price->point[i].rmse);
	for (int k = 0; k < LADDER_N_KINDS; k++)
		price_print_db(to, price->of_kind[k][i].rmse);
	if (price->bytes[i] > 0)
		fprintf(to, " %7.1f", price->bytes[i] / 1000);
	putc('\n', to);
}

struct printing {
	FILE *to;
	const struct price *price;
	const char *bound; /* a format of the bound */
};

static void print_row(double bound, uint32_t setting, void *userdata)
{
	const struct printing *p = userdata;
	const struct ladder_point *point = &p->price->point[setting];

	fprintf(p->to, p->bound, bound);
	fprintf(p->to, "  %-22s %9.3f ", p->price->set.setting[setting].name, point->ms);
	price_print_db(p->to, point->rmse);
	putc('\n', p->to);
}

void price_print(FILE *to, const struct price *price)
{
	const struct price_options *options = price->options;
	struct printing printing = { to, price, "%8.3g ms" };
	const struct price_rows rows = { print_row, &printing };

	fprintf(to, "%u views of %ux%u pixels, a model of %u; one light, one thread, %u rounds\n", options->n_views,
	        options->size[0], options->size[1], options->resolution, options->n_rounds);
	fputs("ms: mean over the views of the median frame; ratio: to usual, with quartiles; dB: to the truth\n"
	      "*: no other choice is as fast and as good; =: the usual picture, byte by byte\n"
	      "normals and depths of fewer bits are made in memory: files have one width of each\n\n", to);
	fprintf(to, "   %-22s %9s %6s %-14s%7s", "setting", "ms", "ratio", "  quartiles", "dB");
	for (int k = 0; k < LADDER_N_KINDS; k++)
		fprintf(to, "%7.7s", ladder_kind_name((enum ladder_kind)k));
	fputs("      kB\n", to);
	for (uint32_t i = 0; i < price->set.n; i++)
		print_setting(to, price, i);
	fprintf(to, "\nThe best choice within a time\n%11s  %-22s %9s %7s\n", "at most", "setting", "ms", "dB");
	price_equal_times(price, &rows);
	printing.bound = "%8.3g dB";
	fprintf(to, "\nThe cheapest choice within an error\n%11s  %-22s %9s %7s\n", "at least", "setting", "ms", "dB");
	price_equal_errors(price, &rows);
}
