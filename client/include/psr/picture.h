/* Pictures in the client's memory, and the files that they are written to. */
#ifndef PSR_PICTURE_H
#define PSR_PICTURE_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Rows top-down, packed. */
struct psr_picture {
	uint32_t width, height;
	/* Each NULL if it was not asked for; what they hold is told by PROTOCOL.md, RECT. */
	uint8_t *rgb;    /* 3 * width * height, sRGB */
	float *depth;    /* width * height, z' in world units, +inf where nothing is */
	int16_t *normal; /* 3 * width * height, world space, of length 32767; 0, 0, 0 without a sample */
	uint32_t *id;    /* width * height, instance; UINT32_MAX without a sample */
	uint8_t *weight; /* width * height, 255 * weight before the fill */
	uint64_t *words; /* width * height, bits of z' << 32 | sample id; 7F800000FFFFFFFF without a sample */
	uint8_t *block;  /* 3 * width * height, level of the model, of the depth buffer, facing; 255 without a sample */
};

/* The pixels of a plane (enum psr_wire_plane), NULL if it was not asked for. */
void *psr_picture_plane(const struct psr_picture *picture, unsigned plane);

/* The file's ending, in lower case or not, chooses the format. Colour: .png (libpng, 8 bits, with an sRGB chunk) and
 * .ppm. Depth: .pfm (little-endian, bottom-up as the format has it, +inf kept). All other endings that OpenImageIO
 * writes come from the module psr-image-oiio.so, which is loaded on the first such call: colour as 8-bit sRGB, or
 * linear where the format holds light (.exr, .hdr), depth as one channel `Z` of floats (.exr, .tif).
 *
 * The path "-" is standard output: colour as PNG, depth as PFM.
 * A regular file is written under a temporary name beside `path` and renamed: `path` is either what it was or the whole
 * new picture. Devices and pipes are written in place. Both sides are at least 1 pixel.
 * ARG: no or an unfit ending; NOT_FOUND: no such folder; UNSUPPORTED: the module is missing, or does not know the
 * ending; IO: the system refused (disk full, permission); MEMORY. */
int psr_picture_write_color(const struct psr_picture *picture, const char *path, struct psr_error *err);
int psr_picture_write_depth(const struct psr_picture *picture, const char *path, struct psr_error *err);

/* One plane, which the picture has. Every plane goes to .npy as it is: NumPy's array of (height, width) or (height,
 * width, 3) little-endian numbers, rows from the top. Otherwise colour and depth go where the calls above put them; of
 * normals and weights a picture to look at is written as if it were colour: 255 (n + 1) / 2 as red, green and blue,
 * black without a sample; grey. Ids, words and blocks take no other format than .npy. */
int psr_picture_write_plane(const struct psr_picture *picture, unsigned plane, const char *path, struct psr_error *err);

/* The colours in which n normals are written. */
void psr_picture_color_normals(uint8_t *rgb, const int16_t *normal, size_t n);

/* An animation of pictures of one size, which plays for ever, `seconds` (at most 65) a picture: .png and .apng (APNG),
 * also to "-", and what OpenImageIO writes with several pictures in a file, of which .gif moves. Errors as above.
 * add: n_frames times, in their order. close: renames the file if code is PSR_OK and all was written; returns code, or
 * what failed. NULL is fine. */
struct psr_animation;
int psr_animation_open(struct psr_animation **out, const char *path, const struct psr_picture *first, uint32_t n_frames,
                       double seconds, struct psr_error *err);
int psr_animation_add(struct psr_animation *animation, const struct psr_picture *picture, struct psr_error *err);
int psr_animation_close(struct psr_animation *animation, int code, struct psr_error *err);
int psr_animation_check(const char *path, struct psr_error *err);

/* What the calls above would refuse at once: the ending, and a missing module. */
int psr_picture_check_color(const char *path, struct psr_error *err);
int psr_picture_check_depth(const char *path, struct psr_error *err);
int psr_picture_check_plane(unsigned plane, const char *path, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
