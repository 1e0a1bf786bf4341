/* Suites as people write them: tests, defaults, what is expected, and where an error stands. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "client/test/result.h"
#include "client/test/suite.h"

static struct suite *suite;
static struct psr_error err;

static int parse(const char *text)
{
	suite_free(suite);
	suite = NULL;
	return suite_parse(&suite, "folder/demo.suite", strdup(text), &err);
}

static int tear_down(void **state)
{
	(void)state;
	suite_free(suite);
	suite = NULL;
	return 0;
}

static void words_before_the_first_test_are_defaults(void **state)
{
	(void)state;
	assert_int_equal(parse("models=m size=64x48 light=dir:0,-1,0\n"
	                       "test=a model=x hash=?\n"
	                       "test=b model=y size=32x32 # wider\n"
	                       "\tlight=dir:1,0,0 hash=?\n"), PSR_OK);
	assert_int_equal(suite->n_tests, 2);
	assert_string_equal(suite->name, "demo");
	assert_string_equal(suite->models, "folder/m");
	assert_string_equal(suite->test[0].name, "a");
	assert_int_equal(suite->test[0].frame.width, 64);
	assert_int_equal(suite->test[0].scene.n_lights, 1);
	assert_string_equal(suite->test[0].scene.instance[0].model, "x");
	assert_int_equal(suite->test[1].frame.width, 32);
	assert_int_equal(suite->test[1].scene.n_lights, 2);
	assert_int_equal(suite->test[1].scene.n_instances, 1);
	assert_string_equal(suite->test[1].scene.instance[0].model, "y");
	assert_int_equal(suite->test[1].line, 3);
}

static void a_test_may_have_several_pictures(void **state)
{
	char name[RESULT_NAME];

	(void)state;
	assert_int_equal(parse("model=x\n"
	                       "test=turn turntable=12 hash=?\n"
	                       "test=sides view=front,left hash=0123456789abcdef,00000000000000ff\n"), PSR_OK);
	assert_int_equal(suite->test[0].n_pictures, 12);
	assert_null(suite->test[0].expect.hash[PSR_PLANE_COLOR].value);
	assert_int_equal(suite->test[1].n_pictures, 2);
	assert_true(suite->test[1].expect.hash[PSR_PLANE_COLOR].value[0] == 0x0123456789abcdef);
	assert_true(suite->test[1].expect.hash[PSR_PLANE_COLOR].value[1] == 0xff);
	result_name(name, &suite->test[0], 11);
	assert_string_equal(name, "turn/12");
}

static void expectations_say_which_planes_are_drawn(void **state)
{
	const uint32_t color = 1 << PSR_PLANE_COLOR;

	(void)state;
	assert_int_equal(parse("model=x\n"
	                       "test=a hash=?\n"
	                       "test=b hash=normal:0123456789abcdef hash=depth:?\n"
	                       "test=c depth=c.pfm depth-rmse=0.5\n"), PSR_OK);
	assert_int_equal(suite->test[0].frame.planes, color);
	assert_int_equal(suite->test[1].frame.planes, color | 1 << PSR_PLANE_NORMAL | 1 << PSR_PLANE_DEPTH);
	assert_int_equal(suite->test[2].frame.planes, color | 1 << PSR_PLANE_DEPTH);
	assert_string_equal(suite->test[2].expect.depth, "folder/c.pfm");
}

static void metrics_have_bounds(void **state)
{
	const struct expect *e;

	(void)state;
	assert_int_equal(parse("model=x\n"
	                       "test=a reference=/r.png psnr=40 ssim=0.9 flip=0.02 off=16:0.5%\n"
	                       "test=b reference=b.png\n"
	                       "test=c time=0.5,of=a,n=3\n"
	                       "test=d error=over-a-limit\n"), PSR_OK);
	e = &suite->test[0].expect;
	assert_string_equal(e->reference, "/r.png");
	assert_false(e->is_exact);
	assert_true(e->bound[EXPECT_PSNR] == 40 && e->bound[EXPECT_SSIM] == 0.9 && e->bound[EXPECT_FLIP] == 0.02);
	assert_true(e->off_codes == 16 && e->bound[EXPECT_OFF] == 0.005);
	assert_true(suite->test[1].expect.is_exact);
	e = &suite->test[2].expect;
	assert_true(e->ratio == 0.5 && e->n_draws == 3 && e->of_test == 0);
	assert_int_equal(suite->test[3].expect.error, PSR_ERR_LIMIT);
}

static void bounds_may_be_defaults_of_tests_without_a_reference(void **state)
{
	(void)state;
	assert_int_equal(parse("model=x psnr=45 depth-rmse=2\n"
	                       "test=a hash=?\n"
	                       "test=b reference=b.png\n"
	                       "test=c reference=b.png psnr=30\n"
	                       "test=d depth=d.pfm\n"), PSR_OK);
	assert_true(suite->test[1].expect.bound[EXPECT_PSNR] == 45 && !suite->test[1].expect.is_exact);
	assert_true(suite->test[2].expect.bound[EXPECT_PSNR] == 30);
	assert_true(suite->test[3].expect.bound[EXPECT_DEPTH] == 2);
}

static void errors_have_a_place_and_say_what_would_be_right(void **state)
{
	static const struct {
		const char *text, *message;
	} wrong[] = {
		{ "", "demo.suite: there is no test; a line is one" },
		{ "test=a model=x\n", ":1:1: --test: a: the test expects nothing; it needs hash" },
		{ "size=4x4\n test=a hash=?", ":2:2: --test: a: --model NAME is missing" },
		{ "model=x\ntest=a hash=?\ntest=a hash=?", ":3:1: --test: a: there is a test 'a' already, in line 2" },
		{ "model=x\ntest=a zom=2 hash=?", ":2:8: unknown option zom; did you mean zoom?" },
		{ "model=x\ntest=a zoom=x hash=?", ":2:8: --zoom: 'x'" },
		{ "model=x\ntest=a zoom hash=?", ":2:8: zoom needs a value: zoom=FACTOR" },
		{ "model=x\ntest=a,b hash=?", ":2:1: --test: 'a,b' is no name of a test" },
		{ "model=x\ntest=a hash=xyz", ":2:8: --hash: 'xyz' is no hash: it has 16 digits" },
		{ "model=x\ntest=a hash=12", ":2:1: --test: a: hash: '12' has 2 digits" },
		{ "model=x\ntest=a hash=12345678901234567", ":2:1: --test: a: hash: '12345678901234567' has 17 digits" },
		{ "model=x\ntest=a hash=colour:?", ":2:8: --hash: there is no plane 'colour'; there are color, depth" },
		{ "model=x\ntest=a turntable=2 hash=0123456789abcdef", ":2:1: --test: a: hash: there are 1 for 2 pictures" },
		{ "model=x\ntest=a turntable=2 reference=a.png", ":2:1: --test: a: reference: '" },
		{ "model=x\ntest=a reference=a.jpg", "' does not end in .png" },
		{ "model=x\ntest=a psnr=3 hash=?", ":2:1: --test: a: exact, psnr, ssim, flip and off compare with a picture" },
		{ "model=x\ntest=a depth=a.pfm", ":2:1: --test: a: depth=FILE and depth-rmse=MOST go together" },
		{ "model=x\ntest=a off=16", ":2:8: --off: '16' is not CODES:SHARE%, such as 16:0.1%" },
		{ "model=x\ntest=a off=1.5:2%", ":2:8: --off: '1.5:2%' is not" },
		{ "model=x\ntest=a time=2", ":2:8: --time: '2' is not RATIO,of=TEST[,n=N]" },
		{ "model=x\ntest=a time=2,of=b", ":2:8: time: 'b' is no other test" },
		{ "model=x\ntest=a time=2,of=a", ":2:8: time: 'a' is no other test" },
		{ "model=x\ntest=b error=busy test=a time=2,of=b", ":2:26: time: 'b' is no other test" },
		{ "model=x\ntest=a time=2,of=b,n=0", ":2:8: --time: '2,of=b,n=0': behind the test" },
		{ "model=x\ntest=a error=none", ":2:8: --error: 'none' is no error" },
		{ "model=x\ntest=a error=busy hash=?", ":2:1: --test: a: error excludes hash" },
		{ "model=x\ntest=a hash=?\nmodels=m", ":3:1: --models: the folder is that of all tests" },
		{ "model=x\ntest=a view=front azimuth=3 hash=?", ":2:1: --test: a: --view excludes --azimuth" },
		{ "model=x\ntest=a size=0x3 hash=?", ":2:1: --test: a: --size: a picture of 0x3 has no pixels" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
		assert_int_equal(parse(wrong[i].text), PSR_ERR_ARG);
		if (strstr(err.text, wrong[i].message) == NULL)
			fail_msg("'%s' does not say '%s'", err.text, wrong[i].message);
		assert_non_null(strstr(err.text, "demo.suite"));
	}
}

static void patterns_choose_tests(void **state)
{
	struct results results;

	(void)state;
	assert_int_equal(parse("model=x hash=?\ntest=a1\ntest=a2\ntest=b\n"), PSR_OK);
	assert_int_equal(results_init(&results, suite, "a*", NULL, &err), PSR_OK);
	assert_true(results.is_chosen[0] && results.is_chosen[1] && !results.is_chosen[2]);
	results_fini(&results);
	assert_int_equal(results_init(&results, suite, NULL, NULL, &err), PSR_OK);
	assert_true(results.is_chosen[0] && results.is_chosen[1] && results.is_chosen[2] && !results.is_accepted[2]);
	results_fini(&results);
	assert_int_equal(results_init(&results, suite, NULL, "b", &err), PSR_OK);
	assert_true(!results.is_chosen[0] && results.is_chosen[2] && results.is_accepted[2]);
	results_fini(&results);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_teardown(words_before_the_first_test_are_defaults, tear_down),
		cmocka_unit_test_teardown(a_test_may_have_several_pictures, tear_down),
		cmocka_unit_test_teardown(expectations_say_which_planes_are_drawn, tear_down),
		cmocka_unit_test_teardown(metrics_have_bounds, tear_down),
		cmocka_unit_test_teardown(bounds_may_be_defaults_of_tests_without_a_reference, tear_down),
		cmocka_unit_test_teardown(errors_have_a_place_and_say_what_would_be_right, tear_down),
		cmocka_unit_test_teardown(patterns_choose_tests, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
