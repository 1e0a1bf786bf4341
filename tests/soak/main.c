/* soak: a psrd under 64 clients, of which a fourth is rude, for a minute. It checks that every request of a polite
 * client ends once and as it should, that psrd's memory and descriptors stay flat, and that psrd ends when it is told
 * to. It prints how evenly frames came, and asserts no speed. Exit status: 0 all is well, 1 something failed, 2 usage. */
#define _GNU_SOURCE
#include <inttypes.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include "base/cli.h"
#include "psr/client.h"
#include "soak.h"

#define DRAIN_S 5        /* psrd's default */
#define GROWTH_KB 36864  /* see judge_memory() */
#define BESIDE_KB 65536
#define CONNECTION_BYTES 131072
#define MOST_WINDOWS 100000

const char *const soak_model[SOAK_MODELS] = { "case", "dice", "gloss", "hill", "knot", "ring", "scan", "teapot", "top", "wheel" };

struct soak soak = { .models = "tests/golden", .seconds = 60, .seed = 1, .patience_ms = 30000 };

static struct life {
	void (*body)(struct client *client);
	struct client client;
	pthread_t thread;
	unsigned seen;       /* frames up to the last window */
} life[SOAK_CLIENTS];

static struct tally {    /* of all windows of two seconds */
	double least_index, sum_index;
	unsigned n, least_frames;
	long peak_kb[3];     /* resident memory beyond that of STATS, in each third of the time */
	long peak_resident_kb;
	long peak_descriptors[3];
	uint64_t least_models, most_bytes, limit;
	uint64_t longest_ns; /* that an answer to STATS took */
} tally = { .least_index = 1, .least_frames = UINT32_MAX, .least_models = UINT64_MAX,
	        .peak_kb = { LONG_MIN, LONG_MIN, LONG_MIN } };

static pid_t psrd, relay;
static char errors_path[64], relay_errors_path[64];
static int n_claims;

void soak_fail(const char *format, ...)
{
	static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
	va_list arguments;

	pthread_mutex_lock(&mutex);
	if (++soak.n_failures <= 20) {
		va_start(arguments, format);
		printf("# ");
		vprintf(format, arguments);
		printf("\n");
		fflush(stdout);
		va_end(arguments);
	}
	pthread_mutex_unlock(&mutex);
}

void soak_sleep_ms(unsigned ms)
{
	usleep(1000 * ms);
}

static void claim(const char *what, int is_true)
{
	printf("%sok %d - %s\n", is_true ? "" : "not ", ++n_claims, what);
	fflush(stdout);
	if (!is_true)
		soak.n_failures++;
}

/* ---- the crowd ---- */

static void *run_life(void *userdata)
{
	struct life *l = userdata;

	l->body(&l->client);
	return NULL;
}

static void start_crowd(uint64_t seed)
{
	static void (*const body[16])(struct client *client) = { /* of 64: 28 move, 12 stay, 4 visit, 4 are slow, 16 rude */
		polite_move, polite_move, polite_stay, rude_client, polite_move, polite_move, polite_stay, rude_client,
		polite_move, polite_visit, polite_slowly, rude_client, polite_move, polite_move, polite_stay, rude_client,
	};

	for (unsigned i = 0; i < SOAK_CLIENTS; i++) {
		life[i].body = body[i % 16];
		life[i].seen = 0;
		life[i].client = (struct client){ .number = i, .random = seed * SOAK_CLIENTS + i };
		if (pthread_create(&life[i].thread, NULL, run_life, &life[i]) != 0) {
			perror("soak: a thread");
			exit(2);
		}
	}
}

static void join_crowd(void)
{
	for (unsigned i = 0; i < SOAK_CLIENTS; i++)
		pthread_join(life[i].thread, NULL);
}

/* ---- what is looked at meanwhile ---- */

static uint64_t stat_of(const struct psr_msg_stats_reply *stats, unsigned id)
{
	for (unsigned i = 0; i < stats->n_stats; i++)
		if (stats->stat[i].id == id)
			return stats->stat[i].value;
	return 0;
}

static int ask_stats(struct psr_client *observer, struct psr_msg_stats_reply *stats)
{
	struct psr_error err;

	if (psr_client_stats(observer, stats, (int)soak.patience_ms, &err) == PSR_OK)
		return 1;
	soak_fail("the observer is dropped: %s", err.text);
	return 0;
}

