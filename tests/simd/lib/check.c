#define _GNU_SOURCE
#include <assert.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/maths.h"
#include "base/random.h"
#include "check.h"

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
#define TRIALS_SHARE 8 /* sanitizers make each trial as many times slower */
#else
#define TRIALS_SHARE 1
#endif
#define CANARY 0xa5
#define MOST_SPARE 512
#define MOST_SPARE_BYTES ((size_t)1 << 20)
#define BENCH_ROUNDS 8
#define ROUND_NS 2e7

static const struct check *current; /* for what a fault prints */
static const char *current_claim;

uint64_t check_u64(struct check *c)
{
	return random_next(&c->random);
}

uint32_t check_u32(struct check *c)
{
	return (uint32_t)(check_u64(c) >> 32);
}

uint32_t check_below(struct check *c, uint32_t n)
{
	return random_below(&c->random, n);
}

int check_one_in(struct check *c, uint32_t n)
{
	return check_below(c, n) == 0;
}

double check_real(struct check *c, double low, double high)
{
	return random_in(&c->random, low, high);
}

float check_float(struct check *c)
{
	static const uint32_t special[] = {
		0x00000000, 0x00000001, 0x00000100, 0x007fffff, 0x00800000, 0x3f7fffff, 0x3f800000, 0x3f800001,
		0x46800000, 0x477fff00, 0x4b000000, 0x4effffff, 0x4f000000, 0x5f000000, 0x7e800000, 0x7f7fffff,
		0x7f800000, 0x7f800001, 0x7fc00000, 0x7fffffff,
	};
	switch (check_below(c, 4)) {
	case 0:
		return psr_float_from_bits(special[check_below(c, sizeof special / sizeof special[0])] |
		                           (check_u32(c) & 1u << 31));
	case 1:
		return psr_float_from_bits(check_u32(c));
	default:
		return (float)check_real(c, -2, 2);
	}
}

float check_plain_or_any(struct check *c, int is_any, double low, double high)
{
	return is_any && check_one_in(c, 5) ? check_float(c) : (float)check_real(c, low, high);
}

/* Maps of trials that have ended: making one with its guard pages takes the system longer than most trials take. */
static struct spare {
	uint8_t *map;
	size_t size;
} spare[MOST_SPARE];
static size_t n_spare;

/* Whole pages, of which nobody may touch the first and the last. */
static uint8_t *take_map(size_t size)
{
	const size_t page = (size_t)sysconf(_SC_PAGESIZE);
	uint8_t *map;

	for (size_t i = n_spare; i-- > 0;)
		if (spare[i].size == size) {
			map = spare[i].map;
			spare[i] = spare[--n_spare];
			return map;
		}
	map = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
	assert(map != MAP_FAILED);
	mprotect(map, page, PROT_NONE);
	mprotect(map + size - page, page, PROT_NONE);
	return map;
}

static void keep_map(uint8_t *map, size_t size)
{
	if (n_spare < MOST_SPARE && size <= MOST_SPARE_BYTES)
		spare[n_spare++] = (struct spare){ map, size };
	else
		munmap(map, size);
}

static void *add_buffer(struct check *c, size_t n, size_t size, int is_output)
{
	const size_t page = (size_t)sysconf(_SC_PAGESIZE);
	assert(c->n_buffers < CHECK_BUFFERS && !c->is_started);
	struct check_buffer *b = &c->buffer[c->n_buffers++];
	b->size = n * size;
	b->map_size = (b->size + page - 1) / page * page + 2 * page;
	b->map = take_map(b->map_size);
	memset(b->map + page, CANARY, b->map_size - 2 * page);
	b->data = c->trial & 1 ? b->map + page : b->map + b->map_size - page - b->size;
	for (size_t i = 0; i < b->size; i += 8) {
		const uint64_t bytes = check_u64(c);
		memcpy(b->data + i, &bytes, b->size - i < 8 ? b->size - i : 8);
	}
	b->before = is_output ? malloc(b->size + 1) : NULL;
	b->expected = is_output ? malloc(b->size + 1) : NULL;
	assert(!is_output || (b->before && b->expected));
	return b->data;
}

