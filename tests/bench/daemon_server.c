#include "daemon.h"

#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include "base/clock.h"
#include "report.h"

#define MOST_ARGUMENTS 32
#define STOP_SECONDS 10

static void run_daemon(const struct daemon_server *server, const struct daemon_bench *bench,
                       const char *const *options, int out)
{
	char listen[sizeof server->socket + 8];
	const char *argv[MOST_ARGUMENTS] = { bench->psrd[bench->build], "--models", bench->folder, "--listen", listen,
		                                 "--threads", "2", "--max-clients", "128" };
	int n = 9;

	snprintf(listen, sizeof listen, "unix:%s", server->socket);
	while (*options != NULL && n + 1 < MOST_ARGUMENTS)
		argv[n++] = *options++;
	prctl(PR_SET_PDEATHSIG, SIGKILL); /* where a figure cannot be had, the benchmark ends at once */
	dup2(out, STDOUT_FILENO);
	execv(argv[0], (char *const *)argv);
	_exit(127);
}

void daemon_start(struct daemon_server *server, const struct daemon_bench *bench, const char *const *options)
{
	static unsigned n_started;
	char line[256];
	int pipes[2];
	FILE *out;

	*server = (struct daemon_server){ .pid = -1 };
	snprintf(server->socket, sizeof server->socket, "/tmp/psr-bench-%d-%u", (int)getpid(), n_started++);
	if (pipe(pipes) != 0)
		report_die("pipe", strerror(errno));
	server->pid = fork();
	if (server->pid < 0)
		report_die("fork", strerror(errno));
	if (server->pid == 0)
		run_daemon(server, bench, options, pipes[1]);
	close(pipes[1]);
	out = fdopen(pipes[0], "r");
	if (out == NULL || fgets(line, sizeof line, out) == NULL || strncmp(line, "READY ", 6) != 0)
		report_die(bench->psrd[bench->build], "does not start");
	fclose(out);
	server->minor = link_minor(server);
}

void daemon_stop(struct daemon_server *server)
{
	const double start = clock_seconds();

	kill(server->pid, SIGTERM);
	while (waitpid(server->pid, NULL, WNOHANG) == 0) {
		if (clock_seconds() - start > STOP_SECONDS)
			kill(server->pid, SIGKILL);
		nanosleep(&(struct timespec){ .tv_nsec = 10000000 }, NULL);
	}
	unlink(server->socket);
}

static double seconds_of(struct timeval t)
{
	return (double)t.tv_sec + (double)t.tv_usec * 1e-6;
}

double daemon_processor_s(const struct daemon_server *server)
{
	clockid_t clock;

	if (clock_getcpuclockid(server->pid, &clock) != 0)
		report_die("psrd", "has no clock");
	return (double)clock_read(clock) * 1e-9;
}

double daemon_field(const char *path, const char *name)
{
	FILE *file = fopen(path, "r");
	double sum = 0;
	char line[256];

	if (file == NULL)
		return 0;
	while (fgets(line, sizeof line, file) != NULL)
		if (strncmp(line, name, strlen(name)) == 0)
			sum += strtod(strchr(line, ':') + 1, NULL);
	fclose(file);
	return sum;
}

double daemon_others(void)
{
	static double last[2];
	double now[2] = { 0, clock_seconds() }, part;
	unsigned long long v[8] = { 0 };
	struct rusage self, children;
	FILE *file = fopen("/proc/stat", "r");

	if (file != NULL && fscanf(file, "cpu %llu %llu %llu %llu %llu %llu %llu %llu", &v[0], &v[1], &v[2], &v[3], &v[4],
	                           &v[5], &v[6], &v[7]) == 8)
		now[0] = (double)(v[0] + v[1] + v[2] + v[5] + v[6] + v[7]) / (double)sysconf(_SC_CLK_TCK);
	if (file != NULL)
		fclose(file);
	getrusage(RUSAGE_SELF, &self);
	getrusage(RUSAGE_CHILDREN, &children);
	now[0] -= seconds_of(self.ru_utime) + seconds_of(self.ru_stime);
	now[0] -= seconds_of(children.ru_utime) + seconds_of(children.ru_stime);
	part = (now[0] - last[0]) / (now[1] - last[1]) / (double)sysconf(_SC_NPROCESSORS_ONLN);
	last[0] = now[0];
	last[1] = now[1];
	return part > 0 ? part : 0;
}

double daemon_peak_bytes(const struct daemon_server *server)
{
	char path[64];

	snprintf(path, sizeof path, "/proc/%d/status", (int)server->pid);
	return daemon_field(path, "VmHWM:") * 1024;
}

double daemon_switches(const struct daemon_server *server)
{
	const struct dirent *entry;
	double sum = 0;
	char path[512];
	DIR *tasks;

	snprintf(path, sizeof path, "/proc/%d/task", (int)server->pid);
	tasks = opendir(path);
	while (tasks != NULL && (entry = readdir(tasks)) != NULL) {
		snprintf(path, sizeof path, "/proc/%d/task/%s/status", (int)server->pid, entry->d_name);
		if (entry->d_name[0] != '.')
			sum += daemon_field(path, "voluntary_ctxt_switches:");
	}
	if (tasks != NULL)
		closedir(tasks);
	return sum;
}
