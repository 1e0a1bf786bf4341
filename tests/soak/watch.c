#define _GNU_SOURCE
#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <unistd.h>
#include "soak.h"

pid_t watch_start(const char *const *argv, const char *errors, char address[128])
{
	char line[160];
	int out[2], n = 0;
	pid_t pid;

	if (pipe2(out, O_CLOEXEC) != 0 || (pid = fork()) < 0)
		return -1;
	if (pid == 0) {
		int err = open(errors, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND, 0600);

		prctl(PR_SET_PDEATHSIG, SIGKILL);
		dup2(out[1], 1);
		dup2(err, 2);
		execv(argv[0], (char *const *)argv);
		_exit(127);
	}
	close(out[1]);
	while (n < (int)sizeof line - 1 && read(out[0], &line[n], 1) == 1 && line[n] != '\n')
		n++;
	line[n] = '\0';
	if (sscanf(line, "READY %127s", address) == 1)
		return pid; /* the pipe stays open: it is the child's as long as this program lives */
	kill(pid, SIGKILL);
	return -1;
}

struct watch watch_look(pid_t pid)
{
	struct watch watch = { 0, 0 };
	char path[64], line[256];
	FILE *file;
	DIR *folder;

	snprintf(path, sizeof path, "/proc/%d/status", (int)pid);
	file = fopen(path, "r");
	while (file != NULL && fgets(line, sizeof line, file) != NULL)
		sscanf(line, "VmRSS: %ld", &watch.resident_kb);
	if (file != NULL)
		fclose(file);
	snprintf(path, sizeof path, "/proc/%d/fd", (int)pid);
	folder = opendir(path);
	while (folder != NULL && readdir(folder) != NULL)
		watch.descriptors++;
	if (folder != NULL)
		closedir(folder);
	return watch;
}
