/* JSON that programs print and write. Its users link libcjson. */
#ifndef PSR_BASE_JSON_H
#define PSR_BASE_JSON_H

#include <cjson/cJSON.h>
#include <stdint.h>
#include "psr/error.h"

/* Numbers that read back as the same double. */
void json_add_number(cJSON *to, const char *name, double v);
void json_add_numbers(cJSON *to, const char *name, const double *v, int n);

/* A model's content id, in hexadecimal. */
#define JSON_ID_TEXT 33
const char *json_id(char text[JSON_ID_TEXT], const uint8_t id[16]);

/* The text of `json`, which it frees, with a newline; the caller's (free). NULL: no memory. */
char *json_text(cJSON *json);

/* Prints `json`, which it frees, on standard output. MEMORY, IO. */
int json_print(cJSON *json, struct psr_error *err);

#endif
