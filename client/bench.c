#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/json.h"
#include "base/outfile.h"
#include "client/bench/bench.h"
#include "client/bench/report.h"
#include "client/cli/cli.h"
#include "commands.h"

struct command {
	struct bench_load load;
	struct mix_line line;
	const char *mix_file, *csv;
	int64_t seed;
	int json, has_rate, has_inflight, has_seconds, has_frames;
	struct mix mix;
	struct plan plan;
	struct bench_result result;
	char what[400];
};

static void add_load(struct optlist *list, struct command *command)
{
	struct bench_load *load = &command->load;
	const struct psr_opt opts[] = {
		{ .name = "clients", .letter = 'c', .type = PSR_OPT_INT, .value = &load->n_clients, .arg = "N", .min = 1,
		  .max = BENCH_MAX_CLIENTS, .help = "Connections, each with a camera of its own." },
		{ .name = "seconds", .letter = 't', .type = PSR_OPT_REAL, .value = &load->seconds, .arg = "S", .min = 0.01,
		  .max = 86400, .seen = &command->has_seconds, .help = "How long to measure; warming up comes before." },
		{ .name = "frames", .type = PSR_OPT_INT, .value = &load->n_frames, .arg = "N", .min = 1, .max = 1e12,
		  .seen = &command->has_frames, .help = "Measure so many requests, however long they take, instead of a time." },
		{ .name = "warmup", .type = PSR_OPT_REAL, .value = &load->warmup, .arg = "S", .max = 3600,
		  .help = "Seconds of load before anything is measured." },
		{ .name = "inflight", .type = PSR_OPT_INT, .value = &load->n_inflight, .arg = "K", .min = 1,
		  .max = PSR_WIRE_MAX_OPEN, .seen = &command->has_inflight,
		  .help = "Closed loop: requests of each client under way; the next is sent when one is answered. More hides a "
		          "slow network." },
		{ .name = "rate", .type = PSR_OPT_REAL, .value = &load->rate, .arg = "R", .min = 1e-3, .max = 1e7,
		  .seen = &command->has_rate,
		  .help = "Open loop: so many requests a second of all clients together, whether the server keeps up or not. "
		          "Latency counts from when a request is due." },
		{ .name = "poisson", .type = PSR_OPT_FLAG, .value = &load->is_poisson,
		  .help = "Requests of --rate come at random times, as those of people who do not know of each other." },
		{ .name = "views", .type = PSR_OPT_FLAG, .value = &load->is_view,
		  .help = "Ask as a viewer does: a newer request supersedes older ones, pictures come as changes. Superseded "
		          "requests are counted apart." },
		{ .name = "decode", .type = PSR_OPT_FLAG, .value = &load->is_decoded,
		  .help = "Decode all pictures and check them. It takes processor time; views get whole pictures then." },
		{ .name = "threads", .type = PSR_OPT_INT, .value = &load->n_threads, .arg = "N", .min = 1,
		  .max = BENCH_MAX_THREADS, .help = "Threads of this program; one serves thousands of clients." },
		{ .name = "seed", .type = PSR_OPT_INT, .value = &command->seed, .arg = "N", .max = 1e15,
		  .help = "Of all that is random: paths, choices by weight, arrivals." },
		PSR_OPT_SERVER(load->server),
	};

	optlist_heading(list, "Load", NULL);
	OPTLIST_ADD(list, opts);
}

static void add_results(struct optlist *list, struct command *command)
{
	const struct psr_opt opts[] = {
		{ .name = "json", .type = PSR_OPT_FLAG, .value = &command->json, .help = "Print one object instead of the lines." },
		{ .name = "csv", .type = PSR_OPT_STRING, .value = &command->csv, .arg = "FILE",
		  .help = "A line for each second, as comma-separated values." },
		PSR_OPT_TIMEOUT(command->load.timeout),
	};

	optlist_heading(list, "Results", NULL);
	OPTLIST_ADD(list, opts);
}

