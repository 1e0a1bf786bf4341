#include <stdlib.h>
#include <string.h>
#include "base/html.h"
#include "base/infile.h"
#include "base/outfile.h"
#include "price.h"

#define MOST_PLOT_BYTES (16 << 20)

static void begin(FILE *to, const struct price *price)
{
	const struct price_options *options = price->options;

	fputs("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>What accuracy costs: ", to);
	html_escape(to, price->title);
	fputs("</title>\n<style>\n"
	      "body { font: 15px/1.4 sans-serif; margin: 2em; color: #222; background: #fff }\n"
	      "table { border-collapse: collapse; font-size: 13px; margin: .5em 0 }\n"
	      "td, th { padding: .1em .7em; text-align: right; border-bottom: 1px solid #ddd }\n"
	      "td:first-child, th:first-child { text-align: left } tr.unbeaten { font-weight: bold }\n"
	      "div { display: flex; flex-wrap: wrap; gap: 1em } figure { margin: 0 }\n"
	      "figcaption { color: #666; font-size: 13px } img { display: block; image-rendering: pixelated }\n"
	      "</style>\n</head>\n<body>\n<h1>What accuracy costs: ", to);
	html_escape(to, price->title);
	fprintf(to, "</h1>\n<p>%u views of %ux%u pixels; a model of %u pixels; one light; one thread, %u rounds. "
	        "Milliseconds are the mean over the views of each view's median frame; ratios are to the usual setting's "
	        "frame of the same round, with quartiles; dB are the whole picture's, to rays through the source.</p>\n",
	        options->n_views, options->size[0], options->size[1], options->resolution, options->n_rounds);
}

static int add_plot(FILE *to, const struct price *price, struct psr_error *err)
{
	char path[PRICE_PATH];
	char *svg = NULL;
	int code;

	if (!price->has_plot) {
		fputs("<p>There is no plot, since gnuplot is not installed.</p>\n", to);
		return PSR_OK;
	}
	snprintf(path, sizeof path, "%s/plot.svg", price->options->out);
	code = infile_read_text(&svg, path, MOST_PLOT_BYTES, err);
	if (code == PSR_OK) {
		fputs("<img alt=\"error by milliseconds\" src=\"data:image/svg+xml;base64,", to);
		html_base64(to, (const uint8_t *)svg, strlen(svg));
		fputs("\">\n", to);
	}
	free(svg);
	return code;
}

static void add_db(FILE *to, double rmse)
{
	fputs("<td>", to);
	price_print_db(to, rmse);
	fputs("</td>", to);
}

struct adding {
	FILE *to;
	const struct price *price;
	const char *unit;
};

static void add_row(double bound, uint32_t setting, void *userdata)
{
	const struct adding *a = userdata;

	fprintf(a->to, "<tr><td>%.3g %s</td><td>%s</td><td>%.3f</td>", bound, a->unit, a->price->set.setting[setting].name,
	        a->price->point[setting].ms);
	add_db(a->to, a->price->point[setting].rmse);
	fputs("</tr>\n", a->to);
}

static void add_choices(FILE *to, const struct price *price)
{
	struct adding adding = { to, price, "ms" };
	const struct price_rows rows = { add_row, &adding };

	fputs("<h2>The best choice within a time</h2>\n<table>\n"
	      "<tr><th>at most</th><th>setting</th><th>ms</th><th>dB</th></tr>\n", to);
	price_equal_times(price, &rows);
	fputs("</table>\n<h2>The cheapest choice within an error</h2>\n<table>\n"
	      "<tr><th>at least</th><th>setting</th><th>ms</th><th>dB</th></tr>\n", to);
	adding.unit = "dB";
	price_equal_errors(price, &rows);
	fputs("</table>\n", to);
}

static void add_settings(FILE *to, const struct price *price)
{
	fputs("<h2>All settings</h2>\n<p>Bold: no other choice is as fast and as good. =: the usual picture, byte by byte. "
	      "Normals and depths of fewer bits are made in memory; a model's file has one width of each.</p>\n<table>\n"
	      "<tr><th>setting</th><th></th><th>ms</th><th>ratio</th><th>quartiles</th><th>dB</th>", to);
	for (int k = 0; k < LADDER_N_KINDS; k++)
		fprintf(to, "<th>%s</th>", ladder_kind_name((enum ladder_kind)k));
	fputs("<th>kB</th></tr>\n", to);
	for (uint32_t i = 0; i < price->set.n; i++) {
		fprintf(to, "<tr%s><td>%s</td><td>%s</td><td>%.3f</td><td>%.2f</td><td>%.2f&ndash;%.2f</td>",
		        price->is_unbeaten[i] ? " class=\"unbeaten\"" : "", price->set.setting[i].name,
		        price->is_same[i] ? "=" : "", price->point[i].ms, price->ratio[i][0], price->ratio[i][1], price->ratio[i][2]);
		add_db(to, price->point[i].rmse);
		for (int k = 0; k < LADDER_N_KINDS; k++)
			add_db(to, price->of_kind[k][i].rmse);
		if (price->bytes[i] > 0)
			fprintf(to, "<td>%.1f</td></tr>\n", price->bytes[i] / 1000);
		else
			fputs("<td></td></tr>\n", to);
	}
	fputs("</table>\n", to);
}

static int add_image(FILE *to, const struct price *price, const uint8_t *rgb, struct psr_error *err)
{
	const struct psr_frame frame = { .width = price->options->size[0], .height = price->options->size[1],
		                             .rgb = (uint8_t *)rgb };

	return html_image(to, &frame, 1, err);
}

static int add_pictures(FILE *to, const struct price *price, const struct price_pictures *p, struct psr_error *err)
{
	int code = PSR_OK;

	fprintf(to, "<h2>Pictures</h2>\n<p>Below each, its difference to the truth, times %d.</p>\n", PRICE_TIMES);
	for (uint32_t r = 0; code == PSR_OK && r < p->n_rows; r++) {
		const struct ladder_view *view = &price->view[p->view[r]];

		fprintf(to, "<h3>%s</h3>\n<div><figure><figcaption>truth</figcaption>", ladder_kind_name(view->kind));
		code = add_image(to, price, view->truth, err);
		fputs("</figure>\n", to);
		for (uint32_t c = 0; code == PSR_OK && c < p->n_columns; c++) {
			const uint32_t i = p->setting[c];
			const struct ladder_row *row = &price->row[(size_t)p->view[r] * price->set.n + i];

			fprintf(to, "<figure><figcaption>%s: %.2f ms, ", price->set.setting[i].name, row->ms);
			price_print_db(to, row->rmse);
			fputs(" dB</figcaption>", to);
			code = add_image(to, price, p->rgb[r][c], err);
			if (code == PSR_OK)
				code = add_image(to, price, p->difference[r][c], err);
			fputs("</figure>\n", to);
		}
		fputs("</div>\n", to);
	}
	return code;
}

int price_write_page(const struct price *price, const struct price_pictures *pictures, struct psr_error *err)
{
	char path[PRICE_PATH];
	struct outfile file;
	int code = price_open(&file, path, price, "index.html", err);

	if (code != PSR_OK)
		return code;
	begin(file.stream, price);
	code = add_plot(file.stream, price, err);
	add_choices(file.stream, price);
	if (code == PSR_OK)
		code = add_pictures(file.stream, price, pictures, err);
	add_settings(file.stream, price);
	fputs("</body>\n</html>\n", file.stream);
	return outfile_close(&file, code, err);
}
