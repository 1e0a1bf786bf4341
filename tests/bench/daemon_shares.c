/* Many clients at once: equal ones, mixed ones, and all against one. */
#include "daemon.h"

#include <math.h>
#include <stdio.h>
#include "base/clock.h"
#include "report.h"

#define EQUALS 64
#define WINDOW_SECONDS 2
#define EQUAL_SIDE 256
#define SIZES 4
#define OF_EACH 4
#define QUANTUM 0.01    /* of a client's time is the most that one frame may be, */
#define MOST_SECONDS 60 /* unless the measurement took longer */

static void open_links(struct link *links, unsigned n, const struct daemon_server *server, const struct scene_film *film)
{
	for (unsigned i = 0; i < n; i++) {
		link_connect(&links[i], server, film);
		link_frame(&links[i], film->picture.width, film->picture.height);
	}
}

static void close_links(struct link *links, unsigned n)
{
	for (unsigned i = 0; i < n; i++)
		link_close(&links[i]);
}

/* First frames read the model from the disk, and make buffers. */
static void warm_up(struct link *link)
{
	link_ask(link);
	links_finish(link, 1, 10);
}

static void want(struct link *links, unsigned n, unsigned n_wanted)
{
	for (unsigned i = 0; i < n; i++)
		links[i].n_wanted = n_wanted;
}

static unsigned count_done(const struct link *links, unsigned n)
{
	unsigned sum = 0;

	for (unsigned i = 0; i < n; i++)
		sum += links[i].n_done;
	return sum;
}

/* ---- 3: equals ---- */

static double frames_of(const struct link *link)
{
	return link->n_done;
}

static double time_of(const struct link *link)
{
	return link->cores_s;
}

/* (sum x)^2 / (n sum x^2): 1 if all have as much, 1/n if one has all. */
static double jain(const struct link *links, unsigned n, double (*of)(const struct link *link))
{
	double sum = 0, squares = 0;

	for (unsigned i = 0; i < n; i++) {
		sum += of(&links[i]);
		squares += of(&links[i]) * of(&links[i]);
	}
	return squares > 0 ? sum * sum / (n * squares) : 0;
}

void daemon_equals(struct daemon_bench *bench)
{
	static const char *const options[] = { NULL };
	static struct link links[EQUALS];
	const int n_windows = (int)fmax(2, 2 * bench->seconds / WINDOW_SECONDS);
	struct daemon_server server;
	struct scene_film film;
	double least = 1, least_time = 1, sum = 0, greedy = 0, frames = 0;

	daemon_start(&server, bench, options);
	daemon_film(&film, bench, EQUAL_SIDE, EQUAL_SIDE);
	open_links(links, EQUALS, &server, &film);
	for (unsigned i = 0; i < EQUALS; i++)
		warm_up(&links[i]);
	want(links, EQUALS, 1);
	links[0].n_wanted = PSR_WIRE_MAX_OPEN;
	links_run(links, EQUALS, 1);
	for (int w = 0; w < n_windows; w++) {
		links_forget(links, EQUALS);
		links_run(links, EQUALS, WINDOW_SECONDS);
		least = fmin(least, jain(links, EQUALS, frames_of));
		least_time = fmin(least_time, jain(links, EQUALS, time_of));
		sum += jain(links, EQUALS, frames_of);
		frames += count_done(links, EQUALS);
		greedy += links[0].n_done;
	}
	daemon_figure(bench, "Jain's index, least of windows of 2 s", "", least, DAEMON_AT_LEAST, 0.98);
	daemon_figure(bench, "Jain's index, mean", "", sum / n_windows, DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "frames a client and window", "", frames / n_windows / EQUALS, DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "greedy client's frames / mean", "x", greedy * EQUALS / frames, DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "Jain's index of cores' time, least", "", least_time, DAEMON_NO_BOUND, 0);
	close_links(links, EQUALS);
	daemon_stop(&server);
}

/* ---- 4: sizes ---- */

static const uint32_t mixed_size[SIZES][2] = { { 64, 64 }, { 256, 256 }, { 1024, 1024 }, { 1920, 1080 } };

/* Processor seconds of psrd for a frame of the link, which is alone: also those of its loop, which sends, and of idle
 * cores that spin. */
static double price(const struct daemon_bench *bench, const struct daemon_server *server, struct link *link)
{
	link->n_wanted = 2;
	links_run(link, 1, bench->seconds / 8);
	links_forget(link, 1);
	const double start_s = daemon_processor_s(server);
	links_run(link, 1, bench->seconds / 2);
	const double used_s = daemon_processor_s(server) - start_s;
	const double n = link->n_done;
	links_finish(link, 1, 10);
	return n > 0 ? used_s / n : 0;
}

/* part[i]: what link i got. Returns by how much a share is off at most; of_size: that of the links of a size, by their
 * equal share. */
static double compare_shares(const double part[SIZES * OF_EACH], double of_size[SIZES])
{
	double sum = 0, most = 0;

	for (int i = 0; i < SIZES * OF_EACH; i++)
		sum += part[i];
	for (int s = 0; s < SIZES; s++)
		of_size[s] = 0;
	for (int i = 0; i < SIZES * OF_EACH; i++) {
		of_size[i / OF_EACH] += part[i] * SIZES / sum;
		most = fmax(most, fabs(part[i] * SIZES * OF_EACH / sum - 1));
	}
	return most;
}

static void print_sizes(const struct daemon_bench *bench, const double of_size[SIZES])
{
	char name[64];

	for (int s = 0; s < SIZES; s++) {
		snprintf(name, sizeof name, "share of %ux%u clients / equal", mixed_size[s][0], mixed_size[s][1]);
		daemon_figure(bench, name, "x", of_size[s], DAEMON_NO_BOUND, 0);
	}
}

