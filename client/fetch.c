#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/outfile.h"
#include "client/cli/cli.h"
#include "commands.h"
#include "model/arrival.h"

#define READ_BYTES 65536
#define LOOK_BYTES 65536      /* asked for at a time until the levels of a file are known */
#define DRAW_NS UINT64_C(100000000)

struct wish {
	const char *server, *model, *output;
	int64_t timeout, level;
	int quiet;
};

struct fetching {
	const struct wish *wish;
	char output[PATH_MAX], part[PATH_MAX];
	int fd;                       /* of the part */
	struct arrival *arrival;
	const struct arrival_facts *facts;
	uint64_t start_bytes, start_ns, drawn_ns;
	int is_drawn, has_restarted, is_copy; /* the latter: the part began as a copy of the output */
	uint32_t handle;              /* of a model that was built; 0: it is a file */
	uint64_t stop;                /* byte that --level ends at; 0: not known, or the whole file */
};

/* ---- what is shown ---- */

/* Returns the last step whose bytes are there; NULL: none. */
static const struct octree_step *step_there(const struct arrival_facts *facts)
{
	const struct octree_step *step = NULL;

	for (int s = 0; s < facts->n_steps && facts->step[s].end <= facts->n_checked; s++)
		step = &facts->step[s];
	return step;
}

static void draw_progress(struct fetching *f)
{
	const struct arrival_facts *facts = f->facts;
	const struct octree_step *step = step_there(facts);
	const uint64_t now_ns = clock_ns();
	const double seconds = (double)(now_ns - f->start_ns) * 1e-9;

	if (f->wish->quiet || !isatty(STDERR_FILENO) || (f->is_drawn && now_ns - f->drawn_ns < DRAW_NS))
		return;
	fprintf(stderr, "\r%.2f of %.2f MB, %.2f MB/s", (double)facts->n_taken * 1e-6, (double)facts->n_file * 1e-6,
	        seconds > 0 ? (double)(facts->n_taken - f->start_bytes) * 1e-6 / seconds : 0);
	if (step != NULL)
		fprintf(stderr, "; level %d of %d, %" PRIu64 " points", step->depth, facts->step[facts->n_steps - 1].depth,
		        step->n_leaves);
	fprintf(stderr, "\033[K");
	f->is_drawn = 1;
	f->drawn_ns = now_ns;
}

static void end_progress(struct fetching *f)
{
	if (f->is_drawn)
		fprintf(stderr, "\r\033[K");
	f->is_drawn = 0;
}

static void say(struct fetching *f, const char *text)
{
	end_progress(f);
	if (!f->wish->quiet)
		fprintf(stderr, "psr fetch: %s: %s\n", f->part, text);
}

static int print_result(const struct fetching *f, struct psr_error *err)
{
	const struct arrival_facts *facts = f->facts;
	const struct octree_step *step = step_there(facts);

	if (f->wish->quiet)
		return PSR_OK;
	if (facts->n_taken == facts->n_file)
		printf("%s: %.2f MB", f->output, (double)facts->n_file * 1e-6);
	else
		printf("%s: the first %.2f of %.2f MB", f->output, (double)facts->n_taken * 1e-6, (double)facts->n_file * 1e-6);
	if (step != NULL)
		printf(", level %d of %d, %" PRIu64 " points", step->depth, facts->step[facts->n_steps - 1].depth,
		       step->n_leaves);
	printf("; %.2f MB fetched\n", (double)(facts->n_taken - f->start_bytes) * 1e-6);
	return outfile_flush_stdout(err);
}

/* ---- the file ---- */

static int write_all(struct fetching *f, const uint8_t *bytes, size_t n, struct psr_error *err)
{
	while (n > 0) {
		const ssize_t done = write(f->fd, bytes, n);

		if (done < 0 && errno == EINTR)
			continue;
		if (done < 0)
			return psr_fail(err, PSR_ERR_IO, "%s: %s", f->part, strerror(errno));
		bytes += done;
		n -= (size_t)done;
	}
	return PSR_OK;
}

