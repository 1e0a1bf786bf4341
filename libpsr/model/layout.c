#include <assert.h>
#include <xxhash.h>
#include "base/mem.h"
#include "file.h"

_Static_assert(sizeof(struct psr_projection) == 40 && offsetof(struct psr_projection, spacing) == 36, "section PROJ");
_Static_assert(sizeof(struct psr_cluster) == 32 && offsetof(struct psr_cluster, first_block) == 16, "section CLUS");
_Static_assert(offsetof(struct psr_cluster, group) == 24 && offsetof(struct psr_cluster, level) == 28, "section CLUS");
_Static_assert(sizeof(struct psr_run) == 8 && offsetof(struct psr_run, visibility_first) == 4, "section RUNS");
_Static_assert(sizeof(struct psr_preset_camera) == CAMERA_BYTES && offsetof(struct psr_preset_camera, camera) == 64
               && offsetof(struct psr_camera, kind) == 72 && offsetof(struct psr_camera, fov_y) == 80, "section CAMS");
_Static_assert(sizeof(struct psr_preset_light) == LIGHT_BYTES && offsetof(struct psr_preset_light, light) == 64
               && offsetof(struct psr_light, position) == 8 && offsetof(struct psr_light, inner) == 80, "section LGTS");
_Static_assert(sizeof(struct dpoint_group) == 32 && offsetof(struct dpoint_group, first) == 24
               && offsetof(struct dpoint_group, flags) == 31, "section DGRP");
_Static_assert(sizeof(struct dpoint_word) == 16 && offsetof(struct dpoint_word, attr) == 8, "section DWRD");
_Static_assert(sizeof(struct dpoint_lean) == 12 && offsetof(struct dpoint_lean, by) == 4, "section DLEN");
_Static_assert(sizeof(struct octree_skip) == 24 && offsetof(struct octree_skip, leaf) == 16, "section OSKP");

#define SET(type, count, item, field) \
	{ type, 1, 0, count, item, offsetof(struct content, points) + offsetof(struct dpoint_set, field) }
#define ARRAY(type, flags, count, item, field) \
	{ type, 1, flags, count, item, offsetof(struct content, blocks) + offsetof(struct psr_blocks, field) }
#define TREE(type, count, item, field) \
	{ type, 1, 0, count, item, offsetof(struct content, octree) + offsetof(struct octree, field) }

const struct section_spec section_table[N_KNOWN_SECTIONS] = {
	[SECTION_INFO] = { "INFO", 1, ENTRY_REQUIRED, COUNT_ONE, INFO_BYTES, 0 },
	[SECTION_BLOCKS] = { "BLKS", 1, ENTRY_REQUIRED, COUNT_ONE, BLOCKS_BYTES, 0 },
	[SECTION_CAMERAS] = { "CAMS", 1, 0, COUNT_CAMERAS, CAMERA_BYTES, 0 },
	[SECTION_LIGHTS] = { "LGTS", 1, 0, COUNT_LIGHTS, LIGHT_BYTES, 0 },
	ARRAY("PROJ", ENTRY_REQUIRED, COUNT_PROJECTIONS, 40, projection),
	ARRAY("CLUS", ENTRY_REQUIRED, COUNT_CLUSTERS, 32, cluster),
	ARRAY("RUNS", ENTRY_REQUIRED, COUNT_RUNS, 8, run),
	ARRAY("SPHX", ENTRY_REQUIRED, COUNT_BLOCKS, 2, sphere_x),
	ARRAY("SPHY", ENTRY_REQUIRED, COUNT_BLOCKS, 2, sphere_y),
	ARRAY("SPHZ", ENTRY_REQUIRED, COUNT_BLOCKS, 2, sphere_z),
	ARRAY("SPHR", ENTRY_REQUIRED, COUNT_BLOCKS, 2, sphere_r),
	ARRAY("BPRJ", ENTRY_REQUIRED, COUNT_BLOCKS, 1, block_projection),
	ARRAY("BFLG", ENTRY_REQUIRED, COUNT_BLOCKS, 1, flags),
	ARRAY("MASK", ENTRY_REQUIRED, COUNT_BLOCKS, 8, mask),
	ARRAY("AOFF", ENTRY_REQUIRED, COUNT_BLOCKS, 2, attr_offset),
	ARRAY("CONX", 0, COUNT_BLOCKS, 1, cone_x),
	ARRAY("CONY", 0, COUNT_BLOCKS, 1, cone_y),
	ARRAY("CONZ", 0, COUNT_BLOCKS, 1, cone_z),
	ARRAY("CONS", 0, COUNT_BLOCKS, 1, cone_sine),
	ARRAY("TRTS", 0, COUNT_BLOCKS, 1, traits),
	ARRAY("VISI", 0, COUNT_BLOCKS, 1, visibility_index),
	ARRAY("VISM", 0, COUNT_MASKS, 16, visibility_mask),
	ARRAY("DPTH", ENTRY_REQUIRED, COUNT_SAMPLES, 2, depth),
	ARRAY("ATTR", ENTRY_REQUIRED, COUNT_SAMPLES, 8, attr),
	ARRAY("OPAC", 0, COUNT_SAMPLES, 1, opacity),
	[SECTION_OCTREE] = { "OCTR", 1, 0, COUNT_ONE, OCTREE_BYTES, 0 },
	TREE("OSKP", COUNT_SKIPS, 24, skip),
	TREE("OCOD", COUNT_CODES, 1, code),
	TREE("ONRM", COUNT_LEAVES, 2, normal),
	TREE("OOFF", COUNT_LEAVES, 1, offset),
	TREE("OCOL", COUNT_LEAVES, 3, color),
	[SECTION_MATERIAL] = TREE("OMAT", COUNT_LEAVES, 3, material),
	[SECTION_CALIBRATION] = { "CALB", 1, 0, COUNT_CALIBRATED, CALIBRATED_BYTES, 0 },
	[SECTION_POINTS] = { "DPNT", 1, 0, COUNT_ONE, POINTS_BYTES, 0 },
	SET("DGRP", COUNT_GROUPS, 32, group),
	SET("DWRD", COUNT_POINTS, 16, word),
	TREE("OINT", COUNT_LEAVES, 2, scan.intensity),
	TREE("OCLS", COUNT_LEAVES, 1, scan.class),
	TREE("ORET", COUNT_LEAVES, 1, scan.returns),
	TREE("OTIM", COUNT_LEAVES, 4, scan.time),
	TREE("OTSC", COUNT_ONE, 16, scan.time_scale),
	[SECTION_CALIBRATION_FINE] = { "CALF", 1, 0, COUNT_CALIBRATED, CALIBRATED_FINE_BYTES,
	                               offsetof(struct content, calibration) + offsetof(struct psr_calibration, fine) },
	[SECTION_ONE_MATERIAL] = TREE("OMT1", COUNT_ONE, 3, one_material),
	[SECTION_LEAN] = TREE("OLEN", COUNT_LEAN, 1, lean),
	[SECTION_DELTAS] = SET("DDLT", COUNT_DELTAS, 2, delta),
	[SECTION_POINT_LEAN] = SET("DLEN", COUNT_POINT_LEAN, 12, lean),
};

