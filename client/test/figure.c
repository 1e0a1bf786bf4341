#include "figure.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/html.h"

#define ENLARGED 240  /* pixels on the screen that the side of an enlarged box has, about */
#define MARGIN 4      /* pixels around the box that are enlarged with it */

struct figure {
	FILE *to;
	uint32_t width, height;
	struct compare_box box; /* with its margin; width 0: nothing is enlarged */
	uint32_t factor;
	uint8_t *rgb;           /* of width x height, for what is painted */
};

static void difference_of_colors(uint8_t *out, const uint8_t *a, const uint8_t *b, size_t n, unsigned *factor)
{
	int most = 0;

	for (size_t i = 0; i < 3 * n; i++)
		most = abs(a[i] - b[i]) > most ? abs(a[i] - b[i]) : most;
	*factor = most > 0 ? 255u / (unsigned)most : 1;
	for (size_t i = 0; i < 3 * n; i++)
		out[i] = (uint8_t)(abs(a[i] - b[i]) * (int)*factor);
}

/* White is the greatest difference; red are pixels that only one of the two shows. */
static void difference_of_depths(uint8_t *out, const float *a, const float *b, size_t n, double *most)
{
	*most = 0;
	for (size_t i = 0; i < n; i++)
		if (isfinite(a[i]) && isfinite(b[i]))
			*most = fmax(*most, fabs((double)a[i] - (double)b[i]));
	for (size_t i = 0; i < n; i++) {
		const int is_one = isfinite(a[i]) != isfinite(b[i]);
		const double d = isfinite(a[i]) && isfinite(b[i]) ? fabs((double)a[i] - (double)b[i]) : 0;
		const uint8_t grey = *most > 0 ? (uint8_t)(255 * d / *most) : 0;

		out[3 * i] = is_one ? 255 : grey;
		out[3 * i + 1] = out[3 * i + 2] = grey;
	}
}

/* Near is white, as psr shot --show depth has it. */
static void paint_depths(uint8_t *out, const float *depth, size_t n)
{
	double least = INFINITY, most = -INFINITY;

	for (size_t i = 0; i < n; i++)
		if (isfinite(depth[i])) {
			least = fmin(least, (double)depth[i]);
			most = fmax(most, (double)depth[i]);
		}
	for (size_t i = 0; i < n; i++) {
		const double part = most > least ? ((double)depth[i] - least) / (most - least) : 0;

		memset(out + 3 * i, isfinite(depth[i]) ? (int)(255 - 215 * part) : 0, 3);
	}
}

static struct compare_box with_margin(const struct compare_box *box, uint32_t width, uint32_t height)
{
	const uint32_t x = box->x > MARGIN ? box->x - MARGIN : 0, y = box->y > MARGIN ? box->y - MARGIN : 0;
	const uint32_t right = box->x + box->width + MARGIN, bottom = box->y + box->height + MARGIN;

	return (struct compare_box){ x, y, (right < width ? right : width) - x, (bottom < height ? bottom : height) - y };
}

/* A column: the picture with its box outlined, and below it the box enlarged. */
static int print_column(const struct figure *figure, const char *title, const uint8_t *rgb, struct psr_error *err)
{
	const struct compare_box *box = &figure->box;
	struct psr_frame frame = { .width = figure->width, .height = figure->height, .rgb = (uint8_t *)rgb };
	int code;

	fprintf(figure->to, "<figure><figcaption>%s</figcaption><span>", title);
	code = html_image(figure->to, &frame, 1, err);
	if (box->width > 0)
		fprintf(figure->to, "<i style=\"left:%.2f%%;top:%.2f%%;width:%.2f%%;height:%.2f%%\"></i>",
		        100.0 * box->x / figure->width, 100.0 * box->y / figure->height, 100.0 * box->width / figure->width,
		        100.0 * box->height / figure->height);
	fputs("</span>", figure->to);
	if (code == PSR_OK && box->width > 0) {
		frame = (struct psr_frame){ .width = box->width, .height = box->height,
			                        .rgb = malloc(3 * (size_t)box->width * box->height) };
		for (uint32_t y = 0; frame.rgb != NULL && y < box->height; y++)
			memcpy(frame.rgb + 3 * (size_t)y * box->width,
			       rgb + 3 * ((size_t)(box->y + y) * figure->width + box->x), 3 * (size_t)box->width);
		code = frame.rgb != NULL ? html_image(figure->to, &frame, figure->factor, err)
		                         : psr_fail(err, PSR_ERR_MEMORY, "no memory for a picture of the page");
		free(frame.rgb);
	}
	fputs("</figure>\n", figure->to);
	return code;
}

static int print_colors(struct figure *figure, const struct psr_frame *picture, const uint8_t *reference,
                        struct psr_error *err)
{
	char title[64];
	unsigned factor;
	int code = print_column(figure, "picture", picture->rgb, err);

	if (reference == NULL || code != PSR_OK)
		return code;
	difference_of_colors(figure->rgb, picture->rgb, reference, (size_t)figure->width * figure->height, &factor);
	snprintf(title, sizeof title, factor > 1 ? "difference, times %u" : "difference", factor);
	code = print_column(figure, "reference", reference, err);
	return code == PSR_OK ? print_column(figure, title, figure->rgb, err) : code;
}

static int print_depths(struct figure *figure, const float *depth, const float *reference, struct psr_error *err)
{
	const size_t n = (size_t)figure->width * figure->height;
	char title[96];
	double most;
	int code;

	paint_depths(figure->rgb, depth, n);
	code = print_column(figure, "depth", figure->rgb, err);
	paint_depths(figure->rgb, reference, n);
	if (code == PSR_OK)
		code = print_column(figure, "its reference", figure->rgb, err);
	difference_of_depths(figure->rgb, depth, reference, n, &most);
	snprintf(title, sizeof title, "difference; white: %.4g, red: in one alone", most);
	return code == PSR_OK ? print_column(figure, title, figure->rgb, err) : code;
}

int figure_make(char **html, const struct psr_frame *picture, const uint8_t *reference, const float *depth,
                const struct compare_box *box, struct psr_error *err)
{
	struct figure figure = { .width = picture->width, .height = picture->height };
	size_t n;
	int code = PSR_OK;

	*html = NULL;
	figure.rgb = malloc(3 * (size_t)picture->width * picture->height);
	figure.to = open_memstream(html, &n);
	if (figure.to == NULL || figure.rgb == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for a picture of the page");
	if (box->width > 0) {
		figure.box = with_margin(box, picture->width, picture->height);
		n = figure.box.width > figure.box.height ? figure.box.width : figure.box.height;
		figure.factor = n < ENLARGED ? ENLARGED / (uint32_t)n : 1;
	}
	if (code == PSR_OK)
		code = print_colors(&figure, picture, reference, err);
	if (code == PSR_OK && depth != NULL)
		code = print_depths(&figure, picture->depth, depth, err);
	if (figure.to != NULL && fclose(figure.to) != 0 && code == PSR_OK)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for a picture of the page");
	free(figure.rgb);
	if (code != PSR_OK) {
		free(*html);
		*html = NULL;
	}
	return code;
}
