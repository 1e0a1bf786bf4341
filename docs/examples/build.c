/* build MODEL.psr: builds a model of arrays, a red pyramid.
 * cc build.c $(pkg-config --cflags --libs psr-build) -o build */
#include <stdio.h>
#include <string.h>
#include <psr/build.h>

static const double point[5][3] = { { -1, 0, -1 }, { 1, 0, -1 }, { 1, 0, 1 }, { -1, 0, 1 }, { 0, 1.5, 0 } };
static const uint32_t face[6][3] = { { 3, 2, 4 }, { 2, 1, 4 }, { 1, 0, 4 }, { 0, 3, 4 }, { 0, 1, 2 }, { 0, 2, 3 } };
static const float red[4] = { 0.8f, 0.02f, 0.02f, 1 };

int main(int argc, char **argv)
{
	struct psr_mesh *mesh = NULL;
	struct psr_model *model = NULL;
	struct psr_build_options options;
	struct psr_error err = { 0 };

	psr_build_options_default(&options);
	if (argc != 2) {
		psr_fail(&err, PSR_ERR_ARG, "usage: build MODEL.psr");
	} else if (psr_mesh_create(&mesh, point, 5, face, 6, &err) == PSR_OK) {
		memcpy(mesh->material[0].base_color, red, sizeof red);
		if (psr_model_build(&model, mesh, &options, NULL, &err) == PSR_OK)
			psr_model_write(model, argv[1], &err);
	}
	if (err.code != PSR_OK)
		fprintf(stderr, "%s\n", err.text);
	psr_model_unref(model);
	psr_mesh_destroy(mesh);
	return psr_exit_status(err.code);
}
