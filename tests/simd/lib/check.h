/* Every variant of a kernel against the C reference: the same bytes, the same result, and nothing touched outside of
 * the buffers that the contract gives it. The same program times the variants (--bench, or PSR_BENCH=1).
 *
 * A test makes random inputs and calls the kernel in a loop, once for each variant that the machine has:
 *
 *	static void random_rows(struct check *c)
 *	{
 *		const uint32_t n = 1 + check_below(c, 500);
 *		float *in = check_in(c, n, sizeof *in), *out = check_out(c, n, sizeof *out);
 *		for (uint32_t i = 0; i < n; i++)
 *			in[i] = check_float(c);
 *		while (check_next(c))
 *			check_result(c, c->simd->rows(in, n, out));
 *	}
 *
 * The C reference runs first. Before each variant the outputs are again what the test wrote into them. */
#ifndef TESTS_SIMD_CHECK_H
#define TESTS_SIMD_CHECK_H

#include <stddef.h>
#include <stdint.h>
#include "simd/simd.h"

#define CHECK_BUFFERS 40

struct check_buffer {
	uint8_t *data, *map, *before, *expected; /* before, expected: of outputs */
	size_t size, map_size;
};

struct check {
	const struct simd *simd; /* the variant to be called */
	enum psr_isa isa;
	/* The rest is check.c's. */
	uint64_t random, result, expected;
	int trial, is_started, is_failed, is_bench, round;
	uint64_t started_ns;
	double best_ns[PSR_N_ISAS], spent_ns, units;
	int n_buffers;
	struct check_buffer buffer[CHECK_BUFFERS];
	char why[256];
};

struct check_test {
	const char *claim; /* "warp: random blocks" */
	void (*run)(struct check *c);
	int n_trials;     /* for checking; 0: for --bench only */
	const char *unit; /* for --bench, "sample"; NULL: for checking only */
};

/* Runs the tests, TAP on standard output, or with --bench prints nanoseconds a unit by ISA. The exit status. */
int check_main(int argc, char **argv, const struct check_test *tests, size_t n_tests);

/* Room for n elements, until the trial's end. It ends or begins at a page that nobody may touch, by turns. The bytes of
 * outputs are compared. Filled with random bytes. */
void *check_in(struct check *c, size_t n, size_t size);
void *check_out(struct check *c, size_t n, size_t size);

int check_next(struct check *c);
void check_result(struct check *c, uint64_t result);
void check_units(struct check *c, uint64_t n); /* that a call handles; for --bench */

/* All NaNs become one: which of two operands a NaN comes from is the compiler's choice. */
void check_settle(float *value, size_t n);

uint32_t check_u32(struct check *c);
uint64_t check_u64(struct check *c);
uint32_t check_below(struct check *c, uint32_t n); /* 0..n-1 */
int check_one_in(struct check *c, uint32_t n);     /* true once in n times */
double check_real(struct check *c, double low, double high);
float check_float(struct check *c); /* any bits: denormal, huge, infinite, NaN, -0 and plain ones, all often */
float check_plain_or_any(struct check *c, int is_any, double low, double high); /* any one time in five */

#endif
