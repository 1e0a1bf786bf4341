#include <assert.h>
#include "read.h"

static int check_length(const struct reader *r, int known, uint64_t expected)
{
	struct section s = read_section(r, (uint32_t)r->entry[known]);

	if (s.length != expected)
		return bad(r, "section %s at byte %" PRIu64 " has %" PRIu64 " bytes and should have %" PRIu64, s.type, s.offset,
		           s.length, expected);
	return PSR_OK;
}

static int get_info(const struct reader *r, struct psr_model_info *info)
{
	const uint8_t *at = r->bytes + read_section(r, (uint32_t)r->entry[SECTION_INFO]).offset;
	int code = check_length(r, SECTION_INFO, INFO_BYTES);

	if (code != PSR_OK)
		return code;
	for (int k = 0; k < 3; k++) {
		info->origin[k] = file_get_double(at + 8 * k);
		info->box_min[k] = file_get_double(at + 32 + 8 * k);
		info->box_max[k] = file_get_double(at + 56 + 8 * k);
		info->up[k] = file_get_double(at + 160 + 8 * k);
	}
	info->scale = file_get_double(at + 24);
	info->spacing = file_get_double(at + 80);
	info->tolerance = file_get_double(at + 88);
	info->resolution = (uint32_t)file_get(at + 96, 4);
	info->n_trials = file_get(at + 104, 8);
	info->n_missing = file_get(at + 112, 8);
	info->n_lost = file_get(at + 120, 8);
	memcpy(info->builder, at + 128, sizeof info->builder);
	if (file_get(at + 100, 4) != 0)
		return bad(r, "section INFO: reserved bytes are not zero");
	return PSR_OK;
}

static int get_blocks(const struct reader *r, struct psr_blocks *blocks)
{
	const uint8_t *at = r->bytes + read_section(r, (uint32_t)r->entry[SECTION_BLOCKS]).offset;
	int code = check_length(r, SECTION_BLOCKS, BLOCKS_BYTES);

	if (code != PSR_OK)
		return code;
	file_get_counts(blocks, at);
	if (file_get(at + 28, 4) != 0)
		return bad(r, "section BLKS: reserved bytes are not zero");
	/* With this and 32-bit counts no product below overflows; the validator checks the limits of counts. */
	if (blocks->n_samples > (uint64_t)PSR_BLOCK_SAMPLES * blocks->n_blocks)
		return bad(r, "section BLKS: %" PRIu64 " samples do not fit %" PRIu32 " blocks", blocks->n_samples,
		           blocks->n_blocks);
	return PSR_OK;
}

/* *n: the items of an optional section, 1 to PSR_MAX_PRESETS == PSR_MAX_CALIBRATED, or 0 if it is missing. */
static int get_presets(const struct reader *r, int known, uint32_t *n, const void **array)
{
	const uint32_t item_bytes = section_table[known].item_bytes;
	struct section s;

	*n = 0;
	*array = NULL;
	if (r->entry[known] < 0)
		return PSR_OK;
	s = read_section(r, (uint32_t)r->entry[known]);
	if (s.length == 0 || s.length % item_bytes != 0 || s.length / item_bytes > PSR_MAX_PRESETS)
		return bad(r, "section %s at byte %" PRIu64 " has %" PRIu64 " bytes and should have 1 to %d times %" PRIu32,
		           s.type, s.offset, s.length, PSR_MAX_PRESETS, item_bytes);
	*n = (uint32_t)(s.length / item_bytes);
	*array = r->bytes + s.offset;
	return PSR_OK;
}

static int get_octree(const struct reader *r, struct octree *tree)
{
	const uint8_t *at = r->bytes + read_section(r, (uint32_t)r->entry[SECTION_OCTREE]).offset;
	int code = check_length(r, SECTION_OCTREE, OCTREE_BYTES);

	if (code != PSR_OK)
		return code;
	file_get_octree(tree, at);
	if (file_get(at + 4, 4) > 3)
		return bad(r, "section OCTR: its flags are %" PRIu64 "; only bits 0 and 1 are known", file_get(at + 4, 4));
	return model_check_octree_counts(tree, r->name, r->err);
}

static int get_points(const struct reader *r, struct dpoint_set *set)
{
	const uint8_t *at = r->bytes + read_section(r, (uint32_t)r->entry[SECTION_POINTS]).offset;
	int code = check_length(r, SECTION_POINTS, POINTS_BYTES);

	if (code != PSR_OK)
		return code;
	file_get_points(set, at);
	if (r->entry[SECTION_POINT_LEAN] >= 0)
		set->n_lean = file_lean_count(read_section(r, (uint32_t)r->entry[SECTION_POINT_LEAN]).length);
	return model_check_point_counts(set, r->name, r->err);
}