static int check(struct command *command, struct psr_error *err)
{
	struct bench_load *load = &command->load;

	if (command->has_rate && command->has_inflight)
		return psr_fail(err, PSR_ERR_ARG, "--rate excludes --inflight: an open loop waits for no answers");
	if (load->is_poisson && !command->has_rate)
		return psr_fail(err, PSR_ERR_ARG, "--poisson needs --rate");
	if (command->has_seconds && command->has_frames)
		return psr_fail(err, PSR_ERR_ARG, "--seconds and --frames exclude each other");
	if (load->n_threads > load->n_clients)
		load->n_threads = load->n_clients;
	return mix_make(&command->mix, &command->line, command->mix_file, err);
}

static int parse(struct command *command, int argc, char **argv, struct psr_error *err)
{
	struct optlist list = { .n = 0 };
	const struct psr_opt mix[] = {
		{ .name = "mix", .type = PSR_OPT_STRING, .value = &command->mix_file, .arg = "FILE",
		  .help = "Requests of several kinds by weight, a line each of words such as weight=3 model=engine "
		          "size=640x480 path=zoom; see psr-mix(5). The options below are their defaults." },
	};
	const struct psr_cli cli = {
		"psr bench --model NAME|--mix FILE [--clients N] [--rate R] [--seconds S] [models, camera, light, quality]",
		"Loads a server with many clients and measures. Closed loop: each client asks for the next picture when one has "
		"come. Open loop (--rate): requests are due at times of their own, and latency counts from then, so that what a "
		"slow server makes wait is seen. Pictures are not decoded.",
		list.opt,
		SCENE_LIGHT_HELP "\n" PSR_EXIT_CODES,
	};
	int code;

	add_load(&list, command);
	optlist_heading(&list, "What is drawn",
	                "The defaults are those of psr shot but for --size and --codec: smoothing is on, too.");
	OPTLIST_ADD(&list, mix);
	mix_add_options(&list, &command->line);
	add_results(&list, command);
	code = psr_cli_parse(&cli, argc, argv, NULL, err);
	return code == PSR_OK ? check(command, err) : code;
}

/* Names the load in a line. */
static void describe(struct command *command)
{
	const struct mix_line *line = &command->mix.line[0];

	if (command->mix_file != NULL)
		snprintf(command->what, sizeof command->what, "%.300s", command->mix_file);
	else
		snprintf(command->what, sizeof command->what, "%.255s %" PRIu32 "x%" PRIu32 " %.20s, %.80s",
		         line->scene.instance[0].model, line->frame.width, line->frame.height, line->quality.codec, line->path);
}

static int run(struct command *command, struct psr_error *err)
{
	struct bench_result *result = &command->result;
	int code = plan_make(&command->plan, &command->mix, command->load.server, (int)command->load.timeout * 1000, err);

	if (code == PSR_OK)
		code = bench_run(result, &command->plan, &command->load, command->json ? NULL : report_print_row, err);
	if (code == PSR_OK && command->json)
		code = json_print(report_json(result, command->what), err);
	else if (code == PSR_OK)
		report_print(result, command->what);
	if (code == PSR_OK && !command->json)
		code = outfile_flush_stdout(err);
	if (code == PSR_OK && command->csv != NULL)
		code = report_csv(result, command->csv, err);
	return code;
}

static void command_init(struct command *command)
{
	command->load = (struct bench_load){ .server = psr_default_server(), .n_clients = 4, .n_threads = 1, .n_inflight = 1,
		                                 .warmup = 1, .seconds = 5, .timeout = PSR_DEFAULT_TIMEOUT };
	command->seed = 1;
	mix_line_init(&command->line);
}

int psr_bench_main(int argc, char **argv)
{
	struct command *command = calloc(1, sizeof *command);
	struct psr_error err;
	int code, is_bad = 0;

	if (command == NULL) {
		psr_fail(&err, PSR_ERR_MEMORY, "no memory");
		return psr_cli_fail("psr bench", &err);
	}
	command_init(command);
	code = parse(command, argc, argv, &err);
	if (code == PSR_OK) {
		command->plan.seed = (uint64_t)command->seed;
		describe(command);
		code = run(command, &err);
		is_bad = measure_failed(&command->result.measure) > 0 || command->result.n_lost > 0;
	}
	bench_result_fini(&command->result);
	plan_fini(&command->plan);
	mix_fini(&command->mix);
	scene_wish_fini(&command->line.scene);
	free(command);
	if (code > 0)
		return 0;
	return code == PSR_OK ? is_bad : psr_cli_fail("psr bench", &err);
}
