/* Records in the order of their paths, more than memory holds. */
#ifndef PSR_OCTREE_BUILD_RUNS_H
#define PSR_OCTREE_BUILD_RUNS_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"

#define RECORD_NO_NORMAL UINT16_MAX

struct record {
	uint64_t path;
	union {
		struct { /* a point */
			uint8_t color[3], part[3]; /* part: the place within the leaf, in 256ths */
			uint16_t normal;           /* base/direction.h; RECORD_NO_NORMAL */
		};
		uint32_t triangle;
	};
};

/* A record that is longer by what a scan tells of a point. */
struct scan_record {
	struct record record;
	uint16_t intensity;
	uint8_t class, returns;
	uint32_t time;
};

struct run {
	uint64_t at, end;   /* of the next bytes in the file, and behind the last ones */
	uint8_t *record;    /* what has been read: */
	size_t next, n;
};

struct runs {
	const char *folder;
	size_t bytes;      /* of a record: sizeof(struct record), or sizeof(struct scan_record) */
	uint8_t *record, *spare; /* room for a run each */
	size_t n, room;
	int bits;          /* of a path */
	int fd;            /* of a file without a name; -1: all records are in memory */
	uint64_t written;  /* bytes of the file; without one, the records that runs_next() has returned */
	struct run *run;
	uint32_t *heap;    /* of runs that have records left, the least path first */
	size_t n_runs, n_heap, runs_room, run_room; /* run_room: records of a run that are in memory while merging */
	struct scan_record taken;
};

/* Takes `memory` bytes for records, which are longer ones if is_scan. MEMORY. */
int runs_init(struct runs *runs, const char *folder, int bits, int is_scan, uint64_t memory, struct psr_error *err);
void runs_fini(struct runs *runs);

/* Copies a record of `bytes`. */
int runs_put(struct runs *runs, const struct record *record, struct psr_error *err); /* IO, MEMORY */

/* Ends the putting. IO, MEMORY. */
int runs_end(struct runs *runs, struct psr_error *err);

/* Returns the next record in the order of paths, valid until the next call; NULL behind the last one, or with *rc
 * other than PSR_OK. Records of one path come in a fixed order. */
const struct record *runs_next(struct runs *runs, int *rc, struct psr_error *err);

#endif
