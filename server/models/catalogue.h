/* The catalogue: from names to files of the models folder; the models in memory.
 *
 * `dragon.psr` and `dragon.glb` are both the model `dragon`. Of several files with one name the .psr wins, then the one
 * directly in the folder, then .glb, .gltf, then the path that sorts first. A subfolder whose model files all have one
 * stem counts with that stem (clearcoat/ClearCoatTest.gltf is `ClearCoatTest`). Names are looked up, never used as
 * paths.
 *
 * Some files are entries that cannot be served, with a reason: a file in a format that psr does not read, unless a
 * model has its name; a second source of one name, under its path (`scan.ply`); a subfolder of several models, under the
 * folder's name; a file whose name is not clean UTF-8, with `?` for each byte that is not ASCII. The catalogue ignores
 * hidden files and all others.
 *
 * Scanning may run on any thread; everything else belongs to the loop's. */
#ifndef PSRD_CATALOGUE_H
#define PSRD_CATALOGUE_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"
#include "psr/model.h"
#include "psr/proto.h"

#define CATALOGUE_MAX_FILES 65536
#define CATALOGUE_KEY 33 /* 32 hexadecimal digits and the NUL */

struct catalogue_file {
	char name[PSR_WIRE_MAX_NAME + 1];
	char *path;
	int is_source;           /* must be built first */
	int is_nested;           /* in a subfolder */
	int is_broken;           /* a .psr with a bad header; opening it says why */
	char *reason;            /* why it cannot be served, for people; NULL: it can */
	uint64_t bytes;          /* with the files that a source names */
	uint64_t device, inode;
	int64_t modified_ns;
};

struct catalogue_listing { /* sorted by the bytes of the names, each name once */
	struct catalogue_file *file;
	size_t n;
};

/* Reads the folder. IO, NOT_FOUND, LIMIT (too many files), MEMORY. */
int catalogue_scan(struct catalogue_listing **out, const char *folder, struct psr_error *err);
void catalogue_listing_destroy(struct catalogue_listing *listing); /* NULL is fine */
void catalogue_file_fini(struct catalogue_file *file);

/* Whether a file of this name is a source that psr-model can read, by its ending. */
int catalogue_is_source(const char *file_name);

struct catalogue_model { /* a model in memory; users are handles and scenes */
	struct psr_model *model;
	struct catalogue_entry *entry; /* NULL: its file has changed or gone; freed with its last user */
	struct catalogue_model *of_entry; /* the next one of the same entry */
	char key[CATALOGUE_KEY];       /* of a built model, else "" */
	uint32_t resolution;           /* of its build; 0: a .psr file */
	int is_stale;                  /* its source may have changed since */
	uint64_t bytes, last_use;
	uint32_t n_users;
	struct catalogue_model *next;
};

struct catalogue_entry {
	struct catalogue_file file;
	struct catalogue_model *model; /* in memory, the latest first; a source has one a resolution */
	uint8_t content_id[16];        /* of the latest model; zero: unknown */
	int has_failed;                /* the last attempt to read or build it failed */
};

struct catalogue {
	struct catalogue_entry *entry;
	size_t n;
	struct catalogue_model *models;
	uint64_t bytes, reserved, max_bytes, clock;
	uint32_t n_models;
};

void catalogue_init(struct catalogue *catalogue, uint64_t max_bytes);
void catalogue_fini(struct catalogue *catalogue);

/* Replaces the entries, keeps models of unchanged files, takes the listing. MEMORY: changes nothing. */
int catalogue_adopt(struct catalogue *catalogue, struct catalogue_listing *listing);

struct catalogue_entry *catalogue_find(struct catalogue *catalogue, const char *name); /* NULL if there is none */

/* Makes room for a model of so many bytes: drops unused models, the least recently used first. LIMIT if the rest
 * leaves too little. Every reservation ends in catalogue_add or catalogue_release. */
int catalogue_reserve(struct catalogue *catalogue, uint64_t bytes, const char *name, struct psr_error *err);
void catalogue_release(struct catalogue *catalogue, uint64_t bytes);

/* The entry's model of this resolution (0: of a .psr file), or NULL: not in memory. */
struct catalogue_model *catalogue_model(const struct catalogue_entry *entry, uint32_t resolution);

struct catalogue_loaded {
	struct catalogue_entry *entry; /* NULL: none any more */
	struct psr_model *model;       /* a reference, which catalogue_add() takes */
	const char *key;               /* of a built model, else "" */
	uint32_t resolution;           /* 0: of a .psr file */
	uint64_t reserved;             /* bytes reserved for it */
};

/* Takes the model in, in place of its reservation and of the entry's model of this resolution; *out is one user's
 * reference. MEMORY: the model is released. */
int catalogue_add(struct catalogue_model **out, struct catalogue *catalogue, const struct catalogue_loaded *loaded);

struct catalogue_model *catalogue_ref(struct catalogue *catalogue, struct catalogue_model *model);
void catalogue_unref(struct catalogue *catalogue, struct catalogue_model *model);

#endif
