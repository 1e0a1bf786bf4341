/* Points as they come, of all formats that are told by their first bytes. */
#include "import_points.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	points_check(octree_source_open, octree_source_close, 1, data, n);
	return 0;
}
