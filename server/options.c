#define _GNU_SOURCE
#include <inttypes.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "options.h"
#include "base/cli.h"
#include "simd/isa.h"

#define MAX_OPTIONS 40
#define MEBI 1048576.0
#define LEAST_RESOLUTION 8   /* as in psr-model build */
#define MOST_RESOLUTION 8192

static int on_listen(const char *text, void *userdata, struct psr_error *err)
{
	struct options *options = userdata;

	if (options->n_listen == OPTIONS_MAX_LISTEN)
		return psr_fail(err, PSR_ERR_LIMIT, "there are at most %d listeners", OPTIONS_MAX_LISTEN);
	options->listen[options->n_listen++] = text;
	return PSR_OK;
}

static int count_cores(void)
{
	cpu_set_t set;
	int n = 1;

	if (sched_getaffinity(0, sizeof set, &set) == 0)
		n = CPU_COUNT(&set);
	return n < 1 ? 1 : n > 256 ? 256 : n;
}

static char *find_cache(void)
{
	const char *base = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
	char *path = NULL;
	int n;

	if (base != NULL && base[0] == '/')
		n = asprintf(&path, "%s/psr/built", base);
	else
		n = asprintf(&path, "%s/.cache/psr/built", home != NULL && home[0] == '/' ? home : "/tmp");
	return n < 0 ? NULL : path;
}

