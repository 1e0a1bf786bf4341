#include <inttypes.h>
#include <stdio.h>
#include "base/json.h"
#include "base/outfile.h"
#include "client/bench/bench.h"
#include "client/cli/cli.h"
#include "commands.h"

static int check(struct bench_options *options, struct psr_error *err)
{
	struct views views = { .n = 0 };
	int code = scene_check(&options->scene, err);

	if (code == PSR_OK)
		code = views_make(&views, &options->view, NULL, err);
	if (code == PSR_OK && views.n == 1)
		options->view = views.wish[0];
	else if (code == PSR_OK)
		code = psr_fail(err, PSR_ERR_ARG, "--view: a bench begins at one view, not at %u", views.n);
	options->view.view = NULL; /* the wish holds the view's angles now */
	views_fini(&views);
	options->frame.planes = 1 << PSR_PLANE_COLOR;
	if (code == PSR_OK)
		code = quality_apply(&options->frame, &options->quality, err);
	options->scene.pixels =
		options->frame.width > options->frame.height ? options->frame.width : options->frame.height;
	return code;
}

static int parse(struct bench_options *options, int *json, int argc, char **argv, struct psr_error *err)
{
	struct optlist list = { .n = 0 };
	const struct psr_opt load[] = {
		{ .name = "clients", .letter = 'c', .type = PSR_OPT_INT, .value = &options->n_clients, .arg = "N", .min = 1,
		  .max = BENCH_MAX_CLIENTS, .help = "Connections, each with a camera of its own." },
		{ .name = "seconds", .letter = 't', .type = PSR_OPT_INT, .value = &options->seconds, .arg = "S", .min = 1,
		  .max = 86400, .help = "How long to measure; warming up comes before." },
		{ .name = "inflight", .type = PSR_OPT_INT, .value = &options->n_inflight, .arg = "K", .min = 1,
		  .max = PSR_WIRE_MAX_OPEN,
		  .help = "Pictures that each connection asks for before the first has come: more hides a slow network." },
		PSR_OPT_SERVER(options->server),
	};
	const struct psr_opt script[] = {
		{ .name = "json", .type = PSR_OPT_FLAG, .value = json, .help = "Print one object instead of the lines." },
		PSR_OPT_TIMEOUT(options->timeout),
	};
	const struct psr_cli cli = {
		.usage = "psr bench --model NAME [--server ADDR] [--clients N] [--seconds S] [models, camera, light, quality] "
		         "[--json]",
		.summary = "Measures how many pictures a server draws: N connections whose cameras fly around the model, each "
		           "asking for the next picture when one has come. Latency is the time from asking to the decoded "
		           "picture.",
		.opts = list.opt,
		.footer = SCENE_LIGHT_HELP "\n" PSR_EXIT_CODES,
	};
	int code;

	optlist_heading(&list, "Load", NULL);
	OPTLIST_ADD(&list, load);
	optlist_heading(&list, "What is drawn",
	                "The defaults are those of psr shot but for --size and --codec: smoothing is "
	                "on, too.");
	scene_add_model_options(&list, &options->scene);
	view_add_options(&list, &options->view);
	scene_add_light_options(&list, &options->scene);
	quality_add_options(&list, &options->quality);
	quality_add_codec_option(&list, &options->quality);
	optlist_heading(&list, "For developers", NULL);
	OPTLIST_ADD(&list, script);
	code = psr_command_parse("bench", &cli, argc, argv, NULL, err);
	return code == PSR_OK ? check(options, err) : code;
}

static int print_result(const struct bench_options *options, const struct bench_result *r, int as_json,
                        struct psr_error *err)
{
	const struct psr_msg_frame *frame = &options->frame;
	const double size[2] = { frame->width, frame->height };
	const char *model = options->scene.instance[0].model, *codec = options->quality.codec;
	cJSON *json, *latency;

	if (!as_json) {
		printf("%s %ux%u %s, %" PRId64 " clients, %" PRId64 " under way each, %" PRId64 " s\n", model, frame->width,
		       frame->height, codec, options->n_clients, options->n_inflight, options->seconds);
		printf("frames/s  %10.1f in all, %.1f each\n", r->frames_per_s, r->frames_per_s / (double)options->n_clients);
		printf("MB/s      %10.2f\n", r->mb_per_s);
		printf("latency   %10.2f ms p50, %.2f p90, %.2f p99, %.2f max (%" PRIu64 " frames)\n", r->p50_ms, r->p90_ms,
		       r->p99_ms, r->max_ms, r->n_samples);
		printf("failed    %10" PRIu64 "\n", r->n_failed);
		return outfile_flush_stdout(err);
	}
	json = cJSON_CreateObject();
	cJSON_AddStringToObject(json, "model", model);
	cJSON_AddItemToObject(json, "size", cJSON_CreateDoubleArray(size, 2));
	cJSON_AddStringToObject(json, "codec", codec);
	cJSON_AddNumberToObject(json, "clients", (double)options->n_clients);
	cJSON_AddNumberToObject(json, "inflight", (double)options->n_inflight);
	cJSON_AddNumberToObject(json, "seconds", (double)options->seconds);
	cJSON_AddNumberToObject(json, "frames", (double)r->n_frames);
	cJSON_AddNumberToObject(json, "frames_per_s", r->frames_per_s);
	cJSON_AddNumberToObject(json, "frames_per_s_each", r->frames_per_s / (double)options->n_clients);
	cJSON_AddNumberToObject(json, "mb_per_s", r->mb_per_s);
	cJSON_AddNumberToObject(json, "failed", (double)r->n_failed);
	latency = cJSON_AddObjectToObject(json, "latency_ms");
	cJSON_AddNumberToObject(latency, "p50", r->p50_ms);
	cJSON_AddNumberToObject(latency, "p90", r->p90_ms);
	cJSON_AddNumberToObject(latency, "p99", r->p99_ms);
	cJSON_AddNumberToObject(latency, "max", r->max_ms);
	return json_print(json, err);
}

int psr_bench_main(int argc, char **argv)
{
	struct bench_options options = { .server = psr_default_server(),
		                             .n_clients = 4,
		                             .seconds = 5,
		                             .n_inflight = 1,
		                             .timeout = PSR_DEFAULT_TIMEOUT };
	struct bench_result result;
	struct psr_error err;
	int json = 0, code;

	scene_wish_init(&options.scene);
	view_wish_init(&options.view);
	quality_wish_init(&options.quality, 512, 512, "jpeg:85");
	options.scene.is_quiet = 1;
	code = parse(&options, &json, argc, argv, &err);
	if (code == PSR_OK)
		code = bench_run(&result, &options, &err);
	if (code == PSR_OK)
		code = print_result(&options, &result, json, &err);
	scene_wish_fini(&options.scene);
	if (code > 0)
		return 0;
	return code == PSR_OK ? result.n_failed > 0 : psr_cli_fail("psr bench", &err);
}
