#include "child.h"

#include <fcntl.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include "base/clock.h"

static double seconds_of(struct timeval t)
{
	return (double)t.tv_sec + (double)t.tv_usec * 1e-6;
}

int child_run(struct child_use *use, const char *const *argv)
{
	struct rusage usage;
	double start = clock_seconds();
	int status, null;
	pid_t pid = fork();

	memset(use, 0, sizeof *use);
	if (pid < 0)
		return -1;
	if (pid == 0) {
		null = open("/dev/null", O_WRONLY);
		if (null >= 0)
			dup2(null, STDOUT_FILENO);
		execv(argv[0], (char *const *)argv);
		_exit(127);
	}
	if (wait4(pid, &status, 0, &usage) != pid || !WIFEXITED(status))
		return -1;
	use->seconds = clock_seconds() - start;
	use->cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
	use->peak_mib = (double)usage.ru_maxrss / 1024;
	return WEXITSTATUS(status);
}
