/* APNG, version 1.0: a PNG whose IDAT is the first frame, with fdAT chunks for the others. libpng compresses each frame
 * as a picture of its own; apng.c takes the data out of that. */
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include "base/png.h"
#include "picture.h"

#define PNG_SIGNATURE 8
#define MILLISECONDS 1000

struct apng {
	png_structp png;
	png_infop info;
	struct psr_error why; /* of libpng */
	uint32_t n_written, sequence;
	uint16_t delay_ms;
	uint8_t *data;        /* a frame as a PNG */
	size_t n_data, capacity;
};

static void put_u32(uint8_t *to, uint32_t v)
{
	for (int i = 0; i < 4; i++)
		to[i] = (uint8_t)(v >> (24 - 8 * i));
}

static uint32_t get_u32(const uint8_t *from)
{
	return (uint32_t)from[0] << 24 | (uint32_t)from[1] << 16 | (uint32_t)from[2] << 8 | from[3];
}

int apng_open(struct apng **out, struct outfile *file, const struct psr_frame *first, uint32_t n_frames,
              double seconds, struct psr_error *err)
{
	struct apng *apng = calloc(1, sizeof *apng);
	uint8_t control[8];

	if (apng != NULL)
		apng->png = png_writer_create(&apng->info, &apng->why);
	if (apng == NULL || apng->png == NULL) {
		apng_close(apng, 0, err);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to write an animation");
	}
	apng->delay_ms = (uint16_t)(seconds * MILLISECONDS + 0.5);
	put_u32(control, n_frames);
	put_u32(control + 4, 0); /* plays for ever */
	if (setjmp(png_jmpbuf(apng->png)) != 0) {
		int code = psr_fail(err, apng->why.code, "%s", apng->why.text);

		apng_close(apng, 0, NULL);
		return code;
	}
	png_writer_begin(apng->png, apng->info, file, png_write_outfile, first);
	png_write_chunk(apng->png, (png_const_bytep)"acTL", control, sizeof control);
	*out = apng;
	return PSR_OK;
}

/* ---- one frame ---- */

static void on_frame_write(png_structp png, png_bytep data, size_t n)
{
	struct apng *apng = png_get_io_ptr(png);

	if (apng->n_data + n > apng->capacity) {
		size_t capacity = 2 * (apng->n_data + n);
		uint8_t *grown = realloc(apng->data, capacity);

		if (grown == NULL)
			png_error(png, "no memory");
		apng->data = grown;
		apng->capacity = capacity;
	}
	memcpy(apng->data + apng->n_data, data, n);
	apng->n_data += n;
}

static void write_control(struct apng *apng, const struct psr_frame *picture)
{
	uint8_t control[26] = { 0 }; /* the frame lies at 0,0 and replaces the one before */

	put_u32(control, apng->sequence++);
	put_u32(control + 4, picture->width);
	put_u32(control + 8, picture->height);
	control[20] = (uint8_t)(apng->delay_ms >> 8);
	control[21] = (uint8_t)apng->delay_ms;
	control[22] = MILLISECONDS >> 8;
	control[23] = MILLISECONDS & 255;
	png_write_chunk(apng->png, (png_const_bytep)"fcTL", control, sizeof control);
}

/* Writes a chunk of the frame's PNG. A later frame's chunk has a number in front of its data, over the old length and
 * type. */
static void write_data(struct apng *apng, uint8_t *data, uint32_t n)
{
	if (apng->n_written == 0) {
		png_write_chunk(apng->png, (png_const_bytep)"IDAT", data, n);
		return;
	}
	put_u32(data - 4, apng->sequence++);
	png_write_chunk(apng->png, (png_const_bytep)"fdAT", data - 4, n + 4);
}

int apng_add(struct apng *apng, const struct psr_frame *picture, struct psr_error *err)
{
	int code;

	apng->n_data = 0;
	code = png_encode(apng, on_frame_write, picture, err);
	if (code != PSR_OK)
		return code;
	if (setjmp(png_jmpbuf(apng->png)) != 0)
		return psr_fail(err, apng->why.code, "%s", apng->why.text);
	write_control(apng, picture);
	for (size_t at = PNG_SIGNATURE; at + 12 <= apng->n_data;) {
		uint32_t n = get_u32(apng->data + at);

		if (memcmp(apng->data + at + 4, "IDAT", 4) == 0)
			write_data(apng, apng->data + at + 8, n);
		at += (size_t)n + 12;
	}
	apng->n_written++;
	return PSR_OK;
}

static int end_file(struct apng *apng, struct psr_error *err)
{
	if (setjmp(png_jmpbuf(apng->png)) != 0)
		return psr_fail(err, apng->why.code, "%s", apng->why.text);
	png_write_chunk(apng->png, (png_const_bytep)"IEND", NULL, 0);
	return PSR_OK;
}

int apng_close(struct apng *apng, int is_whole, struct psr_error *err)
{
	int code;

	if (apng == NULL)
		return PSR_OK;
	code = is_whole ? end_file(apng, err) : PSR_OK;
	if (apng->png != NULL)
		png_destroy_write_struct(&apng->png, &apng->info);
	free(apng->data);
	free(apng);
	return code;
}