/* By what psrd says that its cores worked for each frame, and by what the frames cost when they are alone. */
static void print_shares(const struct daemon_bench *bench, const struct link *links, const double *price_s,
                         double used_s)
{
	double cores[SIZES * OF_EACH], alone[SIZES * OF_EACH], of_size[SIZES], sum = 0, worked = 0;

	for (int i = 0; i < SIZES * OF_EACH; i++) {
		worked += cores[i] = links[i].cores_s;
		sum += alone[i] = links[i].n_done * price_s[i / OF_EACH];
	}
	if (worked > 0) {
		daemon_figure(bench, "share of cores' time, off by at most", "%", 100 * compare_shares(cores, of_size),
		              DAEMON_AT_MOST, 10);
		print_sizes(bench, of_size);
	}
	daemon_figure(bench, "share of frames x price alone, off by", "%", 100 * compare_shares(alone, of_size),
	              DAEMON_NO_BOUND, 0);
	if (worked == 0)
		print_sizes(bench, of_size);
	daemon_figure(bench, "frames x price alone / time used", "x", sum / used_s, DAEMON_NO_BOUND, 0);
}

/* Shares come in whole frames. Runs until the slowest client has so many that one of them is QUANTUM. Returns what part
 * of its time a frame of the slowest one is. */
static double run_until_fine(const struct daemon_bench *bench, struct link *links)
{
	const double start_s = clock_seconds(), most_s = fmax(MOST_SECONDS, 3 * bench->seconds);
	unsigned least;

	do {
		links_run(links, SIZES * OF_EACH, bench->seconds);
		least = links[0].n_done;
		for (int i = 1; i < SIZES * OF_EACH; i++)
			least = links[i].n_done < least ? links[i].n_done : least;
	} while (least * QUANTUM < 1 && clock_seconds() - start_s < most_s);
	return least > 0 ? 1.0 / least : 1;
}

void daemon_mixed(struct daemon_bench *bench)
{
	static const char *const options[] = { NULL };
	struct link links[SIZES * OF_EACH];
	struct daemon_server server;
	struct scene_film film[SIZES];
	double price_s[SIZES], used_s, quantum;

	daemon_start(&server, bench, options);
	for (int s = 0; s < SIZES; s++) {
		daemon_film(&film[s], bench, mixed_size[s][0], mixed_size[s][1]);
		open_links(links + s * OF_EACH, OF_EACH, &server, &film[s]);
		for (int i = 0; i < OF_EACH; i++)
			warm_up(&links[s * OF_EACH + i]);
		price_s[s] = price(bench, &server, &links[s * OF_EACH]);
	}
	want(links, SIZES * OF_EACH, 2);
	links_run(links, SIZES * OF_EACH, bench->seconds / 2);
	links_forget(links, SIZES * OF_EACH);
	used_s = daemon_processor_s(&server);
	quantum = run_until_fine(bench, links);
	used_s = daemon_processor_s(&server) - used_s;
	daemon_figure(bench, "a frame of 1920x1080 of its client's time", "%", 100 * quantum, DAEMON_NO_BOUND, 0);
	print_shares(bench, links, price_s, used_s);
	close_links(links, SIZES * OF_EACH);
	daemon_stop(&server);
}

/* ---- 6: all against one ---- */

#define TURNS 4

/* In turn, so that both see the same machine. */
static void compare(const struct daemon_bench *bench, const struct daemon_server *server, uint32_t side)
{
	static struct link links[EQUALS];
	double frames[2] = { 0 }, used_s[2] = { 0 };
	struct scene_film film;
	char name[64];

	daemon_film(&film, bench, side, side);
	open_links(links, EQUALS, server, &film);
	for (int turn = 0; turn < 2 * TURNS; turn++) {
		const unsigned n = turn % 2 == 0 ? 1 : EQUALS;

		want(links, n, 1);
		links_run(links, n, bench->seconds / 8);
		links_forget(links, EQUALS);
		const double start_s = daemon_processor_s(server);
		links_run(links, n, bench->seconds / 2);
		used_s[turn % 2] += daemon_processor_s(server) - start_s;
		frames[turn % 2] += count_done(links, n);
		links_finish(links, n, 30);
	}
	snprintf(name, sizeof name, "%ux%u: frames/s of 64 / of one", side, side);
	daemon_figure(bench, name, "x", report_ratio(frames[1], frames[0]), DAEMON_AT_LEAST, 1.25);
	snprintf(name, sizeof name, "%ux%u: processor time a frame, same", side, side);
	daemon_figure(bench, name, "x", report_ratio(used_s[1] * frames[0], used_s[0] * frames[1]), DAEMON_NO_BOUND, 0);
	snprintf(name, sizeof name, "%ux%u: frames/s of one", side, side);
	daemon_figure(bench, name, "1/s", frames[0] / (TURNS * bench->seconds / 2), DAEMON_NO_BOUND, 0);
	const double in_use = used_s[0] / (TURNS * bench->seconds / 2);
	snprintf(name, sizeof name, "%ux%u: processors in use for one", side, side);
	daemon_figure(bench, name, "", in_use, DAEMON_NO_BOUND, 0);
	snprintf(name, sizeof name, "%ux%u: bound, 2 / those in use", side, side);
	daemon_figure(bench, name, "x", 2 / in_use, DAEMON_NO_BOUND, 0);
	close_links(links, EQUALS);
}

void daemon_throughput(struct daemon_bench *bench)
{
	static const char *const options[] = { NULL };
	struct daemon_server server;

	daemon_start(&server, bench, options);
	compare(bench, &server, 256);
	compare(bench, &server, 1024);
	daemon_stop(&server);
}
