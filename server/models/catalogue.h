/* The catalogue: which file of the models folder has which name, and which models are in memory.
 *
 * `dragon.psr` and `dragon.glb` are both the model `dragon`. Of several files with one name the .psr wins, then the
 * file directly in the folder, then .glb, .gltf, then the path that sorts first. A subfolder whose model files all have
 * one stem counts as that stem (clearcoat/ClearCoatTest.gltf is `ClearCoatTest`). Names are looked up, and never used
 * as paths.
 *
 * Some files become entries that cannot be served, with a reason: a file in a format that psr does not read, unless a
 * model has its name; a second source of one name, under its path (`scan.ply`); a subfolder of several models, under
 * the folder's name; a file whose name is not clean UTF-8, with `?` for each byte that is not ASCII. The catalogue
 * ignores hidden files and all others.
 *
 * Scanning may run on any thread; everything else belongs to the loop's. */
#ifndef PSRD_CATALOGUE_H
#define PSRD_CATALOGUE_H

#include <stddef.h>
#include <stdint.h>
#include "card.h"
#include "psr/error.h"
#include "psr/model.h"
#include "proto/proto.h"
#include "base/pool.h"

#define CATALOGUE_MAX_FILES 65536
#define CATALOGUE_KEY 33 /* 32 hexadecimal digits and the NUL */

struct catalogue_file {
	char name[PSR_WIRE_MAX_NAME + 1];
	char *path;
	int is_source;           /* psrd must build a model of it first */
	int is_nested;           /* in a subfolder */
	int is_broken;           /* a .psr with a bad header; opening it says why */
	uint32_t beginnings;     /* of a .psr: psr_model_beginnings() */
	char *reason;            /* why psrd cannot serve it, for people; NULL: it can */
	uint64_t bytes;          /* including the files that a source names */
	uint64_t device, inode;
	int64_t modified_ns;
};

struct catalogue_model;

struct catalogue_entry {
	struct catalogue_file file;
	struct catalogue_model *model; /* head of a list, the latest first; a source has one for each resolution, a .psr one
	                                * for each beginning */
	uint8_t content_id[16];        /* of the latest model; zero: unknown */
	int has_failed;                /* the last attempt to read or build it failed */
};

struct catalogue_listing { /* sorted by the bytes of the names; no name twice */
	struct catalogue_entry *entry;
	size_t n;
};

/* Reads the folder. IO, NOT_FOUND, LIMIT (too many files), MEMORY. */
int catalogue_scan(struct catalogue_listing **out, const char *folder, struct psr_error *err);
void catalogue_listing_destroy(struct catalogue_listing *listing); /* NULL is fine */
void catalogue_file_fini(struct catalogue_file *file);

/* Returns whether a file of this name is a source that psr-model can read; only the ending counts. */
int catalogue_is_source(const char *file_name);
/* Returns whether it holds points alone, whatever is in it. */
int catalogue_is_cloud(const char *file_name);

/* A model that has been in memory. Its users (handles and scenes) keep its name and its card; its pins (frames) keep it
 * in memory. A model without pins leaves memory when another needs the room, the longest unused first, and comes back
 * when a frame asks for it (residence.h). A model without users is forgotten when it leaves. */
struct catalogue_model {
	struct psr_model *model; /* NULL: out of memory */
	struct card card;
	struct catalogue_entry *entry; /* NULL: its file has changed or is gone */
	struct catalogue_model *of_entry; /* next model of the same entry */
	char key[CATALOGUE_KEY];       /* of a built model, else "" */
	uint32_t resolution;           /* of its build; 0: it came from a .psr file */
	uint32_t levels;               /* of the beginning of that file; 0: all of it */
	int is_stale;                  /* its source may have changed since it was built */
	uint64_t bytes;                /* memory that it takes, or took before it left */
	uint32_t n_users, n_pins;
	struct coming *coming;         /* set while it comes back; belongs to residence.c */
	struct catalogue_model *older, *newer; /* list of the models in memory without pins, by last use */
};

/* A claim waits for room; claims are tried in order of arrival. Part of its owner. */
struct catalogue_claim {
	struct catalogue_claim *next;
	int (*try)(void *userdata); /* takes the room, after catalogue_unclaim(), and returns 1; returns 0 if there is still
	                             * too little */
	void *userdata;
	unsigned n_overtaken;
};

