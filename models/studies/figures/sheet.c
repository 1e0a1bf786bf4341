#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "figures.h"

#define GUTTER 4
#define UNLIKE 8 /* codes */
#define STEP 8   /* pixels */

void figure_sheet_init(struct figure_sheet *sheet, uint32_t columns, const struct figure_part *part)
{
	*sheet = (struct figure_sheet){ .columns = columns };
	sheet->width = part->width * part->zoom;
	sheet->height = part->height * part->zoom;
}

int figure_sheet_add(struct figure_sheet *sheet, const uint8_t *rgb, uint32_t side, const struct figure_part *part,
                     struct psr_error *err)
{
	uint8_t *cell = sheet->n_cells < FIGURE_MOST_CELLS ? malloc((size_t)3 * sheet->width * sheet->height) : NULL;

	if (cell == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a sheet of pictures");
	for (uint32_t y = 0; y < sheet->height; y++)
		for (uint32_t x = 0; x < sheet->width; x++)
			memcpy(cell + 3 * ((size_t)y * sheet->width + x),
			       rgb + 3 * ((size_t)(part->y + y / part->zoom) * side + part->x + x / part->zoom), 3);
	sheet->cell[sheet->n_cells++] = cell;
	return PSR_OK;
}

void figure_sheet_drop(struct figure_sheet *sheet, uint32_t n_cells)
{
	while (sheet->n_cells > n_cells)
		free(sheet->cell[--sheet->n_cells]);
}

static void paste(const struct psr_frame *to, const struct figure_sheet *sheet, uint32_t i)
{
	const uint32_t left = i % sheet->columns * (sheet->width + GUTTER);
	const uint32_t top = i / sheet->columns * (sheet->height + GUTTER);

	for (uint32_t y = 0; y < sheet->height; y++)
		memcpy(to->rgb + 3 * ((size_t)(top + y) * to->width + left), sheet->cell[i] + (size_t)3 * y * sheet->width,
		       (size_t)3 * sheet->width);
}

static int write_sheet(const struct figure_sheet *sheet, const struct study *study, const char *name)
{
	const uint32_t rows = (sheet->n_cells + sheet->columns - 1) / sheet->columns;
	struct psr_frame frame;
	char path[1024];
	int rc;

	if (snprintf(path, sizeof path, "%s/%s.png", study->out, name) >= (int)sizeof path)
		return psr_fail(study->err, PSR_ERR_ARG, "--out: the folder's name is too long");
	rc = psr_frame_alloc(&frame, sheet->columns * (sheet->width + GUTTER) - GUTTER,
	                     rows * (sheet->height + GUTTER) - GUTTER, 1u << PSR_PLANE_COLOR, study->err);
	if (rc != PSR_OK)
		return rc;
	memset(frame.rgb, 0xff, (size_t)3 * frame.width * frame.height);
	for (uint32_t i = 0; i < sheet->n_cells; i++)
		paste(&frame, sheet, i);
	rc = psr_image_write(&frame, path, study->err);
	psr_frame_free(&frame);
	return rc;
}

int figure_sheet_finish(struct figure_sheet *sheet, const struct study *study, const char *name, int rc)
{
	if (rc == PSR_OK)
		rc = write_sheet(sheet, study, name);
	figure_sheet_drop(sheet, 0);
	return rc;
}

static uint64_t gain_at(const uint8_t *a, const uint8_t *b, const uint8_t *right)
{
	const int gain = figure_difference(a, right) - figure_difference(b, right);

	return gain > UNLIKE ? (uint64_t)(gain * gain) : 0;
}

uint64_t figure_part_find(struct figure_part *part, const uint8_t *a, const uint8_t *b,
                          const struct figure_truth *truth)
{
	uint64_t most = 0;

	part->x = part->y = 0;
	for (uint32_t top = 0; top + part->height <= truth->side; top += STEP)
		for (uint32_t left = 0; left + part->width <= truth->side; left += STEP) {
			uint64_t gain = 0;

			for (uint32_t y = top; y < top + part->height; y++)
				for (uint32_t x = left; x < left + part->width; x++) {
					const size_t at = (size_t)y * truth->side + x;

					if (truth->n_met[at] == truth->rays * truth->rays)
						gain += gain_at(a + 3 * at, b + 3 * at, truth->rgb + 3 * at);
				}
			if (gain > most) {
				most = gain;
				part->x = left;
				part->y = top;
			}
		}
	return most;
}