uint64_t section_items(const struct section_spec *spec, const struct content *content)
{
	const struct psr_blocks *blocks = &content->blocks;

	switch (spec->count) {
	case COUNT_CAMERAS:
		return content->presets.n_cameras;
	case COUNT_LIGHTS:
		return content->presets.n_lights;
	case COUNT_PROJECTIONS:
		return blocks->n_projections;
	case COUNT_CLUSTERS:
		return blocks->n_clusters;
	case COUNT_RUNS:
		return psr_blocks_runs(blocks);
	case COUNT_MASKS:
		return blocks->n_masks;
	case COUNT_BLOCKS:
		return blocks->n_blocks;
	case COUNT_SAMPLES:
		return blocks->n_samples;
	case COUNT_SKIPS:
		return content->octree.n_skips;
	case COUNT_CODES:
		return content->octree.n_codes;
	case COUNT_LEAVES:
		return content->octree.n_leaves;
	case COUNT_CALIBRATED:
		return content->calibration.n;
	case COUNT_GROUPS:
		return content->points.n_groups;
	case COUNT_POINTS:
	case COUNT_DELTAS:
		return content->points.n_points;
	case COUNT_LEAN:
		return OCTREE_LEAN_CELLS;
	case COUNT_POINT_LEAN:
		return content->points.n_lean;
	case COUNT_ONE:
		break;
	}
	return 1;
}

const void *section_array(const struct section_spec *spec, const struct content *content)
{
	const void *array;

	if (spec->pointer == 0)
		return NULL;
	memcpy(&array, (const char *)content + spec->pointer, sizeof array);
	return array;
}

int section_is_foreign(const struct section_spec *spec, const struct content *content)
{
	const ptrdiff_t k = spec - section_table;

	if (k == SECTION_CALIBRATION_FINE)
		return !content->has_blocks;
	if (section_is_of_points((int)k))
		return !content->has_points;
	if ((k >= SECTION_OCTREE && k < SECTION_END_OF_OCTREE) || k >= SECTION_FIRST_OF_SCAN)
		return !content->has_octree;
	return (k == SECTION_BLOCKS || k >= SECTION_FIRST_ARRAY) && !content->has_blocks;
}

uint64_t file_section_hash(const uint8_t *section, uint64_t length, const uint8_t *chunks)
{
	uint64_t n_chunks = file_chunks(length);

	return n_chunks == 0 ? XXH64(section, length, 0) : XXH64(chunks, 8 * n_chunks, 0);
}

