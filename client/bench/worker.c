#include "worker.h"
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>
#include "base/clock.h"

#define EVENTS 256
#define SECOND UINT64_C(1000000000)
#define MAX_WAITING (UINT64_C(1) << 24) /* requests that are due in one thread; more of them end the load */

static void on_ready(struct conn *conn)
{
	struct worker *worker = conn->shared->userdata;

	if (worker->load->rate <= 0 && worker->load->n_inflight > conn->most_open)
		conn_fail(conn, PSR_ERR_LIMIT, "--inflight %" PRId64 ": the server lets a client open %" PRIu32 " requests",
		          worker->load->n_inflight, conn->most_open);
	else
		worker->n_ready++;
}

int worker_init(struct worker *worker, struct psr_error *err)
{
	const struct bench_load *load = worker->load;
	struct epoll_event event = { .events = EPOLLIN };

	pthread_mutex_init(&worker->lock, NULL);
	worker->epoll = epoll_create1(EPOLL_CLOEXEC);
	worker->timer = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK);
	worker->n_clients = (uint32_t)((load->n_clients - worker->index + load->n_threads - 1) / load->n_threads);
	worker->client = calloc(worker->n_clients, sizeof *worker->client);
	worker->shared = (struct conn_shared){ .plan = worker->plan, .server = load->server, .is_view = load->is_view,
		                                   .is_decoded = load->is_decoded, .userdata = worker, .on_ready = on_ready,
		                                   .on_answer = worker_on_answer };
	if (worker->client == NULL || (load->is_decoded && client_decoder_create(&worker->shared.decoder) != PSR_OK))
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %" PRId64 " clients", load->n_clients);
	if (worker->epoll < 0 || worker->timer < 0 || epoll_ctl(worker->epoll, EPOLL_CTL_ADD, worker->timer, &event) != 0)
		return psr_fail(err, PSR_ERR_LIMIT, "the system gives no event loop: %s", strerror(errno));
	return PSR_OK;
}

void worker_fini(struct worker *worker)
{
	for (uint32_t i = 0; worker->client != NULL && i < worker->n_clients; i++) {
		conn_close(&worker->client[i].conn);
		free(worker->client[i].waiting);
	}
	free(worker->client);
	free(worker->kept);
	client_decoder_destroy(worker->shared.decoder);
	if (worker->epoll >= 0)
		close(worker->epoll);
	if (worker->timer >= 0)
		close(worker->timer);
	pthread_mutex_destroy(&worker->lock);
}

/* ---- requests that wait ---- */

static void push(struct worker *worker, struct worker_client *client, const struct worker_waiting *one)
{
	if (client->n_waiting == client->capacity) {
		const size_t capacity = client->capacity == 0 ? 16 : 2 * client->capacity;
		struct worker_waiting *grown =
			worker->n_waiting < MAX_WAITING ? malloc(capacity * sizeof *grown) : NULL;

		if (grown == NULL) {
			conn_fail(&client->conn, PSR_ERR_LIMIT, "%" PRIu64 " requests wait: the rate is far above what it can draw",
			          (uint64_t)worker->n_waiting);
			return;
		}
		for (size_t i = 0; i < client->n_waiting; i++)
			grown[i] = client->waiting[(client->first + i) % client->capacity];
		free(client->waiting);
		client->waiting = grown;
		client->first = 0;
		client->capacity = capacity;
	}
	client->waiting[(client->first + client->n_waiting++) % client->capacity] = *one;
	worker->n_waiting++;
}

static struct worker_waiting pop(struct worker *worker, struct worker_client *client)
{
	const struct worker_waiting one = client->waiting[client->first];

	client->first = (client->first + 1) % client->capacity;
	client->n_waiting--;
	worker->n_waiting--;
	return one;
}

/* ---- asking ---- */

static void send_one(struct worker *worker, struct worker_client *client, uint64_t k, uint64_t intended_ns)
{
	worker->n_open += (uint64_t)conn_ask(&client->conn, k, intended_ns, (uint32_t)worker->load->n_clients);
}

/* Whether a request of that time is still part of the load. */
static int may_ask(struct worker *worker, uint64_t intended_ns)
{
	struct worker_gate *gate = worker->gate;

	if (intended_ns >= atomic_load(&gate->end_ns))
		return 0;
	if (worker->load->n_frames == 0 || intended_ns < gate->begin_ns)
		return 1;
	if (atomic_fetch_add(&gate->n_asked, 1) < worker->load->n_frames)
		return 1;
	atomic_store(&gate->end_ns, intended_ns);
	return 0;
}

static int is_open_loop(const struct worker *worker)
{
	return worker->load->rate > 0 || worker->plan->request != NULL;
}

