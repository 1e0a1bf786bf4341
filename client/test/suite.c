#include "suite.h"
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/infile.h"

#define MAX_BYTES (16u << 20)
#define MAX_TURN 3600

/* Words before the first test= are the defaults of all tests: they stand in `now` until then. */
struct reader {
	struct suite *suite;
	struct suite_test now, defaults;
	int has_test;
	uint32_t n_pictures;
	struct wordfile file;
	struct expect_reader expect;
};

const char *suite_beside(struct suite *suite, const char *name)
{
	char **grown = realloc(suite->made, (suite->n_made + 1) * sizeof *grown), *path;
	const size_t n_folder = name[0] == '/' ? 0 : strlen(suite->folder);

	if (grown == NULL)
		return NULL;
	suite->made = grown;
	path = malloc(n_folder + strlen(name) + 1);
	if (path == NULL)
		return NULL;
	memcpy(path, suite->folder, n_folder);
	strcpy(path + n_folder, name);
	return grown[suite->n_made++] = path;
}

static int beside(const char **name, struct suite *suite, struct psr_error *err)
{
	if (*name == NULL)
		return PSR_OK;
	*name = suite_beside(suite, *name);
	return *name != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory for the name of a file");
}

static void test_fini(struct suite_test *test)
{
	scene_wish_fini(&test->scene);
	views_fini(&test->views);
	expect_fini(&test->expect);
}

static int test_init(struct suite_test *to, const struct suite_test *defaults, struct psr_error *err)
{
	*to = *defaults;
	expect_begin(&to->expect);
	return scene_wish_copy(&to->scene, &defaults->scene, err);
}

/* ---- a whole test ---- */

static int check_pictures(struct suite_test *test, struct psr_error *err)
{
	int code = views_make(&test->views, &test->view, test->cameras, err);

	if (code == PSR_OK && test->n_turn > 0 && test->views.n != 1)
		code = psr_fail(err, PSR_ERR_ARG, "turntable: it has one view, not %u", test->views.n);
	if (code != PSR_OK)
		return code;
	test->n_pictures = test->n_turn > 0 ? (uint32_t)test->n_turn : test->views.n;
	return PSR_OK;
}

static void finish_request(struct suite_test *test)
{
	struct psr_msg_frame *frame = &test->frame;

	frame->planes = expect_planes(&test->expect);
	quality_choose_codecs(frame);
	test->scene.pixels = frame->width > frame->height ? frame->width : frame->height;
	test->scene.is_quiet = 1;
}

static int check_test(struct suite *suite, struct suite_test *test, struct psr_error *err)
{
	int code = PSR_OK;

	for (uint32_t i = 0; i < suite->n_tests; i++)
		if (strcmp(suite->test[i].name, test->name) == 0)
			return psr_fail(err, PSR_ERR_ARG, "there is a test '%.80s' already, in line %d", test->name,
			                suite->test[i].line);
	if (test->scene.file != NULL)
		code = beside(&test->scene.file, suite, err);
	if (code == PSR_OK)
		code = beside(&test->cameras, suite, err);
	if (code == PSR_OK)
		code = beside(&test->expect.reference, suite, err);
	if (code == PSR_OK)
		code = beside(&test->expect.depth, suite, err);
	if (code == PSR_OK)
		code = scene_check(&test->scene, err);
	if (code == PSR_OK)
		code = check_pictures(test, err);
	if (code == PSR_OK)
		code = quality_apply(&test->frame, &test->quality, err);
	if (code == PSR_OK)
		code = expect_finish(&test->expect, test->n_pictures, err);
	if (code == PSR_OK)
		finish_request(test);
	return code;
}

