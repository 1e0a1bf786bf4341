#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/json.h"
#include "base/outfile.h"
#include "client/bench/bench.h"
#include "client/bench/plot.h"
#include "client/bench/record.h"
#include "client/bench/report.h"
#include "client/bench/sweep.h"
#include "client/bench/verify.h"
#include "client/cli/cli.h"
#include "commands.h"

struct command {
	struct bench_load load;
	struct mix_line line;
	const char *mix_file, *csv, *plot, *record, *replay, *sweep_text, *slo_text, *models;
	int64_t seed, verify;
	double floor;
	int json, has_rate, has_inflight, has_seconds, has_frames, has_floor, has_warmup, has_clients;
	struct sweep sweep;
	struct slo slo;
	struct mix mix;
	struct bench_plan plan;
	struct bench_result result;
	struct sweep_points points;
	struct verify_result verified;
	double best; /* the greatest load that holds --slo */
	char what[400];
};

static void add_load(struct optlist *list, struct command *command)
{
	struct bench_load *load = &command->load;
	const struct psr_opt opts[] = {
		{ .name = "clients", .letter = 'c', .type = PSR_OPT_INT, .value = &load->n_clients, .arg = "N", .min = 1,
		  .max = BENCH_MAX_CLIENTS, .seen = &command->has_clients,
		  .help = "Connections, each with a camera of its own." },
		{ .name = "seconds", .letter = 't', .type = PSR_OPT_REAL, .value = &load->seconds, .arg = "S", .min = 0.01,
		  .max = 86400, .seen = &command->has_seconds, .help = "How long to measure; warming up comes before." },
		{ .name = "frames", .type = PSR_OPT_INT, .value = &load->n_frames, .arg = "N", .min = 1, .max = 1e12,
		  .seen = &command->has_frames, .help = "Measure so many requests, however long they take, instead of a time." },
		{ .name = "warmup", .type = PSR_OPT_REAL, .value = &load->warmup, .arg = "S", .max = 3600,
		  .seen = &command->has_warmup, .help = "Seconds of load before anything is measured." },
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

static void add_searches(struct optlist *list, struct command *command)
{
	const struct psr_opt opts[] = {
		{ .name = "sweep", .type = PSR_OPT_STRING, .value = &command->sweep_text, .arg = "clients=A..B|rate=A..B",
		  .help = "One load after another, 7 of them at equal ratios (/N behind it: N), and where the knee is: the most "
		          "frames/s for their mean latency." },
		{ .name = "slo", .type = PSR_OPT_STRING, .value = &command->slo_text, .arg = "PART=TIME",
		  .help = "Search the greatest load whose latency holds this, as p99=50ms does, within the range of --sweep "
		          "(without it rate=1..10000), to 5 %." },
		{ .name = "floor", .type = PSR_OPT_REAL, .value = &command->floor, .arg = "LOAD", .min = 1e-3, .max = 1e7,
		  .seen = &command->has_floor, .help = "With --slo: exit with 1 if the greatest load is below this one." },
	};

	optlist_heading(list, "Several loads", NULL);
	OPTLIST_ADD(list, opts);
}

static void add_checks(struct optlist *list, struct command *command)
{
	const struct psr_opt opts[] = {
		{ .name = "verify", .type = PSR_OPT_INT, .value = &command->verify, .arg = "N", .min = 1, .max = 1e12,
		  .help = "Compare the hash of every Nth picture with one that psr itself draws of --verify-models, or with the "
		          "recording of --replay; exit with 1 if any differs." },
		{ .name = "verify-models", .type = PSR_OPT_STRING, .value = &command->models, .arg = "DIR",
		  .help = "The folder with the server's .psr files: its --models, or its --cache." },
		{ .name = "record", .type = PSR_OPT_STRING, .value = &command->record, .arg = "FILE",
		  .help = "Write all requests that were answered, with their times, cameras and hashes." },
		{ .name = "replay", .type = PSR_OPT_STRING, .value = &command->replay, .arg = "FILE",
		  .help = "Send the requests of a recording at their times." },
	};

	optlist_heading(list, "Right pictures, and the same load again", NULL);
	OPTLIST_ADD(list, opts);
}

static void add_results(struct optlist *list, struct command *command)
{
	const struct psr_opt opts[] = {
		{ .name = "json", .type = PSR_OPT_FLAG, .value = &command->json, .help = "Print one object instead of the lines." },
		{ .name = "csv", .type = PSR_OPT_STRING, .value = &command->csv, .arg = "FILE",
		  .help = "A line for each second, as comma-separated values." },
		{ .name = "plot", .type = PSR_OPT_STRING, .value = &command->plot, .arg = "FILE",
		  .help = "Latency over time and its distribution, or the loads of --sweep, into this .svg or .png, with gnuplot, "
		          "which must be installed." },
		PSR_OPT_TIMEOUT(command->load.timeout),
	};

	optlist_heading(list, "Results", NULL);
	OPTLIST_ADD(list, opts);
}

static int check_searches(struct command *command, struct psr_error *err)
{
	const int is_search = command->sweep_text != NULL || command->slo_text != NULL;
	int code = PSR_OK;

	if (command->has_floor && command->slo_text == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--floor needs --slo");
	if (is_search && (command->record != NULL || command->replay != NULL || command->verify > 0 || command->csv != NULL))
		return psr_fail(err, PSR_ERR_ARG, "--sweep and --slo run several loads; they exclude --record, --replay, --verify "
		                "and --csv");
	if (command->sweep_text != NULL)
		code = sweep_parse(&command->sweep, command->sweep_text, err);
	else if (command->slo_text != NULL)
		command->sweep = (struct sweep){ .is_rate = 1, .low = 1, .high = 10000, .n = 1 };
	if (code == PSR_OK && command->slo_text != NULL)
		code = slo_parse(&command->slo, command->slo_text, err);
	if (code == PSR_OK && is_search && (command->sweep.is_rate ? command->has_inflight || command->has_rate
	                                                             : command->has_clients > 0))
		code = psr_fail(err, PSR_ERR_ARG, command->sweep.is_rate
		                ? "--rate and --inflight: the loads are requests a second, as --sweep says"
		                : "--clients: --sweep says how many there are");
	return code;
}

static int check_pictures(struct command *command, struct psr_error *err)
{
	const struct mix_line *line = &command->line;

	if (command->verify > 0 && command->models == NULL && command->replay == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--verify needs --verify-models or --replay");
	if (command->models != NULL && command->verify == 0)
		return psr_fail(err, PSR_ERR_ARG, "--verify-models needs --verify");
	if (command->record != NULL && command->verify > 1)
		return psr_fail(err, PSR_ERR_ARG, "--record keeps every answer: --verify takes 1 beside it");
	if (command->replay == NULL)
		return PSR_OK;
	if (command->mix_file != NULL || line->scene.n_said > 0 || line->scene.has_ambient || view_is_said(&line->view)
	    || quality_is_said(&line->quality))
		return psr_fail(err, PSR_ERR_ARG, "--replay: the recording says what is drawn, not --mix and options of models, "
		                "lights, cameras and quality");
	if (command->has_rate || command->has_inflight || command->has_seconds || command->has_frames
	    || command->has_warmup || command->has_clients)
		return psr_fail(err, PSR_ERR_ARG, "--replay: the recording says how many clients ask, and when");
	return PSR_OK;
}

static int check(struct command *command, struct psr_error *err)
{
	struct bench_load *load = &command->load;

	if (command->has_rate && command->has_inflight)
		return psr_fail(err, PSR_ERR_ARG, "--rate excludes --inflight: an open loop waits for no answers");
	if (load->is_poisson && !command->has_rate && command->sweep_text == NULL && command->slo_text == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--poisson needs --rate");
	if (command->has_seconds && command->has_frames)
		return psr_fail(err, PSR_ERR_ARG, "--seconds and --frames exclude each other");
	if (load->n_threads > load->n_clients && command->sweep_text == NULL)
		load->n_threads = load->n_clients;
	if (command->plot != NULL && plot_check(command->plot, err) != PSR_OK)
		return err->code;
	load->keep = command->record != NULL ? 1 : command->verify;
	if (check_searches(command, err) != PSR_OK || check_pictures(command, err) != PSR_OK)
		return err->code;
	if (command->replay != NULL)
		return PSR_OK;
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
		.usage = "psr bench --model NAME|--mix FILE [--clients N] [--rate R] [--seconds S] [models, camera, light, quality]",
		.summary = "Loads a server with many clients and measures. Closed loop: each client asks for the next picture when "
		"one has come. Open loop (--rate): requests are due at times of their own, and latency counts from then, so that "
		"what a slow server makes wait is seen. Pictures are not decoded.",
		.opts = list.opt,
		.footer = SCENE_LIGHT_HELP "\n" PSR_EXIT_CODES,
	};
	int code;

	add_load(&list, command);
	optlist_heading(&list, "What is drawn",
	                "The defaults are those of psr shot but for --size and --codec: smoothing is on, too.");
	OPTLIST_ADD(&list, mix);
	mix_add_options(&list, &command->line);
	add_searches(&list, command);
	add_checks(&list, command);
	add_results(&list, command);
	code = psr_command_parse("bench", &cli, argc, argv, NULL, err);
	return code == PSR_OK ? check(command, err) : code;
}

/* Names the load in a line. */
static void describe(struct command *command)
{
	const struct mix_line *line = &command->mix.line[0];

	if (command->mix_file != NULL || command->replay != NULL)
		snprintf(command->what, sizeof command->what, "%.300s",
		         command->mix_file != NULL ? command->mix_file : command->replay);
	else
		snprintf(command->what, sizeof command->what, "%.255s %" PRIu32 "x%" PRIu32 " %.20s, %.80s",
		         line->scene.instance[0].model, line->frame.width, line->frame.height, line->quality.codec, line->path);
}

static int make_plan(struct command *command, struct psr_error *err)
{
	struct bench_load *load = &command->load;
	const int timeout_ms = (int)load->timeout * 1000;
	int code;

	command->plan.seed = (uint64_t)command->seed;
	if (command->replay == NULL)
		return bench_plan_make(&command->plan, &command->mix, load->server, timeout_ms, err);
	code = record_read(&command->plan, command->replay, load->server, timeout_ms, err);
	load->n_clients = command->plan.n_clients;
	load->warmup = 0;
	if (load->n_threads > load->n_clients)
		load->n_threads = load->n_clients;
	return code;
}

static int verify(struct command *command, struct psr_error *err)
{
	int code = PSR_OK;

	if (command->models != NULL)
		code = verify_by_drawing(&command->verified, &command->plan, &command->result, command->models, err);
	else
		verify_with_recording(&command->verified, &command->plan, &command->result);
	return code;
}

static int print_load(struct command *command, struct psr_error *err)
{
	const struct verify_result *verified = &command->verified;
	cJSON *json;

	if (!command->json) {
		report_print(&command->result, command->what);
		if (command->verify > 0)
			printf("verified: %" PRIu64 " pictures right, %" PRIu64 " wrong\n", verified->n_right, verified->n_wrong);
		return outfile_flush_stdout(err);
	}
	json = report_json(&command->result, command->what);
	if (command->verify > 0) {
		cJSON_AddNumberToObject(json, "verified_right", (double)verified->n_right);
		cJSON_AddNumberToObject(json, "verified_wrong", (double)verified->n_wrong);
	}
	return json_print(json, err);
}

static int run_load(struct command *command, struct psr_error *err)
{
	struct bench_result *result = &command->result;
	int code = bench_run(result, &command->plan, &command->load, command->json ? NULL : report_print_row, err);

	if (code == PSR_OK && command->verify > 0)
		code = verify(command, err);
	if (code == PSR_OK)
		code = print_load(command, err);
	if (code == PSR_OK && command->csv != NULL)
		code = report_csv(result, command->csv, err);
	if (code == PSR_OK && command->record != NULL)
		code = record_write(command->record, &command->plan, result, err);
	if (code == PSR_OK && command->plot != NULL)
		code = plot_load(result, command->what, command->plot, err);
	return code;
}

static int print_search(struct command *command, struct psr_error *err)
{
	const struct sweep *sweep = &command->sweep;
	cJSON *json;

	if (command->json) {
		json = sweep_json(sweep, &command->points, command->what);
		if (command->slo_text != NULL)
			json_add_number(json, "greatest_load", command->best);
		return json_print(json, err);
	}
	sweep_print_knee(sweep, &command->points);
	if (command->slo_text != NULL)
		printf("greatest %s that holds %s: %g\n", sweep->is_rate ? "rate" : "number of clients", command->slo.text,
		       command->best);
	return outfile_flush_stdout(err);
}

static int run_search(struct command *command, struct psr_error *err)
{
	void (*on_point)(const struct sweep *, const struct sweep_point *) = command->json ? NULL : sweep_print_point;
	int code;

	if (!command->json) {
		printf("%s, %g s each\n", command->what, command->load.seconds);
		sweep_print_head(&command->sweep);
	}
	if (command->slo_text != NULL)
		code = slo_search(&command->best, &command->points, &command->slo, &command->sweep, &command->plan, &command->load,
		                  on_point, err);
	else
		code = sweep_run(&command->points, &command->sweep, &command->plan, &command->load, on_point, err);
	if (code == PSR_OK)
		code = print_search(command, err);
	if (code == PSR_OK && command->plot != NULL)
		code = plot_sweep(&command->sweep, &command->points, command->what, command->plot, err);
	return code;
}

/* Whether the exit status is 1: something failed, was wrong, or below the floor. */
static int is_bad(const struct command *command)
{
	return measure_failed(&command->result.measure) > 0 || command->result.n_lost > 0 || command->verified.n_wrong > 0
	       || (command->has_floor && command->best < command->floor);
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
	int code, status = 0;

	if (command == NULL) {
		psr_fail(&err, PSR_ERR_MEMORY, "no memory");
		return psr_cli_fail("psr bench", &err);
	}
	command_init(command);
	code = parse(command, argc, argv, &err);
	if (code == PSR_OK) {
		describe(command);
		code = make_plan(command, &err);
	}
	if (code == PSR_OK) {
		const int is_search = command->sweep_text != NULL || command->slo_text != NULL;

		code = is_search ? run_search(command, &err) : run_load(command, &err);
		status = is_bad(command);
	}
	if (code < 0)
		status = psr_cli_fail("psr bench", &err);
	bench_result_fini(&command->result);
	bench_plan_fini(&command->plan);
	mix_fini(&command->mix);
	scene_wish_fini(&command->line.scene);
	free(command);
	return status;
}
