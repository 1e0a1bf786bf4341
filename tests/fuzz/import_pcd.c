/* PCD from memory: whatever is accepted keeps the promises of psr/mesh.h. */
#include "import_check.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	import_check(import_pcd, "tests/data/import/fuzz.pcd", data, n);
	return 0;
}