void worker_ask(struct worker *worker, struct worker_client *client)
{
	struct conn *conn = &client->conn;
	const uint32_t most = (uint32_t)worker->load->n_inflight;

	while (conn->state == CONN_READY && client->n_waiting > 0 && conn->n_open < conn->most_open) {
		const struct worker_waiting one = pop(worker, client);
		const uint64_t now_ns = clock_ns();

		pthread_mutex_lock(&worker->lock);
		if (worker_is_measured(worker, one.intended_ns))
			histogram_add(&worker->total.waited, now_ns - one.intended_ns);
		pthread_mutex_unlock(&worker->lock);
		send_one(worker, client, one.k, one.intended_ns);
	}
	while (!is_open_loop(worker) && conn->state == CONN_READY && conn->n_open < most) {
		const uint64_t now_ns = clock_ns();

		if (!may_ask(worker, now_ns))
			break;
		send_one(worker, client, client->next_k++, now_ns);
	}
}

static void arrive(struct worker *worker, struct worker_client *client, uint64_t k, uint64_t intended_ns)
{
	struct conn *conn = &client->conn;

	if (conn->state == CONN_READY && client->n_waiting == 0 && conn->n_open < conn->most_open)
		send_one(worker, client, k, intended_ns);
	else if (conn->state == CONN_READY)
		push(worker, client, &(struct worker_waiting){ k, intended_ns });
}

/* ---- the loop ---- */

static void lose(struct worker *worker, struct worker_client *client)
{
	if (client->is_lost)
		return;
	client->is_lost = 1;
	worker->n_lost++;
	if (worker->error.code == PSR_OK)
		worker->error = client->conn.why;
	if (client->is_watched)
		epoll_ctl(worker->epoll, EPOLL_CTL_DEL, client->conn.fd, NULL);
	client->is_watched = 0;
	pthread_mutex_lock(&worker->lock);
	while (client->n_waiting > 0)
		if (worker_is_measured(worker, pop(worker, client).intended_ns))
			worker->total.n_failed[-client->conn.why.code]++;
	pthread_mutex_unlock(&worker->lock);
}

/* Asks for the events that the connection wants now. */
static void watch(struct worker *worker, struct worker_client *client)
{
	const uint32_t events = EPOLLIN | (client->conn.wants_out ? EPOLLOUT : 0);
	struct epoll_event event = { .events = events, .data.ptr = client };

	if (client->conn.state == CONN_OVER) {
		lose(worker, client);
		return;
	}
	if (client->is_watched && client->events == events)
		return;
	if (epoll_ctl(worker->epoll, client->is_watched ? EPOLL_CTL_MOD : EPOLL_CTL_ADD, client->conn.fd, &event) != 0) {
		conn_fail(&client->conn, PSR_ERR_LIMIT, "the system watches no more connections: %s", strerror(errno));
		lose(worker, client);
		return;
	}
	client->is_watched = 1;
	client->events = events;
}

/* Handles events until `until_ns`, or until something has happened. */
static void wait_for_events(struct worker *worker, uint64_t until_ns)
{
	struct itimerspec timer = { .it_value = { (time_t)(until_ns / SECOND), (long)(until_ns % SECOND) } };
	struct epoll_event event[EVENTS];
	uint64_t n_rings;
	int n;

	if (until_ns != worker->timer_ns)
		timerfd_settime(worker->timer, TFD_TIMER_ABSTIME, &timer, NULL);
	worker->timer_ns = until_ns;
	n = epoll_wait(worker->epoll, event, EVENTS, -1);
	for (int i = 0; i < n; i++) {
		struct worker_client *client = event[i].data.ptr;

		if (client == NULL) {
			if (read(worker->timer, &n_rings, sizeof n_rings) > 0)
				worker->timer_ns = 0;
			continue;
		}
		if (event[i].events & EPOLLOUT)
			conn_flush(&client->conn);
		if (event[i].events & (EPOLLIN | EPOLLHUP | EPOLLERR))
			conn_read(&client->conn);
		watch(worker, client);
	}
}

/* A server that says nothing to anybody for so long is given up. Looks are counted, not time: while this program itself
 * did not run, nobody was silent. */
static void check_silence(struct worker *worker, uint64_t now_ns, int is_waiting)
{
	if (now_ns < worker->checked_ns + SECOND)
		return;
	worker->checked_ns = now_ns;
	worker->n_silent = is_waiting && worker->n_heard == worker->shared.n_received ? worker->n_silent + 1 : 0;
	worker->n_heard = worker->shared.n_received;
	if (worker->n_silent <= worker->load->timeout)
		return;
	worker->shared.now_ns = now_ns;
	for (uint32_t i = 0; i < worker->n_clients; i++) {
		struct worker_client *client = &worker->client[i];

		if (client->conn.shared == NULL)
			continue;
		conn_fail(&client->conn, PSR_ERR_CONNECTION, "no answer within %" PRId64 " s", worker->load->timeout);
		watch(worker, client);
	}
}

static int set_up(struct worker *worker)
{
	const uint64_t deadline_ns = clock_ns() + (uint64_t)worker->load->timeout * SECOND;

	for (uint32_t i = 0; i < worker->n_clients && worker->n_lost == 0; i++) {
		struct worker_client *client = &worker->client[i];
		const uint32_t index = worker->index + i * (uint32_t)worker->load->n_threads;

		if (conn_open(&client->conn, &worker->shared, index, deadline_ns, &worker->error) != PSR_OK)
			return worker->error.code;
		watch(worker, client);
	}
	while (worker->n_ready < worker->n_clients && worker->n_lost == 0) {
		wait_for_events(worker, clock_ns() + SECOND);
		check_silence(worker, clock_ns(), 1);
	}
	return worker->error.code;
}

