#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include "base/json.h"
#include "base/outfile.h"
#include "client/cli/cli.h"
#include "commands.h"

enum { COUNTER, GAUGE, SUMMARY };

static const char *const kinds[] = { "counter", "gauge", "summary" };

#define ANSWERED "From the arrival of a FRAME until the socket had its first picture; since the start."

/* Prometheus wants seconds, and _total behind counters; `scale` makes seconds of microseconds there. help NULL: the same
 * metric as before, with another label. */
static const struct stat {
	uint16_t id;
	int kind;
	const char *name, *metric, *help;
	double scale;
} stats[] = {
	{ PSR_STAT_UPTIME_US, GAUGE, "uptime_us", "uptime_seconds", "Since the start.", 1e-6 },
	{ PSR_STAT_CONNECTIONS, GAUGE, "connections", "connections", "Connections now.", 1 },
	{ PSR_STAT_CONNECTIONS_TOTAL, COUNTER, "connections_total", "connections_accepted_total", "Accepted.", 1 },
	{ PSR_STAT_MODELS, GAUGE, "models", "models", "Models in memory.", 1 },
	{ PSR_STAT_MODEL_BYTES, GAUGE, "model_bytes", "model_bytes", "Bytes of models in memory.", 1 },
	{ PSR_STAT_FRAMES, COUNTER, "frames", "frames_total", "Frames sent to their end.", 1 },
	{ PSR_STAT_FRAMES_FAILED, COUNTER, "frames_failed", "frames_failed_total", "Frames that ended in ERROR.", 1 },
	{ PSR_STAT_FRAMES_WAITING, GAUGE, "frames_waiting", "frames_waiting", "Frames waiting.", 1 },
	{ PSR_STAT_BYTES_SENT, COUNTER, "bytes_sent", "sent_bytes_total", "Bytes sent.", 1 },
	{ PSR_STAT_BYTES_RECEIVED, COUNTER, "bytes_received", "received_bytes_total", "Bytes received.", 1 },
	{ PSR_STAT_FRAMES_SUPERSEDED, COUNTER, "frames_superseded", "frames_superseded_total", "Frames superseded.", 1 },
	{ PSR_STAT_FRAMES_CANCELLED, COUNTER, "frames_cancelled", "frames_cancelled_total", "Frames cancelled.", 1 },
	{ PSR_STAT_THREADS, GAUGE, "threads", "threads", "Threads that draw.", 1 },
	{ PSR_STAT_DROPPED_PEERS, COUNTER, "dropped_peers", "peers_dropped_total", "Dropped for an error or a limit.", 1 },
	{ PSR_STAT_MEMORY_BYTES, GAUGE, "memory_bytes", "memory_bytes", "Models, workers, pictures and queues.", 1 },
	{ PSR_STAT_MEMORY_LIMIT, GAUGE, "memory_limit", "memory_limit_bytes", "Limit of memory_bytes.", 1 },
	{ PSR_STAT_CONNECTIONS_NEW, GAUGE, "connections_new", "connections_new", "Connections without a HELLO yet.", 1 },
	{ PSR_STAT_CONNECTIONS_BUSY, COUNTER, "connections_busy", "connections_refused_total", "Refused as full.", 1 },
	{ PSR_STAT_LOG_DROPPED, COUNTER, "log_dropped", "log_lines_dropped_total", "Lines of the log that nobody read.", 1 },
	{ PSR_STAT_FRAMES_TIMED_OUT, COUNTER, "frames_timed_out", "frames_timed_out_total", "Failed, over their time.", 1 },
	{ PSR_STAT_FRAMES_LACKING, GAUGE, "frames_lacking", "frames_lacking_memory", "Waiting for memory.", 1 },
	{ PSR_STAT_FRAMES_ON_BASE, COUNTER, "frames_on_base", "frames_on_base_total", "Frames sent as changes.", 1 },
	{ PSR_STAT_BUILDS, GAUGE, "builds", "builds", "Builds that run.", 1 },
	{ PSR_STAT_BUILDS_WAITING, GAUGE, "builds_waiting", "builds_waiting", "Builds that wait.", 1 },
	{ PSR_STAT_BUILDS_DONE, COUNTER, "builds_done", "builds_done_total", "Builds that succeeded.", 1 },
	{ PSR_STAT_BUILDS_FAILED, COUNTER, "builds_failed", "builds_failed_total", "Builds failed or stopped.", 1 },
	{ PSR_STAT_MODELS_LEFT, COUNTER, "models_left", "models_left_total", "Models that left memory while open.", 1 },
	{ PSR_STAT_MODELS_RETURNED, COUNTER, "models_returned", "models_returned_total", "Such models that came back.", 1 },
	{ PSR_STAT_DRAW_US, COUNTER, "draw_us", "draw_seconds_total", "Time of frames on cores.", 1e-6 },
	{ PSR_STAT_PEERS_SLOW, COUNTER, "peers_slow", "peers_slow_total", "Dropped for reading too slowly.", 1 },
	{ PSR_STAT_PEERS_SILENT, COUNTER, "peers_silent", "peers_silent_total", "Dropped for silence.", 1 },
	{ PSR_STAT_ANSWERED_P50_US, SUMMARY, "answered_p50_us", "answered_seconds{quantile=\"0.5\"}", ANSWERED, 1e-6 },
	{ PSR_STAT_ANSWERED_P90_US, SUMMARY, "answered_p90_us", "answered_seconds{quantile=\"0.9\"}", NULL, 1e-6 },
	{ PSR_STAT_ANSWERED_P99_US, SUMMARY, "answered_p99_us", "answered_seconds{quantile=\"0.99\"}", NULL, 1e-6 },
	{ PSR_STAT_ANSWERED_MAX_US, SUMMARY, "answered_max_us", "answered_seconds{quantile=\"1\"}", NULL, 1e-6 },
};

