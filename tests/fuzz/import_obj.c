/* The text that Assimp gets in the place of an OBJ: as many vertices as were read, numbered in their order. A plain file,
 * read without Assimp, has the same vertices, and faces of them. */
#include <string.h>
#include "import/assimp/obj.h"
#include "import_check.h"

static void check_plain(const struct obj *obj, const uint8_t *data, size_t n)
{
	struct psr_error err = { 0, "" };
	struct import_mesh im;
	int rc;

	require(import_mesh_init(&im, "fuzz.obj", &err) == PSR_OK);
	rc = obj_read_plain(&im, data, n, &err);
	require(rc == 1 || rc == err.code);
	require(rc == 1 || (im.mesh->n_vertices == 0 && im.mesh->n_triangles == 0));
	if (rc == 1) {
		require(im.mesh->n_vertices == obj->n);
		require(memcmp(im.mesh->position, obj->position, obj->n * sizeof *obj->position) == 0);
		for (uint32_t i = 0; i < 3 * im.mesh->n_triangles; i++)
			require(im.mesh->triangle[i / 3][i % 3] < obj->n);
	}
	import_mesh_fini(&im);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	struct obj obj, again;
	struct psr_error err = { 0, "" };
	const int rc = obj_read(&obj, "fuzz.obj", data, n, &err);

	require(rc == err.code);
	if (rc != PSR_OK) {
		require(obj.text == NULL && obj.position == NULL);
		return 0;
	}
	check_plain(&obj, data, n);
	require(obj_read(&again, "fuzz.obj", obj.text, obj.n_text, &err) == PSR_OK);
	require(again.n == obj.n && again.n_text == obj.n_text && memcmp(again.text, obj.text, obj.n_text) == 0);
	for (uint32_t i = 0; i < obj.n; i++) {
		double p[3];

		obj_position(p, &obj, (float)again.position[i][0], (float)again.position[i][1]);
		require(memcmp(p, obj.position[i], sizeof p) == 0);
	}
	obj_fini(&again);
	obj_fini(&obj);
	return 0;
}
