#include "base/clock.h"
#include "report.h"

#include <stdio.h>
#include <stdlib.h>

static cJSON *root;

double report_ms(void)
{
	return (double)clock_ns() * 1e-6;
}

double report_ratio(double a, double b)
{
	return b == 0 ? 0 : a / b;
}

void report_die(const char *what, const char *detail)
{
	fflush(stdout);
	fprintf(stderr, "bench: %s: %s\n", what, detail);
	exit(1);
}

void *report_alloc(size_t n, size_t size)
{
	void *memory = calloc(n > 0 ? n : 1, size);

	if (memory == NULL)
		report_die("memory", "there is not enough");
	return memory;
}

static cJSON *member(const char *name, cJSON *(*create)(void))
{
	cJSON *item;

	if (root == NULL)
		root = cJSON_CreateObject();
	item = cJSON_GetObjectItemCaseSensitive(root, name);
	if (item == NULL) {
		item = create();
		cJSON_AddItemToObject(root, name, item);
	}
	return item;
}

cJSON *report_array(const char *name)
{
	return member(name, cJSON_CreateArray);
}

cJSON *report_object(const char *name)
{
	return member(name, cJSON_CreateObject);
}

cJSON *report_add(cJSON *array)
{
	cJSON *item = cJSON_CreateObject();

	cJSON_AddItemToArray(array, item);
	return item;
}

void report_number(cJSON *object, const char *name, double value)
{
	cJSON_AddNumberToObject(object, name, value);
}

void report_text(cJSON *object, const char *name, const char *value)
{
	cJSON_AddStringToObject(object, name, value);
}

void report_target(const char *what, double value, const char *unit, enum report_bound kind, double bound)
{
	cJSON *item = report_add(report_array("targets"));

	report_text(item, "what", what);
	report_number(item, "value", value);
	report_text(item, "unit", unit);
	report_text(item, "kind", kind == REPORT_AT_MOST ? "at most" : "at least");
	report_number(item, "bound", bound);
	cJSON_AddBoolToObject(item, "met", kind == REPORT_AT_MOST ? value <= bound : value >= bound);
}

static double number_of(const cJSON *item, const char *name)
{
	return cJSON_GetNumberValue(cJSON_GetObjectItemCaseSensitive(item, name));
}

static const char *text_of(const cJSON *item, const char *name)
{
	return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, name));
}

void report_print_targets(void)
{
	const cJSON *list = report_array("targets"), *item;
	int n = 0, n_met = 0;

	printf("\nTargets\n");
	cJSON_ArrayForEach(item, list) {
		const int met = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(item, "met"));

		printf("%-48s %9.4g %-6s %s %6g: %s\n", text_of(item, "what"), number_of(item, "value"), text_of(item, "unit"),
		       text_of(item, "kind"), number_of(item, "bound"), met ? "met" : "missed");
		n++;
		n_met += met;
	}
	printf("%d of %d met, %d missed\n", n_met, n, n - n_met);
}

void report_write(const char *path)
{
	char *text = cJSON_Print(root);
	FILE *file = fopen(path, "w");

	if (text == NULL || file == NULL || fprintf(file, "%s\n", text) < 0 || fclose(file) != 0)
		report_die(path, "cannot be written");
	cJSON_free(text);
	cJSON_Delete(root);
	root = NULL;
}
