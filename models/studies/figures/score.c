#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "figures.h"

static int is_inside(const struct figure_truth *truth, uint32_t x, uint32_t y)
{
	if (x == 0 || y == 0 || x + 1 == truth->side || y + 1 == truth->side)
		return 0;
	for (uint32_t v = y - 1; v <= y + 1; v++)
		for (uint32_t u = x - 1; u <= x + 1; u++)
			if (truth->n_met[(size_t)v * truth->side + u] < truth->rays * truth->rays)
				return 0;
	return 1;
}

int figure_difference(const uint8_t *a, const uint8_t *b)
{
	int most = 0;

	for (int c = 0; c < 3; c++)
		most = abs(a[c] - b[c]) > most ? abs(a[c] - b[c]) : most;
	return most;
}

static void add_pixel(struct figure_score *score, const struct psr_frame *frame, const struct figure_truth *truth,
                      uint32_t x, uint32_t y)
{
	const size_t at = (size_t)y * truth->side + x;
	const int inside = is_inside(truth, x, y);
	uint64_t square = 0;

	if (truth->n_met[at] == 0)
		return;
	for (size_t i = 3 * at; i < 3 * at + 3; i++)
		square += (uint64_t)((frame->rgb[i] - truth->rgb[i]) * (frame->rgb[i] - truth->rgb[i]));
	score->n_met++;
	score->square += square;
	if (2 * truth->n_met[at] >= truth->rays * truth->rays) {
		score->n_half++;
		score->n_missing += frame->depth != NULL && !isfinite(frame->depth[at]);
	}
	if (inside) {
		score->n_inside++;
		score->inside_square += square;
		score->difference += (uint64_t)figure_difference(frame->rgb + 3 * at, truth->rgb + 3 * at);
	}
}

void figure_score_colors(struct figure_score *score, const struct psr_frame *frame, const struct figure_truth *truth)
{
	for (uint32_t y = 0; y < truth->side; y++)
		for (uint32_t x = 0; x < truth->side; x++)
			add_pixel(score, frame, truth, x, y);
}

int figure_score_add(struct figure_score *score, struct study *study, const struct figure_model *model,
                     const struct figure_shot *shot, const struct psr_frame *frame, const struct figure_truth *truth)
{
	const struct psr_truth_shot seen = { model->truth, &shot->scene.camera, frame->width, frame->height,
		                                 study->n_threads };
	struct psr_accuracy accuracy;
	int rc = psr_accuracy_measure(&accuracy, &seen, frame->depth, model->spacing, study->err);

	if (rc != PSR_OK)
		return rc;
	score->n_holes += accuracy.n_holes;
	score->n_outside += accuracy.n_outside_drawn;
	figure_score_colors(score, frame, truth);
	return PSR_OK;
}

double figure_psnr(uint64_t square, uint64_t n_pixels)
{
	return square ? 10 * log10(255.0 * 255.0 * 3 * (double)n_pixels / (double)square) : INFINITY;
}

void figure_score_print_head(const char *first)
{
	printf("%-32s %6s %8s %7s %8s %8s %7s %6s %10s\n", first, "holes", "/million", "outside", "/million", "missing",
	       "PSNR dB", "inside", "difference");
}

static double million(uint64_t n, uint64_t all)
{
	return all ? 1e6 * (double)n / (double)all : 0;
}

void figure_score_print(const char *label, const struct figure_score *s)
{
	printf("%-32s %6" PRIu64 " %8.1f %7" PRIu64 " %8.1f %8.1f %7.2f %6.2f %10.2f\n", label, s->n_holes,
	       million(s->n_holes, s->n_inside), s->n_outside, million(s->n_outside, s->n_met),
	       million(s->n_missing, s->n_half), figure_psnr(s->square, s->n_met),
	       figure_psnr(s->inside_square, s->n_inside),
	       s->n_inside ? (double)s->difference / (double)s->n_inside : 0);
}
