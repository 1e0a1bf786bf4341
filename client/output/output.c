#include "output.h"
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_SHEET_PIXELS (1u << 28)

/* Returns the length of the number format at `at`, which is a %; 0 if it is not one. */
static size_t number_length(const char *at)
{
	size_t n = 1;

	if (at[n] == '0' && isdigit((unsigned char)at[n + 1]))
		n += 2;
	return at[n] == 'd' ? n + 1 : 0;
}

int output_is_numbered(int *is_numbered, const char *name, struct psr_error *err)
{
	*is_numbered = 0;
	for (const char *at = name; (at = strchr(at, '%')) != NULL;) {
		size_t n = number_length(at);

		if (at[1] == '%') {
			at += 2;
			continue;
		}
		if (n == 0 || *is_numbered)
			return psr_fail(err, PSR_ERR_ARG,
			                "'%.200s': one %%d or %%03d stands for the number of a picture, %%%% for a %%", name);
		*is_numbered = 1;
		at += n;
	}
	return PSR_OK;
}

int output_name(char path[PATH_MAX], const char *name, uint32_t number, struct psr_error *err)
{
	size_t used = 0;

	for (const char *at = name; *at != '\0';) {
		size_t n = *at == '%' ? number_length(at) : 0;

		if (used + 16 >= PATH_MAX)
			return psr_fail(err, PSR_ERR_LIMIT, "'%.200s...' is too long for a file's name", name);
		if (n > 0)
			used += (size_t)sprintf(path + used, "%0*u", n > 2 ? at[2] - '0' : 1, number);
		else
			path[used++] = *at;
		at += n > 0 ? n : *at == '%' && at[1] == '%' ? 2 : 1;
	}
	path[used] = '\0';
	return PSR_OK;
}

int sheet_check(const struct sheet *sheet, uint32_t n_pictures, uint32_t width, uint32_t height, struct psr_error *err)
{
	uint64_t n = (uint64_t)sheet->columns * sheet->rows;

	if (n == 0)
		return psr_fail(err, PSR_ERR_ARG, "--sheet: %ux%u has no place for a picture", sheet->columns, sheet->rows);
	if (n < n_pictures)
		return psr_fail(err, PSR_ERR_ARG, "--sheet: %ux%u has places for %llu pictures, and there are %u",
		                sheet->columns, sheet->rows, (unsigned long long)n, n_pictures);
	if (n > MAX_SHEET_PIXELS || n * width * height > MAX_SHEET_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "--sheet: %ux%u pictures of %ux%u pixels are more than %u pixels; choose a "
		                "smaller --size", sheet->columns, sheet->rows, width, height, MAX_SHEET_PIXELS);
	return PSR_OK;
}

int sheet_add(struct sheet *sheet, uint32_t k, const struct psr_frame *picture, const uint8_t background[3],
              struct psr_error *err)
{
	struct psr_frame *whole = &sheet->picture;
	size_t row = 3 * (size_t)picture->width, stride;
	uint8_t *to;

	if (whole->rgb == NULL) {
		whole->width = sheet->columns * picture->width;
		whole->height = sheet->rows * picture->height;
		whole->rgb = malloc(3 * (size_t)whole->width * whole->height);
		if (whole->rgb == NULL)
			return psr_fail(err, PSR_ERR_MEMORY, "no memory for a sheet of %ux%u pixels", whole->width, whole->height);
		for (size_t i = 0; i < (size_t)whole->width * whole->height; i++)
			memcpy(whole->rgb + 3 * i, background, 3);
	}
	stride = 3 * (size_t)whole->width;
	to = whole->rgb + stride * (k / sheet->columns) * picture->height + row * (k % sheet->columns);
	for (uint32_t y = 0; y < picture->height; y++)
		memcpy(to + stride * y, picture->rgb + row * y, row);
	return PSR_OK;
}

void sheet_fini(struct sheet *sheet)
{
	free(sheet->picture.rgb);
	sheet->picture.rgb = NULL;
}
