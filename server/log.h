/* The daemon's log: lines on standard error, debugging lines only with --verbose. Any thread may log, and none waits
 * for a reader: a line that a pipe, socket or terminal does not take at once is lost and counted. Before the next line
 * that is taken, the log says how many were lost. */
#ifndef PSRD_LOG_H
#define PSRD_LOG_H

#include <stdint.h>

void log_set_verbose(int verbose); /* call it before any other thread runs */
void log_info(const char *format, ...) __attribute__((format(printf, 1, 2))); /* with --verbose */
void log_warn(const char *format, ...) __attribute__((format(printf, 1, 2)));
uint64_t log_lost(void); /* lines lost since the start */

#endif