void *check_in(struct check *c, size_t n, size_t size)
{
	return add_buffer(c, n, size, 0);
}

void *check_out(struct check *c, size_t n, size_t size)
{
	return add_buffer(c, n, size, 1);
}

static void release(struct check *c)
{
	for (int i = 0; i < c->n_buffers; i++) {
		keep_map(c->buffer[i].map, c->buffer[i].map_size);
		free(c->buffer[i].before);
		free(c->buffer[i].expected);
	}
	c->n_buffers = 0;
}

static void fail(struct check *c, const char *what, int buffer, size_t at, unsigned got, unsigned expected)
{
	if (!c->is_failed)
		snprintf(c->why, sizeof c->why, "trial %d, %s: buffer %d, byte %zu of %zu: %s (%02x, C has %02x)", c->trial,
		         psr_isa_name(c->isa), buffer, at, c->buffer[buffer].size, what, got, expected);
	c->is_failed = 1;
}

static void check_canaries(struct check *c, int i)
{
	const struct check_buffer *b = &c->buffer[i];
	const size_t page = (size_t)sysconf(_SC_PAGESIZE);
	const uint8_t *begin = b->map + page, *end = b->map + b->map_size - page, *rest = b->data + b->size;
	const uint8_t *first = b->data > begin ? begin : rest, *last = b->data > begin ? b->data : end;
	/* They are all alike if each is like the next. */
	if (last > first && (*first != CANARY || memcmp(first, first + 1, (size_t)(last - first) - 1) != 0))
		for (const uint8_t *at = first; at < last; at++)
			if (*at != CANARY)
				fail(c, "written outside of the buffer", i, (size_t)(at - b->data), *at, CANARY);
}

static void compare(struct check *c)
{
	for (int i = 0; i < c->n_buffers; i++) {
		const struct check_buffer *b = &c->buffer[i];
		check_canaries(c, i);
		if (!b->expected)
			continue;
		if (c->isa == PSR_ISA_C)
			memcpy(b->expected, b->data, b->size);
		if (c->is_failed || memcmp(b->data, b->expected, b->size) == 0)
			continue;
		for (size_t k = 0; k < b->size && !c->is_failed; k++)
			if (b->data[k] != b->expected[k])
				fail(c, "differs", i, k, b->data[k], b->expected[k]);
	}
	if (c->isa == PSR_ISA_C)
		c->expected = c->result;
	if (c->result != c->expected && !c->is_failed) {
		c->is_failed = 1;
		snprintf(c->why, sizeof c->why, "trial %d, %s: the result is %llu, C has %llu", c->trial, psr_isa_name(c->isa),
		         (unsigned long long)c->result, (unsigned long long)c->expected);
	}
}

/* The next variant of the machine, those of a round one after the other. */
static int advance(struct check *c)
{
	int isa = c->simd ? (int)c->isa + 1 : 0;
	c->spent_ns = 0;
	while (isa < PSR_N_ISAS && !simd_of((enum psr_isa)isa))
		isa++;
	if (isa == PSR_N_ISAS) {
		if (!c->is_bench || ++c->round == BENCH_ROUNDS)
			return 0;
		isa = PSR_ISA_C;
	}
	c->isa = (enum psr_isa)isa;
	c->simd = simd_of(c->isa);
	return 1;
}

int check_next(struct check *c)
{
	const uint64_t ended = clock_ns();
	if (!c->is_started) {
		for (int i = 0; i < c->n_buffers; i++)
			if (c->buffer[i].before)
				memcpy(c->buffer[i].before, c->buffer[i].data, c->buffer[i].size);
		c->is_started = 1;
		advance(c);
	} else {
		const double ns = (double)(ended - c->started_ns);
		c->spent_ns += ns;
		c->best_ns[c->isa] = ns < c->best_ns[c->isa] ? ns : c->best_ns[c->isa];
		if (!c->is_bench)
			compare(c);
		if (c->is_failed || ((!c->is_bench || c->spent_ns >= ROUND_NS) && !advance(c)))
			return 0;
		for (int i = 0; i < c->n_buffers; i++)
			if (c->buffer[i].before)
				memcpy(c->buffer[i].data, c->buffer[i].before, c->buffer[i].size);
	}
	c->result = 0;
	c->started_ns = clock_ns();
	return 1;
}

