/* A small font for words and numbers in pictures: digits, lower-case letters, and + - . */
#ifndef PSR_CLIENT_OUTPUT_FONT_H
#define PSR_CLIENT_OUTPUT_FONT_H

#include <stdint.h>

#define FONT_COLUMNS 5
#define FONT_ROWS 8     /* the last one is below the base line */
#define FONT_ADVANCE 6  /* from a character to the next */

/* Returns FONT_ROWS rows from the top; of each, bit FONT_COLUMNS - 1 is the leftmost pixel. Other characters are
 * blank. */
const uint8_t *font_glyph(char c);

#endif
