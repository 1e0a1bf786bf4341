/* A thread of a load: an event loop over its share of the connections. */
#ifndef PSR_CLIENT_BENCH_WORKER_H
#define PSR_CLIENT_BENCH_WORKER_H

#include <pthread.h>
#include <stdatomic.h>
#include "arrivals.h"
#include "bench.h"

/* What the threads of a load share. */
struct worker_gate {
	pthread_mutex_t lock;
	pthread_cond_t changed;
	uint32_t n_ready, n_over;          /* threads */
	int state;                         /* 0 closed; 1 go; -1 go home */
	uint64_t start_ns, begin_ns;       /* of the load; of measuring */
	_Atomic uint64_t end_ns;           /* no request is due from then on */
	_Atomic int64_t n_asked;           /* since begin_ns, with load.n_frames */
};

struct worker_row { /* since it was last read */
	struct histogram latency;
	uint64_t n_drawn, n_bytes, n_superseded, n_failed;
};

struct worker_waiting { uint64_t k, intended_ns; };

struct worker_client {
	struct conn conn; /* first */
	uint64_t next_k, n_drawn;
	struct worker_waiting *waiting; /* a ring of requests that are due, but may not be open yet */
	size_t first, n_waiting, capacity;
	int is_watched, is_lost;
	uint32_t events;
};

struct worker {
	const struct bench_plan *plan;
	const struct bench_load *load;
	struct worker_gate *gate;
	uint32_t index, n_clients; /* it has connections index, index + load.n_threads, ... */
	pthread_t thread;
	struct conn_shared shared;
	struct worker_client *client;
	int epoll, timer;
	struct arrivals arrivals;
	uint64_t next_request;     /* of a recording */
	uint32_t turn;             /* whose is the next request of an open loop */
	uint32_t n_ready, n_lost;
	uint64_t n_open, n_seen, timer_ns;
	uint64_t checked_ns, n_heard; /* when silence was looked for, and the bytes that had come by then */
	int64_t n_silent;          /* looks since the server said anything */
	uint64_t used_ns, used_from_ns; /* processor time */
	struct bench_kept *kept;
	size_t n_kept;
	pthread_mutex_t lock;      /* guards the next two */
	struct measure total;
	struct worker_row row;
	_Atomic uint64_t n_waiting;
	_Atomic uint64_t last_ns;  /* when the last measured answer came */
	struct psr_error error;    /* code 0: none; of setting up, or of the first connection that was lost */
};

/* Makes the thread's parts; worker_fini() is due also after an error. LIMIT, MEMORY. */
int worker_init(struct worker *worker, struct psr_error *err);
void worker_fini(struct worker *worker);

/* The thread. */
void *worker_run(void *worker);

/* worker_answer.c */
void worker_on_answer(struct conn *conn, const struct conn_request *request, const struct conn_answer *answer);
void worker_count_unfinished(struct worker *worker);
int worker_is_measured(const struct worker *worker, uint64_t intended_ns);

/* worker.c: what a client may ask for now, it does. */
void worker_ask(struct worker *worker, struct worker_client *client);

#endif
