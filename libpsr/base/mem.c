#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>
#include "mem.h"

#define HUGE_PAGE ((size_t)2 << 20)

void *psr_alloc_array(size_t n, size_t size)
{
	size_t n_bytes;

	if (__builtin_mul_overflow(n, size, &n_bytes) || n_bytes > PTRDIFF_MAX - PSR_ALIGNMENT)
		return NULL;
	n_bytes = (n_bytes + PSR_ALIGNMENT - 1) / PSR_ALIGNMENT * PSR_ALIGNMENT;
	return aligned_alloc(PSR_ALIGNMENT, n_bytes != 0 ? n_bytes : PSR_ALIGNMENT);
}

void psr_free(void *memory)
{
	free(memory);
}

static size_t whole_pages(size_t n_bytes)
{
	size_t page = (size_t)sysconf(_SC_PAGESIZE);

	return (n_bytes + page - 1) / page * page;
}

void *psr_alloc_huge(size_t n_bytes)
{
	size_t slack = n_bytes >= HUGE_PAGE ? HUGE_PAGE : 0, head, used, left;
	char *memory;

	if (n_bytes == 0 || n_bytes > PTRDIFF_MAX - slack)
		return NULL;
	memory = mmap(NULL, n_bytes + slack, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
	if (memory == MAP_FAILED)
		return NULL;
	if (slack == 0)
		return memory;
	head = (HUGE_PAGE - (uintptr_t)memory % HUGE_PAGE) % HUGE_PAGE;
	if (head != 0)
		munmap(memory, head);
	memory += head;
	used = whole_pages(n_bytes);
	left = whole_pages(n_bytes + slack) - head;
	if (left > used)
		munmap(memory + used, left - used);
	/* May fail without harm: ordinary pages serve as well. */
	(void)madvise(memory, n_bytes, MADV_HUGEPAGE);
	return memory;
}

void psr_free_huge(void *memory, size_t n_bytes)
{
	int failed;

	if (memory == NULL)
		return;
	failed = munmap(memory, n_bytes);
	assert(failed == 0);
	(void)failed;
}

static void *alloc_pages(size_t n_bytes)
{
	void *memory;

	if (n_bytes == 0 || n_bytes > PTRDIFF_MAX)
		return NULL;
	memory = mmap(NULL, n_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
	if (memory == MAP_FAILED)
		return NULL;
	/* May fail without harm: a system without huge pages does not know it. */
	(void)madvise(memory, n_bytes, MADV_NOHUGEPAGE);
	return memory;
}

static void *grow(void *memory, size_t *capacity, size_t n_bytes, void *(*alloc)(size_t n_bytes))
{
	if (memory != NULL && n_bytes <= *capacity)
		return memory;
	psr_free_huge(memory, *capacity);
	memory = alloc(n_bytes);
	*capacity = memory != NULL ? n_bytes : 0;
	return memory;
}

void *psr_grow_huge(void *memory, size_t *capacity, size_t n_bytes)
{
	return grow(memory, capacity, n_bytes, psr_alloc_huge);
}

void *psr_grow_by_pages(void *memory, size_t *capacity, size_t n_bytes)
{
	return grow(memory, capacity, n_bytes, alloc_pages);
}