uint64_t file_header_hash(const uint8_t *bytes, uint64_t table_end)
{
	return XXH64(bytes + FILE_HEADER_BYTES, table_end - FILE_HEADER_BYTES, XXH64(bytes, HEADER_HASH, 0));
}

void file_content_id(const uint8_t *bytes, uint32_t n_sections, uint8_t id[16])
{
	uint8_t list[FILE_MAX_SECTIONS * 24];
	XXH128_hash_t hash;

	assert(n_sections <= FILE_MAX_SECTIONS);
	for (uint32_t i = 0; i < n_sections; i++) {
		const uint8_t *entry = bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;

		memcpy(list + 24 * i, entry + ENTRY_TYPE, 6);
		file_put(list + 24 * i + 6, 2, 0);
		memcpy(list + 24 * i + 8, entry + ENTRY_LENGTH, 16);
	}
	hash = XXH3_128bits(list, 24 * n_sections);
	file_put(id, 8, hash.low64);
	file_put(id + 8, 8, hash.high64);
}

static void hash_chunks(const uint8_t *section, uint64_t length, uint8_t *chunks)
{
	uint64_t n_chunks = file_chunks(length);

	for (uint64_t i = 0; i < n_chunks; i++) {
		uint64_t first = i * FILE_CHUNK_BYTES, left = length - first;

		file_put(chunks + 8 * i, 8, XXH64(section + first, left < FILE_CHUNK_BYTES ? left : FILE_CHUNK_BYTES, 0));
	}
}

void file_seal(uint8_t *bytes, size_t n_bytes)
{
	uint64_t n_sections, n_chunks, table_end, chunks_at;

	if (n_bytes < FILE_HEADER_BYTES)
		return;
	n_sections = file_get(bytes + HEADER_N_SECTIONS, 4);
	n_chunks = file_get(bytes + HEADER_N_CHUNKS, 4);
	chunks_at = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * n_sections;
	table_end = chunks_at + 8 * n_chunks;
	if (n_sections > FILE_MAX_SECTIONS || table_end > n_bytes)
		return;
	for (uint64_t i = 0; i < n_sections; i++) {
		uint8_t *entry = bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;
		uint64_t offset = file_get(entry + ENTRY_OFFSET, 8), length = file_get(entry + ENTRY_LENGTH, 8);

		if (offset < table_end || offset > n_bytes || length > n_bytes - offset
		    || file_chunks(length) > (table_end - chunks_at) / 8)
			continue;
		hash_chunks(bytes + offset, length, bytes + chunks_at);
		file_put(entry + ENTRY_HASH, 8, file_section_hash(bytes + offset, length, bytes + chunks_at));
		chunks_at += 8 * file_chunks(length);
	}
	file_content_id(bytes, (uint32_t)n_sections, bytes + HEADER_CONTENT_ID);
	file_put(bytes + HEADER_HASH, 8, file_header_hash(bytes, table_end));
}

static void put_info(uint8_t *at, const struct psr_model_info *info)
{
	for (int k = 0; k < 3; k++) {
		file_put_double(at + 8 * k, info->origin[k]);
		file_put_double(at + 32 + 8 * k, info->box_min[k]);
		file_put_double(at + 56 + 8 * k, info->box_max[k]);
		file_put_double(at + 160 + 8 * k, info->up[k]);
	}
	file_put_double(at + 24, info->scale);
	file_put_double(at + 80, info->spacing);
	file_put_double(at + 88, info->tolerance);
	file_put(at + 96, 4, info->resolution);
	file_put(at + 104, 8, info->n_trials);
	file_put(at + 112, 8, info->n_missing);
	file_put(at + 120, 8, info->n_lost);
	memcpy(at + 128, info->builder, strnlen(info->builder, sizeof info->builder - 1));
}

static void put_blocks(uint8_t *at, const struct psr_blocks *blocks)
{
	file_put(at, 4, blocks->n_blocks);
	file_put(at + 4, 4, blocks->n_projections);
	file_put(at + 8, 4, blocks->n_clusters);
	file_put(at + 12, 4, blocks->n_levels);
	file_put(at + 16, 8, blocks->n_samples);
	file_put(at + 24, 4, blocks->n_masks);
}

void file_get_counts(struct psr_blocks *blocks, const uint8_t *at)
{
	blocks->n_blocks = (uint32_t)file_get(at, 4);
	blocks->n_projections = (uint32_t)file_get(at + 4, 4);
	blocks->n_clusters = (uint32_t)file_get(at + 8, 4);
	blocks->n_levels = (uint32_t)file_get(at + 12, 4);
	blocks->n_samples = file_get(at + 16, 8);
	blocks->n_masks = (uint32_t)file_get(at + 24, 4);
}