/* Other users of max_bytes: frames and queues. */
struct catalogue_others {
	/* frees up to `wanted` bytes of what they keep for later; returns the bytes that they still hold */
	uint64_t (*held)(uint64_t wanted, void *userdata);
	void *userdata;
};

struct catalogue {
	struct catalogue_entry *entry;
	size_t n;
	struct catalogue_model *oldest, *newest; /* list of models without pins */
	struct catalogue_claim *first_claim, **last_claim;
	int is_trying;
	uint64_t bytes, pinned;              /* of models in memory; of pinned ones among them */
	uint64_t reserved, max_bytes;        /* reserved: for models on their way; max_bytes: for all models and for others
	                                      * together */
	struct catalogue_others others;      /* held NULL: there are no others */
	uint32_t n_models;                   /* in memory */
	uint64_t n_left, n_returned;         /* how often a model with users left memory, and came back */
	struct psr_pool *io;                 /* frees large memory off the loop; NULL: it is freed at once */
};

void catalogue_init(struct catalogue *catalogue, uint64_t max_bytes);
void catalogue_fini(struct catalogue *catalogue);

/* Replaces the entries, keeps models of unchanged files, and takes the listing. */
void catalogue_adopt(struct catalogue *catalogue, struct catalogue_listing *listing);

int catalogue_has_sources(const struct catalogue *catalogue); /* whether some file has to be built */

struct catalogue_entry *catalogue_find(struct catalogue *catalogue, const char *name); /* NULL if there is none */

/* Sets bytes aside; models without pins leave memory for them. BUSY: pinned models, models on their way and others
 * leave too little now; LIMIT: more than max_bytes. Every reservation ends in catalogue_add, _return or _release. */
int catalogue_reserve(struct catalogue *catalogue, uint64_t bytes, const char *name, struct psr_error *err);
void catalogue_release(struct catalogue *catalogue, uint64_t bytes);

/* Removes models without pins from memory until `bytes` are freed or none is left; returns the bytes freed. */
uint64_t catalogue_make_room(struct catalogue *catalogue, uint64_t bytes);

/* Calls claim->try() now, and again whenever there may be more room, until it returns 1; earlier claims come first. */
void catalogue_claim(struct catalogue *catalogue, struct catalogue_claim *claim);
/* ends a claim; fine for one that does not wait */
void catalogue_unclaim(struct catalogue *catalogue, struct catalogue_claim *claim);

/* Returns whether a request that needs no room may overtake claims that wait. Returns 1 only so often that the claims
 * do not starve. */
int catalogue_overtake(struct catalogue *catalogue);

/* Returns the entry's model of this resolution (0: from a .psr file) and of so many levels (0: all), or NULL. */
struct catalogue_model *catalogue_model(const struct catalogue_entry *entry, uint32_t resolution, uint32_t levels);

int catalogue_is_loaded(const struct catalogue_entry *entry); /* one of the entry's models is in memory */

struct catalogue_loaded {
	struct catalogue_entry *entry; /* NULL: the entry is gone */
	struct psr_model *model;       /* a reference; catalogue_add() takes it */
	const char *key;               /* of a built model; else "" */
	uint32_t resolution, levels;   /* as in struct catalogue_model */
	uint64_t reserved;             /* bytes reserved for the model */
};

/* Adds a model in place of its reservation. It replaces the entry's model of this resolution and levels; if that has
 * the same content, the old one comes back into memory instead. *out is one user's reference. MEMORY: the model is
 * released. */
int catalogue_add(struct catalogue_model **out, struct catalogue *catalogue, const struct catalogue_loaded *loaded);

/* Takes a model that has come back (a reference) in place of its reservation; its content must be that of the card. */
void catalogue_return(struct catalogue *catalogue, struct catalogue_model *model, struct psr_model *returned,
                      uint64_t reserved);

struct catalogue_model *catalogue_ref(struct catalogue *catalogue, struct catalogue_model *model);
void catalogue_unref(struct catalogue *catalogue, struct catalogue_model *model);

void catalogue_pin(struct catalogue *catalogue, struct catalogue_model *model); /* also for a model out of memory */
void catalogue_unpin(struct catalogue *catalogue, struct catalogue_model *model);

void catalogue_let_go(struct catalogue *catalogue, struct psr_model *model); /* gives up a reference; the memory is
                                                                              * freed off the loop */

/* For catalogue.c and catalogue_memory.c: the model loses its entry; there may be more room. */
void catalogue_detach(struct catalogue *catalogue, struct catalogue_model *model);
void catalogue_try_claims(struct catalogue *catalogue);

#endif
