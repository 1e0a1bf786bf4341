#include <assert.h>
#include <fenv.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <ucontext.h>
#include <unistd.h>
#include "fiber.h"
#include "psr/error.h"

/* The sanitizers follow stacks, and must be told. */
#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/asan_interface.h>
#endif
#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

/* Pages are taken as they are touched. Below the stack lies one that nobody may touch. */
#define STACK_BYTES ((size_t)4 << 20)

struct fiber {
	ucontext_t inside, outside;
	unsigned char *stack; /* STACK_BYTES and the guard before them */
	size_t guard_bytes;
	void (*fn)(void *userdata);
	void *userdata;
	int has_context;
	int is_running; /* its function has not returned */
#ifdef __SANITIZE_ADDRESS__
	const void *outer_stack;
	size_t outer_bytes;
#endif
#ifdef __SANITIZE_THREAD__
	void *own, *outer;
#endif
};

static void arrive(struct fiber *fiber, void *saved)
{
#ifdef __SANITIZE_ADDRESS__
	__sanitizer_finish_switch_fiber(saved, &fiber->outer_stack, &fiber->outer_bytes);
#else
	(void)fiber;
	(void)saved;
#endif
}

static void go_out(struct fiber *fiber)
{
	void *saved = NULL;

#ifdef __SANITIZE_ADDRESS__
	__sanitizer_start_switch_fiber(&saved, fiber->outer_stack, fiber->outer_bytes);
#endif
#ifdef __SANITIZE_THREAD__
	__tsan_switch_to_fiber(fiber->outer, 0);
#endif
	swapcontext(&fiber->inside, &fiber->outside);
	arrive(fiber, saved);
}

/* makecontext() passes ints. */
static void begin(unsigned high, unsigned low)
{
	struct fiber *fiber = (struct fiber *)((uintptr_t)high << 16 << 16 | low);

	arrive(fiber, NULL);
	for (;;) {
		fesetenv(FE_DFL_ENV);
		fiber->fn(fiber->userdata);
		fiber->is_running = 0;
		go_out(fiber);
	}
}

/* On the thread that enters it first: its signals are the fiber's. */
static void make_context(struct fiber *fiber)
{
	const uintptr_t address = (uintptr_t)fiber;

	getcontext(&fiber->inside);
	fiber->inside.uc_stack.ss_sp = fiber->stack + fiber->guard_bytes;
	fiber->inside.uc_stack.ss_size = STACK_BYTES;
	fiber->inside.uc_link = NULL;
	makecontext(&fiber->inside, (void (*)(void))begin, 2, (unsigned)(address >> 16 >> 16), (unsigned)address);
	fiber->has_context = 1;
}

int fiber_create(struct fiber **out)
{
	struct fiber *fiber = calloc(1, sizeof *fiber);

	if (fiber == NULL)
		return PSR_ERR_MEMORY;
	fiber->guard_bytes = (size_t)sysconf(_SC_PAGESIZE);
	fiber->stack = mmap(NULL, fiber->guard_bytes + STACK_BYTES, PROT_READ | PROT_WRITE,
	                    MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK, -1, 0);
	if (fiber->stack == MAP_FAILED) {
		free(fiber);
		return PSR_ERR_MEMORY;
	}
	if (mprotect(fiber->stack, fiber->guard_bytes, PROT_NONE) != 0) {
		munmap(fiber->stack, fiber->guard_bytes + STACK_BYTES);
		free(fiber);
		return PSR_ERR_MEMORY;
	}
#ifdef __SANITIZE_THREAD__
	fiber->own = __tsan_create_fiber(0);
#endif
	*out = fiber;
	return PSR_OK;
}

void fiber_destroy(struct fiber *fiber)
{
	if (fiber == NULL)
		return;
	assert(!fiber->is_running);
#ifdef __SANITIZE_THREAD__
	__tsan_destroy_fiber(fiber->own);
#endif
#ifdef __SANITIZE_ADDRESS__
	__asan_unpoison_memory_region(fiber->stack, fiber->guard_bytes + STACK_BYTES);
#endif
	munmap(fiber->stack, fiber->guard_bytes + STACK_BYTES);
	free(fiber);
}

void fiber_set(struct fiber *fiber, void (*fn)(void *userdata), void *userdata)
{
	assert(!fiber->is_running);
	fiber->fn = fn;
	fiber->userdata = userdata;
	fiber->is_running = 1;
}

int fiber_enter(struct fiber *fiber)
{
	assert(fiber->is_running);
	if (!fiber->has_context)
		make_context(fiber);
#ifdef __SANITIZE_ADDRESS__
	void *saved = NULL;

	__sanitizer_start_switch_fiber(&saved, fiber->stack + fiber->guard_bytes, STACK_BYTES);
#endif
#ifdef __SANITIZE_THREAD__
	fiber->outer = __tsan_get_current_fiber();
	__tsan_switch_to_fiber(fiber->own, 0);
#endif
	swapcontext(&fiber->outside, &fiber->inside);
#ifdef __SANITIZE_ADDRESS__
	__sanitizer_finish_switch_fiber(saved, NULL, NULL);
#endif
	return fiber->is_running;
}

void fiber_leave(struct fiber *fiber)
{
	go_out(fiber);
}
