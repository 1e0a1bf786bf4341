/* Builds and prints JSON. Its users link libcjson. */
#ifndef PSR_BASE_JSON_H
#define PSR_BASE_JSON_H

#include <cjson/cJSON.h>
#include <stdint.h>
#include "psr/error.h"

/* Writes numbers so that they read back as the same double. */
void json_add_number(cJSON *to, const char *name, double v);
void json_add_numbers(cJSON *to, const char *name, const double *v, int n);

/* Adds a model's content id, in hexadecimal. */
#define JSON_ID_TEXT 33
const char *json_id(char text[JSON_ID_TEXT], const uint8_t id[16]);

/* Returns the text of `json` with a newline, which the caller frees (free), and frees `json`. NULL without memory. */
char *json_text(cJSON *json);

/* Prints `json` on standard output, and frees it. MEMORY, IO. */
int json_print(cJSON *json, struct psr_error *err);

#endif
