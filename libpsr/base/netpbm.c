#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include "netpbm.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "rows are written as they are");

static int open_picture(FILE **file, const char *path, struct psr_error *err)
{
	*file = fopen(path, "rbe");
	if (*file == NULL)
		return psr_fail(err, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s: %s", path, strerror(errno));
	return PSR_OK;
}

/* Memory for width x height pixels of `bytes` bytes. */
static int make_pixels(void **out, size_t bytes, unsigned width, unsigned height, const char *path,
                       struct psr_error *err)
{
	if (width < 1 || height < 1 || width > PSR_MAX_SIDE || height > PSR_MAX_SIDE
	    || (uint64_t)width * height > PSR_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: %ux%u pixels are outside of 1 to %d a side, %u in all", path, width,
		                height, PSR_MAX_SIDE, PSR_MAX_PIXELS);
	*out = malloc(bytes * width * height);
	return *out != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory for %s", path);
}

static int read_row(FILE *file, void *row, size_t n, const char *path, struct psr_error *err)
{
	if (fread(row, 1, n, file) == n)
		return PSR_OK;
	return ferror(file) ? psr_fail(err, PSR_ERR_IO, "%s: %s", path, strerror(errno))
	                    : psr_fail(err, PSR_ERR_FORMAT, "%s ends before its pixels do", path);
}

int ppm_read(uint8_t **rgb, uint32_t *width, uint32_t *height, const char *path, struct psr_error *err)
{
	unsigned w, h, most;
	FILE *file;
	void *pixels = NULL;
	char end;
	int code = open_picture(&file, path, err);

	if (code != PSR_OK)
		return code;
	if (fscanf(file, "P6 %u %u %u%c", &w, &h, &most, &end) != 4 || most != 255 || (end != '\n' && end != ' '))
		code = psr_fail(err, PSR_ERR_FORMAT, "%s: not a binary PPM picture of 8 bits ('P6')", path);
	else
		code = make_pixels(&pixels, 3, w, h, path, err);
	if (code == PSR_OK)
		code = read_row(file, pixels, 3 * (size_t)w * h, path, err);
	fclose(file);
	if (code != PSR_OK) {
		free(pixels);
		return code;
	}
	*rgb = pixels;
	*width = w;
	*height = h;
	return PSR_OK;
}

static void swap_bytes(uint32_t *v, size_t n)
{
	for (size_t i = 0; i < n; i++)
		v[i] = __builtin_bswap32(v[i]);
}

static int read_rows(FILE *file, float *depth, uint32_t width, uint32_t height, const char *path, struct psr_error *err)
{
	int code = PSR_OK;

	for (uint32_t y = height; y-- > 0 && code == PSR_OK;)
		code = read_row(file, depth + (size_t)y * width, width * sizeof *depth, path, err);
	if (code == PSR_OK && fgetc(file) != EOF)
		code = psr_fail(err, PSR_ERR_FORMAT, "%s goes on after its %ux%u pixels", path, width, height);
	return code;
}

int pfm_read(float **depth, uint32_t *width, uint32_t *height, const char *path, struct psr_error *err)
{
	unsigned w, h;
	double scale;
	FILE *file;
	void *pixels = NULL;
	char kind, end;
	int code = open_picture(&file, path, err);

	if (code != PSR_OK)
		return code;
	if (fscanf(file, "P%c %u %u %lf%c", &kind, &w, &h, &scale, &end) != 5 || kind != 'f' || (end != '\n' && end != ' ')
	    || scale == 0)
		code = psr_fail(err, PSR_ERR_FORMAT, "%s: not a PFM picture of one channel ('Pf')", path);
	else
		code = make_pixels(&pixels, sizeof **depth, w, h, path, err);
	if (code == PSR_OK)
		code = read_rows(file, pixels, w, h, path, err);
	fclose(file);
	if (code != PSR_OK) {
		free(pixels);
		return code;
	}
	if (scale > 0)
		swap_bytes(pixels, (size_t)w * h);
	*depth = pixels;
	*width = w;
	*height = h;
	return PSR_OK;
}

int ppm_write_frame(struct outfile *file, const struct psr_frame *frame, struct psr_error *err)
{
	char header[64];
	int n = snprintf(header, sizeof header, "P6\n%u %u\n255\n", frame->width, frame->height);

	(void)err;
	outfile_write(file, header, (size_t)n);
	outfile_write(file, frame->rgb, (size_t)frame->width * frame->height * 3);
	return PSR_OK;
}

int pfm_write_frame(struct outfile *file, const struct psr_frame *frame, struct psr_error *err)
{
	char header[64];
	int n = snprintf(header, sizeof header, "Pf\n%u %u\n-1.0\n", frame->width, frame->height);

	(void)err;
	outfile_write(file, header, (size_t)n);
	for (uint32_t y = frame->height; y-- > 0;)
		outfile_write(file, frame->depth + (size_t)y * frame->width, frame->width * sizeof *frame->depth);
	return PSR_OK;
}