static const struct stat *find(uint16_t id)
{
	for (size_t i = 0; i < sizeof stats / sizeof stats[0]; i++)
		if (stats[i].id == id)
			return &stats[i];
	return NULL; /* a later version's */
}

static void print_prometheus(const struct psr_msg_stats_reply *reply)
{
	for (unsigned i = 0; i < reply->n_stats; i++) {
		const struct stat *stat = find(reply->stat[i].id);

		if (stat == NULL)
			continue;
		if (stat->help != NULL)
			printf("# HELP psrd_%.*s %s\n# TYPE psrd_%.*s %s\n", (int)strcspn(stat->metric, "{"), stat->metric, stat->help,
			       (int)strcspn(stat->metric, "{"), stat->metric, kinds[stat->kind]);
		printf("psrd_%s %.17g\n", stat->metric, (double)reply->stat[i].value * stat->scale);
	}
}

static int print_json(const struct psr_msg_stats_reply *reply, struct psr_error *err)
{
	cJSON *json = cJSON_CreateObject();

	for (unsigned i = 0; i < reply->n_stats; i++)
		if (find(reply->stat[i].id) != NULL)
			cJSON_AddNumberToObject(json, find(reply->stat[i].id)->name, (double)reply->stat[i].value);
	return json_print(json, err);
}

static uint64_t value_of(const struct psr_msg_stats_reply *reply, uint16_t id)
{
	for (unsigned i = 0; i < reply->n_stats; i++)
		if (reply->stat[i].id == id)
			return reply->stat[i].value;
	return 0;
}

/* before: NULL, or what was told before: then counters have their growth a second beside them. */
static void print_table(const struct psr_msg_stats_reply *reply, const struct psr_msg_stats_reply *before)
{
	const double now_us = (double)value_of(reply, PSR_STAT_UPTIME_US);
	const double seconds = before != NULL ? (now_us - (double)value_of(before, PSR_STAT_UPTIME_US)) / 1e6 : 0;

	for (unsigned i = 0; i < reply->n_stats; i++) {
		const struct stat *stat = find(reply->stat[i].id);
		const uint64_t value = reply->stat[i].value;

		if (stat == NULL)
			continue;
		printf("%-18s %16" PRIu64, stat->name, value);
		if (stat->kind == COUNTER && seconds > 0)
			printf(" %12.1f/s", ((double)value - (double)value_of(before, stat->id)) / seconds);
		printf("\n");
	}
}

struct wish {
	const char *server;
	int64_t timeout;
	int watch, json, prometheus;
};

static int show(const struct wish *wish, struct psr_client *client, struct psr_error *err)
{
	static const struct timespec second = { .tv_sec = 1 };
	struct psr_msg_stats_reply reply, before;
	int has_before = 0, code;

	for (;;) {
		code = psr_client_stats(client, &reply, (int)wish->timeout * 1000, err);
		if (code == PSR_OK && wish->json) {
			code = print_json(&reply, err);
		} else if (code == PSR_OK) {
			if (wish->prometheus)
				print_prometheus(&reply);
			else
				print_table(&reply, has_before ? &before : NULL);
			if (wish->watch)
				printf("\n");
			code = outfile_flush_stdout(err);
		}
		if (code != PSR_OK || !wish->watch)
			return code;
		before = reply;
		has_before = 1;
		nanosleep(&second, NULL);
	}
}

int psr_stats_main(int argc, char **argv)
{
	struct wish wish = { .server = psr_default_server(), .timeout = PSR_DEFAULT_TIMEOUT };
	const struct psr_opt opts[] = {
		PSR_OPT_SERVER(wish.server),
		{ .name = "watch", .letter = 'w', .type = PSR_OPT_FLAG, .value = &wish.watch,
		  .help = "Again each second, with the growth of counters a second, until interrupted." },
		{ .name = "json", .type = PSR_OPT_FLAG, .value = &wish.json, .help = "For scripts: an object of numbers." },
		{ .name = "prometheus", .type = PSR_OPT_FLAG, .value = &wish.prometheus,
		  .help = "The text format that Prometheus reads, names beginning with psrd_." },
		PSR_OPT_TIMEOUT(wish.timeout),
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr stats [--server ADDR] [--watch] [--json|--prometheus]",
		.summary = "Prints what a server counts: connections, models, frames, bytes, memory, builds; of the whole server "
		"since its start.",
		.opts = opts,
		.footer = PSR_EXIT_CODES,
	};
	struct psr_client *client = NULL;
	struct psr_error err;
	int code = psr_command_parse("stats", &cli, argc, argv, NULL, &err);

	if (code > 0)
		return 0;
	if (code == PSR_OK && wish.json && wish.prometheus)
		code = psr_fail(&err, PSR_ERR_ARG, "--json and --prometheus exclude each other");
	if (code == PSR_OK)
		code = psr_client_connect(&client, wish.server, PSR_PROGRAM, NULL, (int)wish.timeout * 1000, &err);
	if (code == PSR_OK)
		code = show(&wish, client, &err);
	psr_client_close(client);
	return code == PSR_OK ? 0 : psr_cli_fail("psr stats", &err);
}
