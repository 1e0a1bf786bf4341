/* The text that Assimp gets in the place of an OBJ: as many vertices as were read, numbered in their order. */
#include <string.h>
#include "import/assimp/obj.h"
#include "import_check.h"

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
