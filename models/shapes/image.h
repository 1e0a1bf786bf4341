/* Pictures that generators wrap around their shapes, and PNG: stored, not compressed, so that no version of zlib
 * changes a byte. */
#ifndef MODELS_IMAGE_H
#define MODELS_IMAGE_H

#include <stddef.h>
#include <stdint.h>

/* All return a size x size RGB picture that repeats without a seam, which the caller frees; NULL without memory. size
 * is a power of two, 16 to 1024; colours are 0xRRGGBB. */
uint8_t *image_wood(uint32_t size, uint32_t dark, uint32_t light, uint64_t seed); /* the grain runs along v */
uint8_t *image_checker(uint32_t size, uint32_t a, uint32_t b);                    /* 2 x 2 squares */
uint8_t *image_planks(uint32_t size, uint32_t wood, uint32_t seam, uint64_t seed); /* four planks along v */
/* A leaf from its stalk (v = 0) to its tip (v = 1), its midrib at u = 1/2. */
uint8_t *image_leaf(uint32_t size, uint32_t blade, uint32_t vein);

/* Returns the bytes of the PNG of such a picture; size <= 1024. */
size_t image_png_bytes(uint32_t size);

/* Writes them. */
void image_png(uint8_t *out, uint32_t size, const uint8_t *rgb);

#endif
