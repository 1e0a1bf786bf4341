/* Parts of pages that stand alone: texts and pictures. Errors of the stream stay with it. */
#ifndef PSR_BASE_HTML_H
#define PSR_BASE_HTML_H

#include <stdint.h>
#include <stdio.h>
#include "psr/error.h"
#include "psr/frame.h"

/* Writes a text for XML and HTML; what is not printable becomes a ?. */
void html_escape(FILE *to, const char *text);

/* Writes n bytes as the end of a data: URI that says ";base64,". */
void html_base64(FILE *to, const uint8_t *bytes, size_t n);

/* Writes an <img> of the frame's colours, `factor` times as large; its data: URI is a PNG. MEMORY. */
int html_image(FILE *to, const struct psr_frame *picture, uint32_t factor, struct psr_error *err);

#endif
