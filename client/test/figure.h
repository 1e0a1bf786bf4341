/* A picture that failed, on the page: picture, reference and difference side by side, and their worst part enlarged. */
#ifndef PSR_CLIENT_TEST_FIGURE_H
#define PSR_CLIENT_TEST_FIGURE_H

#include "compare/compare.h"
#include "psr/frame.h"

/* Makes a fragment of HTML of malloc(), whose pictures are data: URIs. reference: colours of the picture's size, depth:
 * the reference's depths; either may be NULL, and then its difference is left out. box: where it is worst; width 0: it
 * is not enlarged. MEMORY. */
int figure_make(char **html, const struct psr_frame *picture, const uint8_t *reference, const float *depth,
                const struct compare_box *box, struct psr_error *err);

#endif
