/* Points as lines of numbers; the first byte tells XYZ, PTS or PTX, and whether a part is enough. */
#include "import_points.h"
#include "import/points/text.h"

static enum text_kind kind;
static uint64_t part;

static int open_text(struct octree_source *out, const char *path, struct psr_error *err)
{
	return text_points_open(out, path, kind, part, err);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	if (n == 0)
		return 0;
	kind = (enum text_kind)(data[0] % 3);
	part = data[0] & 0x80 ? 1 : 0;
	points_check(open_text, text_points_close, 0, data + 1, n - 1);
	return 0;
}
