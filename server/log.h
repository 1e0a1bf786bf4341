/* The daemon's log: lines on standard error, the chatty ones only with --verbose. Any thread. */
#ifndef PSRD_LOG_H
#define PSRD_LOG_H

void log_set_verbose(int verbose); /* before any other thread runs */
void log_info(const char *format, ...) __attribute__((format(printf, 1, 2))); /* with --verbose */
void log_warn(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
