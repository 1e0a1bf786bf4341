/* Writes planes and animations as files. Endings are compared without case; both sides of a picture are at least 1
 * pixel. "-" is standard output. A regular file holds either its old content or the whole picture; devices and pipes
 * are written in place. Errors: ARG (an ending that does not fit or is missing), NOT_FOUND (no such folder),
 * UNSUPPORTED (the image module is missing or does not know the ending), IO, MEMORY. */
#ifndef PSR_CLIENT_PICTURE_H
#define PSR_CLIENT_PICTURE_H

#include "base/outfile.h"
#include "psr/frame.h"

/* The file's ending chooses the format. Colour: .png and .ppm. Depth: .pfm. The image module psr-image-oiio.so, loaded
 * on the first such call, writes all other endings of OpenImageIO: colour as 8-bit sRGB, or linear where the format
 * holds light (.exr, .hdr); depth as one channel `Z` of floats (.exr, .tif). Standard output gets PNG and PFM. */
int psr_picture_write_color(const struct psr_frame *frame, const char *path, struct psr_error *err);
int psr_picture_write_depth(const struct psr_frame *frame, const char *path, struct psr_error *err);

/* Writes one plane, which the frame must have. Every plane can go to .npy: NumPy's array of (height, width) or (height,
 * width, 3) little-endian numbers, rows from the top; ids, words and blocks only there. Other endings are those of the
 * functions above for colour and depth. Normals become colours: 255 (n + 1) / 2 as red, green and blue, black without a
 * sample. Weights become grey. */
int psr_picture_write_plane(const struct psr_frame *frame, unsigned plane, const char *path, struct psr_error *err);

/* Paints n normals. */
void psr_picture_color_normals(uint8_t *rgb, const int16_t *normal, size_t n);

/* Finds the errors of the functions above that the path alone shows: its ending, and a missing module. */
int psr_picture_check_color(const char *path, struct psr_error *err);
int psr_picture_check_depth(const char *path, struct psr_error *err);
int psr_picture_check_plane(unsigned plane, const char *path, struct psr_error *err);

/* An animation of pictures of one size, which plays for ever and shows each picture for `seconds` (at most 65): .png
 * and .apng (APNG), also to "-", and the formats of OpenImageIO with several pictures in a file; of these only .gif
 * moves. add: call it n_frames times, in order. close: renames the file if code is PSR_OK and all was written; returns
 * code, or the error of writing. NULL is fine. */
struct psr_animation;
int psr_animation_open(struct psr_animation **out, const char *path, const struct psr_frame *first, uint32_t n_frames,
                       double seconds, struct psr_error *err);
int psr_animation_add(struct psr_animation *animation, const struct psr_frame *frame, struct psr_error *err);
int psr_animation_close(struct psr_animation *animation, int code, struct psr_error *err);
int psr_animation_check(const char *path, struct psr_error *err);

/* ---- apng.c: the caller owns the file, which stays open ---- */

struct apng;
int apng_open(struct apng **out, struct outfile *file, const struct psr_frame *first, uint32_t n_frames,
              double seconds, struct psr_error *err);
int apng_add(struct apng *apng, const struct psr_frame *frame, struct psr_error *err);
int apng_close(struct apng *apng, int is_whole, struct psr_error *err); /* not whole: writes nothing more */

#endif
