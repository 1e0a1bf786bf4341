/* The sRGB curve: 8-bit codes to linear light and back, the same bits on every machine.
 *
 * linear = c / 12.92 for c <= 0.04045, else ((c + 0.055) / 1.055)^2.4, with c = code / 255. Both directions are tables
 * of constants computed to 50 digits. */
#ifndef PSR_BASE_SRGB_H
#define PSR_BASE_SRGB_H

#include <stdint.h>

extern const float psr_srgb_to_linear[256]; /* correctly rounded; 0 -> 0, 255 -> 1 */

/* Returns the code whose light is nearest to `linear`, halves up; clamps to 0..255; NaN gives 0. */
uint8_t psr_linear_to_srgb(float linear);

/* Returns a table of 65536 codes: of i / 65535. The first call makes it, in half a millisecond, for good. Any
 * thread. */
const uint8_t *psr_srgb_of_16_bits(void);

#endif