/* Jain's index over those that ask for the same, as fast as they get it. */
static void take_window(void)
{
	double sum = 0, squares = 0;
	unsigned n = 0;

	for (unsigned i = 0; i < SOAK_CLIENTS; i++) {
		const unsigned frames = life[i].client.n_frames - life[i].seen;

		life[i].seen += frames;
		if (life[i].body != polite_move)
			continue;
		tally.least_frames = frames < tally.least_frames ? frames : tally.least_frames;
		if (life[i].client.number % 4 < 2) {
			n++;
			sum += frames;
			squares += (double)frames * frames;
		}
	}
	if (squares > 0) {
		const double index = sum * sum / (n * squares);

		tally.least_index = index < tally.least_index ? index : tally.least_index;
		tally.sum_index += index;
		tally.n++;
	}
}

static void look(struct psr_client *observer, unsigned third)
{
	const struct watch watch = watch_look(psrd);
	struct psr_msg_stats_reply stats;
	uint64_t bytes, models;
	const uint64_t start_ns = clock_ns();
	uint64_t took_ns;
	long rest_kb;

	if (!ask_stats(observer, &stats))
		return;
	took_ns = clock_ns() - start_ns;
	tally.longest_ns = took_ns > tally.longest_ns ? took_ns : tally.longest_ns;
	bytes = stat_of(&stats, PSR_STAT_MEMORY_BYTES);
	models = stat_of(&stats, PSR_STAT_MODELS);
	tally.limit = stat_of(&stats, PSR_STAT_MEMORY_LIMIT);
	tally.most_bytes = bytes > tally.most_bytes ? bytes : tally.most_bytes;
	tally.least_models = models < tally.least_models ? models : tally.least_models;
	rest_kb = watch.resident_kb - (long)(bytes >> 10);
	tally.peak_kb[third] = rest_kb > tally.peak_kb[third] ? rest_kb : tally.peak_kb[third];
	if (watch.resident_kb > tally.peak_resident_kb)
		tally.peak_resident_kb = watch.resident_kb;
	if (watch.descriptors > tally.peak_descriptors[third])
		tally.peak_descriptors[third] = watch.descriptors;
}

static void observe(struct psr_client *observer)
{
	const uint64_t start_ns = clock_ns(), total_ns = (uint64_t)(soak.seconds * 1e9);
	uint64_t window_ns = start_ns, hangup_ns = start_ns, now_ns;

	while ((now_ns = clock_ns()) - start_ns < total_ns && soak.n_failures < 20) {
		look(observer, (unsigned)((now_ns - start_ns) * 3 / total_ns));
		if (now_ns - window_ns >= SOAK_WINDOW_NS) {
			take_window();
			window_ns += SOAK_WINDOW_NS;
		}
		if (now_ns - hangup_ns >= UINT64_C(700000000)) {
			kill(psrd, SIGHUP);
			hangup_ns = now_ns;
		}
		soak_sleep_ms(100);
	}
}

/* ---- what is said about it ---- */

static void report(void)
{
	unsigned frames = 0, ends = 0, superseded = 0, busy = 0, on_base = 0, sharp = 0, visits = 0, rude = 0;

	for (unsigned i = 0; i < SOAK_CLIENTS; i++) {
		struct client *c = &life[i].client;

		frames += c->n_frames;
		ends += c->n_ends;
		superseded += c->n_superseded;
		busy += c->n_busy;
		on_base += c->n_on_base;
		sharp += c->n_sharp;
		*(life[i].body == rude_client ? &rude : &visits) += c->n_runs;
	}
	printf("# %u requests of %u polite connections ended: %u frames, %u on a base, %u sharp or refined; %u superseded, %u"
	       " told to try again; %u rude connections\n", ends, visits, frames, on_base, sharp, superseded, busy, rude);
	if (tally.n > 0)
		printf("# frames of a moving client in 2 s: at least %u; Jain's index of equal ones: at least %.3f, %.3f in the"
		       " mean of %u windows\n", tally.least_frames, tally.least_index, tally.sum_index / tally.n, tally.n);
	printf("# an answer to STATS took %.1f ms at most\n", (double)tally.longest_ns * 1e-6);
	printf("# memory: at most %.1f of %.1f MB by STATS, %.1f MB resident, which is more by %.1f, %.1f, %.1f MB in each third; at least %" PRIu64
	       " of %d models in memory; descriptors at most %ld, %ld, %ld\n", (double)tally.most_bytes / 1e6,
	       (double)tally.limit / 1e6, (double)tally.peak_resident_kb / 1e3, (double)tally.peak_kb[0] / 1e3, (double)tally.peak_kb[1] / 1e3,
	       (double)tally.peak_kb[2] / 1e3, tally.least_models, SOAK_MODELS, tally.peak_descriptors[0],
	       tally.peak_descriptors[1], tally.peak_descriptors[2]);
}

