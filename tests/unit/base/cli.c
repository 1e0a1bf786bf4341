#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/cli.h"

static struct values {
	int flag, seen, n_calls;
	int64_t count, bytes;
	double angle, eye[3];
	const char *name;
	uint32_t size[2];
	uint8_t color[3];
	char last_call[32];
} v;

static int on_light(const char *text, void *userdata, struct psr_error *err)
{
	struct values *values = userdata;

	if (strcmp(text, "bad") == 0)
		return psr_fail(err, PSR_ERR_ARG, "'bad' is no light");
	if (strcmp(text, "silent") == 0)
		return PSR_ERR_ARG;
	snprintf(values->last_call, sizeof values->last_call, "%s", text);
	values->n_calls++;
	return PSR_OK;
}

static const struct psr_opt table[] = {
	{ "flag", 'f', PSR_OPT_FLAG, &v.flag, NULL, "A flag.", 0, 0, NULL, NULL, NULL },
	{ "count", 'n', PSR_OPT_INT, &v.count, "N", "How many.", 1, 256, NULL, &v.seen, NULL },
	{ "bytes", 0, PSR_OPT_INT, &v.bytes, "BYTES", "Memory for everything, which is said at such a length that the line "
	  "has to be broken twice or more before its end, and then\nanother line.", 0, 0, NULL, NULL, NULL },
	{ "angle", 'a', PSR_OPT_REAL, &v.angle, "DEG", "An angle.", -1, 180, NULL, NULL, NULL },
	{ "name", 0, PSR_OPT_STRING, &v.name, "NAME", "A name.", 0, 0, NULL, NULL, NULL },
	{ "eye", 0, PSR_OPT_VEC3, v.eye, "X,Y,Z", "A point.", 0, 0, NULL, NULL, NULL },
	{ "size", 's', PSR_OPT_SIZE, v.size, "WxH", "A size.", 1, 16384, NULL, NULL, NULL },
	{ "color", 0, PSR_OPT_COLOR, v.color, "#RRGGBB", "A color.", 0, 0, NULL, NULL, NULL },
	{ "light", 0, PSR_OPT_CALL, &v, "dir:x,y,z[,color=#rrggbb][,intensity=I]", "A light.", 0, 0, on_light, NULL, NULL },
	{ 0 },
};

static const struct psr_cli cli = {
	.usage = "psr test [options] FILE", .summary = "Tests the command line.", .opts = table, .footer = "Examples:\n  none",
};

static int reset(void **state)
{
	(void)state;
	v = (struct values){ .count = 8, .bytes = 64 << 20, .angle = 0.1, .eye = { NAN, 0, 0 }, .size = { 640, 480 },
		             .color = { 1, 0xab, 255 } };
	return 0;
}

static int parse(const char *const *args, int *n_operands, char *operands[16], struct psr_error *err)
{
	char *argv[16] = { (char *)"psr" };
	int argc = 1, code;

	for (; args[argc - 1] != NULL; argc++)
		argv[argc] = (char *)args[argc - 1];
	code = psr_cli_parse(&cli, argc, argv, n_operands, err);
	memcpy(operands, argv + 1, 15 * sizeof *argv);
	return code;
}

#define PARSE(err, ...) parse((const char *const[]){ __VA_ARGS__, NULL }, &n, operands, err)

static void every_type_is_read_in_both_spellings(void **state)
{
	struct psr_error err = { 0 };
	char *operands[16];
	int n;

	(void)state;
	assert_int_equal(PARSE(&err, "--flag", "--count", "12", "--bytes=3g", "-a", "-0.5", "--name=a=b", "--eye",
	                       "-1,2.5,3e2", "-s", "1920x1080", "--color", "#80C0ff"), PSR_OK);
	assert_int_equal(n, 0);
	assert_int_equal(v.flag, 1);
	assert_int_equal(v.count, 12);
	assert_int_equal(v.seen, 1);
	assert_true(v.bytes == INT64_C(3) << 30);
	assert_true(v.angle == -0.5);
	assert_string_equal(v.name, "a=b");
	assert_true(v.eye[0] == -1 && v.eye[1] == 2.5 && v.eye[2] == 300);
	assert_true(v.size[0] == 1920 && v.size[1] == 1080);
	assert_true(v.color[0] == 0x80 && v.color[1] == 0xc0 && v.color[2] == 0xff);
	assert_int_equal(err.code, PSR_OK);
}

