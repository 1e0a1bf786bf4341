#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "tests/unit/model/fixture.h"
#include "models/commands.h"

struct files {
	char folder[32], model[64], output[64];
};

static int write_model(void **state)
{
	static struct files files;
	struct fixture *fixture = malloc(sizeof *fixture);
	struct psr_model *model = NULL;
	int code;

	strcpy(files.folder, "/tmp/psr-info-XXXXXX");
	if (fixture == NULL || mkdtemp(files.folder) == NULL)
		return 1;
	snprintf(files.model, sizeof files.model, "%s/small.thing.psr", files.folder);
	snprintf(files.output, sizeof files.output, "%s/output", files.folder);
	fixture_init(fixture, 1);
	code = psr_model_create(&model, &fixture->info, &fixture->blocks, &fixture->presets, NULL);
	if (code == PSR_OK)
		code = psr_model_write(model, files.model, NULL);
	psr_model_unref(model);
	free(fixture);
	*state = &files;
	return code != PSR_OK;
}

static int remove_files(void **state)
{
	struct files *files = *state;

	unlink(files->model);
	unlink(files->output);
	return rmdir(files->folder);
}

/* Runs `info` with standard output in a file and returns what it printed, to be freed. */
static char *run_info(const struct files *files, const char *path, const char *option, int *status)
{
	char *argv[] = { (char *)"info", (char *)path, (char *)option, NULL };
	char *text = calloc(1, 8192);
	FILE *file;
	int saved;

	assert_non_null(text);
	fflush(stdout);
	saved = dup(STDOUT_FILENO);
	file = fopen(files->output, "w+b");
	assert_non_null(file);
	assert_true(dup2(fileno(file), STDOUT_FILENO) >= 0);
	*status = cmd_info(option == NULL ? 2 : 3, argv);
	fflush(stdout);
	assert_true(dup2(saved, STDOUT_FILENO) >= 0);
	close(saved);
	rewind(file);
	assert_true(fread(text, 1, 8191, file) < 8191);
	fclose(file);
	return text;
}

static double number(const cJSON *object, const char *name)
{
	const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);

	assert_true(cJSON_IsNumber(item));
	return item->valuedouble;
}

static void json_tells_what_the_model_holds(void **state)
{
	const struct files *files = *state;
	int status;
	char *text = run_info(files, files->model, "--json", &status);
	cJSON *root = cJSON_Parse(text);
	const cJSON *blocks = cJSON_GetObjectItemCaseSensitive(root, "blocks");
	const cJSON *levels = cJSON_GetObjectItemCaseSensitive(blocks, "level_blocks");
	const cJSON *samples = cJSON_GetObjectItemCaseSensitive(blocks, "level_samples");
	const cJSON *adequacy = cJSON_GetObjectItemCaseSensitive(root, "adequacy");
	const cJSON *cameras = cJSON_GetObjectItemCaseSensitive(root, "cameras");
	const cJSON *lights = cJSON_GetObjectItemCaseSensitive(root, "lights"), *last;

	assert_int_equal(status, 0);
	assert_non_null(root);
	assert_string_equal(cJSON_GetObjectItemCaseSensitive(root, "name")->valuestring, "small.thing");
	assert_string_equal(cJSON_GetObjectItemCaseSensitive(root, "builder")->valuestring, "test 1.0");
	assert_int_equal(strlen(cJSON_GetObjectItemCaseSensitive(root, "content_id")->valuestring), 32);
	assert_true(number(root, "resolution") == 256 && number(root, "spacing") == 0.01 && number(root, "scale") == 12.5);
	assert_true(cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(root, "box_max"), 2)->valuedouble == 6);
	assert_true(number(blocks, "samples") == FIXTURE_SAMPLES && number(blocks, "blocks") == FIXTURE_BLOCKS);
	assert_true(number(blocks, "projections") == 2 && number(blocks, "clusters") == 3 && number(blocks, "levels") == 2);
	assert_true(number(blocks, "samples_per_block") == (double)FIXTURE_SAMPLES / FIXTURE_BLOCKS);
	/* Numbers are written with 15 digits at least: within half a unit of the last one. */
	assert_true(fabs(number(blocks, "bytes_per_sample") * FIXTURE_SAMPLES / number(root, "bytes") - 1) < 1e-14);
	assert_true(number(blocks, "bent") == 3 && number(blocks, "sheer") == 2);
	assert_int_equal(cJSON_GetArraySize(levels), 2);
	assert_int_equal(cJSON_GetArrayItem(levels, 0)->valueint, 5);
	assert_int_equal(cJSON_GetArrayItem(levels, 1)->valueint, 1);
	assert_int_equal(cJSON_GetArraySize(samples), 2);
	assert_int_equal(cJSON_GetArrayItem(samples, 0)->valueint, FIXTURE_SAMPLES - 36);
	assert_int_equal(cJSON_GetArrayItem(samples, 1)->valueint, 36);
	assert_true(number(adequacy, "pixels") == 1e6 && number(adequacy, "missing") == 3);
	assert_true(number(adequacy, "lost_to_culling") == 1);
	assert_int_equal(cJSON_GetArraySize(cameras), 2);
	last = cJSON_GetArrayItem(cameras, 1);
	assert_string_equal(cJSON_GetObjectItemCaseSensitive(last, "name")->valuestring, "S\303\274dwand");
	assert_string_equal(cJSON_GetObjectItemCaseSensitive(last, "kind")->valuestring, "orthographic");
	assert_int_equal(cJSON_GetArraySize(lights), 3);
	last = cJSON_GetArrayItem(lights, 2);
	assert_string_equal(cJSON_GetObjectItemCaseSensitive(last, "name")->valuestring, "beam");
	assert_string_equal(cJSON_GetObjectItemCaseSensitive(last, "kind")->valuestring, "spot");
	cJSON_Delete(root);
	free(text);
}

