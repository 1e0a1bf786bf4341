/* Colours that tell a number of each point instead of its own colour: of what a laser scan measured, or of its
 * height. */
#ifndef PSR_TINT_H
#define PSR_TINT_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* INTENSITY: the ramp, from psr_scan.low to high. CLASS: psr_class_color(). HEIGHT: the ramp, from the bottom to the
 * top of the model's box along its way up. RETURN: psr_order_color(). */
enum psr_color_by { PSR_COLOR_OWN, PSR_COLOR_INTENSITY, PSR_COLOR_CLASS, PSR_COLOR_HEIGHT, PSR_COLOR_RETURN };

/* Which one of the returns of its pulse a point is: the only one, the first, one between, the last. */
enum psr_return_order { PSR_RETURN_ONLY, PSR_RETURN_FIRST, PSR_RETURN_BETWEEN, PSR_RETURN_LAST, PSR_N_RETURN_ORDERS };

/* What points have of a laser scan. */
struct psr_scan {
	int has_intensity, has_class, has_return;
	uint16_t low, high;  /* the least and the greatest intensity but for a fiftieth of all points at either end */
	uint64_t classes[4]; /* bit c % 64 of [c / 64]: a point has class c */
	unsigned orders;     /* bit o: a point is of order o */
};

#define PSR_RAMP 256 /* colours of the ramp */

/* Sets the sRGB of step 0..PSR_RAMP - 1 of a ramp that rises evenly in lightness, from dark violet to yellow (viridis
 * of Smith and van der Walt, through nine of its colours). */
void psr_ramp_color(uint8_t rgb[3], unsigned step);

/* The classes of ASPRS LAS 1.4. Names are "reserved" or "user" where it leaves them open; never NULL. */
void psr_class_color(uint8_t rgb[3], unsigned class_code);
const char *psr_class_name(unsigned class_code);

void psr_order_color(uint8_t rgb[3], enum psr_return_order order);
const char *psr_order_name(enum psr_return_order order);

/* Of the byte that octrees keep: the number of the return in its low 4 bits, of how many in its high 4. */
static inline enum psr_return_order psr_return_order(uint8_t returns)
{
	const unsigned number = returns & 15, n = returns >> 4;

	if (n <= 1)
		return PSR_RETURN_ONLY;
	return number <= 1 ? PSR_RETURN_FIRST : number < n ? PSR_RETURN_BETWEEN : PSR_RETURN_LAST;
}

#ifdef __cplusplus
}
#endif
#endif
