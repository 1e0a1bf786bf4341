#include "canvas.h"
#include <chafa.h>
#include <string.h>

extern char **environ;

/* What a cell has where the terminal does not say: right enough for the shape of the picture. */
#define USUAL_CELL_W 8
#define USUAL_CELL_H 16

static const char home[] = "\033[?2026h\033[H", shown[] = "\033[0m\033[?2026l"; /* between them nothing is shown */
static const char forget[] = "\033_Ga=d,q=2\033\\";                             /* kitty's pictures before */

static ChafaCanvasMode mode_of(const ChafaTermInfo *info)
{
	if (chafa_term_info_have_seq(info, CHAFA_TERM_SEQ_SET_COLOR_FGBG_DIRECT))
		return CHAFA_CANVAS_MODE_TRUECOLOR;
	if (chafa_term_info_have_seq(info, CHAFA_TERM_SEQ_SET_COLOR_FGBG_256))
		return CHAFA_CANVAS_MODE_INDEXED_240;
	if (chafa_term_info_have_seq(info, CHAFA_TERM_SEQ_SET_COLOR_FGBG_16))
		return CHAFA_CANVAS_MODE_INDEXED_16;
	return CHAFA_CANVAS_MODE_FGBG;
}

static enum canvas_way choose(const struct tty *tty, const ChafaTermInfo *info, enum canvas_way way)
{
	if (way != CANVAS_AUTO)
		return way;
	if (tty->has_kitty || chafa_term_info_have_seq(info, CHAFA_TERM_SEQ_BEGIN_KITTY_IMMEDIATE_IMAGE_V1))
		return CANVAS_KITTY;
	if (tty->has_sixel || chafa_term_info_have_seq(info, CHAFA_TERM_SEQ_BEGIN_SIXELS))
		return CANVAS_SIXEL;
	return CANVAS_SYMBOLS;
}

static ChafaCanvasConfig *configure(const struct canvas *canvas, ChafaCanvasMode mode)
{
	static const ChafaPixelMode modes[] = { [CANVAS_KITTY] = CHAFA_PIXEL_MODE_KITTY,
		                                    [CANVAS_SIXEL] = CHAFA_PIXEL_MODE_SIXELS,
		                                    [CANVAS_SYMBOLS] = CHAFA_PIXEL_MODE_SYMBOLS };
	ChafaCanvasConfig *config = chafa_canvas_config_new();
	ChafaSymbolMap *symbols = chafa_symbol_map_new();

	chafa_symbol_map_add_by_tags(symbols, CHAFA_SYMBOL_TAG_SPACE | CHAFA_SYMBOL_TAG_BLOCK | CHAFA_SYMBOL_TAG_QUAD);
	chafa_canvas_config_set_symbol_map(config, symbols);
	chafa_symbol_map_unref(symbols);
	chafa_canvas_config_set_geometry(config, canvas->cols, canvas->rows);
	chafa_canvas_config_set_cell_geometry(config, canvas->cell_w, canvas->cell_h);
	chafa_canvas_config_set_pixel_mode(config, modes[canvas->way]);
	chafa_canvas_config_set_canvas_mode(config, mode);
	chafa_canvas_config_set_preprocessing_enabled(config, FALSE);
	return config;
}

/* Sixels come in rows of six: a picture that ends within one would scroll the screen. */
static int whole_rows(const struct canvas *canvas)
{
	int rows = canvas->rows;

	const int height = rows * canvas->cell_h;

	while (canvas->way == CANVAS_SIXEL && rows > 1 && (rows * canvas->cell_h + 5) / 6 * 6 > height)
		rows--;
	return rows;
}

int canvas_open(struct canvas *canvas, const struct tty *tty, enum canvas_way way, struct psr_error *err)
{
	ChafaTermDb *known = chafa_term_db_get_default();
	ChafaTermInfo *info = chafa_term_db_detect(known, environ);
	const ChafaCanvasMode mode = mode_of(info);
	ChafaCanvasConfig *config;

	memset(canvas, 0, sizeof *canvas);
	canvas->way = choose(tty, info, way);
	chafa_term_info_supplement(info, chafa_term_db_get_fallback_info(known));
	canvas->info = info;
	canvas->cell_w = tty->cell_w > 0 ? tty->cell_w : USUAL_CELL_W;
	canvas->cell_h = tty->cell_h > 0 ? tty->cell_h : USUAL_CELL_H;
	canvas->cols = tty->cols;
	canvas->rows = tty->rows > 1 ? tty->rows - 1 : 1;
	canvas->rows = whole_rows(canvas);
	canvas->width = (uint32_t)(canvas->cols * canvas->cell_w);
	canvas->height = (uint32_t)(canvas->rows * canvas->cell_h);
	if (canvas->width > PSR_MAX_SIDE || canvas->height > PSR_MAX_SIDE)
		return psr_fail(err, PSR_ERR_LIMIT, "the terminal has %u x %u pixels; at most %d a side can be drawn",
		                canvas->width, canvas->height, PSR_MAX_SIDE);
	config = configure(canvas, mode);
	canvas->canvas = chafa_canvas_new(config);
	chafa_canvas_config_unref(config);
	return PSR_OK;
}

void canvas_close(struct canvas *canvas)
{
	if (canvas->canvas != NULL)
		chafa_canvas_unref(canvas->canvas);
	if (canvas->info != NULL)
		chafa_term_info_unref(canvas->info);
	memset(canvas, 0, sizeof *canvas);
}

void canvas_draw(struct canvas *canvas, const struct psr_frame *frame)
{
	GString *text;

	chafa_canvas_draw_all_pixels(canvas->canvas, CHAFA_PIXEL_RGB8, frame->rgb, (gint)frame->width, (gint)frame->height,
	                             (gint)(3 * frame->width));
	text = chafa_canvas_print(canvas->canvas, canvas->info);
	tty_write(home, sizeof home - 1);
	if (canvas->way == CANVAS_KITTY)
		tty_write(forget, sizeof forget - 1);
	tty_write(text->str, text->len);
	tty_write(shown, sizeof shown - 1);
	g_string_free(text, TRUE);
}
