#include <stdlib.h>
#include <string.h>
#include "base/outfile.h"
#include "base/png.h"
#include "price.h"

#define GUTTER 4

/* ---- what is shown ---- */

static void add_column(struct price_pictures *p, uint32_t setting)
{
	for (uint32_t i = 0; i < p->n_columns; i++)
		if (p->setting[i] == setting)
			return;
	p->setting[p->n_columns++] = setting;
}

static void choose(struct price_pictures *p, const struct price *price)
{
	const uint32_t n = price->n_unbeaten;

	for (int kind = 0; kind < LADDER_N_KINDS; kind++)
		for (uint32_t v = 0; v < price->options->n_views; v++)
			if (price->view[v].kind == (enum ladder_kind)kind) {
				p->view[p->n_rows++] = v;
				break;
			}
	add_column(p, price->unbeaten[0]);
	add_column(p, 0);
	add_column(p, price->unbeaten[n / 3]);
	add_column(p, price->unbeaten[2 * n / 3]);
	add_column(p, price->unbeaten[n - 1]);
}

static void paint_difference(uint8_t *out, const uint8_t *rgb, const uint8_t *truth, size_t n_pixels)
{
	for (size_t i = 0; i < n_pixels; i++) {
		int most = 0;

		for (size_t c = 3 * i; c < 3 * i + 3; c++)
			most = abs(rgb[c] - truth[c]) > most ? abs(rgb[c] - truth[c]) : most;
		memset(out + 3 * i, most * PRICE_TIMES < 255 ? most * PRICE_TIMES : 255, 3);
	}
}

int price_pictures_make(struct price_pictures *p, const struct price *price, struct psr_error *err)
{
	const uint32_t width = price->options->size[0], height = price->options->size[1];
	const size_t n_pixels = (size_t)width * height;

	*p = (struct price_pictures){ .n_rows = 0 };
	choose(p, price);
	for (uint32_t r = 0; r < p->n_rows; r++) {
		const struct ladder_view *view = &price->view[p->view[r]];

		for (uint32_t c = 0; c < p->n_columns; c++) {
			uint8_t *rgb = p->rgb[r][c] = malloc(3 * n_pixels), *difference = p->difference[r][c] = malloc(3 * n_pixels);
			int rc;

			if (rgb == NULL || difference == NULL)
				return psr_fail(err, PSR_ERR_MEMORY, "no memory for a picture of %ux%u", width, height);
			rc = ladder_draw(rgb, price->ladder, view, &price->set.rung[p->setting[c]], err);
			if (rc != PSR_OK)
				return rc;
			paint_difference(difference, rgb, view->truth, n_pixels);
		}
	}
	return PSR_OK;
}

void price_pictures_fini(struct price_pictures *p)
{
	for (uint32_t r = 0; r < LADDER_N_KINDS; r++)
		for (uint32_t c = 0; c < PRICE_MOST_COLUMNS; c++) {
			free(p->rgb[r][c]);
			free(p->difference[r][c]);
		}
}

/* ---- strip.png ---- */

/* Puts a picture into cell (column, line) of the strip. */
static void paste(const struct psr_frame *strip, const struct price *price, const uint8_t *rgb, uint32_t column,
                  uint32_t line)
{
	const uint32_t width = price->options->size[0], height = price->options->size[1];
	const size_t left = (size_t)column * (width + GUTTER), top = (size_t)line * (height + GUTTER);

	for (uint32_t y = 0; y < height; y++)
		memcpy(strip->rgb + 3 * ((top + y) * strip->width + left), rgb + (size_t)3 * y * width, (size_t)3 * width);
}

int price_write_strip(const struct price *price, const struct price_pictures *p, struct psr_error *err)
{
	const uint32_t width = (p->n_columns + 1) * (price->options->size[0] + GUTTER) - GUTTER;
	const uint32_t height = 2 * p->n_rows * (price->options->size[1] + GUTTER) - GUTTER;
	char path[PRICE_PATH];
	struct outfile file;
	struct psr_frame strip;
	int rc = psr_frame_alloc(&strip, width, height, 1u << PSR_PLANE_COLOR, err);

	if (rc != PSR_OK)
		return rc;
	memset(strip.rgb, 255, (size_t)3 * width * height);
	for (uint32_t r = 0; r < p->n_rows; r++) {
		paste(&strip, price, price->view[p->view[r]].truth, 0, 2 * r);
		for (uint32_t c = 0; c < p->n_columns; c++) {
			paste(&strip, price, p->rgb[r][c], c + 1, 2 * r);
			paste(&strip, price, p->difference[r][c], c + 1, 2 * r + 1);
		}
	}
	rc = price_open(&file, path, price, "strip.png", err);
	if (rc == PSR_OK)
		rc = outfile_close(&file, png_write_frame(&file, &strip, err), err);
	psr_frame_free(&strip);
	return rc;
}
