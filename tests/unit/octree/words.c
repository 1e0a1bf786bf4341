/* Eight numbers of 16 bits: this machine's instructions, plain C, and sums that are wide enough. Packed codes are the
 * same bytes everywhere if these agree, as all else of codes_mixed.c has one form. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include "base/random.h"
#include "octree/words.h"

#define TRIES 200000

static const int16_t ends[] = { INT16_MIN, INT16_MIN + 1, -1, 0, 1, INT16_MAX - 1, INT16_MAX };

/* Any number, or one of the ends. */
static int16_t any_word(uint64_t *random)
{
	const uint64_t x = random_next(random);

	return x % 4 == 0 ? ends[(x >> 8) % (sizeof ends / sizeof *ends)] : (int16_t)(x >> 32);
}

static words any_words(uint64_t *random)
{
	words x;

	for (int i = 0; i < 8; i++)
		x[i] = any_word(random);
	return x;
}

/* Within -2048..2047, as logits are. */
static words any_logits(uint64_t *random)
{
	return any_words(random) >> 4;
}

static int64_t held_wide(int64_t x)
{
	return x < INT16_MIN ? INT16_MIN : x > INT16_MAX ? INT16_MAX : x;
}

static int64_t floor_shift(int64_t x, int bits)
{
	const int64_t part = (int64_t)1 << bits;

	return (x - ((x % part + part) % part)) / part;
}

static void sums_are_held_at_their_ends(void **state)
{
	uint64_t random = 1;

	(void)state;
	for (int n = 0; n < TRIES; n++) {
		const words a = any_words(&random), b = any_words(&random), sum = words_add(a, b), in_c = words_add_c(a, b);

		assert_memory_equal(&sum, &in_c, sizeof sum);
		for (int i = 0; i < 8; i++)
			assert_int_equal(sum[i], held_wide((int64_t)a[i] + b[i]));
	}
}

static void logits_are_weighed_without_loss(void **state)
{
	uint64_t random = 2;

	(void)state;
	for (int n = 0; n < TRIES; n++) {
		const words logit = any_logits(&random), weight = any_words(&random);
		int64_t wide = 0;

		for (int i = 0; i < 8; i++)
			wide += (int64_t)logit[i] * weight[i];
		assert_int_equal(words_weigh(logit, weight), wide);
		assert_int_equal(words_weigh_c(logit, weight), wide);
	}
}

static void two_sums_are_those_of_each(void **state)
{
	uint64_t random = 4;

	(void)state;
	for (int n = 0; n < TRIES; n++) {
		const words logit[2] = { any_logits(&random), any_logits(&random) };
		/* Small weights, too, since most of the others are held. */
		const words weight[2] = { any_words(&random), any_words(&random) >> n % 8 };
		int32_t x[2], in_c[2];

		words_weigh_both(x, logit[0], weight[0], logit[1], weight[1]);
		words_weigh_both_c(in_c, logit[0], weight[0], logit[1], weight[1]);
		for (int i = 0; i < 2; i++) {
			const int64_t wide = floor_shift(words_weigh_c(logit[i], weight[i]), 13);

			assert_int_equal(x[i], wide < -2047 ? -2047 : wide > 2047 ? 2047 : wide);
			assert_int_equal(in_c[i], x[i]);
		}
	}
}

static void weights_learn_the_same(void **state)
{
	uint64_t random = 3;

	(void)state;
	for (int n = 0; n < TRIES; n++) {
		const words weight = any_words(&random), logit = any_logits(&random);
		const int16_t step = any_word(&random);
		const words is = words_learn(weight, logit, step), in_c = words_learn_c(weight, logit, step);

		assert_memory_equal(&is, &in_c, sizeof is);
		for (int i = 0; i < 8; i++) {
			const int64_t part = floor_shift((int64_t)logit[i] * 16 * step, 16);

			assert_int_equal(is[i], held_wide(weight[i] + floor_shift(part + 1, 1)));
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sums_are_held_at_their_ends),
		cmocka_unit_test(logits_are_weighed_without_loss),
		cmocka_unit_test(two_sums_are_those_of_each),
		cmocka_unit_test(weights_learn_the_same),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
