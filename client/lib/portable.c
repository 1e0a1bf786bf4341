#include <stdlib.h>
#include <string.h>
#include "picture.h"

int picture_write_ppm(struct outfile *file, const struct psr_frame *picture, struct psr_error *err)
{
	char header[64];
	int n = snprintf(header, sizeof header, "P6\n%u %u\n255\n", picture->width, picture->height);

	(void)err;
	outfile_write(file, header, (size_t)n);
	outfile_write(file, picture->rgb, (size_t)picture->width * picture->height * 3);
	return PSR_OK;
}

int picture_write_pfm(struct outfile *file, const struct psr_frame *picture, struct psr_error *err)
{
	char header[64];
	int n = snprintf(header, sizeof header, "Pf\n%u %u\n-1.0\n", picture->width, picture->height);
	uint8_t *bytes = malloc((size_t)picture->width * 4);

	if (bytes == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to write a PFM");
	outfile_write(file, header, (size_t)n);
	for (uint32_t y = picture->height; y-- > 0;) {
		const float *row = picture->depth + (size_t)y * picture->width;

		for (uint32_t x = 0; x < picture->width; x++) {
			uint32_t bits;

			memcpy(&bits, &row[x], sizeof bits);
			for (int i = 0; i < 4; i++)
				bytes[4 * x + (uint32_t)i] = (uint8_t)(bits >> 8 * i);
		}
		outfile_write(file, bytes, (size_t)picture->width * 4);
	}
	free(bytes);
	return PSR_OK;
}