static void operands_come_to_the_front_and_two_dashes_end_options(void **state)
{
	char *operands[16];
	int n;

	(void)state;
	assert_int_equal(PARSE(NULL, "one", "-f", "-", "--count", "3", "--", "--flag", "-x"), PSR_OK);
	assert_int_equal(n, 4);
	assert_string_equal(operands[0], "one");
	assert_string_equal(operands[1], "-");
	assert_string_equal(operands[2], "--flag");
	assert_string_equal(operands[3], "-x");
}

static void calls_repeat_and_their_errors_carry_the_option(void **state)
{
	struct psr_error err;
	char *operands[16];
	int n;

	(void)state;
	assert_int_equal(PARSE(&err, "--light", "dir:0,0,1", "--light=point:1,2,3"), PSR_OK);
	assert_int_equal(v.n_calls, 2);
	assert_string_equal(v.last_call, "point:1,2,3");
	assert_int_equal(PARSE(&err, "--light", "bad"), PSR_ERR_ARG);
	assert_string_equal(err.text, "--light: 'bad' is no light");
	assert_int_equal(PARSE(&err, "--light", "silent"), PSR_ERR_ARG);
	assert_string_equal(err.text, "--light: 'silent' is not valid");
}

static void bad_command_lines_get_a_sentence_and_change_nothing(void **state)
{
	static const struct {
		const char *args[3], *text;
	} cases[] = {
		{ { "--cuont", "1" }, "unknown option --cuont; did you mean --count?" },
		{ { "--nothing-like-it" }, "unknown option --nothing-like-it; --help lists the options" },
		{ { "-z" }, "unknown option -z; --help lists the options" },
		{ { "-fs" }, "unknown option -fs; --help lists the options" },
		{ { "--flag=1" }, "--flag takes no value" },
		{ { "--count" }, "--count needs a value: --count N" },
		{ { "--count", "0" }, "--count: '0' is out of range; it takes 1 to 256" },
		{ { "--count", "257" }, "--count: '257' is out of range; it takes 1 to 256" },
		{ { "--count", "1k" }, "--count: '1k' is out of range; it takes 1 to 256" },
		{ { "--count", "" }, "--count: '' is not a whole number such as 8 or 64m" },
		{ { "--count", "1.5" }, "--count: '1.5' is not a whole number such as 8 or 64m" },
		{ { "--count", "8mb" }, "--count: '8mb' is not a whole number such as 8 or 64m" },
		{ { "--bytes", "9223372036854775808" }, "--bytes: '9223372036854775808' is too large" },
		{ { "--bytes", "8589934592g" }, "--bytes: '8589934592g' is too large" },
		{ { "--angle", "180.5" }, "--angle: '180.5' is out of range; it takes -1 to 180" },
		{ { "--angle", "nan" }, "--angle: 'nan' is not a finite decimal number such as 1.5" },
		{ { "--angle", "1e999" }, "--angle: '1e999' is not a finite decimal number such as 1.5" },
		{ { "--angle", "0x10" }, "--angle: '0x10' is not a finite decimal number such as 1.5" },
		{ { "--angle", " 1" }, "--angle: ' 1' is not a finite decimal number such as 1.5" },
		{ { "--eye", "1,2" }, "--eye: '1,2' is not three finite numbers with commas between, such as 0,1.5,-2" },
		{ { "--eye", "1,2,inf" },
		  "--eye: '1,2,inf' is not three finite numbers with commas between, such as 0,1.5,-2" },
		{ { "--eye", "1,2,3,4" },
		  "--eye: '1,2,3,4' is not three finite numbers with commas between, such as 0,1.5,-2" },
		{ { "--size", "640" }, "--size: '640' is not a size such as 1280x720" },
		{ { "--size", "-1x5" }, "--size: '-1x5' is not a size such as 1280x720" },
		{ { "--size", "0x5" }, "--size: '0x5' is out of range; it takes 1 to 16384" },
		{ { "--size", "100000x100000" }, "--size: '100000x100000' is out of range; it takes 1 to 16384" },
		{ { "--size", "99999999999999999999x1" }, "--size: '99999999999999999999x1' is not a size such as 1280x720" },
		{ { "--color", "80c0ff" }, "--color: '80c0ff' is not a color such as #80c0ff" },
		{ { "--color", "#80c0f" }, "--color: '#80c0f' is not a color such as #80c0ff" },
		{ { "--color", "#80c0ff0" }, "--color: '#80c0ff0' is not a color such as #80c0ff" },
	};
	char *operands[16];

	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		struct values before;
		struct psr_error err = { 0 };
		int n;

		reset(state);
		before = v;
		assert_int_equal(parse(cases[i].args, &n, operands, &err), PSR_ERR_ARG);
		assert_int_equal(err.code, PSR_ERR_ARG);
		assert_string_equal(err.text, cases[i].text);
		assert_memory_equal(&v, &before, sizeof v);
	}
}

