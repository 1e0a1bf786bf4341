/* Connections that come and go, many and fast. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <inttypes.h>
#include <sys/prctl.h>
#include "plate.h"

static struct daemon psrd;
static struct peer p, q;

/* ---- connections that come and go ---- */

static int count_descriptors(void)
{
	char command[64];
	FILE *pipe;
	int n = 0;

	snprintf(command, sizeof command, "ls /proc/%d/fd | wc -l", (int)psrd.pid);
	pipe = popen(command, "r");
	assert_non_null(pipe);
	assert_int_equal(fscanf(pipe, "%d", &n), 1);
	pclose(pipe);
	return n;
}

/* By turns: at once, in the middle of a frame, by RST, half closed, without HELLO, with nonsense. */
static void come_and_go(int i)
{
	static const struct linger rst = { .l_onoff = 1 };
	struct psr_msg_frame frame = frame_default(300, 300);
	struct psr_message message;

	if (i % 6 == 4) {
		peer_connect(&p, &psrd);
	} else if (i % 6 == 5) {
		peer_connect(&p, &psrd);
		peer_write(&p, "GET / HTTP/1.0\r\n\r\n", 18);
	} else {
		peer_begin(&p, &psrd, "plate");
		frame.color_codec = PSR_CODEC_RAW;
		peer_ask_frame(&p, &frame);
		if (i % 6 != 0)
			assert_true(peer_next(&p, &message));
		if (i % 6 == 2)
			setsockopt(p.fd, SOL_SOCKET, SO_LINGER, &rst, sizeof rst);
		if (i % 6 == 3) {
			shutdown(p.fd, SHUT_WR);
			while (peer_next(&p, &message))
				;
		}
	}
	peer_close(&p);
}

/* A thousand show memory that is left behind. Descriptors show at once, and so do races and bad accesses: the sanitizers,
 * under which a connection costs twenty times as much, see fewer. */
#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
#define N_BEFORE 30
#define N_AFTER 120
#else
#define N_BEFORE 300
#define N_AFTER 1000
#endif

static void a_thousand_reconnections_leave_nothing_behind(void **state)
{
	int64_t end;
	int fds;
	long kb;

	(void)state;
	daemon_start(&psrd, folder, NULL);
	peer_begin(&q, &psrd, "plate");
	for (int i = 0; i < N_BEFORE; i++)
		come_and_go(i);
	while (stat_of(&psrd, PSR_STAT_CONNECTIONS) > 2)
		usleep(10000);
	kb = daemon_resident_kb(&psrd);
	fds = count_descriptors();
	for (int i = 0; i < N_AFTER; i++)
		come_and_go(i);
	peer_draw(&q);
	end = clock_ms() + PATIENCE_MS;
	while (stat_of(&psrd, PSR_STAT_CONNECTIONS) > 2 || count_descriptors() > fds) {
		assert_true(clock_ms() < end);
		usleep(10000);
	}
	/* A connection holds 130 KB of buffers and a frame of 270 KB: one in fifty left behind would show. The sanitizers' own
	 * memory grows. */
	if (N_AFTER == 1000)
		assert_in_range(daemon_resident_kb(&psrd) - kb + 8192, 0, 2 * 8192);
	peer_close(&q);
	daemon_stop(&psrd);
}

/* Connections as fast as two processes can make them, for a second: a client's frames go on, and others come in. */
static void a_flood_of_connections_stops_nobody(void **state)
{
	const char *const more[] = { "--max-pending", "64", NULL };
	int64_t end;
	pid_t flood[2];
	int n_frames = 0, n_clients = 0;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_begin(&p, &psrd, "plate");
	for (int k = 0; k < 2; k++) {
		flood[k] = fork();
		assert_true(flood[k] >= 0);
		if (flood[k] == 0) {
			prctl(PR_SET_PDEATHSIG, SIGKILL);
			for (;;) {
				struct sockaddr_in in = { .sin_family = AF_INET, .sin_port = htons(psrd.port),
					                      .sin_addr.s_addr = htonl(INADDR_LOOPBACK) };
				const struct linger rst = { .l_onoff = 1 };
				int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);

				connect(fd, (struct sockaddr *)&in, sizeof in);
				setsockopt(fd, SOL_SOCKET, SO_LINGER, &rst, sizeof rst); /* or the flood runs out of ports */
				close(fd);
			}
		}
	}
	for (end = clock_ms() + 1000; clock_ms() < end; n_frames++)
		peer_draw(&p);
	for (end = clock_ms() + 500; clock_ms() < end; n_clients++)
		expect_serves(&psrd, "plate");
	for (int k = 0; k < 2; k++) {
		kill(flood[k], SIGKILL);
		waitpid(flood[k], NULL, 0);
	}
	assert_true(n_frames > 0 && n_clients > 0);
	print_message("# %d frames and %d clients beside %" PRIu64 " connections\n", n_frames, n_clients,
	              stat_of(&psrd, PSR_STAT_CONNECTIONS_TOTAL));
	peer_close(&p);
	daemon_stop(&psrd);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(a_thousand_reconnections_leave_nothing_behind, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_flood_of_connections_stops_nobody, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