static void judge_memory(void)
{
	long before_kb;

	/* Buffers of clients that have just come count at once, and room for them is made with the next frame. */
	claim("memory is within its limit", tally.most_bytes <= tally.limit + SOAK_CLIENTS * CONNECTION_BYTES);
	if (strstr(soak.psrd, "san/") != NULL) {
		printf("ok %d - memory beside it is bounded # SKIP sanitizers keep what is freed\n", ++n_claims);
		printf("ok %d - and does not grow # SKIP sanitizers keep what is freed\n", ++n_claims);
		return;
	}
	/* What STATS leaves out: the program, stacks, small blocks, and free ones. STATS counts for a frame the most that it
	 * may take, tens of megabytes more than it takes, so the difference can be negative, and its peaks differ. */
	claim("memory beside it is bounded", tally.peak_resident_kb <= (long)(tally.limit >> 10) + BESIDE_KB);
	before_kb = tally.peak_kb[0] > tally.peak_kb[1] ? tally.peak_kb[0] : tally.peak_kb[1];
	claim("and does not grow", tally.peak_kb[2] - before_kb <= GROWTH_KB);
}

static int prints_nothing(const char *path)
{
	char line[512];
	int n = 0;
	FILE *file = fopen(path, "r");

	while (file != NULL && fgets(line, sizeof line, file) != NULL && n < 60) {
		/* The address sanitizer says so of every program with fibers; ours tell it of each switch. */
		if (strstr(line, "makecontext/swapcontext") != NULL)
			continue;
		printf("# psrd: %s%s", line, strchr(line, '\n') != NULL ? "" : "\n");
		n++;
	}
	if (file != NULL)
		fclose(file);
	return n == 0;
}

/* NULL: psrd does not let it in. */
static struct psr_client *send_observer(void)
{
	struct psr_client *observer = NULL;
	struct psr_error err;

	if (psr_client_connect(&observer, soak.address, "observer", NULL, (int)soak.patience_ms, &err) != PSR_OK)
		soak_fail("the observer cannot come in: %s", err.text);
	return observer;
}

/* Only the observer is left, a new one: nobody asked for anything while the crowd left. */
static void judge_rest(long descriptors)
{
	struct psr_client *observer = send_observer();
	const uint64_t end_ns = clock_ns() + (uint64_t)soak.patience_ms * 1000000;
	struct psr_msg_stats_reply stats = { 0 };
	struct watch watch;
	int is_alone = 0;

	do {
		soak_sleep_ms(50);
		watch = watch_look(psrd);
		is_alone = ask_stats(observer, &stats) && stat_of(&stats, PSR_STAT_CONNECTIONS) == 1;
	} while (observer != NULL && (!is_alone || watch.descriptors > descriptors) && clock_ns() < end_ns);
	claim("all connections have gone", is_alone);
	claim("no descriptor is left", watch.descriptors <= descriptors);
	claim("no frame waits", stat_of(&stats, PSR_STAT_FRAMES_WAITING) == 0);
	psr_client_close(observer);
}

/* In the middle of the crowd's frames. */
static void judge_end(void)
{
	const uint64_t start_ns = clock_ns();
	uint64_t end_ns;
	int status = -1;

	soak.is_ending = soak.is_over = 1;
	kill(psrd, SIGTERM);
	while (waitpid(psrd, &status, WNOHANG) == 0 && clock_ns() - start_ns < (uint64_t)soak.patience_ms * 1000000)
		soak_sleep_ms(10);
	end_ns = clock_ns() - start_ns;
	printf("# psrd ended %.1f s after SIGTERM, with status %x\n", (double)end_ns * 1e-9, status);
	claim("psrd ends with 0", WIFEXITED(status) && WEXITSTATUS(status) == 0);
	/* and some seconds in which a loaded machine ran others */
	claim("within its drain time", end_ns < (DRAIN_S + 8) * UINT64_C(1000000000));
	if (!WIFEXITED(status))
		kill(psrd, SIGKILL);
	join_crowd();
}

