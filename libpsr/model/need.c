#include <unistd.h>
#include "cubes.h"
#include "pack.h"

/* Which sections of the table have the attributes of leaves: 2 bytes of normals, and so on. */
static unsigned leaf_bytes(const uint8_t *table, uint64_t n_sections, int *has_normal)
{
	static const struct {
		char type[5];
		unsigned bytes;
	} of[] = { { "ONRM", 2 }, { "OOFF", 1 }, { "OCOL", 3 }, { "OMAT", 3 }, { "OMT1", 3 },
	         { "OINT", 2 }, { "OCLS", 1 }, { "ORET", 1 } };
	unsigned bytes = 0;

	*has_normal = 0;
	for (uint64_t i = 0; i < n_sections; i++)
		for (size_t k = 0; k < sizeof of / sizeof *of; k++)
			if (memcmp(table + FILE_ENTRY_BYTES * i + ENTRY_TYPE, of[k].type, 4) == 0) {
				bytes += of[k].bytes;
				*has_normal |= k == 0;
			}
	return bytes;
}

/* Reads OCTR of a plain file. */
static int read_octree(uint8_t octree[OCTREE_BYTES], const struct pack_source *source, const uint8_t *table,
                       uint64_t n_sections)
{
	for (uint64_t i = 0; i < n_sections; i++) {
		const uint8_t *entry = table + FILE_ENTRY_BYTES * i;

		if (file_is_section(entry, SECTION_OCTREE) && file_get(entry + ENTRY_LENGTH, 8) == OCTREE_BYTES)
			return pread(source->fd, octree, OCTREE_BYTES, (off_t)file_get(entry + ENTRY_OFFSET, 8)) == OCTREE_BYTES;
	}
	return 0;
}

uint64_t model_cubes_need(const struct pack_source *source, int is_packed)
{
	uint8_t bytes[FILE_HEADER_BYTES + FILE_ENTRY_BYTES * FILE_MAX_SECTIONS], octree[OCTREE_BYTES];
	const uint8_t *const table = bytes + FILE_HEADER_BYTES;
	const ssize_t got = pread(source->fd, bytes, sizeof bytes, 0);
	static uint16_t normal; /* there are some */
	struct octree tree = { .levels = 0 };
	uint64_t n_sections;
	unsigned leaf;
	int has_normal;

	if (got < FILE_HEADER_BYTES)
		return 0;
	n_sections = file_get(bytes + HEADER_N_SECTIONS, 4);
	if (n_sections > ((uint64_t)got - FILE_HEADER_BYTES) / FILE_ENTRY_BYTES)
		return 0;
	if (!(is_packed ? pack_read_octree(octree, source) : read_octree(octree, source, table, n_sections)))
		return 0;
	file_get_octree(&tree, octree);
	if (model_check_octree_counts(&tree, source->name, NULL) != PSR_OK)
		return 0;
	leaf = leaf_bytes(table, n_sections, &has_normal);
	tree.normal = has_normal ? &normal : NULL;
	return psr_cubes_guess(&tree, leaf);
}
