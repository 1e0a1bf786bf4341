#include "commands.h"

#include <stdio.h>
#include <stdlib.h>
#include "generators.h"
#include "glb.h"
#include "psr/cli.h"

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
		code = glb_write(path, bytes, n_bytes, err);
	if (code == PSR_OK)
		printf("%s: %u triangles, %u materials, %.2f MB\n", path, shape.n_triangles, shape.n_materials,
		       (double)n_bytes / 1e6);
	free(bytes);
	shape_fini(&shape);
	return code;
}

int cmd_make(int argc, char **argv)
{
	const struct generator *generator;
	const char *path = NULL;
	int list = 0, n_operands, code;
	struct psr_error err;
	const struct psr_opt opts[] = {
		{ .name = "output", .letter = 'o', .type = PSR_OPT_STRING, .value = &path, .arg = "OUT.glb",
		  .help = "the file to write" },
		{ .name = "list", .type = PSR_OPT_FLAG, .value = &list, .help = "print the names and what they are" },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr-model make NAME -o OUT.glb | psr-model make --list",
		.summary = "Generates a model of the standard set as binary glTF. The same bytes on every machine.",
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
	if (code == PSR_OK) {
		generator = generator_find(argv[1], &err);
		if (generator == NULL)
			code = err.code;
		else if (path == NULL)
			code = psr_fail(&err, PSR_ERR_ARG, "-o OUT.glb is missing");
		else
			code = make_file(generator, path, &err);
	}
	return code == PSR_OK ? 0 : psr_cli_fail("psr-model make", &err);
}