static void soak_all(void)
{
	struct psr_client *observer = send_observer();
	struct psr_msg_stats_reply stats;
	long descriptors;

	if (observer == NULL)
		return;
	ask_stats(observer, &stats);
	descriptors = watch_look(psrd).descriptors;
	start_crowd((uint64_t)soak.seed);
	observe(observer);
	psr_client_close(observer);
	soak.is_over = 1;
	join_crowd();
	report();
	claim("every request of a polite client ended once, and as it should", soak.n_failures == 0);
	judge_memory();
	judge_rest(descriptors);
	soak.is_over = 0;
	start_crowd((uint64_t)soak.seed + 1);
	soak_sleep_ms(700);
	judge_end();
	claim("and prints nothing", prints_nothing(errors_path));
}

static int start(void)
{
	const char *const argv[] = { soak.psrd, "--listen", "127.0.0.1:0", "--models", soak.models, "--threads", "2",
		"--max-clients", "200", "--max-memory", "110000000", "--max-queue", "2000000", "--idle-timeout", "4",
		"--slow-timeout", "3", "--handshake-timeout", "1", NULL };
	const char *const relay_argv[] = { soak.relay, "--to", soak.address, "--rate-down", "8", "--rate-up", "2", "--delay",
		"20", "--jitter", "10", "--queue", "100000", NULL };

	snprintf(errors_path, sizeof errors_path, "/tmp/psr-soak-%d.psrd", (int)getpid());
	snprintf(relay_errors_path, sizeof relay_errors_path, "/tmp/psr-soak-%d.relay", (int)getpid());
	psrd = watch_start(argv, errors_path, soak.address);
	if (psrd > 0)
		relay = watch_start(relay_argv, relay_errors_path, soak.relay_address);
	if (psrd > 0 && relay > 0)
		return 1;
	prints_nothing(errors_path);
	return 0;
}

int main(int argc, char **argv)
{
	const struct psr_opt opts[] = {
		{ .name = "psrd", .type = PSR_OPT_STRING, .value = &soak.psrd, .arg = "PROGRAM", .help = "Which psrd." },
		{ .name = "relay", .type = PSR_OPT_STRING, .value = &soak.relay, .arg = "PROGRAM", .help = "The relay of tests/tools." },
		{ .name = "models", .type = PSR_OPT_STRING, .value = &soak.models, .arg = "DIR", .help = "The golden models." },
		{ .name = "seconds", .type = PSR_OPT_REAL, .value = &soak.seconds, .arg = "N", .min = 1, .max = 1e7,
		  .help = "How long the crowd stays." },
		{ .name = "seed", .type = PSR_OPT_INT, .value = &soak.seed, .arg = "N", .max = 9e15, .help = "Of all that is random." },
		{ .name = "patience", .type = PSR_OPT_INT, .value = &soak.patience_ms, .arg = "MS", .min = 1, .max = 1e9,
		  .help = "For whatever must happen." },
		{ 0 },
	};
	const struct psr_cli cli = { .usage = "soak --psrd PROGRAM --relay PROGRAM [options]", .opts = opts,
		                         .summary = "psrd under 64 clients, good and bad ones." };
	struct psr_error err;
	int n_operands, code = psr_cli_parse(&cli, argc, argv, &n_operands, &err);

	if (code == 1)
		return 0;
	if (code == PSR_OK && (n_operands > 0 || soak.psrd == NULL || soak.relay == NULL))
		code = psr_fail(&err, PSR_ERR_ARG, "it takes --psrd and --relay; see --help");
	if (code != PSR_OK)
		return psr_cli_fail("soak", &err);
	setvbuf(stdout, NULL, _IOLBF, 0);
	printf("# seed %" PRId64 ", %.0f s\n", soak.seed, soak.seconds);
	if (!start()) {
		claim("psrd and the relay start", 0);
		return 1;
	}
	soak_all();
	kill(relay, SIGTERM);
	waitpid(relay, NULL, 0);
	unlink(errors_path);
	unlink(relay_errors_path);
	printf("1..%d\n", n_claims);
	return soak.n_failures > 0;
}
