/* The figures of a comparison, and its verdict, for people or as JSON. */
#ifndef MODELS_ACCURACY_PRINT_H
#define MODELS_ACCURACY_PRINT_H

#include "verdict.h"

struct accuracy_result {
	struct psr_accuracy depth;
	struct psr_color_accuracy color;   /* if has_color */
	struct psr_shadow_accuracy shadow; /* if has_shadow */
	int has_color, has_shadow;
	enum accuracy_verdict verdict;
	char text[ACCURACY_TEXT];
};

/* Prints on standard output; as JSON, a verdict other than PASS goes to standard error as well. MEMORY, IO. */
int accuracy_print(const struct accuracy_result *result, int is_json, struct psr_error *err);

#endif
