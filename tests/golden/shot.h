/* The shots of tests/golden/shots as scenes for the renderer: what `psr shot` asks psrd for, without sockets. */
#ifndef TESTS_GOLDEN_SHOT_H
#define TESTS_GOLDEN_SHOT_H

#include "psr/render.h"

#define SHOT_NAME_BYTES 64
#define SHOT_MAX_LIGHTS 8

struct shot {
	char name[SHOT_NAME_BYTES], model[SHOT_NAME_BYTES];
	uint32_t size[2];
	int is_smooth;
	struct psr_scene scene; /* of instance and light below: the shot must stay where it is */
	struct psr_instance instance;
	struct psr_light light[SHOT_MAX_LIGHTS];
};

/* A line of the file, which is changed: a name and options of `psr shot`. `open` gives the model of a name, or NULL.
 * PSR_OK, 1 for an empty line or a comment, or ARG, NOT_FOUND. */
int shot_parse(struct shot *shot, char *line, const struct psr_model *(*open)(const char *name), struct psr_error *err);

#endif
