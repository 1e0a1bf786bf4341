/* libpng for frames of 8-bit sRGB. */
#ifndef PSR_BASE_PNG_H
#define PSR_BASE_PNG_H

#include <png.h>
#include "outfile.h"
#include "psr/frame.h"

/* Errors go to *why, which must outlive the writer, and jump to the caller's setjmp(png_jmpbuf()). NULL: no memory. */
png_structp png_writer_create(png_infop *info, struct psr_error *why);

/* Writes signature and header of a picture of the frame's size; `write` gets the bytes, with png_get_io_ptr() ==
 * sink. */
void png_writer_begin(png_structp png, png_infop info, void *sink, png_rw_ptr write, const struct psr_frame *frame);

void png_write_outfile(png_structp png, png_bytep data, size_t n); /* a png_rw_ptr; its sink is a struct outfile */

/* Writes a whole PNG of the colours. MEMORY, IO. */
int png_encode(void *sink, png_rw_ptr write, const struct psr_frame *frame, struct psr_error *err);
int png_write_frame(struct outfile *file, const struct psr_frame *frame, struct psr_error *err);

/* Reads the colours of a PNG without alpha, as 8-bit sRGB, into a new frame (psr_frame_free()). NOT_FOUND, IO, FORMAT,
 * UNSUPPORTED, LIMIT, MEMORY; after a failure there is nothing to free. */
int png_read_frame(struct psr_frame *frame, const char *path, struct psr_error *err);

#endif
