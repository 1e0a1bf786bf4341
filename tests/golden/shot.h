/* The shots of a suite (psr-suite(5)) as scenes for the renderer: what `psr test` asks psrd for, without sockets. */
#ifndef TESTS_GOLDEN_SHOT_H
#define TESTS_GOLDEN_SHOT_H

#include "psr/render.h"

#define SHOT_NAME_BYTES 64
#define SHOT_MAX_LIGHTS 8

struct shot {
	char name[SHOT_NAME_BYTES], model[SHOT_NAME_BYTES];
	uint32_t size[2];
	int is_smooth;
	unsigned n_passes;
	struct psr_scene scene; /* of instance and light below: the shot must stay where it is */
	struct psr_instance instance;
	struct psr_light light[SHOT_MAX_LIGHTS];
	uint64_t color, depth; /* the hashes that are expected */
};

/* Gives every shot of the file to on_shot, in order. Knows the words that the golden frames need; each shot has a hash
 * of colour and one of depth. open: gives the model of a name, or NULL. ARG, NOT_FOUND, and the errors of
 * wordfile_read(). */
int shots_read(const char *path, const struct psr_model *(*open)(const char *name), void (*on_shot)(struct shot *shot),
               struct psr_error *err);

#endif