static int set_defaults(struct options *options)
{
	*options = (struct options){
		.threads = count_cores(), .resolution = 768, .max_resolution = 1536,
		.max_clients = 64, .max_pending = 1024, .max_open = 64, .max_handles = 64, .max_builds = 1,
		.max_pixels = INT64_C(16) << 20,
		.max_memory = INT64_C(4) << 30, .max_queue = INT64_C(32) << 20, .build_memory = INT64_C(16) << 30,
		.build_file_size = INT64_C(4) << 30, .cache_size = INT64_C(16) << 30,
		.handshake_timeout = 5, .idle_timeout = 600, .slow_timeout = 30, .drain_timeout = 5, .frame_timeout = 10,
		.build_time = 3600, .build_wall_time = 7200,
	};
	options->isa = psr_isa_name(psr_isa_get());
	options->cache = options->cache_default = find_cache();
	return options->cache != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

static void fill_table(struct psr_opt table[MAX_OPTIONS], struct options *o, int *has_least, int *has_most)
{
	const struct psr_opt opts[] = {
		{ .name = "What is served, and where", .type = PSR_OPT_HEADING },
		{ .name = "models", .letter = 'm', .type = PSR_OPT_STRING, .value = &o->models, .arg = "DIR",
		  .help = "The folder whose models clients see: .psr files, and meshes and scans, which psrd builds at the first"
		          " request. Required." },
		{ .name = "listen", .letter = 'l', .type = PSR_OPT_CALL, .value = o, .arg = "ADDR:PORT|unix:PATH",
		  .call = on_listen,
		  .help = "Where clients connect; repeatable. Port 0 takes any free one. IPv6 addresses stand in brackets. TCP serves"
		          " this machine only (loopback addresses); `ssh -L` reaches it from others. [" OPTIONS_LISTEN_DEFAULT "]" },
		{ .name = "cache", .type = PSR_OPT_STRING, .value = &o->cache, .arg = "DIR",
		  .help = "The folder that keeps models built from meshes and scans. It needs room: tens of MB a model." },
		{ .name = "cache-size", .type = PSR_OPT_INT, .value = &o->cache_size, .arg = "BYTES", .min = 0, .max = 1e15,
		  .help = "Built models that the cache keeps; beyond it the longest unused are removed. 0: no limit." },
		{ .name = "config", .letter = 'c', .type = PSR_OPT_STRING, .value = &o->config, .arg = "FILE",
		  .help = "A file of `name = value` lines, names as here without the dashes; the command line wins." },
		{ .name = "verbose", .letter = 'v', .type = PSR_OPT_FLAG, .value = &o->verbose,
		  .help = "Reports connections, loads and builds on standard error." },
		{ .name = "version", .type = PSR_OPT_FLAG, .value = &o->version, .help = "Prints the version and exits." },
		{ .name = "Models built from meshes and scans", .type = PSR_OPT_HEADING },
		{ .name = "resolution", .letter = 'r', .type = PSR_OPT_INT, .value = &o->resolution, .arg = "PIXELS",
		  .seen = has_least, .min = LEAST_RESOLUTION, .max = MOST_RESOLUTION,
		  .help = "The coarsest model that psrd builds: sharp in pictures up to this side. Larger pictures get a finer"
		          " model, see --max-resolution. Twice the figure takes four times the memory." },
		{ .name = "max-resolution", .type = PSR_OPT_INT, .value = &o->max_resolution, .arg = "PIXELS",
		  .seen = has_most, .min = LEAST_RESOLUTION, .max = MOST_RESOLUTION,
		  .help = "The finest model that psrd builds. Raise it for pictures larger than this side; lower it where first"
		          " pictures take too long. The same as --resolution: one model for all pictures." },
		{ .name = "max-builds", .type = PSR_OPT_INT, .value = &o->max_builds, .arg = "N", .min = 1, .max = 64,
		  .help = "Builds at the same time; others wait their turn." },
		{ .name = "build-memory", .type = PSR_OPT_INT, .value = &o->build_memory, .arg = "BYTES", .min = 64 * MEBI,
		  .max = 1e15, .help = "Memory (address space) that one build may take; one that needs more fails and says so." },
		{ .name = "build-time", .type = PSR_OPT_INT, .value = &o->build_time, .arg = "SECONDS", .min = 1, .max = 1e6,
		  .help = "Processor time that one build may take, over all its threads; one that needs more fails and says so." },
		{ .name = "build-wall-time", .type = PSR_OPT_INT, .value = &o->build_wall_time, .arg = "SECONDS", .min = 1,
		  .max = 1e6, .help = "Time that one build may take by the clock; one that takes longer is ended, and says so." },
		{ .name = "build-file-size", .type = PSR_OPT_INT, .value = &o->build_file_size, .arg = "BYTES", .min = MEBI,
		  .max = 1e15, .help = "Size of each file that a build may write; one that needs more fails and says so." },
		{ .name = "Share of the machine", .type = PSR_OPT_HEADING },
		{ .name = "threads", .letter = 't', .type = PSR_OPT_INT, .value = &o->threads, .arg = "N", .min = 1, .max = 256,
		  .help = "Processor cores that draw and build. Lower it to leave cores to other programs." },
		{ .name = "max-memory", .type = PSR_OPT_INT, .value = &o->max_memory, .arg = "BYTES", .min = MEBI, .max = 1e15,
		  .help = "Memory for models, pictures and answers that wait. Models that no frame has used for longest make room"
		          " for others, and come back when one asks; raise it if frames wait for that." },
		{ .name = "max-clients", .type = PSR_OPT_INT, .value = &o->max_clients, .arg = "N", .min = 1, .max = 65536,
		  .help = "Clients connected at the same time; further ones are told that the server is full." },
		{ .name = "max-pixels", .type = PSR_OPT_INT, .value = &o->max_pixels, .arg = "N", .min = 1, .max = 64 * MEBI,
		  .help = "Pixels of the largest picture; drawing takes some tens of bytes of memory a pixel." },
		{ .name = "frame-timeout", .type = PSR_OPT_REAL, .value = &o->frame_timeout, .arg = "SECONDS", .min = 0.001,
		  .max = 1e6, .help = "Time of one picture on all cores, before refinement; one that needs more is answered by an"
		                      " error." },
		{ .name = "For those who run many clients", .type = PSR_OPT_HEADING,
		  .help = "The defaults serve programs that keep to the protocol." },
		{ .name = "max-open", .type = PSR_OPT_INT, .value = &o->max_open, .arg = "N", .min = 1, .max = 64,
		  .help = "Unanswered requests of one client; further ones are answered `busy`." },
		{ .name = "max-handles", .type = PSR_OPT_INT, .value = &o->max_handles, .arg = "N", .min = 1, .max = 65536,
		  .help = "Models that one client may hold open; further ones are refused." },
		{ .name = "max-queue", .type = PSR_OPT_INT, .value = &o->max_queue, .arg = "BYTES", .min = 65536, .max = 1e12,
		  .help = "Answers that may wait in memory for one slow client before its requests wait too; a single frame may"
		          " exceed it." },
		{ .name = "max-pending", .type = PSR_OPT_INT, .value = &o->max_pending, .arg = "N", .min = 1, .max = 65536,
		  .help = "Connections that have not introduced themselves (HELLO), beside --max-clients. Another one takes the"
		          " place of the one that waits longest." },
		{ .name = "max-pending-per-address", .type = PSR_OPT_INT, .value = &o->max_pending_per_address, .arg = "N",
		  .min = 0, .max = 65536, .help = "The same from one address; 0: as many as --max-pending. All addresses of this"
		                                  " machine count as one." },
		{ .name = "handshake-timeout", .type = PSR_OPT_REAL, .value = &o->handshake_timeout, .arg = "SECONDS",
		  .min = 0.05, .max = 3600, .help = "A connection that has not introduced itself (HELLO) by then is closed." },
		{ .name = "idle-timeout", .type = PSR_OPT_REAL, .value = &o->idle_timeout, .arg = "SECONDS",
		  .min = 0, .max = 1e6, .help = "A client that says nothing for so long is disconnected; 0: never. psrd sends it a PING"
		                             " after half of that." },
		{ .name = "slow-timeout", .type = PSR_OPT_REAL, .value = &o->slow_timeout, .arg = "SECONDS",
		  .min = 0.05, .max = 3600, .help = "A client that reads less than 64 KiB of its answers in that time, or"
		                                     " less than a sixteenth of what waits for it, is disconnected." },
		{ .name = "drain-timeout", .type = PSR_OPT_REAL, .value = &o->drain_timeout, .arg = "SECONDS",
		  .min = 0, .max = 3600, .help = "How long psrd, told to end, finishes the frames under way." },
		{ .name = "For developers", .type = PSR_OPT_HEADING },
		{ .name = "isa", .type = PSR_OPT_STRING, .value = &o->isa, .arg = "NAME",
		  .words = "c avx2 avx512",
		  .help = "The widest instructions that draw: c (what any processor of the kind has), avx2 or avx512. Frames"
		          " are the same bytes with each; only their time differs." },
		{ .name = NULL },
	};

	_Static_assert(sizeof opts / sizeof opts[0] <= MAX_OPTIONS, "the table is too small");
	memcpy(table, opts, sizeof opts);
}

/* If only one of the two was given, the other follows it. */
static int check_resolutions(struct options *options, int has_least, int has_most, struct psr_error *err)
{
	if (options->resolution <= options->max_resolution)
		return PSR_OK;
	if (has_least && has_most)
		return psr_fail(err, PSR_ERR_ARG, "--resolution %" PRId64 " is above --max-resolution %" PRId64
		                "; the coarsest model cannot be finer than the finest", options->resolution,
		                options->max_resolution);
	if (has_most)
		options->resolution = options->max_resolution;
	else
		options->max_resolution = options->resolution;
	return PSR_OK;
}

int options_parse(struct options *options, int argc, char **argv, struct psr_error *err)
{
	enum psr_isa isa;
	struct psr_opt table[MAX_OPTIONS];
	int given[MAX_OPTIONS] = { 0 }, has_least = 0, has_most = 0, n_operands = 0, code;
	const struct psr_cli cli = {
		.usage = "psrd --models DIR [--listen ADDR:PORT|unix:PATH]... [options]",
		.summary = "Holds point-sample models in memory and draws frames of them for thin clients (psr).",
		.opts = table,
		.footer = "Once it serves, psrd prints `READY ADDR:PORT` or `READY unix:PATH`, a line a listener, on standard\n"
		          "output. "
		          "SIGTERM ends it after the frames under way, SIGHUP reads the models folder again.\n"
		          "Exit codes: 0 ok, 2 usage, 3 file or system, 5 over a limit, 6 address in use, 7 internal."
		          " More in psrd(1).",
		.given = given,
	};

	if (set_defaults(options) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory");
	fill_table(table, options, &has_least, &has_most);
	code = psr_cli_parse(&cli, argc, argv, &n_operands, err);
	if (code != PSR_OK)
		return code;
	if (options->version) {
		printf("psrd %s\n", PSR_VERSION);
		return 1;
	}
	if (n_operands > 0)
		return psr_fail(err, PSR_ERR_ARG, "unexpected argument '%.80s'; --help shows the usage", argv[1]);
	if (options->config != NULL) {
		const struct psr_config config = { .path = options->config };
		struct psr_error why;

		code = psr_config_read(&options->config_text, &config, &cli, &why);
		if (code != PSR_OK)
			return psr_fail(err, code, "--config %s", why.text);
	}
	if (psr_isa_check_environment(err) != PSR_OK)
		return PSR_ERR_ARG;
	if (psr_isa_parse(&isa, options->isa) != PSR_OK)
		return psr_fail(err, PSR_ERR_ARG, "--isa: there is no '%.40s'; it takes c, avx2 or avx512", options->isa);
	psr_isa_cap(isa);
	if (check_resolutions(options, has_least, has_most, err) != PSR_OK)
		return PSR_ERR_ARG;
	if (options->max_pending_per_address == 0 || options->max_pending_per_address > options->max_pending)
		options->max_pending_per_address = options->max_pending;
	if (options->models == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--models DIR is missing: it names the folder of models");
	if (options->n_listen == 0)
		options->listen[options->n_listen++] = OPTIONS_LISTEN_DEFAULT;
	return PSR_OK;
}

void options_fini(struct options *options)
{
	free(options->cache_default);
	free(options->config_text);
	options->cache_default = options->config_text = NULL;
}
