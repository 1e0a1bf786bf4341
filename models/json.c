#include "json.h"

#include <stdio.h>

int json_print(cJSON *json, struct psr_error *err)
{
	char *text = cJSON_Print(json);

	cJSON_Delete(json);
	if (text == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to print JSON");
	puts(text);
	cJSON_free(text);
	return PSR_OK;
}
