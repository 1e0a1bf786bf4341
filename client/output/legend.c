#include "legend.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "font.h"

/* Pixels at scale 1. */
#define MARGIN 6  /* around the plate */
#define PAD 5     /* within it */
#define ROW 11    /* from a line of text to the next */
#define SWATCH 9  /* both sides; how wide the ramp is, too */
#define GAP 5     /* from a swatch to its text */
#define TICKS 5
#define TICK_ROW 16 /* from a tick to the next */
#define MAX_ROWS 32
#define MAX_TEXT 40

/* Pictures of so many pixels more are drawn with pixels of the font that are a pixel larger. */
#define SCALE_WIDTH 320
#define SCALE_HEIGHT 240
#define MAX_SCALE 8

struct row {
	uint8_t rgb[3];
	int has_swatch;
	char text[MAX_TEXT];
};

struct table {
	struct row row[MAX_ROWS];
	unsigned n;
};

struct canvas {
	uint8_t *rgb;
	uint32_t width, height, scale;
	uint32_t left, top; /* of the plate */
};

/* ---- what it tells ---- */

static int find_entry(const struct psr_msg_frame_end *end, unsigned id, uint64_t *bits)
{
	for (unsigned i = 0; i < end->n_entries; i++)
		if (end->entry[i].id == id) {
			*bits = end->entry[i].count;
			return 1;
		}
	*bits = 0;
	return 0;
}

static void find_heights(struct legend *legend, const struct psr_msg_opened *model)
{
	legend->low = legend->high = 0;
	for (int c = 0; c < 3; c++) {
		const double a = model->up[c] * model->box_min[c], b = model->up[c] * model->box_max[c];

		legend->low += fmin(a, b);
		legend->high += fmax(a, b);
	}
}

int legend_find_of(struct legend *legend, enum psr_color_by by, const struct psr_msg_opened *model,
                   const struct psr_msg_frame_end *end)
{
	uint64_t bits;

	*legend = (struct legend){ .by = by };
	if (by == PSR_COLOR_OWN || (by == PSR_COLOR_HEIGHT && model == NULL))
		return 0;
	if (by == PSR_COLOR_INTENSITY) {
		if (!find_entry(end, PSR_WIRE_REPORT_INTENSITIES, &bits))
			return 0;
		legend->low = (double)(bits & 0xffff);
		legend->high = (double)(bits >> 16 & 0xffff);
	}
	if (by == PSR_COLOR_HEIGHT)
		find_heights(legend, model);
	for (unsigned k = 0; k < 4; k++)
		find_entry(end, PSR_WIRE_REPORT_CLASSES + k, &legend->classes[k]);
	find_entry(end, PSR_WIRE_REPORT_RETURNS, &bits);
	legend->orders = (unsigned)bits;
	return 1;
}

int legend_find(struct legend *legend, const struct scene *scene, const struct psr_msg_frame_end *end)
{
	enum psr_color_by all = PSR_COLOR_OWN;
	uint32_t model = 0;
	int has_others = 0;

	*legend = (struct legend){ .by = PSR_COLOR_OWN };
	for (uint32_t i = 0; i < scene->msg.n_instances; i++) {
		const enum psr_color_by by = (enum psr_color_by)scene->msg.instance[i].color_by;

		if (by == PSR_COLOR_OWN)
			continue;
		if (all != PSR_COLOR_OWN && by != all)
			return 0;
		has_others |= all != PSR_COLOR_OWN && scene->model_of[i] != model;
		all = by;
		model = scene->model_of[i];
	}
	return legend_find_of(legend, all, has_others ? NULL : &scene->model[model].opened, end);
}

/* ---- rows of swatches ---- */

static struct row *add(struct table *table, unsigned *n_left_out, unsigned most)
{
	if (table->n >= most) {
		++*n_left_out;
		return NULL;
	}
	table->row[table->n] = (struct row){ .has_swatch = 1 };
	return &table->row[table->n++];
}

/* Lists what is there, in at most `most` rows; a last one says how many have no place. */
static void list_rows(struct table *table, const struct legend *legend, unsigned most)
{
	unsigned n_left_out = 0;
	struct row *row;

	for (unsigned c = 0; c < 256 && legend->by == PSR_COLOR_CLASS; c++)
		if ((legend->classes[c / 64] >> c % 64 & 1) && (row = add(table, &n_left_out, most)) != NULL) {
			psr_class_color(row->rgb, c);
			snprintf(row->text, sizeof row->text, "%u %s", c, psr_class_name(c));
		}
	for (unsigned o = 0; o < PSR_N_RETURN_ORDERS && legend->by == PSR_COLOR_RETURN; o++)
		if ((legend->orders >> o & 1) && (row = add(table, &n_left_out, most)) != NULL) {
			psr_order_color(row->rgb, (enum psr_return_order)o);
			snprintf(row->text, sizeof row->text, "%s", psr_order_name((enum psr_return_order)o));
		}
	if (n_left_out > 0) {
		row = &table->row[table->n - 1];
		row->has_swatch = 0;
		snprintf(row->text, sizeof row->text, "and %u more", n_left_out + 1);
	}
}

/* ---- numbers at the ramp ---- */

/* Lists the ramp's numbers from its top, with so many decimals that a hundredth of the ramp shows. */
static void list_ticks(struct table *table, const struct legend *legend)
{
	const double extent = legend->high - legend->low;
	int decimals = 0;

	for (double unit = 1; decimals < 6 && unit > extent / 100; unit /= 10)
		decimals++;
	if (legend->by == PSR_COLOR_INTENSITY && extent >= TICKS - 1)
		decimals = 0;
	for (; table->n < TICKS; table->n++)
		snprintf(table->row[table->n].text, MAX_TEXT, "%.*f", decimals,
		         legend->high - extent * table->n / (TICKS - 1));
}

