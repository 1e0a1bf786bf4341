/* Modules that crash, end, are killed or give much, in a process of their own. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include "import/cad/apart.h"

static void destroy(struct cad_module_mesh *mesh)
{
	if (mesh == NULL)
		return;
	for (uint32_t i = 0; i < mesh->n_patches; i++)
		cad_patch_free(&mesh->patch[i]);
	free(mesh->position);
	free(mesh->normal);
	free(mesh->triangle);
	free(mesh->color_of);
	free(mesh->color);
	free(mesh->patch);
	free(mesh->patch_of);
	free(mesh);
}

static void *filled(size_t n, uint8_t with)
{
	void *bytes = malloc(n);

	assert_non_null(bytes);
	memset(bytes, with, n);
	return bytes;
}

/* More than a pipe holds. */
static int give(struct cad_module_mesh **out, const struct cad_module_source *source, char *message, unsigned size)
{
	struct cad_module_mesh *m = calloc(1, sizeof *m);

	(void)message, (void)size;
	assert_non_null(m);
	m->n_vertices = 100000;
	m->n_triangles = 50000;
	m->n_colors = 2;
	m->n_patches = 2;
	m->n_faces = 7;
	m->position = filled(m->n_vertices * sizeof *m->position, 1);
	m->normal = filled(m->n_vertices * sizeof *m->normal, 2);
	m->triangle = filled(m->n_triangles * sizeof *m->triangle, 3);
	m->color_of = filled(m->n_triangles * sizeof *m->color_of, 4);
	m->color = filled(m->n_colors * sizeof *m->color, 5);
	m->patch_of = filled(m->n_triangles * sizeof *m->patch_of, 6);
	m->patch = calloc(m->n_patches, sizeof *m->patch);
	assert_non_null(m->patch);
	for (uint32_t i = 0; i < m->n_patches; i++) {
		struct psr_patch *p = &m->patch[i];

		*p = (struct psr_patch){ .degree = { 1, 2 }, .n = { 2, 3 + i }, .n_corners = 4 + i, .n_triangles = 5 };
		p->material = i;
		p->knot[0] = filled(4 * sizeof(double), 7);
		p->knot[1] = filled((6 + i) * sizeof(double), 8);
		p->control = filled((size_t)2 * (3 + i) * sizeof *p->control, 9);
		p->corner = filled(p->n_corners * sizeof *p->corner, 10);
		p->triangle = filled(p->n_triangles * sizeof *p->triangle, 11);
		p->rim = filled(p->n_triangles, (uint8_t)(12 + i));
	}
	strcpy(m->first_left_out, "3 of part \"x\"");
	source->report->n_lacking = 5;
	strcpy(source->report->first_lacking, "#1");
	*out = m;
	return PSR_OK;
}

static int refuse(struct cad_module_mesh **out, const struct cad_module_source *source, char *message, unsigned size)
{
	(void)out, (void)source;
	snprintf(message, size, "too many of them");
	return PSR_ERR_LIMIT;
}

static volatile int never;

static int recurse(const volatile int *above)
{
	volatile int here[1000];

	here[0] = *above;
	return never ? 0 : recurse(here) + here[0];
}

/* By what the source's path names. */
static int end(struct cad_module_mesh **out, const struct cad_module_source *source, char *message, unsigned size)
{
	const int how = atoi(source->path);

	(void)out, (void)message, (void)size;
	source->report->doing = CAD_MODULE_CUTS;
	if (how == 0)
		_exit(0);
	if (how < 0)
		return recurse(&how);
	raise(how);
	return PSR_OK;
}

/* Half of a mesh. */
static int give_half(struct cad_module_mesh **out, const struct cad_module_source *source, char *message, unsigned size)
{
	give(out, source, message, size);
	free((*out)->triangle);
	(*out)->triangle = (void *)8;
	return PSR_OK;
}

static int ends_of_module; /* of a pipe that only it has open */

static int wait_for_ever(struct cad_module_mesh **out, const struct cad_module_source *source, char *message,
                         unsigned size)
{
	(void)out, (void)source, (void)message, (void)size;
	assert_int_equal(write(ends_of_module, "x", 1), 1);
	for (;;)
		pause();
	return PSR_OK;
}

static int read_apart(struct cad_module_mesh **out, struct cad_module_report *report, cad_module_read *function,
                      const char *path, char message[200])
{
	const struct cad_module module = { CAD_MODULE_VERSION, function, destroy };
	const struct cad_module_source source = { .path = path };

	message[0] = '\0';
	return import_cad_apart(out, report, &module, &source, message, 200);
}

static void expect_filled(const void *bytes, size_t n, uint8_t with)
{
	const uint8_t *b = bytes;

	for (size_t i = 0; i < n; i++)
		assert_int_equal(b[i], with);
}

