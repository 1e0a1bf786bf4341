#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include "json.h"
#include "outfile.h"

static cJSON *make_number(double v)
{
	char text[32];

	snprintf(text, sizeof text, "%.17g", v);
	return cJSON_CreateRaw(text);
}

void json_add_number(cJSON *to, const char *name, double v)
{
	cJSON_AddItemToObject(to, name, make_number(v));
}

void json_add_numbers(cJSON *to, const char *name, const double *v, int n)
{
	cJSON *array = cJSON_AddArrayToObject(to, name);

	for (int i = 0; i < n; i++)
		cJSON_AddItemToArray(array, make_number(v[i]));
}

const char *json_id(char text[JSON_ID_TEXT], const uint8_t id[16])
{
	for (int i = 0; i < 16; i++)
		snprintf(text + 2 * i, 3, "%02x", id[i]);
	return text;
}

char *json_text(cJSON *json)
{
	char *printed = cJSON_Print(json), *text = NULL;

	cJSON_Delete(json);
	if (printed != NULL && asprintf(&text, "%s\n", printed) < 0)
		text = NULL;
	cJSON_free(printed);
	return text;
}

int json_print(cJSON *json, struct psr_error *err)
{
	char *text = json_text(json);

	if (text == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the JSON text");
	fputs(text, stdout);
	free(text);
	return outfile_flush_stdout(err);
}
