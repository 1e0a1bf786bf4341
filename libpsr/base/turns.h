/* How long the system lets a thread run in one turn. */
#ifndef PSR_BASE_TURNS_H
#define PSR_BASE_TURNS_H

/* For a thread that works little and often: gives it turns of 0.1 ms, so that it gets a processor as soon as it wakes,
 * without waiting until a drawing thread has had its turn of milliseconds. It gets no more time than before. Needs
 * Linux 6.12; older kernels ignore it. */
void turns_be_short(void);

#endif
