/* What the files of `make bench-daemon` share: a psrd that was started for it, connections that take pictures without
 * looking at them, and figures. */
#ifndef TESTS_BENCH_DAEMON_H
#define TESTS_BENCH_DAEMON_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>
#include "proto/proto.h"
#include "scene.h"

#define DAEMON_MODEL "stanford"
#define DAEMON_RESOLUTION 1024
#define DAEMON_QUALITY 85
#define DAEMON_MOST_BUILDS 4
#define LINK_STORAGE_BYTES (4 * PSR_WIRE_MAX_MESSAGE)

/* ---- figures ---- */

enum daemon_bound { DAEMON_NO_BOUND, DAEMON_AT_MOST, DAEMON_AT_LEAST };

struct daemon_bench {
	const char *folder;        /* of models */
	struct psr_model *model;   /* which the daemon serves, too */
	const char *psrd[DAEMON_MOST_BUILDS]; /* programs that are measured; the first is held against the targets */
	unsigned n_builds, build;  /* the one under measurement */
	double seconds;            /* of a measurement; a case has several */
};

/* A figure of the case and build under measurement. Names of a case are the same for all builds. */
void daemon_figure(const struct daemon_bench *bench, const char *name, const char *unit, double value,
                   enum daemon_bound kind, double bound);

void daemon_must(int code, const char *what, const struct psr_error *err); /* or the end */

/* ---- a daemon ---- */

struct daemon_server {
	pid_t pid;
	char socket[108];
	int minor;                 /* of the protocol */
};

/* Starts the build under measurement with two threads; `options` (NULL ends them) come after. */
void daemon_start(struct daemon_server *server, const struct daemon_bench *bench, const char *const *options);
void daemon_stop(struct daemon_server *server);

double daemon_processor_s(const struct daemon_server *server); /* processor time of all its threads so far */
/* The part of the machine's processors that other programs used since the last call; while no daemon runs. */
double daemon_others(void);
double daemon_peak_bytes(const struct daemon_server *server);
/* The sum of a field's numbers in a file of lines `NAME: NUMBER`; names that begin alike count, too. 0 without the file. */
double daemon_field(const char *path, const char *name);
double daemon_switches(const struct daemon_server *server);    /* context switches of all its threads so far */

/* ---- a connection ---- */

/* The whole model, seen by a camera that swings. */
void daemon_film(struct scene_film *film, const struct daemon_bench *bench, uint32_t width, uint32_t height);

struct link {
	int fd;                    /* -1: closed */
	int minor, is_lost;        /* the server closed it, or said ERROR with id 0 */
	uint8_t *storage;
	size_t n_stored;
	uint32_t next_id, handle;
	const struct scene_film *film;
	struct psr_msg_frame frame; /* what it asks for; the camera swings */
	uint16_t view;
	unsigned n_wanted;         /* requests that links_run() keeps open */
	uint64_t period_ns, due_ns; /* between requests; 0: none */
	struct { uint32_t id; uint64_t sent_ns; } open[PSR_WIRE_MAX_OPEN];
	unsigned n_open, n_asked;
	/* results */
	unsigned n_done, n_failed, n_replies;
	double cores_s;            /* that psrd's cores worked for its frames, if psrd tells */
	uint32_t last_id;          /* of the last FRAME_END, */
	unsigned last_pass;
	uint64_t last_ns;          /* and when it came */
	double *latency_ms;        /* of final FRAME_ENDs */
	size_t n_latencies, capacity;
	struct psr_msg_stats_reply stats;
	struct psr_error error;    /* the first one */
};

int link_minor(const struct daemon_server *server); /* of the protocol: the newest, or 1 */

/* Connects, opens the model, and sends the scene of the film to slot 0. */
void link_connect(struct link *link, const struct daemon_server *server, const struct scene_film *film);
void link_scene(struct link *link, const struct psr_scene *scene); /* another one; one model */
void link_close(struct link *link);

void link_frame(struct link *link, uint32_t width, uint32_t height); /* what it asks for from now on: JPEG */
uint32_t link_ask(struct link *link);
void link_cancel(struct link *link, uint32_t id);

/* Asks and takes answers for so long; ends at once where nothing is open and nobody wants anything. */
void links_run(struct link *links, unsigned n, double seconds);
void links_finish(struct link *links, unsigned n, double most_seconds); /* asks for nothing more, waits for what is open */
void links_forget(struct link *links, unsigned n);                      /* the results so far */

void link_send(struct link *link, const uint8_t *data, size_t n);
void link_wait(struct link *link, const char *what); /* until there is one more answer, of whatever kind */

/* The value of the server's statistics, 0 if it has none. Waits for the answer. */
uint64_t link_stat(struct link *link, unsigned id);

double link_percentile(struct link *link, double part); /* of latency_ms; 0 of none */

/* ---- cases ---- */

void daemon_beside_stills(struct daemon_bench *bench);
void daemon_beside_worst(struct daemon_bench *bench);
void daemon_given_up(struct daemon_bench *bench);
void daemon_at_rest(struct daemon_bench *bench);
void daemon_equals(struct daemon_bench *bench);
void daemon_mixed(struct daemon_bench *bench);
void daemon_throughput(struct daemon_bench *bench);
void daemon_memory(struct daemon_bench *bench);
void daemon_overhead(struct daemon_bench *bench);

#endif
