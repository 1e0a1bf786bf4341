#include "ppm.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "psr/render.h"

static int read_picture(FILE *file, uint8_t **out, uint32_t *width, uint32_t *height, const char *path,
                        struct psr_error *err)
{
	unsigned w, h, most;
	char end;
	size_t n;

	if (fscanf(file, "P6 %u %u %u%c", &w, &h, &most, &end) != 4 || most != 255 || (end != '\n' && end != ' '))
		return psr_fail(err, PSR_ERR_FORMAT, "%s: not a binary PPM picture of 8 bits ('P6')", path);
	if (w < 1 || h < 1 || w > PSR_MAX_SIDE || h > PSR_MAX_SIDE || (uint64_t)w * h > PSR_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: %ux%u pixels are outside of 1 to %d a side, %u in all", path, w, h,
		                PSR_MAX_SIDE, PSR_MAX_PIXELS);
	n = 3 * (size_t)w * h;
	*out = malloc(n);
	if (*out == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %s", path);
	if (fread(*out, 1, n, file) != n)
		return ferror(file) ? psr_fail(err, PSR_ERR_IO, "%s: %s", path, strerror(errno))
		                    : psr_fail(err, PSR_ERR_FORMAT, "%s ends before its %ux%u pixels do", path, w, h);
	*width = w;
	*height = h;
	return PSR_OK;
}

int ppm_read(uint8_t **out, uint32_t *width, uint32_t *height, const char *path, struct psr_error *err)
{
	FILE *file = fopen(path, "rb");
	uint8_t *rgb = NULL;
	int code;

	if (file == NULL)
		return psr_fail(err, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s: %s", path, strerror(errno));
	code = read_picture(file, &rgb, width, height, path, err);
	fclose(file);
	if (code != PSR_OK)
		free(rgb);
	else
		*out = rgb;
	return code;
}
