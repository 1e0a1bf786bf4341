#include "pfm.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "psr/render.h"

static float get_float(const uint8_t *at, int is_little)
{
	uint32_t bits = 0;
	float v;

	for (int i = 0; i < 4; i++)
		bits |= (uint32_t)at[is_little ? i : 3 - i] << 8 * i;
	memcpy(&v, &bits, sizeof v);
	return v;
}

static int read_header(FILE *file, uint32_t *width, uint32_t *height, int *is_little, const char *path,
                       struct psr_error *err)
{
	unsigned w, h;
	char kind, end;
	double scale;

	if (fscanf(file, "P%c %u %u %lf%c", &kind, &w, &h, &scale, &end) != 5 || kind != 'f' || (end != '\n' && end != ' ')
	    || scale == 0)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: not a PFM picture of one channel ('Pf')", path);
	if (w < 1 || h < 1 || w > PSR_MAX_SIDE || h > PSR_MAX_SIDE || (uint64_t)w * h > PSR_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: %ux%u pixels are outside of 1 to %d a side, %u in all", path, w, h,
		                PSR_MAX_SIDE, PSR_MAX_PIXELS);
	*width = w;
	*height = h;
	*is_little = scale < 0;
	return PSR_OK;
}

static int read_rows(FILE *file, float *depth, uint32_t width, uint32_t height, int is_little, const char *path,
                     struct psr_error *err)
{
	uint8_t *row = malloc(4 * (size_t)width);
	int code = PSR_OK;

	if (row == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %s", path);
	for (uint32_t y = height; y-- > 0 && code == PSR_OK;) {
		if (fread(row, 4, width, file) != width)
			code = ferror(file) ? psr_fail(err, PSR_ERR_IO, "%s: %s", path, strerror(errno))
			                    : psr_fail(err, PSR_ERR_FORMAT, "%s ends within row %u of %u", path, height - y,
			                               height);
		for (uint32_t x = 0; x < width && code == PSR_OK; x++)
			depth[(size_t)y * width + x] = get_float(row + 4 * (size_t)x, is_little);
	}
	if (code == PSR_OK && fgetc(file) != EOF)
		code = psr_fail(err, PSR_ERR_FORMAT, "%s goes on after its %ux%u pixels", path, width, height);
	free(row);
	return code;
}

int pfm_read(float **out, uint32_t *width, uint32_t *height, const char *path, struct psr_error *err)
{
	FILE *file = fopen(path, "rb");
	float *depth = NULL;
	int code, is_little = 0;

	if (file == NULL)
		return psr_fail(err, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s: %s", path, strerror(errno));
	code = read_header(file, width, height, &is_little, path, err);
	if (code == PSR_OK) {
		depth = malloc((size_t)*width * *height * sizeof *depth);
		code = depth == NULL ? psr_fail(err, PSR_ERR_MEMORY, "no memory for %s", path)
		                     : read_rows(file, depth, *width, *height, is_little, path, err);
	}
	fclose(file);
	if (code != PSR_OK)
		free(depth);
	else
		*out = depth;
	return code;
}