void check_result(struct check *c, uint64_t result)
{
	c->result = result;
}

void check_units(struct check *c, uint64_t n)
{
	c->units = (double)n;
}

void check_settle(float *value, size_t n)
{
	for (size_t i = 0; i < n; i++)
		if (isnan(value[i]))
			value[i] = psr_float_from_bits(0x7fc00000);
}

static void on_fault(int signal)
{
	printf("not ok - %s\n# trial %d, %s: signal %d: a buffer's guard page was touched, or worse\n", current_claim,
	       current->trial, psr_isa_name(current->isa), signal);
	fflush(stdout);
	_exit(1);
}

static void begin(struct check *c, int trial, int is_bench)
{
	memset(c, 0, sizeof *c);
	c->trial = trial;
	c->is_bench = is_bench;
	c->random = (uint64_t)trial;
	for (int i = 0; i < PSR_N_ISAS; i++)
		c->best_ns[i] = INFINITY;
}

static int check_one(struct check *c, const struct check_test *test, int number)
{
	for (int trial = 0; trial * TRIALS_SHARE < test->n_trials; trial++) {
		begin(c, trial, 0);
		test->run(c);
		release(c);
		if (c->is_failed)
			break;
	}
	printf("%s %d - %s: every variant as C\n", c->is_failed ? "not ok" : "ok", number, test->claim);
	if (c->is_failed)
		printf("# %s\n", c->why);
	fflush(stdout);
	return !c->is_failed;
}

/* What reading the clock twice takes. */
static double clock_cost(void)
{
	double best = INFINITY;
	for (int i = 0; i < 1000; i++) {
		const uint64_t start = clock_ns();
		const double ns = (double)(clock_ns() - start);
		best = ns < best ? ns : best;
	}
	return best;
}

static void bench_one(struct check *c, const struct check_test *test)
{
	const double clock = clock_cost();
	begin(c, 1, 1);
	test->run(c);
	release(c);
	printf("%-39s", test->claim);
	for (int i = 0; i < PSR_N_ISAS; i++) {
		const double ns = (c->best_ns[i] - clock) / c->units;
		if (c->best_ns[i] == INFINITY)
			continue;
		printf("  %s %6.3f", psr_isa_name((enum psr_isa)i), ns);
		if (i != PSR_ISA_C)
			printf(" %4.1fx", (c->best_ns[PSR_ISA_C] - clock) / (c->best_ns[i] - clock));
	}
	printf("  ns a %s\n", test->unit);
}

int check_main(int argc, char **argv, const struct check_test *tests, size_t n_tests)
{
	static struct check c;
	const char *wanted = getenv("PSR_BENCH");
	const int is_bench = (argc > 1 && strcmp(argv[1], "--bench") == 0) || (wanted && strcmp(wanted, "1") == 0);
	int number = 0, n_failed = 0;

	current = &c;
	signal(SIGSEGV, on_fault);
	signal(SIGBUS, on_fault);
	for (size_t i = 0; i < n_tests; i++) {
		current_claim = tests[i].claim;
		if (is_bench && tests[i].unit)
			bench_one(&c, &tests[i]);
		if (!is_bench && tests[i].n_trials)
			n_failed += !check_one(&c, &tests[i], ++number);
	}
	if (!is_bench) {
		for (int i = 0; i < PSR_N_ISAS; i++)
			if (!simd_of((enum psr_isa)i))
				printf("ok %d - %s # SKIP this machine has no %s\n", ++number, argv[0], psr_isa_name((enum psr_isa)i));
		printf("1..%d\n", number);
	}
	return n_failed != 0;
}