/* Keeps the first n bytes, and writes on behind them. */
static int cut_part(struct fetching *f, uint64_t n, struct psr_error *err)
{
	if (ftruncate(f->fd, (off_t)n) != 0 || lseek(f->fd, (off_t)n, SEEK_SET) < 0)
		return psr_fail(err, PSR_ERR_IO, "%s: %s", f->part, strerror(errno));
	return PSR_OK;
}

/* Checks what is there already, from the part itself, or, copied, from a file that --level ended early. */
static int take_old(struct fetching *f, int fd, struct psr_error *err)
{
	uint8_t *bytes = malloc(READ_BYTES);
	struct psr_error why;
	ssize_t n = 0;
	int code = bytes != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory");

	while (code == PSR_OK && (n = read(fd, bytes, READ_BYTES)) > 0) {
		if (fd != f->fd)
			code = write_all(f, bytes, (size_t)n, err);
		if (code == PSR_OK && arrival_take(f->arrival, bytes, (size_t)n, &why) != PSR_OK)
			break;
	}
	if (code == PSR_OK && n < 0)
		code = psr_fail(err, PSR_ERR_IO, "%s: %s", f->part, strerror(errno));
	if (code == PSR_OK && n > 0 && fd == f->fd)
		say(f, why.text);
	free(bytes);
	arrival_rewind(f->arrival);
	return code == PSR_OK ? cut_part(f, f->facts->n_checked, err) : code;
}

