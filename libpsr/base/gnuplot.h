/* Plots by gnuplot, a program that may be missing. */
#ifndef PSR_BASE_GNUPLOT_H
#define PSR_BASE_GNUPLOT_H

#include <stdio.h>
#include "psr/error.h"

/* Starts it; what is written to *out is its program. gnuplot_close() is due after success. IO. */
int gnuplot_open(FILE **out, struct psr_error *err);

/* In quotes, as gnuplot reads them: within '...' a quote is written twice. */
void gnuplot_quote(FILE *gnuplot, const char *text);

/* Waits for its end. NOT_FOUND: it is not installed; IO: it failed, and has said why on standard error. */
int gnuplot_close(FILE *gnuplot, struct psr_error *err);

#endif