static int is_present(int section, const struct content *content)
{
	switch (section) {
	case SECTION_INFO:
		return 1;
	case SECTION_BLOCKS:
		return content->has_blocks;
	case SECTION_OCTREE:
		return content->has_octree;
	case SECTION_POINTS:
		return content->has_points;
	case SECTION_CAMERAS:
	case SECTION_LIGHTS:
	case SECTION_CALIBRATION:
		return section_items(&section_table[section], content) > 0;
	default:
		return section_array(&section_table[section], content) != NULL;
	}
}

static void put_section(uint8_t *at, int section, const struct content *content, uint64_t length)
{
	switch (section) {
	case SECTION_INFO:
		put_info(at, &content->info);
		break;
	case SECTION_BLOCKS:
		put_blocks(at, &content->blocks);
		break;
	case SECTION_OCTREE:
		file_put_octree(at, &content->octree);
		break;
	case SECTION_POINTS:
		file_put_points(at, &content->points);
		break;
	case SECTION_CALIBRATION:
		memcpy(at, content->calibration.view, length);
		break;
	case SECTION_CAMERAS:
		preset_put_cameras((struct psr_preset_camera *)(void *)at, content->presets.camera, content->presets.n_cameras);
		break;
	case SECTION_LIGHTS:
		preset_put_lights((struct psr_preset_light *)(void *)at, content->presets.light, content->presets.n_lights);
		break;
	default:
		memcpy(at, section_array(&section_table[section], content), length);
	}
}

/* The first version that knows all sections. */
static unsigned minor_of(const struct content *content)
{
	if (is_present(SECTION_POINT_LEAN, content))
		return FILE_MINOR_POINT_LEAN;
	if (is_present(SECTION_LEAN, content))
		return FILE_MINOR_LEAN;
	if (content->blocks.n_blocks != 0 && !(content->blocks.traits_of_all & PSR_BLOCK_OLD))
		return FILE_MINOR_OFF;
	if (is_present(SECTION_DELTAS, content))
		return FILE_MINOR_DELTAS;
	if (is_present(SECTION_MATERIAL, content) || is_present(SECTION_ONE_MATERIAL, content))
		return FILE_MINOR_MATERIAL;
	for (int k = SECTION_FIRST_OF_SCAN; k < SECTION_END_OF_SCAN; k++)
		if (is_present(k, content))
			return FILE_MINOR_SCAN;
	return content->has_points ? FILE_MINOR_POINTS : content->has_octree ? FILE_MINOR_OCTREE : FILE_MINOR;
}

uint8_t *file_image_make(const struct content *content, uint64_t *n_bytes)
{
	uint64_t n_sections = 0, n_chunks = 0, at = 0;
	uint8_t *bytes = NULL, *entry;

	/* Once to add the sizes up, once to write. */
	for (int i = 0; i < N_KNOWN_SECTIONS; i++) {
		uint64_t length = section_table[i].item_bytes * section_items(&section_table[i], content);

		if (is_present(i, content)) {
			n_sections++;
			n_chunks += file_chunks(length);
			at += file_align(length);
		}
	}
	*n_bytes = at + FILE_TAIL_BYTES + file_align(FILE_HEADER_BYTES + FILE_ENTRY_BYTES * n_sections + 8 * n_chunks);
	bytes = psr_alloc_huge(*n_bytes);
	if (bytes == NULL)
		return NULL;
	memcpy(bytes, FILE_MAGIC, 8);
	file_put(bytes + HEADER_MAJOR, 2, FILE_MAJOR);
	file_put(bytes + HEADER_MINOR, 2, minor_of(content));
	file_put(bytes + HEADER_N_SECTIONS, 4, n_sections);
	file_put(bytes + HEADER_FILE_SIZE, 8, *n_bytes);
	file_put(bytes + HEADER_N_CHUNKS, 4, n_chunks);
	at = *n_bytes - FILE_TAIL_BYTES - at;
	entry = bytes + FILE_HEADER_BYTES;
	for (int i = 0; i < N_KNOWN_SECTIONS; i++) {
		uint64_t length = section_table[i].item_bytes * section_items(&section_table[i], content);

		if (!is_present(i, content))
			continue;
		memcpy(entry + ENTRY_TYPE, section_table[i].type, 4);
		file_put(entry + ENTRY_VERSION, 2, section_table[i].version);
		file_put(entry + ENTRY_FLAGS, 2, section_table[i].flags);
		file_put(entry + ENTRY_OFFSET, 8, at);
		file_put(entry + ENTRY_LENGTH, 8, length);
		put_section(bytes + at, i, content, length);
		entry += FILE_ENTRY_BYTES;
		at += file_align(length);
	}
	assert(at + FILE_TAIL_BYTES == *n_bytes);
	file_seal(bytes, *n_bytes);
	return bytes;
}
