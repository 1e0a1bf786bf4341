/* Counts answers, under the lock that the rows are read by. */
#include <stdlib.h>
#include "base/clock.h"
#include "worker.h"

/* With n_frames all requests since begin_ns were counted when they were sent, and no others were sent. */
int worker_is_measured(const struct worker *worker, uint64_t intended_ns)
{
	return intended_ns >= worker->gate->begin_ns
	       && (worker->load->n_frames > 0 || intended_ns < atomic_load(&worker->gate->end_ns));
}

/* Memory for kept answers grows by doubling; without memory fewer are kept. */
static void keep(struct worker *worker, const struct conn *conn, const struct conn_request *request,
                 const struct conn_answer *answer)
{
	const struct psr_msg_frame_end *end = answer->end; /* NULL: it was not drawn */
	struct bench_kept *grown = worker->kept;
	const size_t n = worker->n_kept;

	if (worker->load->keep == 0 || worker->n_seen++ % (uint64_t)worker->load->keep != 0)
		return;
	if ((n & (n - 1)) == 0)
		grown = realloc(grown, (n == 0 ? 1 : 2 * n) * sizeof *grown);
	if (grown == NULL)
		return;
	worker->kept = grown;
	grown[worker->n_kept++] = (struct bench_kept){
		.due_ns = request->intended_ns - worker->gate->begin_ns, .k = request->k, .bytes = request->bytes,
		.latency_ns = worker->shared.now_ns - request->intended_ns, .client = conn->index, .kind = request->kind,
		.outcome = answer->outcome, .code = answer->code, .pass = end != NULL ? end->pass : 0,
		.hash = end != NULL ? end->hash[PSR_PLANE_COLOR] : 0, .has_hash = end != NULL && end->has_hashes,
		.settings = request->settings,
	};
}

static void count(struct worker *worker, struct worker_client *client, const struct conn_request *request,
                  const struct conn_answer *answer)
{
	const uint64_t now_ns = worker->shared.now_ns;
	const int is_measured = worker_is_measured(worker, request->intended_ns);
	/* A load of so many requests measures until the last of them has come. */
	const int is_in_time = worker->load->n_frames > 0 ? is_measured
	                       : now_ns >= worker->gate->begin_ns && now_ns < atomic_load(&worker->gate->end_ns);

	pthread_mutex_lock(&worker->lock);
	if (is_measured) {
		measure_add(&worker->total, request, answer, now_ns);
		atomic_store(&worker->last_ns, now_ns);
	}
	if (is_in_time) {
		struct worker_row *row = &worker->row;

		row->n_superseded += answer->outcome == CONN_SUPERSEDED;
		row->n_failed += answer->outcome == CONN_FAILED;
		if (answer->outcome == CONN_DRAWN) {
			row->n_drawn++;
			row->n_bytes += request->bytes;
			histogram_add(&row->latency, now_ns - request->intended_ns);
			client->n_drawn++;
		}
	}
	pthread_mutex_unlock(&worker->lock);
	if (is_measured)
		keep(worker, &client->conn, request, answer);
}

void worker_on_answer(struct conn *conn, const struct conn_request *request, const struct conn_answer *answer)
{
	struct worker *worker = conn->shared->userdata;
	struct worker_client *client = (struct worker_client *)conn;

	worker->n_open--;
	count(worker, client, request, answer);
	worker_ask(worker, client);
}

static void count_one(struct worker *worker, uint64_t intended_ns, uint64_t now_ns)
{
	if (!worker_is_measured(worker, intended_ns))
		return;
	worker->total.n_unfinished++;
	histogram_add(&worker->total.latency, now_ns - intended_ns);
}

/* They have taken so long already: left out, they would flatter. */
void worker_count_unfinished(struct worker *worker)
{
	const uint64_t now_ns = clock_ns();

	pthread_mutex_lock(&worker->lock);
	for (uint32_t i = 0; i < worker->n_clients; i++) {
		const struct worker_client *client = &worker->client[i];

		for (uint32_t k = 0; client->conn.request != NULL && k < client->conn.most_open; k++)
			if (client->conn.request[k].id != 0)
				count_one(worker, client->conn.request[k].intended_ns, now_ns);
		for (size_t k = 0; k < client->n_waiting; k++)
			count_one(worker, client->waiting[(client->first + k) % client->capacity].intended_ns, now_ns);
	}
	pthread_mutex_unlock(&worker->lock);
}