static void operands_are_refused_where_none_are_taken(void **state)
{
	char *argv[] = { (char *)"psr", (char *)"stray", NULL };
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_cli_parse(&cli, 2, argv, NULL, &err), PSR_ERR_ARG);
	assert_string_equal(err.text, "unexpected argument 'stray'; --help shows the usage");
}

static void configuration_lines_set_the_same_options(void **state)
{
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_cli_set(&cli, "flag", "on", &err), PSR_OK);
	assert_int_equal(v.flag, 1);
	assert_int_equal(psr_cli_set(&cli, "flag", "no", &err), PSR_OK);
	assert_int_equal(v.flag, 0);
	assert_int_equal(psr_cli_set(&cli, "size", "16x32", &err), PSR_OK);
	assert_int_equal(v.size[1], 32);
	assert_int_equal(psr_cli_set(&cli, "flag", "maybe", &err), PSR_ERR_ARG);
	assert_string_equal(err.text, "flag: 'maybe' is neither yes nor no");
	assert_int_equal(psr_cli_set(&cli, "sise", "16x32", &err), PSR_ERR_ARG);
	assert_string_equal(err.text, "unknown option sise; did you mean size?");
}

static void parsers_of_parts_say_where_they_stopped(void **state)
{
	const char *end;
	double p[3], x;
	uint8_t rgb[3];

	(void)state;
	assert_int_equal(psr_parse_vec3("1,2,3:4", p, &end, NULL), PSR_OK);
	assert_string_equal(end, ":4");
	assert_int_equal(psr_parse_color("#010203,x", rgb, &end, NULL), PSR_OK);
	assert_string_equal(end, ",x");
	assert_int_equal(psr_parse_real("-.5e-1em", &x, &end, NULL), PSR_OK);
	assert_true(x == -0.05);
	assert_string_equal(end, "em");
	assert_int_equal(psr_parse_real(".", &x, &end, NULL), PSR_ERR_ARG);
	assert_int_equal(psr_parse_vec3("1,2,3x", p, NULL, NULL), PSR_ERR_ARG);
}

/* What --help prints, caught in a file. */
static void catch_help_of(const struct psr_cli *of, char *text, size_t size)
{
	FILE *file = tmpfile();
	char *argv[] = { (char *)"psr", (char *)"--count", (char *)"3", (char *)"--help", NULL };
	size_t length;
	int saved, n, code;

	assert_non_null(file);
	fflush(stdout);
	saved = dup(1);
	dup2(fileno(file), 1);
	code = psr_cli_parse(of, 4, argv, &n, NULL);
	fflush(stdout);
	dup2(saved, 1);
	close(saved);
	assert_int_equal(code, 1);
	rewind(file);
	length = fread(text, 1, size - 1, file);
	text[length] = '\0';
	fclose(file);
}