static void everything_comes(void **state)
{
	struct cad_module_report report = { .n_lacking = 0 };
	struct cad_module_mesh *m = NULL;
	char message[200];

	(void)state;
	assert_int_equal(read_apart(&m, &report, give, "", message), PSR_OK);
	assert_true(m->n_vertices == 100000 && m->n_triangles == 50000 && m->n_faces == 7 && m->n_patches == 2);
	expect_filled(m->position, m->n_vertices * sizeof *m->position, 1);
	expect_filled(m->normal, m->n_vertices * sizeof *m->normal, 2);
	expect_filled(m->triangle, m->n_triangles * sizeof *m->triangle, 3);
	expect_filled(m->color_of, m->n_triangles * sizeof *m->color_of, 4);
	expect_filled(m->color, m->n_colors * sizeof *m->color, 5);
	expect_filled(m->patch_of, m->n_triangles * sizeof *m->patch_of, 6);
	for (uint32_t i = 0; i < 2; i++) {
		const struct psr_patch *p = &m->patch[i];

		assert_true(p->n[1] == 3 + i && p->n_corners == 4 + i && p->material == i);
		expect_filled(p->knot[0], 4 * sizeof(double), 7);
		expect_filled(p->knot[1], (6 + i) * sizeof(double), 8);
		expect_filled(p->control, (size_t)2 * (3 + i) * sizeof *p->control, 9);
		expect_filled(p->corner, p->n_corners * sizeof *p->corner, 10);
		expect_filled(p->triangle, p->n_triangles * sizeof *p->triangle, 11);
		expect_filled(p->rim, p->n_triangles, (uint8_t)(12 + i));
	}
	assert_string_equal(m->first_left_out, "3 of part \"x\"");
	assert_int_equal(report.n_lacking, 5);
	assert_string_equal(report.first_lacking, "#1");
	destroy(m);
}

static void an_error_comes_as_it_is(void **state)
{
	struct cad_module_report report;
	struct cad_module_mesh *m = NULL;
	char message[200];

	(void)state;
	assert_int_equal(read_apart(&m, &report, refuse, "", message), PSR_ERR_LIMIT);
	assert_string_equal(message, "too many of them");
	assert_null(m);
}

static void a_crash_is_an_error(void **state)
{
	const struct {
		int how;
		const char *words;
	} crash[] = { { SIGSEGV, "(Segmentation fault)" }, { SIGBUS, "(Bus error)" }, { SIGABRT, "(Aborted)" },
		          { SIGFPE, "(Floating point exception)" }, { SIGILL, "(Illegal instruction)" },
		          { 0, "(it ends the process)" }, { -1, "(Segmentation fault)" } };
	struct cad_module_report report;
	struct cad_module_mesh *m = NULL;
	char message[200], how[20];

	(void)state;
	for (size_t i = 0; i < sizeof crash / sizeof *crash; i++) {
		snprintf(how, sizeof how, "%d", crash[i].how);
		assert_int_equal(read_apart(&m, &report, end, how, message), PSR_ERR_FORMAT);
		if (strstr(message, crash[i].words) == NULL || strstr(message, "while it cuts its faces") == NULL)
			fail_msg("%s", message);
		assert_null(m);
	}
}

/* The child ends where an array cannot be written. */
static void half_a_mesh_is_none(void **state)
{
	struct cad_module_report report;
	struct cad_module_mesh *m = NULL;
	char message[200];

	(void)state;
	assert_int_equal(read_apart(&m, &report, give_half, "", message), PSR_ERR_FORMAT);
	assert_null(m);
}

/* As a limit of processor time, which is of the process that reads: who watches it sees this. */
static void other_signals_end_the_process(void **state)
{
	struct cad_module_report report;
	struct cad_module_mesh *m = NULL;
	char message[200], how[20];
	int status;
	pid_t child;

	(void)state;
	snprintf(how, sizeof how, "%d", SIGXCPU);
	child = fork();
	if (child == 0) {
		const struct rlimit none = { 0, 0 };

		setrlimit(RLIMIT_CORE, &none);
		_exit(read_apart(&m, &report, end, how, message) == PSR_OK);
	}
	assert_int_equal(waitpid(child, &status, 0), child);
	assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU);
}

static void it_ends_with_the_process(void **state)
{
	struct cad_module_report report;
	struct cad_module_mesh *m = NULL;
	char message[200], byte;
	int fd[2];
	pid_t child;

	(void)state;
	assert_int_equal(pipe(fd), 0);
	ends_of_module = fd[1];
	child = fork();
	if (child == 0)
		_exit(read_apart(&m, &report, wait_for_ever, "", message) == PSR_OK);
	close(fd[1]);
	assert_int_equal(read(fd[0], &byte, 1), 1);
	kill(child, SIGKILL);
	assert_int_equal(waitpid(child, NULL, 0), child);
	alarm(60);
	assert_int_equal(read(fd[0], &byte, 1), 0);
	alarm(0);
	close(fd[0]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(everything_comes),
		cmocka_unit_test(an_error_comes_as_it_is),
		cmocka_unit_test(a_crash_is_an_error),
		cmocka_unit_test(half_a_mesh_is_none),
		cmocka_unit_test(other_signals_end_the_process),
		cmocka_unit_test(it_ends_with_the_process),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
