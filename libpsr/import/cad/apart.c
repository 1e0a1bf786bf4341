#define _GNU_SOURCE
#include "apart.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

static const int crashes[] = { SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL };
#define N_CRASHES (sizeof crashes / sizeof *crashes)

/* One end of the pipe. Both pass the same things in the same order. */
struct end {
	int fd, takes;
	int code; /* or IO: the other end is gone; MEMORY */
};

static void pass(struct end *end, void *bytes, size_t n)
{
	uint8_t *at = bytes;

	while (end->code == PSR_OK && n > 0) {
		const ssize_t done = end->takes ? read(end->fd, at, n) : write(end->fd, at, n);

		if (done > 0) {
			at += done;
			n -= (size_t)done;
		} else if (done == 0 || errno != EINTR) {
			end->code = PSR_ERR_IO;
		}
	}
}

/* Returns the array: who takes gets a new one, or NULL. */
static void *pass_array(struct end *end, void *array, size_t n_bytes)
{
	if (end->takes) {
		array = end->code == PSR_OK ? malloc(n_bytes + 1) : NULL;
		if (end->code == PSR_OK && array == NULL)
			end->code = PSR_ERR_MEMORY;
	}
	pass(end, array, n_bytes);
	return array;
}

static void pass_patch(struct end *end, struct psr_patch *p)
{
	for (int k = 0; k < 2; k++)
		p->knot[k] = pass_array(end, p->knot[k], ((size_t)p->n[k] + (size_t)p->degree[k] + 1) * sizeof *p->knot[k]);
	p->control = pass_array(end, p->control, (size_t)p->n[0] * p->n[1] * sizeof *p->control);
	p->corner = pass_array(end, p->corner, p->n_corners * sizeof *p->corner);
	p->triangle = pass_array(end, p->triangle, p->n_triangles * sizeof *p->triangle);
	p->rim = pass_array(end, p->rim, p->n_triangles * sizeof *p->rim);
}

static void pass_mesh(struct end *end, struct cad_module_mesh *m)
{
	pass(end, m, sizeof *m);
	m->position = pass_array(end, m->position, m->n_vertices * sizeof *m->position);
	m->normal = pass_array(end, m->normal, m->n_vertices * sizeof *m->normal);
	m->triangle = pass_array(end, m->triangle, m->n_triangles * sizeof *m->triangle);
	m->color_of = pass_array(end, m->color_of, m->n_triangles * sizeof *m->color_of);
	m->color = pass_array(end, m->color, m->n_colors * sizeof *m->color);
	if (m->patch_of != NULL)
		m->patch_of = pass_array(end, m->patch_of, m->n_triangles * sizeof *m->patch_of);
	if (m->patch != NULL)
		m->patch = pass_array(end, m->patch, m->n_patches * sizeof *m->patch);
	if (m->patch == NULL)
		m->n_patches = 0;
	for (uint32_t i = 0; i < m->n_patches; i++)
		pass_patch(end, &m->patch[i]);
}

static _Noreturn void be_child(int fd, pid_t parent, const struct cad_module *module,
                               const struct cad_module_source *source, unsigned message_size)
{
	const struct rlimit none = { 0, 0 };
	struct end end = { .fd = fd };
	struct cad_module_mesh *mesh = NULL;
	char *message = calloc(1, message_size);
	int code;

	prctl(PR_SET_PDEATHSIG, SIGKILL);
	if (getppid() != parent || message == NULL)
		_exit(1);
	for (size_t i = 0; i < N_CRASHES; i++)
		signal(crashes[i], SIG_DFL);
	setrlimit(RLIMIT_CORE, &none);
	code = module->read(&mesh, source, message, message_size);
	pass(&end, &code, sizeof code);
	pass(&end, message, message_size);
	if (code == PSR_OK)
		pass_mesh(&end, mesh);
	_exit(end.code != PSR_OK);
}

static int fail(char *message, unsigned size, int code, const char *what)
{
	snprintf(message, size, "%s: %s", what, strerror(errno));
	return code;
}

/* A child that crashes may have written anything there. */
static struct cad_module_report checked(const struct cad_module_report *shared)
{
	struct cad_module_report report = *shared;

	if ((unsigned)report.doing > CAD_MODULE_CUTS)
		report.doing = CAD_MODULE_CUTS;
	report.first_lacking[sizeof report.first_lacking - 1] = '\0';
	return report;
}

/* What the end of a child means that did not give everything. */
static int explain(char *message, unsigned size, int status, const struct cad_module_report *shared)
{
	static const char *const words[] = {
		[CAD_MODULE_PARSES] = "reads its entities", [CAD_MODULE_SHAPES] = "makes shapes of its entities",
		[CAD_MODULE_CUTS] = "cuts its faces into triangles",
	};
	const struct cad_module_report report = checked(shared);
	const int number = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
	int is_crash = number == 0;

	for (size_t i = 0; i < N_CRASHES; i++)
		is_crash |= number == crashes[i];
	if (!is_crash)
		kill(getpid(), number);
	snprintf(message, size, "Open CASCADE crashes while it %s (%s): %s%s; export it again", words[report.doing],
	         number != 0 ? strsignal(number) : "it ends the process", report.n_lacking > 0 ? "entity " :
	         "an entity may be empty, or a part of itself", report.n_lacking > 0 ? report.first_lacking : "");
	return PSR_ERR_FORMAT;
}

/* Takes what the child gives until it ends. */
static int take(struct cad_module_mesh **out, int fd, pid_t child, const struct cad_module *module,
                const struct cad_module_report *report, char *message, unsigned message_size)
{
	struct end end = { .fd = fd, .takes = 1 };
	struct cad_module_mesh *mesh = NULL;
	int code = PSR_OK, status = 0;

	pass(&end, &code, sizeof code);
	pass(&end, message, message_size);
	if (end.code == PSR_OK && code == PSR_OK) {
		mesh = calloc(1, sizeof *mesh);
		if (mesh != NULL)
			pass_mesh(&end, mesh);
		else
			end.code = PSR_ERR_MEMORY;
	}
	close(fd);
	while (waitpid(child, &status, 0) < 0 && errno == EINTR)
		;
	if (end.code == PSR_ERR_IO)
		code = explain(message, message_size, status, report);
	else if (end.code != PSR_OK)
		code = fail(message, message_size, end.code, "its triangles");
	if (code != PSR_OK)
		module->destroy(mesh);
	else
		*out = mesh;
	return code;
}

int import_cad_apart(struct cad_module_mesh **out, struct cad_module_report *report, const struct cad_module *module,
                     const struct cad_module_source *source, char *message, unsigned message_size)
{
	struct cad_module_source with = *source;
	const pid_t parent = getpid();
	int fd[2], code;
	pid_t child;

	*out = NULL;
	if (pipe2(fd, O_CLOEXEC) != 0)
		return fail(message, message_size, PSR_ERR_IO, "a pipe to a process");
	with.report = mmap(NULL, sizeof *with.report, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	child = with.report != MAP_FAILED ? fork() : -1;
	if (child == 0) {
		close(fd[0]);
		be_child(fd[1], parent, module, &with, message_size);
	}
	close(fd[1]);
	if (child > 0) {
		code = take(out, fd[0], child, module, with.report, message, message_size);
		*report = checked(with.report);
	} else {
		code = fail(message, message_size, PSR_ERR_IO, "a process of its own");
		close(fd[0]);
	}
	if (with.report != MAP_FAILED)
		munmap(with.report, sizeof *with.report);
	return code;
}
