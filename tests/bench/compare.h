/* Whether two renderers drew the same picture. */
#ifndef TESTS_BENCH_COMPARE_H
#define TESTS_BENCH_COMPARE_H

#include <stdint.h>

struct compare {
	double overlap;    /* pixels that are drawn in both, of those drawn in either; what is not black is drawn */
	double difference; /* mean of the channel that differs most, codes, where both are drawn */
};
struct compare compare_pictures(const uint8_t *a, const uint8_t *b, uint32_t width, uint32_t height);

/* Part of the picture that is drawn. */
double compare_covered(const uint8_t *rgb, uint32_t width, uint32_t height);

void compare_save(const char *path, const uint8_t *rgb, uint32_t width, uint32_t height);

#endif