static void text_names_samples_and_content_id(void **state)
{
	const struct files *files = *state;
	int status;
	char *text = run_info(files, files->model, NULL, &status), *line;
	unsigned samples = 0;

	assert_int_equal(status, 0);
	line = strstr(text, "\nsamples ");
	assert_non_null(line);
	assert_int_equal(sscanf(line, " samples %u", &samples), 1);
	assert_int_equal(samples, FIXTURE_SAMPLES);
	assert_non_null(strstr(text, "\ncontent id "));
	assert_non_null(strstr(text, "\nadequacy          3 of 1,000,000 pixels of the visible surface miss (0.0003 %)\n"));
	assert_non_null(
		strstr(text, "\nculling loss      1 of 1,000,000 pixels of the visible surface are lost (0.0001 %)\n"));
	assert_non_null(strstr(text, "\n  perspective     front\n  orthographic    S\303\274dwand\n"));
	assert_non_null(strstr(text, "\n  level 1         36 samples in 1 blocks\n"));
	assert_non_null(strstr(text, " of all levels, all overhead included; "));
	free(text);
}

static void a_packed_model_is_told_apart(void **state)
{
	const struct files *files = *state;
	struct psr_model *model = NULL;
	int status;
	char *text = run_info(files, files->model, "--json", &status);
	cJSON *plain = cJSON_Parse(text), *packed;

	free(text);
	assert_int_equal(psr_model_read(&model, files->model, NULL), PSR_OK);
	assert_int_equal(psr_model_write_packed(model, files->model, NULL), PSR_OK);
	text = run_info(files, files->model, "--json", &status);
	packed = cJSON_Parse(text);
	assert_int_equal(status, 0);
	assert_true(cJSON_IsFalse(cJSON_GetObjectItemCaseSensitive(plain, "is_packed")));
	assert_true(cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(packed, "is_packed")));
	assert_true(number(packed, "bytes") == number(plain, "bytes"));
	assert_true(number(packed, "file_bytes") < number(plain, "file_bytes"));
	assert_string_equal(cJSON_GetObjectItemCaseSensitive(packed, "content_id")->valuestring,
	                    cJSON_GetObjectItemCaseSensitive(plain, "content_id")->valuestring);
	free(text);
	cJSON_Delete(plain);
	cJSON_Delete(packed);
	assert_int_equal(psr_model_write(model, files->model, NULL), PSR_OK);
	psr_model_unref(model);
}

static void broken_and_missing_files_have_their_exit_codes(void **state)
{
	const struct files *files = *state;
	int status;

	assert_int_equal(truncate(files->model, 100), 0);
	free(run_info(files, files->model, "--json", &status));
	assert_int_equal(status, 4);
	free(run_info(files, "/tmp/no/such/file.psr", NULL, &status));
	assert_int_equal(status, 3);
	free(run_info(files, files->model, "--jsn", &status));
	assert_int_equal(status, 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(json_tells_what_the_model_holds),
		cmocka_unit_test(text_names_samples_and_content_id),
		cmocka_unit_test(a_packed_model_is_told_apart),
		cmocka_unit_test(broken_and_missing_files_have_their_exit_codes),
	};

	return cmocka_run_group_tests(tests, write_model, remove_files);
}
