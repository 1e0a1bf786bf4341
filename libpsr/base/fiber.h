/* A fiber: a function with a stack of its own that can leave its thread in the middle and go on later, on any thread. A
 * switch costs half a microsecond; waking a thread costs ten, and then waits until the system gives it a processor.
 *
 * Between two switches a fiber may use thread-local variables; it must not keep their addresses across a switch. */
#ifndef PSR_BASE_FIBER_H
#define PSR_BASE_FIBER_H

struct fiber;

int fiber_create(struct fiber **out); /* MEMORY */
void fiber_destroy(struct fiber *fiber); /* runs nothing; NULL is fine */

/* Sets the function that the fiber runs when it is next entered; its last function must have returned. It runs with the
 * default rounding and with denormal numbers, whatever its thread has. */
void fiber_set(struct fiber *fiber, void (*fn)(void *userdata), void *userdata);

/* Runs the fiber on the caller's thread, and on its own stack. Returns 1 when the fiber leaves, 0 when its function
 * returns. */
int fiber_enter(struct fiber *fiber);

/* Leaves the fiber: fiber_enter() returns. This function returns when the fiber is entered again. */
void fiber_leave(struct fiber *fiber);

#endif
