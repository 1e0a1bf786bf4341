/* How long the system lets a thread run in one turn. */
#ifndef PSR_BASE_TURNS_H
#define PSR_BASE_TURNS_H

#include <pthread.h>

/* For a thread that works little and often: gives it turns of 0.1 ms, so that it gets a processor as soon as it wakes,
 * without waiting until a drawing thread has had its turn of milliseconds. It gets no more time than before. Needs
 * Linux 6.12; older kernels ignore it. */
void turns_be_short(void);

/* For a thread that computes for long: whoever waits for its processor gets it. Linux hands over a processor to a woken
 * thread at once only if that has had less time than it is due, and asks again at the next tick, up to 4 ms later. Where
 * nobody waits it costs a system call; else what is left of the turn, so that turns should be short. */
void turns_let_others_in(void);

/* Keeps n threads apart, each on a processor of its own, if there are exactly as many as the process may use. Linux puts
 * a woken thread behind the one that wakes it where the processors have been busy, though another is idle. */
void turns_keep_apart(const pthread_t *thread, int n);

#endif