/* Of each representation that the file has, all sections that it needs; none of another one. */
static int check_set(const struct reader *r, const struct content *content)
{
	for (int k = 0; k < N_KNOWN_SECTIONS; k++) {
		const struct section_spec *spec = &section_table[k];
		const int is_of_blocks = k < SECTION_OCTREE || k == SECTION_CALIBRATION_FINE;
		const char *first = is_of_blocks ? "BLKS" : section_is_of_points(k) ? "DPNT" : "OCTR";

		if (section_is_foreign(spec, content) && r->entry[k] >= 0)
			return bad(r, "section %s is there, and %s, which tells its length, is missing", spec->type, first);
		if (!section_is_foreign(spec, content) && section_is_needed(spec) && r->entry[k] < 0)
			return bad(r, "section %s is missing", spec->type);
	}
	return PSR_OK;
}

static int get_arrays(const struct reader *r, struct content *content)
{
	struct psr_blocks *blocks = &content->blocks;

	if (r->entry[SECTION_CALIBRATION_FINE] >= 0 && content->calibration.n == 0)
		return bad(r, "section CALF needs CALB, which is missing");
	for (int k = SECTION_FIRST_ARRAY; k < N_KNOWN_SECTIONS; k++) {
		const struct section_spec *spec = &section_table[k];
		const void *array;
		int code;

		if (r->entry[k] < 0 || spec->pointer == 0)
			continue;
		code = check_length(r, k, spec->item_bytes * section_items(spec, content));
		if (code != PSR_OK)
			return code;
		array = r->bytes + read_section(r, (uint32_t)r->entry[k]).offset;
		memcpy((char *)content + spec->pointer, &array, sizeof array);
	}
	/* Before that version the modeller moved samples further without saying which. */
	if (blocks->n_blocks != 0 && file_get(r->bytes + HEADER_MINOR, 2) < FILE_MINOR_OFF)
		content->blocks.traits_of_all = PSR_BLOCK_OLD;
	if ((!blocks->cone_x + !blocks->cone_y + !blocks->cone_z + !blocks->cone_sine) % 4 != 0)
		return bad(r, "some of the sections CONX, CONY, CONZ and CONS are missing");
	if (blocks->traits && !blocks->cone_x)
		return bad(r, "section TRTS needs CONX, CONY, CONZ and CONS, which are missing");
	if (blocks->opacity && !blocks->traits)
		return bad(r, "section OPAC needs TRTS, which is missing");
	if (!blocks->visibility_index != !blocks->visibility_mask || !blocks->visibility_mask != (blocks->n_masks == 0))
		return bad(r, "of the sections VISI and VISM and their number of masks in BLKS some are missing");
	return PSR_OK;
}

int file_parse(const uint8_t *bytes, size_t n_bytes, struct psr_pool *pool, const char *name, struct content *content,
               struct psr_error *err)
{
	const void *camera = NULL, *light = NULL, *calibrated = NULL;
	struct reader r = { .bytes = bytes, .n_bytes = n_bytes, .name = name, .err = err };
	int code;

	assert((uintptr_t)bytes % FILE_ALIGNMENT == 0);
	if (n_bytes < FILE_HEADER_BYTES) {
		if (memcmp(bytes, FILE_MAGIC, n_bytes < 8 ? n_bytes : 8) != 0)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: not a .psr file: it begins otherwise", name);
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the file ends at byte %zu, within its header (bytes 0 to %d); it was "
		                "cut short", name, n_bytes, FILE_HEADER_BYTES);
	}
	code = read_table(&r, pool);
	if (code != PSR_OK)
		return code;
	memset(content, 0, sizeof *content);
	content->has_blocks = r.entry[SECTION_BLOCKS] >= 0;
	content->has_octree = r.entry[SECTION_OCTREE] >= 0;
	content->has_points = r.entry[SECTION_POINTS] >= 0;
	if (!content->has_blocks && !content->has_octree && !content->has_points)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s: the file has none of the sections BLKS, OCTR and DPNT, the kinds of"
		                " samples that this build knows", name);
	code = check_set(&r, content);
	if (code == PSR_OK)
		code = get_info(&r, &content->info);
	if (code == PSR_OK && content->has_blocks)
		code = get_blocks(&r, &content->blocks);
	if (code == PSR_OK && content->has_octree)
		code = get_octree(&r, &content->octree);
	if (code == PSR_OK && content->has_points)
		code = get_points(&r, &content->points);
	if (code == PSR_OK)
		code = get_presets(&r, SECTION_CAMERAS, &content->presets.n_cameras, &camera);
	if (code == PSR_OK)
		code = get_presets(&r, SECTION_LIGHTS, &content->presets.n_lights, &light);
	if (code == PSR_OK)
		code = get_presets(&r, SECTION_CALIBRATION, &content->calibration.n, &calibrated);
	if (code == PSR_OK)
		code = get_arrays(&r, content);
	content->presets.camera = camera;
	content->presets.light = light;
	content->calibration.view = calibrated;
	return code == PSR_OK ? model_validate(content, pool, name, err) : code;
}
