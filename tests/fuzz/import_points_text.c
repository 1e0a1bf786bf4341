/* Points as lines of numbers; the first byte tells XYZ, PTS or PTX. */
#include "import_points.h"
#include "import/points/text.h"

static enum text_kind kind;

static int open_text(struct octree_source *out, const char *path, struct psr_error *err)
{
	return text_points_open(out, path, kind, err);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	if (n == 0)
		return 0;
	kind = (enum text_kind)(data[0] % 3);
	points_check(open_text, text_points_close, 0, data + 1, n - 1);
	return 0;
}