static void catch_help(char *text, size_t size)
{
	catch_help_of(&cli, text, size);
}

static void help_is_aligned_wrapped_and_tells_the_real_defaults(void **state)
{
	static const char expected[] =
		"usage: psr test [options] FILE\n"
		"\n"
		"Tests the command line.\n"
		"\n"
		"options:\n"
		"  -f, --flag           A flag.\n"
		"  -n, --count N        How many. [8]\n"
		"      --bytes BYTES    Memory for everything, which is said at such a length that the line has to be\n"
		"                       broken twice or more before its end, and then\n"
		"                       another line. [64m]\n"
		"  -a, --angle DEG      An angle. [0.1]\n"
		"      --name NAME      A name.\n"
		"      --eye X,Y,Z      A point.\n"
		"  -s, --size WxH       A size. [640x480]\n"
		"      --color #RRGGBB  A color. [#01abff]\n"
		"      --light dir:x,y,z[,color=#rrggbb][,intensity=I]\n"
		"                       A light.\n"
		"      --help           Print this and exit.\n"
		"\n"
		"Examples:\n"
		"  none\n";
	char text[4096];

	(void)state;
	catch_help(text, sizeof text);
	assert_string_equal(text, expected);
}

static void values_in_force_show_as_defaults(void **state)
{
	char text[4096];

	(void)state;
	v.eye[0] = -0.25;
	v.name = "teapot";
	catch_help(text, sizeof text);
	assert_non_null(strstr(text, "A point. [-0.25,0,0]\n"));
	assert_non_null(strstr(text, "A name. [teapot]\n"));
}

static void headings_stand_above_their_options_and_are_none(void **state)
{
	static int flag;
	static const struct psr_opt opts[] = {
		{ .name = "Colours", .type = PSR_OPT_HEADING, .help = "All of them are optional." },
		{ .name = "red", .type = PSR_OPT_FLAG, .value = &flag, .help = "Red." },
		{ .name = "Other", .type = PSR_OPT_HEADING },
		{ .name = "big", .type = PSR_OPT_FLAG, .value = &flag, .help = "Big." },
		{ .name = NULL },
	};
	static const struct psr_cli grouped = { "psr test", "Tests.", opts, NULL, NULL };
	struct psr_error err;
	char text[4096];

	(void)state;
	catch_help_of(&grouped, text, sizeof text);
	assert_string_equal(text, "usage: psr test\n\nTests.\n\nColours:\n  All of them are optional.\n"
	                          "      --red   Red.\n\nOther:\n      --big   Big.\n"
	                          "      --help  Print this and exit.\n");
	assert_int_equal(psr_cli_set(&grouped, "Other", "yes", &err), PSR_ERR_ARG);
	assert_string_equal(err.text, "unknown option Other; --help lists the options");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(every_type_is_read_in_both_spellings, reset),
		cmocka_unit_test_setup(operands_come_to_the_front_and_two_dashes_end_options, reset),
		cmocka_unit_test_setup(calls_repeat_and_their_errors_carry_the_option, reset),
		cmocka_unit_test_setup(bad_command_lines_get_a_sentence_and_change_nothing, reset),
		cmocka_unit_test_setup(operands_are_refused_where_none_are_taken, reset),
		cmocka_unit_test_setup(configuration_lines_set_the_same_options, reset),
		cmocka_unit_test_setup(parsers_of_parts_say_where_they_stopped, reset),
		cmocka_unit_test_setup(help_is_aligned_wrapped_and_tells_the_real_defaults, reset),
		cmocka_unit_test_setup(headings_stand_above_their_options_and_are_none, reset),
		cmocka_unit_test_setup(values_in_force_show_as_defaults, reset),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
