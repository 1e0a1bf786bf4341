/* Part of the benchmark of views: reading a frame, the client alone. */
#ifndef PSR_BENCH_VIEW_READING_H
#define PSR_BENCH_VIEW_READING_H

#include <sys/types.h>
#include "psr/view.h"

/* psrd: the address (unix:PATH) of the one with this pid, which is stopped meanwhile. Prints a line. */
void view_reading(const char *psrd, pid_t pid, const char *model, const struct psr_camera *camera);

#endif
