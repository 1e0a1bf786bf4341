/* The shots of a suite (psr-suite(5)) as scenes for the renderer: what `psr test` asks psrd for, without sockets. */
#ifndef TESTS_GOLDEN_SHOT_H
#define TESTS_GOLDEN_SHOT_H

#include "psr/render.h"

#define SHOT_NAME_BYTES 64
#define SHOT_MAX_LIGHTS 8
#define SHOT_MAX_INSTANCES 4

struct shot {
	char name[SHOT_NAME_BYTES];
	uint32_t size[2];
	enum psr_smooth smooth;
	unsigned n_passes;
	int with_splats;
	struct psr_scene scene; /* of instances and lights below: the shot must stay where it is */
	struct psr_instance instance[SHOT_MAX_INSTANCES];
	struct psr_light light[SHOT_MAX_LIGHTS];
	unsigned planes;              /* 1 << enum psr_plane, OR-ed: those that have a hash */
	uint64_t hash[PSR_N_PLANES];  /* the hashes that are expected */
};

/* Gives every shot of the file to on_shot, in order. Knows the words that the golden frames need; each shot has a hash
 * of a plane, or several. open: gives the model of a name, or NULL. ARG, NOT_FOUND, and the errors of
 * wordfile_read(). */
int shots_read(const char *path, const struct psr_model *(*open)(const char *name), void (*on_shot)(struct shot *shot),
               struct psr_error *err);

#endif