static int open_part(struct fetching *f, struct psr_error *err)
{
	struct stat status;
	int old, code;

	if (stat(f->output, &status) == 0 && !S_ISREG(status.st_mode))
		return psr_fail(err, PSR_ERR_ARG, "%s is no regular file", f->output);
	old = access(f->part, F_OK) != 0 ? open(f->output, O_RDONLY | O_CLOEXEC) : -1;
	f->fd = open(f->part, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
	if (f->fd < 0)
		code = psr_fail(err, PSR_ERR_IO, "%s: %s", f->part, strerror(errno));
	else if (flock(f->fd, LOCK_EX | LOCK_NB) != 0)
		code = psr_fail(err, PSR_ERR_BUSY, "%s: another psr fetch writes it", f->part);
	else
		code = take_old(f, old >= 0 ? old : f->fd, err);
	f->start_bytes = f->facts->n_taken;
	f->is_copy = old >= 0;
	if (old >= 0)
		close(old);
	return code;
}

static int start_again(struct fetching *f, struct psr_error *err)
{
	arrival_destroy(f->arrival);
	f->arrival = NULL;
	f->facts = NULL;
	if (arrival_create(&f->arrival) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory");
	f->facts = arrival_facts(f->arrival);
	f->start_bytes = f->stop = 0;
	return cut_part(f, 0, err);
}

/* Gives the file its name. */
static int keep_part(struct fetching *f, struct psr_error *err)
{
	const int code = cut_part(f, f->facts->n_taken, err);

	if (code != PSR_OK)
		return code;
	if (fdatasync(f->fd) != 0 || rename(f->part, f->output) != 0)
		return psr_fail(err, PSR_ERR_IO, "%s: %s", f->output, strerror(errno));
	return PSR_OK;
}

/* ---- the server ---- */

static int on_part(const uint8_t *bytes, size_t n, void *userdata, struct psr_error *err)
{
	struct fetching *f = userdata;
	struct psr_error why;
	int code = write_all(f, bytes, n, err);

	if (code != PSR_OK)
		return code;
	code = arrival_take(f->arrival, bytes, n, &why);
	draw_progress(f);
	return code == PSR_OK ? code : psr_fail(err, code, "the server's file: %.400s", why.text);
}

/* Finds where --level ends, once the file's levels are known. */
static int find_stop(struct fetching *f, struct psr_error *err)
{
	const struct arrival_facts *facts = f->facts;

	if (f->wish->level == 0 || f->stop > 0 || facts->n_file == 0)
		return PSR_OK;
	if (!facts->has_steps)
		return psr_fail(err, PSR_ERR_ARG, "model %s has no levels to end at; files of octrees have that psr-model build "
		                "--pack made", f->wish->model);
	for (int s = facts->n_steps - 1; s >= 0; s--)
		if (facts->step[s].depth >= f->wish->level || s == facts->n_steps - 1)
			f->stop = facts->step[s].end;
	return PSR_OK;
}

/* A source is built first, which may take a while. */
static int open_model(struct fetching *f, struct psr_client *client, struct psr_error *err)
{
	struct psr_progress_line line = { 0 };
	struct psr_msg_opened opened;
	int code;

	psr_client_on_progress(client, f->wish->quiet ? NULL : psr_progress_draw, &line);
	code = psr_client_open(client, f->wish->model, (int)f->wish->timeout * 1000, &opened, err);
	psr_client_on_progress(client, NULL, NULL);
	psr_progress_end(&line);
	if (code == PSR_OK)
		f->handle = opened.handle;
	f->start_ns = clock_ns();
	return code;
}

/* Asks for what is missing. *is_done: there is no more to come. */
static int ask(struct fetching *f, struct psr_client *client, int *is_done, struct psr_error *err)
{
	const struct arrival_facts *facts = f->facts;
	const struct psr_fetch_user user = { on_part, f };
	struct psr_msg_fetch msg = { .handle = f->handle, .offset = facts->n_taken, .file_hash = facts->hash };
	struct psr_msg_fetch_end end;
	int code = find_stop(f, err);

	if (code != PSR_OK)
		return code;
	if (f->handle == 0)
		strcpy(msg.name, f->wish->model);
	if (f->stop > 0 && facts->n_taken >= f->stop)
		msg.length = 1; /* asks only whether it is the same file */
	else if (f->stop > 0)
		msg.length = f->stop - facts->n_taken;
	else if (f->wish->level > 0)
		msg.length = LOOK_BYTES;
	if (f->stop > 0 && facts->n_taken >= f->stop)
		msg.offset = facts->n_file;
	code = psr_client_fetch(client, &msg, &user, &end, (int)f->wish->timeout * 1000, err);
	if (code == PSR_ERR_UNSUPPORTED && f->handle == 0 &&
	    (psr_client_welcome(client)->capabilities & PSR_CAP_FETCH) != 0)
		return open_model(f, client, err);
	if (code == PSR_ERR_NOT_FOUND && facts->hash != 0 && !f->has_restarted) {
		f->has_restarted = 1;
		say(f, "it is of another file than the server has by now; it is fetched from the beginning");
		return start_again(f, err);
	}
	if (code != PSR_OK)
		return code;
	if (facts->n_file == 0 && facts->n_taken >= end.file_bytes)
		return psr_fail(err, PSR_ERR_FORMAT, "the server's file ends within its header");
	*is_done = facts->n_taken >= (f->stop > 0 ? f->stop : facts->n_file) || facts->n_taken >= end.file_bytes;
	*is_done &= f->wish->level == 0 || f->stop > 0 || facts->n_taken >= end.file_bytes;
	return PSR_OK;
}

static int fetch(struct fetching *f, struct psr_error *err)
{
	const struct wish *wish = f->wish;
	struct psr_client *client = NULL;
	const int patience_ms = (int)wish->timeout * 1000;
	int is_done = 0, code = psr_client_connect(&client, wish->server, PSR_PROGRAM, wish->model, patience_ms, err);

	if (code != PSR_OK)
		return code;
	f->start_ns = clock_ns();
	while (code == PSR_OK && !is_done)
		code = ask(f, client, &is_done, err);
	end_progress(f);
	psr_client_close(client);
	return code;
}

/* What came stays, as far as it is known to be right. */
static void leave_part(struct fetching *f)
{
	struct psr_error ignored;

	arrival_rewind(f->arrival);
	if (f->fd < 0 || cut_part(f, f->facts->n_taken, &ignored) != PSR_OK)
		return;
	if (f->facts->n_taken == 0 || (f->is_copy && f->facts->n_taken == f->start_bytes))
		unlink(f->part);
	else if (!f->wish->quiet)
		fprintf(stderr, "psr fetch: %s has %.2f of %.2f MB; the same command goes on from there\n", f->part,
		        (double)f->facts->n_taken * 1e-6, (double)f->facts->n_file * 1e-6);
}

static int run(const struct wish *wish, struct psr_error *err)
{
	struct fetching f = { .wish = wish, .fd = -1 };
	int code;

	if (wish->output != NULL)
		snprintf(f.output, sizeof f.output, "%s", wish->output);
	else
		snprintf(f.output, sizeof f.output, "%.255s.psr", wish->model);
	if (strlen(f.output) > PATH_MAX - 8)
		return psr_fail(err, PSR_ERR_ARG, "the name of the file is too long");
	snprintf(f.part, sizeof f.part, "%.*s.part", PATH_MAX - 8, f.output);
	if (arrival_create(&f.arrival) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory");
	f.facts = arrival_facts(f.arrival);
	code = open_part(&f, err);
	if (code == PSR_OK) {
		code = fetch(&f, err);
		if (code == PSR_OK)
			code = keep_part(&f, err);
		if (code == PSR_OK)
			code = print_result(&f, err);
		else if (f.arrival != NULL)
			leave_part(&f);
	}
	if (f.fd >= 0)
		close(f.fd);
	arrival_destroy(f.arrival);
	return code;
}

int psr_fetch_main(int argc, char **argv)
{
	struct wish wish = { .server = psr_default_server(), .timeout = PSR_DEFAULT_TIMEOUT };
	const struct psr_opt opts[] = {
		PSR_OPT_SERVER(wish.server),
		{ .name = "output", .letter = 'o', .type = PSR_OPT_STRING, .value = &wish.output, .arg = "FILE",
		  .help = "The file to write. What has come stands in FILE.part, which psr draws, too. If not given: MODEL.psr." },
		{ .name = "level", .letter = 'l', .type = PSR_OPT_INT, .value = &wish.level, .arg = "K", .min = 0, .max = 20,
		  .help = "Ends with the first part of the file that has K levels of its octree. 0: all of it." },
		{ .name = "quiet", .letter = 'q', .type = PSR_OPT_FLAG, .value = &wish.quiet, .help = "Prints errors only." },
		PSR_OPT_TIMEOUT(wish.timeout),
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr fetch MODEL [--server ADDR] [-o FILE] [--level K]",
		.summary = "Brings the file of a model from a server. Each piece is checked as it comes, and what has come stays: "
		           "after a break the same command goes on. A packed octree comes coarse first, and the part of it that is "
		           "there is a model.",
		.opts = opts,
		.footer = PSR_EXIT_CODES,
	};
	struct psr_error err;
	int n_operands = 0, code = psr_command_parse("fetch", &cli, argc, argv, &n_operands, &err);

	if (code > 0)
		return 0;
	if (code == PSR_OK && n_operands != 1)
		code = psr_fail(&err, PSR_ERR_ARG, n_operands == 0 ? "name a model; psr list shows those of the server"
		                                                   : "name one model, not %d", n_operands);
	if (code == PSR_OK) {
		wish.model = argv[1];
		code = wish.model[0] != '\0' && strlen(wish.model) <= PSR_WIRE_MAX_NAME
		           ? PSR_OK : psr_fail(&err, PSR_ERR_ARG, "a model's name has 1 to %d bytes", PSR_WIRE_MAX_NAME);
	}
	if (code == PSR_OK)
		code = run(&wish, &err);
	return code == PSR_OK ? 0 : psr_cli_fail("psr fetch", &err);
}
