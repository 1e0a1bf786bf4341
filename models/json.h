/* Answers as JSON. */
#ifndef PSR_MODELS_JSON_H
#define PSR_MODELS_JSON_H

#include <cjson/cJSON.h>
#include "psr/error.h"

/* Prints `json`, which it frees, on standard output. MEMORY. */
int json_print(cJSON *json, struct psr_error *err);

#endif
