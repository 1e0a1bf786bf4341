#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include "spawn.h"

extern char **environ;

struct plan { /* everything that the child reads, made before the child exists */
	const char *const *argv;
	struct rlimit memory, cpu, file, core;
	int nice, null_fd, error_fd, fd3;
	pid_t parent;
	sigset_t none;
	volatile int failure; /* the child's errno: it shares this memory */
};

/* Between vfork and exec the child shares the parent's memory: system calls only, no allocation, no lock. */
static void become(struct plan *plan)
{
	const struct sigaction standard = { .sa_handler = SIG_DFL };

	setpgid(0, 0);
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	if (getppid() != plan->parent)
		_exit(127);
	for (int number = 1; number < NSIG; number++)
		if (number != SIGKILL && number != SIGSTOP)
			sigaction(number, &standard, NULL);
	setpriority(PRIO_PROCESS, 0, plan->nice);
	setrlimit(RLIMIT_AS, &plan->memory);
	setrlimit(RLIMIT_CPU, &plan->cpu);
	setrlimit(RLIMIT_FSIZE, &plan->file);
	setrlimit(RLIMIT_CORE, &plan->core);
	/* spawn_start() keeps fd3 and error_fd above 3, so that dup2() overwrites neither too early. */
	if (dup2(plan->null_fd, 0) < 0 || dup2(plan->null_fd, 1) < 0 || dup2(plan->error_fd, 2) < 0
	    || dup2(plan->fd3, 3) < 0 || close_range(4, ~0u, 0) != 0) {
		plan->failure = errno;
		_exit(127);
	}
	sigprocmask(SIG_SETMASK, &plan->none, NULL);
	execve(plan->argv[0], (char *const *)plan->argv, environ);
	plan->failure = errno;
	_exit(127);
}

static __attribute__((noinline)) pid_t start(struct plan *plan)
{
	pid_t pid = vfork();

	if (pid == 0)
		become(plan);
	return pid;
}

static int raise_fd(int fd)
{
	int raised = fcntl(fd, F_DUPFD_CLOEXEC, 10);

	if (fd >= 0)
		close(fd);
	return raised;
}

int spawn_start(pid_t *pid, int *fd3, int *error_fd, const char *const *argv, const struct spawn_limits *limits,
                struct psr_error *err)
{
	struct plan plan = {
		.argv = argv, .memory = { limits->memory_bytes, limits->memory_bytes },
		.cpu = { limits->cpu_seconds, limits->cpu_seconds + 5 }, .file = { limits->file_bytes, limits->file_bytes },
		.nice = limits->nice, .parent = getpid(),
	};
	int three[2] = { -1, -1 }, errors[2] = { -1, -1 }, failure;
	sigset_t all, before;

	if (pipe2(three, O_CLOEXEC) != 0 || pipe2(errors, O_CLOEXEC) != 0)
		plan.failure = errno;
	plan.null_fd = raise_fd(open("/dev/null", O_RDWR | O_CLOEXEC));
	plan.error_fd = raise_fd(errors[1]);
	plan.fd3 = raise_fd(three[1]);
	if (plan.failure == 0 && (plan.null_fd < 0 || plan.error_fd < 0 || plan.fd3 < 0))
		plan.failure = EMFILE;
	if (plan.failure == 0) {
		sigemptyset(&plan.none);
		sigfillset(&all);
		pthread_sigmask(SIG_SETMASK, &all, &before);
		*pid = start(&plan);
		failure = errno;
		pthread_sigmask(SIG_SETMASK, &before, NULL);
		if (*pid < 0)
			plan.failure = failure;
		else if (plan.failure != 0)
			waitpid(*pid, NULL, 0);
	}
	close(plan.null_fd);
	close(plan.error_fd);
	close(plan.fd3);
	if (plan.failure != 0) {
		close(three[0]);
		close(errors[0]);
		return psr_fail(err, plan.failure == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s cannot be started: %s",
		                argv[0], strerror(plan.failure));
	}
	fcntl(three[0], F_SETFL, O_NONBLOCK);
	fcntl(errors[0], F_SETFL, O_NONBLOCK);
	*fd3 = three[0];
	*error_fd = errors[0];
	return PSR_OK;
}