/* Checks the test under way, and adds it to the suite. */
static int end_test(struct reader *reader, struct psr_error *err)
{
	struct suite *suite = reader->suite;
	struct suite_test *grown = suite->test, *now = &reader->now;
	const uint32_t n = suite->n_tests;
	struct psr_error why;
	int code;

	if (n == SUITE_MAX_TESTS)
		return psr_fail(err, PSR_ERR_LIMIT, "there are more than %d tests", SUITE_MAX_TESTS);
	if ((n & (n - 1)) == 0)
		grown = realloc(suite->test, (n == 0 ? 1 : 2 * (size_t)n) * sizeof *grown);
	if (grown == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u tests", n);
	suite->test = grown;
	code = check_test(suite, now, &why);
	reader->n_pictures += now->n_pictures;
	if (code == PSR_OK && reader->n_pictures > SUITE_MAX_PICTURES)
		code = psr_fail(&why, PSR_ERR_LIMIT, "there are more than %d pictures", SUITE_MAX_PICTURES);
	if (code != PSR_OK) {
		reader->file.line = now->line;
		reader->file.column = now->column;
		return psr_fail(err, code, "%.80s: %.400s", now->name, why.text);
	}
	suite->test[suite->n_tests++] = *now;
	memset(now, 0, sizeof *now);
	return PSR_OK;
}

/* ---- words ---- */

static int on_test(const char *text, void *userdata, struct psr_error *err)
{
	static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.+";
	struct reader *reader = userdata;
	int code = PSR_OK, line = reader->file.line, column = reader->file.column;

	if (text[0] == '\0' || strlen(text) > PSR_WIRE_MAX_NAME || text[strspn(text, letters)] != '\0')
		return psr_fail(err, PSR_ERR_ARG, "'%.60s' is no name of a test: it has letters, digits and - _ . +", text);
	if (reader->has_test)
		code = end_test(reader, err);
	else
		reader->defaults = reader->now;
	if (code == PSR_OK)
		code = test_init(&reader->now, &reader->defaults, err);
	reader->has_test = 1;
	if (code != PSR_OK)
		return code;
	reader->now.name = text;
	reader->now.line = line;
	reader->now.column = column;
	return PSR_OK;
}

static int on_models(const char *text, void *userdata, struct psr_error *err)
{
	struct reader *reader = userdata;

	if (reader->has_test)
		return psr_fail(err, PSR_ERR_ARG, "the folder is that of all tests; it stands before the first one");
	reader->suite->models = suite_beside(reader->suite, text);
	return reader->suite->models != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory for a path");
}

static void add_options(struct optlist *list, struct reader *reader)
{
	const struct psr_opt own[] = {
		{ .name = "test", .type = PSR_OPT_CALL, .value = reader, .arg = "NAME", .call = on_test },
		{ .name = "models", .type = PSR_OPT_CALL, .value = reader, .arg = "DIR", .call = on_models },
		{ .name = "cameras", .type = PSR_OPT_STRING, .value = &reader->now.cameras, .arg = "FILE" },
		{ .name = "turntable", .type = PSR_OPT_INT, .value = &reader->now.n_turn, .arg = "N", .min = 1,
		  .max = MAX_TURN },
	};

	OPTLIST_ADD(list, own);
	scene_add_model_options(list, &reader->now.scene);
	view_add_options(list, &reader->now.view);
	scene_add_light_options(list, &reader->now.scene);
	quality_add_options(list, &reader->now.quality);
	quality_add_splats_option(list, &reader->now.quality);
	quality_add_budget_option(list, &reader->now.quality);
	quality_add_codec_option(list, &reader->now.quality);
	expect_add_options(list, &reader->expect);
}

/* ---- a whole suite ---- */

static int find_timed(struct reader *reader, struct psr_error *err)
{
	struct suite *suite = reader->suite;

	for (uint32_t i = 0; i < suite->n_tests; i++) {
		struct expect *expect = &suite->test[i].expect;
		const size_t length = expect->of != NULL ? strcspn(expect->of, ",") : 0;
		uint32_t k = 0;

		if (expect->of == NULL)
			continue;
		while (k < suite->n_tests && (strlen(suite->test[k].name) != length
		                              || memcmp(suite->test[k].name, expect->of, length) != 0))
			k++;
		if (k == suite->n_tests || k == i || suite->test[k].expect.error != PSR_OK) {
			return psr_fail(err, PSR_ERR_ARG,
			                "%s:%d:%d: time: '%.*s' is no other test of this suite that draws a picture", suite->path,
			                expect->time_line, expect->time_column, (int)(length < 80 ? length : 80), expect->of);
		}
		expect->of_test = k;
	}
	return PSR_OK;
}

static int parse(struct reader *reader, char *text, struct psr_error *err)
{
	struct optlist list = { .n = 0 };
	const struct psr_cli cli = { .opts = list.opt };
	struct psr_error why;
	int code;

	reader->file = (struct wordfile){ .path = reader->suite->path, .cli = &cli };
	reader->expect = (struct expect_reader){ &reader->now.expect, &reader->file };
	scene_wish_init(&reader->now.scene);
	view_wish_init(&reader->now.view);
	quality_wish_init(&reader->now.quality, 800, 600, "good", "lossless");
	expect_init(&reader->now.expect);
	add_options(&list, reader);
	code = wordfile_parse(&reader->file, text, err);
	if (code == PSR_OK && !reader->has_test)
		code = psr_fail(err, PSR_ERR_ARG, "%s: there is no test; a line is one, such as test=front model=NAME hash=?",
		                reader->suite->path);
	if (code == PSR_OK && (code = end_test(reader, &why)) != PSR_OK)
		psr_fail(err, code, "%.200s:%d:%d: --test: %.280s", reader->suite->path, reader->file.line, reader->file.column,
		         why.text);
	return code == PSR_OK ? find_timed(reader, err) : code;
}

static struct suite *suite_create(const char *path)
{
	const char *slash = strrchr(path, '/'), *file = slash != NULL ? slash + 1 : path, *dot = strrchr(file, '.');
	struct suite *suite = calloc(1, sizeof *suite);

	if (suite == NULL)
		return NULL;
	suite->path = path;
	suite->name = dot != NULL && dot != file ? strndup(file, (size_t)(dot - file)) : strdup(file);
	suite->folder = strndup(path, (size_t)(file - path));
	if (suite->name != NULL && suite->folder != NULL)
		return suite;
	suite_free(suite);
	return NULL;
}

int suite_parse(struct suite **out, const char *path, char *text, struct psr_error *err)
{
	struct reader *reader = calloc(1, sizeof *reader);
	struct suite *suite = suite_create(path);
	int code;

	if (suite == NULL || reader == NULL) {
		free(text);
		free(reader);
		suite_free(suite);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a suite");
	}
	suite->text = text;
	reader->suite = suite;
	code = parse(reader, text, err);
	test_fini(&reader->now);
	test_fini(&reader->defaults);
	free(reader);
	if (code == PSR_OK)
		*out = suite;
	else
		suite_free(suite);
	return code;
}

int suite_read(struct suite **out, const char *path, struct psr_error *err)
{
	struct psr_error why;
	char *text;
	int code = infile_read_text(&text, path, MAX_BYTES, &why);

	if (code != PSR_OK)
		return psr_fail(err, code, "cannot read %s", why.text);
	return suite_parse(out, path, text, err);
}

void suite_free(struct suite *suite)
{
	if (suite == NULL)
		return;
	for (uint32_t i = 0; i < suite->n_tests; i++)
		test_fini(&suite->test[i]);
	for (uint32_t i = 0; i < suite->n_made; i++)
		free(suite->made[i]);
	free(suite->made);
	free(suite->test);
	free(suite->name);
	free(suite->folder);
	free(suite->text);
	free(suite);
}