static int pass_gate(struct worker_gate *gate)
{
	int state;

	pthread_mutex_lock(&gate->lock);
	gate->n_ready++;
	pthread_cond_broadcast(&gate->changed);
	while (gate->state == 0)
		pthread_cond_wait(&gate->changed, &gate->lock);
	state = gate->state;
	pthread_mutex_unlock(&gate->lock);
	return state > 0;
}

/* The next request of a recording that is this thread's. */
static const struct bench_request *next_recorded(struct worker *worker)
{
	const struct bench_plan *plan = worker->plan;

	while (worker->next_request < plan->n_requests
	       && plan->request[worker->next_request].client % worker->load->n_threads != worker->index)
		worker->next_request++;
	return worker->next_request < plan->n_requests ? &plan->request[worker->next_request] : NULL;
}

/* Sends what is due. Returns when the next request is. */
static uint64_t send_due(struct worker *worker)
{
	for (;;) {
		const struct bench_request *recorded = worker->plan->request != NULL ? next_recorded(worker) : NULL;
		struct worker_client *client;
		uint64_t due_ns = UINT64_MAX, k;

		if (recorded != NULL)
			due_ns = worker->gate->start_ns + recorded->due_ns;
		else if (worker->load->rate > 0 && worker->plan->request == NULL)
			due_ns = arrivals_due(&worker->arrivals);
		if (due_ns > clock_ns() || !may_ask(worker, due_ns))
			return due_ns;
		if (recorded != NULL) {
			k = worker->next_request++;
			client = &worker->client[recorded->client / (uint32_t)worker->load->n_threads];
		} else {
			arrivals_advance(&worker->arrivals);
			client = &worker->client[worker->turn++ % worker->n_clients];
			for (uint32_t i = 0; i < worker->n_clients && client->is_lost; i++)
				client = &worker->client[worker->turn++ % worker->n_clients];
			k = client->next_k++;
		}
		worker->shared.now_ns = clock_ns();
		arrive(worker, client, k, due_ns);
		watch(worker, client);
	}
}

/* Notes the processor time at the beginning and at the end of measuring; end_ns 0: that is now. */
static void note_use(struct worker *worker, uint64_t now_ns, uint64_t end_ns)
{
	if (worker->used_from_ns == 0 && now_ns >= worker->gate->begin_ns)
		worker->used_from_ns = clock_thread_ns();
	if (worker->used_ns == 0 && now_ns >= end_ns && (worker->load->n_frames == 0 || end_ns == 0))
		worker->used_ns = clock_thread_ns() - worker->used_from_ns;
}

/* A load of so many requests takes as long as they do. */
static int is_over(const struct worker *worker, uint64_t now_ns, uint64_t end_ns)
{
	const int is_patient = worker->load->n_frames > 0;

	return now_ns >= end_ns
	       && ((worker->n_open == 0 && worker->n_waiting == 0) || (!is_patient && now_ns >= end_ns + BENCH_DRAIN_NS));
}

static void measure(struct worker *worker)
{
	struct worker_gate *gate = worker->gate;
	const struct bench_load *load = worker->load;

	if (load->rate > 0) {
		arrivals_init(&worker->arrivals, gate->start_ns, load->rate * worker->n_clients / (double)load->n_clients,
		              (double)worker->index / (double)load->n_threads);
		if (load->is_poisson)
			arrivals_set_poisson(&worker->arrivals, worker->plan->seed + worker->index);
	}
	for (uint32_t i = 0; i < worker->n_clients && !is_open_loop(worker); i++) {
		worker_ask(worker, &worker->client[i]);
		watch(worker, &worker->client[i]);
	}
	for (;;) {
		const uint64_t due_ns = send_due(worker), now_ns = clock_ns(), end_ns = atomic_load(&gate->end_ns);
		uint64_t until_ns = now_ns + SECOND / 4;

		note_use(worker, now_ns, end_ns);
		if (worker->n_lost == worker->n_clients || is_over(worker, now_ns, end_ns))
			break;
		check_silence(worker, now_ns, worker->n_open > 0);
		if (now_ns < end_ns && end_ns < until_ns)
			until_ns = end_ns;
		if (now_ns < end_ns && due_ns < until_ns)
			until_ns = due_ns;
		wait_for_events(worker, until_ns);
	}
	note_use(worker, UINT64_MAX, 0);
	worker_count_unfinished(worker);
}

void *worker_run(void *userdata)
{
	struct worker *worker = userdata;

	set_up(worker);
	if (pass_gate(worker->gate))
		measure(worker);
	pthread_mutex_lock(&worker->gate->lock);
	worker->gate->n_over++;
	pthread_cond_broadcast(&worker->gate->changed);
	pthread_mutex_unlock(&worker->gate->lock);
	return NULL;
}