/* ---- drawing; places are pixels at scale 1 from the plate's corner ---- */

static void fill(const struct canvas *canvas, const uint32_t at[2], const uint32_t size[2], const uint8_t rgb[3])
{
	const uint32_t s = canvas->scale, left = canvas->left + at[0] * s, top = canvas->top + at[1] * s;
	uint8_t *first = canvas->rgb + 3 * ((size_t)top * canvas->width + left);

	for (uint32_t y = 0; y < size[1] * s; y++)
		for (uint32_t x = 0; x < size[0] * s; x++)
			memcpy(first + 3 * ((size_t)y * canvas->width + x), rgb, 3);
}

static void draw_plate(const struct canvas *canvas, const uint32_t size[2])
{
	for (uint32_t y = 0; y < size[1] * canvas->scale; y++) {
		uint8_t *row = canvas->rgb + 3 * ((size_t)(canvas->top + y) * canvas->width + canvas->left);

		for (uint32_t i = 0; i < 3 * size[0] * canvas->scale; i++)
			row[i] = (uint8_t)((row[i] + 3 * 20) / 4);
	}
}

static void write_text(const struct canvas *canvas, uint32_t x, uint32_t y, const char *text)
{
	static const uint8_t ink[3] = { 240, 240, 240 };

	for (; *text != '\0'; text++, x += FONT_ADVANCE) {
		const uint8_t *glyph = font_glyph(*text);

		for (uint32_t j = 0; j < FONT_ROWS; j++)
			for (uint32_t i = 0; i < FONT_COLUMNS; i++)
				if (glyph[j] >> (FONT_COLUMNS - 1 - i) & 1)
					fill(canvas, (uint32_t[]){ x + i, y + j }, (uint32_t[]){ 1, 1 }, ink);
	}
}

static void draw_ramp(const struct canvas *canvas, uint32_t top)
{
	const uint32_t n = TICK_ROW * (TICKS - 1) + 1;
	static const uint8_t ink[3] = { 240, 240, 240 };
	uint8_t rgb[3];

	for (uint32_t y = 0; y < n; y++) {
		psr_ramp_color(rgb, (n - 1 - y) * (PSR_RAMP - 1) / (n - 1));
		fill(canvas, (uint32_t[]){ PAD, top + y }, (uint32_t[]){ SWATCH, 1 }, rgb);
		if (y % TICK_ROW == 0)
			fill(canvas, (uint32_t[]){ PAD + SWATCH, top + y }, (uint32_t[]){ 2, 1 }, ink);
	}
}

static uint32_t text_width(const char *text)
{
	return FONT_ADVANCE * (uint32_t)strlen(text);
}

/* Places the plate. Returns 0 if it does not fit. */
static int place(struct canvas *canvas, const uint32_t size[2])
{
	while (canvas->scale > 1 && ((size[0] + 2 * MARGIN) * canvas->scale > canvas->width
	                             || (size[1] + 2 * MARGIN) * canvas->scale > canvas->height))
		canvas->scale--;
	const uint32_t wide = (size[0] + MARGIN) * canvas->scale, high = (size[1] + MARGIN) * canvas->scale;
	if (wide > canvas->width || high > canvas->height)
		return 0;
	canvas->left = MARGIN * canvas->scale;
	canvas->top = canvas->height - high;
	return 1;
}

void legend_draw(const struct legend *legend, uint8_t *rgb, uint32_t width, uint32_t height)
{
	static const char *const title[] = { "", "intensity", "class", "height", "return" };
	const int is_ramp = legend->by == PSR_COLOR_INTENSITY || legend->by == PSR_COLOR_HEIGHT;
	const uint32_t by_width = width / SCALE_WIDTH, by_height = height / SCALE_HEIGHT;
	const uint32_t scale = by_width < by_height ? by_width : by_height, room = (height - 2 * MARGIN) / ROW;
	struct canvas canvas = { rgb, width, height, scale < 1 ? 1 : scale < MAX_SCALE ? scale : MAX_SCALE, 0, 0 };
	struct table table = { .n = 0 };
	uint32_t size[2] = { text_width(title[legend->by]), 0 };

	if (width < LEGEND_LEAST_WIDTH || height < LEGEND_LEAST_HEIGHT)
		return;
	if (is_ramp)
		list_ticks(&table, legend);
	else
		list_rows(&table, legend, room - 2 < MAX_ROWS ? room - 2 : MAX_ROWS);
	for (unsigned i = 0; i < table.n; i++)
		if (SWATCH + GAP + text_width(table.row[i].text) > size[0])
			size[0] = SWATCH + GAP + text_width(table.row[i].text);
	size[0] += 2 * PAD;
	size[1] = 2 * PAD + ROW + (is_ramp ? TICK_ROW * (TICKS - 1) + FONT_ROWS + 2 : table.n * ROW);
	if (!place(&canvas, size))
		return;
	draw_plate(&canvas, size);
	write_text(&canvas, PAD, PAD, title[legend->by]);
	if (is_ramp)
		draw_ramp(&canvas, PAD + ROW + 4);
	for (unsigned i = 0; i < table.n; i++) {
		const uint32_t y = PAD + ROW + 1 + i * (is_ramp ? TICK_ROW : ROW);

		if (table.row[i].has_swatch)
			fill(&canvas, (uint32_t[]){ PAD, y - 1 }, (uint32_t[]){ SWATCH, SWATCH }, table.row[i].rgb);
		write_text(&canvas, PAD + SWATCH + GAP, y, table.row[i].text);
	}
}
