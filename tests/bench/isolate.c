#include "isolate.h"

#include <stdio.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include "report.h"

void *isolate_alloc(size_t n_bytes)
{
	void *memory = mmap(NULL, n_bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);

	if (memory == MAP_FAILED)
		report_die("memory", "there is not enough");
	return memory;
}

void isolate_free(void *memory, size_t n_bytes)
{
	munmap(memory, n_bytes);
}

void isolate_run(void (*part)(void *arg), void *arg)
{
	int status;
	pid_t pid;

	fflush(NULL);
	pid = fork();
	if (pid == 0) {
		part(arg);
		_exit(0);
	}
	if (pid < 0 || waitpid(pid, &status, 0) != pid)
		report_die("fork", "no process");
	if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
		report_die("a part of the benchmark", "failed");
}
