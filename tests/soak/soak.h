/* psrd under many clients at once, good and bad ones: what the files of this folder share. Each client is a thread. */
#ifndef TESTS_SOAK_H
#define TESTS_SOAK_H

#include <stdatomic.h>
#include <stdint.h>
#include <sys/types.h>
#include "base/clock.h"
#include "base/random.h"

#define SOAK_CLIENTS 64
#define SOAK_WINDOW_NS UINT64_C(2000000000)
#define SOAK_MODELS 10

extern const char *const soak_model[SOAK_MODELS];

struct soak {
	const char *psrd, *relay, *models; /* programs; a folder of soak_model's */
	double seconds;                    /* of the crowd */
	int64_t seed, patience_ms;         /* for whatever must happen */
	char address[128], relay_address[128];
	atomic_int is_over;                /* clients finish what they have asked for, and leave */
	atomic_int is_ending;              /* psrd has been told to end: it may close connections */
	atomic_int n_failures;
};
extern struct soak soak;

struct client { /* a thread */
	unsigned number;
	uint64_t random;
	atomic_uint n_frames;  /* that came */
	atomic_uint n_ends, n_superseded, n_busy, n_on_base, n_sharp, n_runs;
};

void soak_fail(const char *format, ...) __attribute__((format(printf, 1, 2))); /* says so, and counts it */
void soak_sleep_ms(unsigned ms);

/* Bodies of threads, until soak.is_over. */
void polite_move(struct client *client);   /* views: moves and rests */
void polite_stay(struct client *client);   /* view 0, several requests at once */
void polite_visit(struct client *client);  /* comes, lists, draws, leaves, again and again */
void polite_slowly(struct client *client); /* as polite_move(), over a slow line */
void rude_client(struct client *client);   /* breaks rules, stops reading, goes without a word */

/* A child with its standard output in a pipe, from which its READY line is read, and its errors in a file. */
pid_t watch_start(const char *const *argv, const char *errors, char address[128]);

struct watch { /* of a process */
	long resident_kb, descriptors;
};
struct watch watch_look(pid_t pid);

#endif
