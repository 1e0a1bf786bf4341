#include "commands.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include "base/outfile.h"
#include "models/shapes/generators.h"
#include "models/shapes/glb.h"
#include "base/cli.h"

/* Triangles as drawn, every instance counted. */
static uint64_t count_triangles(const struct shape *shape)
{
	uint64_t n = 0;

	for (uint32_t t = 0; t < shape->n_triangles; t++)
		n += shape->triangle_part[t] == 0;
	for (uint32_t part = 1; part < shape->n_parts; part++) {
		uint64_t n_part = 0, n_copies = 0;
		for (uint32_t t = 0; t < shape->n_triangles; t++)
			n_part += shape->triangle_part[t] == part;
		for (uint32_t i = 0; i < shape->n_instances; i++)
			n_copies += shape->instance[i].part == part;
		n += n_part * n_copies;
	}
	return n;
}

static int make_file(const struct generator *generator, const char *path, struct psr_error *err)
{
	struct shape shape;
	uint8_t *bytes = NULL;
	size_t n_bytes = 0;
	int code;

	shape_init(&shape);
	generator->make(&shape);
	code = glb_encode(&bytes, &n_bytes, &shape, generator->name, err);
	if (code == PSR_OK)
		code = outfile_save(path, OUTFILE_DURABLE, bytes, n_bytes, err);
	if (code == PSR_OK)
		printf("%s: %llu triangles, %u instances, %u materials, %.2f MB\n", path,
		       (unsigned long long)count_triangles(&shape), shape.n_instances, shape.n_materials,
		       (double)n_bytes / 1e6);
	free(bytes);
	shape_fini(&shape);
	return code;
}

/* Every generator, as FOLDER/NAME.glb; the folder is made if it is not there. */
static int make_all(const char *folder, struct psr_error *err)
{
	size_t room = strlen(folder) + 64;
	char *path = malloc(room);
	int code = PSR_OK;

	if (path == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a file name");
	if (mkdir(folder, 0777) != 0 && errno != EEXIST)
		code = psr_fail(err, PSR_ERR_IO, "the folder '%s' cannot be made: %s", folder, strerror(errno));
	for (size_t i = 0; i < n_generators && code == PSR_OK; i++) {
		snprintf(path, room, "%s/%s.glb", folder, generators[i].name);
		code = make_file(&generators[i], path, err);
	}
	free(path);
	return code;
}

int cmd_make(int argc, char **argv)
{
	const struct generator *generator;
	const char *path = NULL;
	int list = 0, n_operands, code;
	struct psr_error err;
	const struct psr_opt opts[] = {
		{ .name = "output", .letter = 'o', .type = PSR_OPT_STRING, .value = &path, .arg = "OUT",
		  .help = "The file to write; for `all` the folder." },
		{ .name = "list", .type = PSR_OPT_FLAG, .value = &list, .help = "Prints the names, and a description of each." },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr-model make NAME -o OUT.glb | psr-model make all -o FOLDER | psr-model make --list",
		.summary = "Generates models of the standard set as binary glTF. The same bytes on every machine.",
		.opts = opts,
		.footer = "Example: psr-model make teapot -o teapot.glb",
	};

	code = psr_cli_parse(&cli, argc, argv, &n_operands, &err);
	if (code > 0)
		return 0;
	if (code == PSR_OK && list) {
		for (size_t i = 0; i < n_generators; i++)
			printf("%-9s  %s\n", generators[i].name, generators[i].summary);
		return 0;
	}
	if (code == PSR_OK && n_operands != 1)
		code = psr_fail(&err, PSR_ERR_ARG, "one NAME is needed; psr-model make --list prints them");
	if (code == PSR_OK && path == NULL)
		code = psr_fail(&err, PSR_ERR_ARG, "-o %s is missing", strcmp(argv[1], "all") == 0 ? "FOLDER" : "OUT.glb");
	if (code == PSR_OK && strcmp(argv[1], "all") == 0) {
		code = make_all(path, &err);
	} else if (code == PSR_OK) {
		generator = generator_find(argv[1], &err);
		code = generator == NULL ? err.code : make_file(generator, path, &err);
	}
	return code == PSR_OK ? 0 : psr_cli_fail("psr-model make", &err);
}
