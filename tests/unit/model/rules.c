#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "model/file.h"
#include "fixture.h"
#include "sections.h"

/* IEEE 754 bits */
#define F_NAN 0x7fc00000u
#define F_INF 0x7f800000u
#define F_MINUS_1 0xbf800000u
#define F_2000 0x44fa0000u
#define F_1_01 0x3f8147aeu
#define D_NAN 0x7ff8000000000000u
#define D_INF 0x7ff0000000000000u
#define D_MINUS_1 0xbff0000000000000u
#define D_2 0x4000000000000000u

static struct fixture fixture;
static uint8_t *original;
static size_t n_bytes;

static int setup(void **state)
{
	struct psr_model *model = NULL;

	(void)state;
	fixture_init(&fixture, 1);
	assert_int_equal(psr_model_create(&model, &fixture.info, &fixture.blocks, &fixture.presets, NULL), PSR_OK);
	model_image(model, &n_bytes);
	original = malloc(n_bytes);
	memcpy(original, model_image(model, &n_bytes), n_bytes);
	psr_model_unref(model);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	free(original);
	return 0;
}

static uint8_t *copy_original(void)
{
	uint8_t *copy = malloc(n_bytes);

	memcpy(copy, original, n_bytes);
	return copy;
}

/* Puts the hashes right and parses; frees the bytes. */
static int open_sealed(struct psr_model **model, uint8_t *bytes, size_t n, struct psr_error *err)
{
	int code;

	*model = NULL;
	file_seal(bytes, n);
	code = psr_model_parse(model, bytes, n, err);
	assert_true((code == PSR_OK) == (*model != NULL));
	free(bytes);
	return code;
}

static int parse_sealed(uint8_t *bytes, size_t n, struct psr_error *err)
{
	struct psr_model *model;
	int code = open_sealed(&model, bytes, n, err);

	psr_model_unref(model);
	return code;
}

struct violation {
	const char *section;
	int at, size; /* of the value, in the section */
	uint64_t value;
	const char *text; /* the error after "the model: section " */
};

static const struct violation violations[] = {
	{ "INFO", 0, 8, D_NAN, "INFO: the origin is not finite" },
	{ "INFO", 16, 8, D_INF, "INFO: the origin is not finite" },
	{ "INFO", 24, 8, 0, "INFO: the scale is 0; it must be positive and finite" },
	{ "INFO", 24, 8, D_MINUS_1, "INFO: the scale is -1; it must be positive and finite" },
	{ "INFO", 24, 8, D_INF, "INFO: the scale is inf; it must be positive and finite" },
	{ "INFO", 32, 8, D_NAN, "INFO: the box is not finite or inside out" },
	{ "INFO", 64, 8, D_INF, "INFO: the box is not finite or inside out" },
	{ "INFO", 72, 8, D_2, "INFO: the box is not finite or inside out" },
	{ "INFO", 32, 8, 0xc65f8def8808b024u, "INFO: the box is from -1e+31 to " },
	{ "INFO", 64, 8, 0x465f8def8808b024u, "1e+31; coordinates are at most 1e30 in magnitude" },
	{ "INFO", 80, 8, 0, "INFO: the spacing is 0; it must be from 1e-30 to 1e30" },
	{ "INFO", 80, 8, 0x398039d665896880u, "INFO: the spacing is 1e-31; it must be from 1e-30 to 1e30" },
	{ "INFO", 80, 8, D_INF, "INFO: the spacing is inf; it must be from 1e-30 to 1e30" },
	{ "INFO", 88, 8, D_2, "INFO: the tolerance is 2; it must be an angle from 0 to half of pi" },
	{ "INFO", 88, 8, D_MINUS_1, "INFO: the tolerance is -1; it must be an angle from 0 to half of pi" },
	{ "INFO", 96, 4, 0, "INFO: the resolution is 0" },
	{ "INFO", 100, 1, 1, "INFO: reserved bytes are not zero" },
	{ "INFO", 104, 8, 2, "INFO: 3 pixels are missing and 1 lost, out of 2" },
	{ "INFO", 120, 8, 1000001, "INFO: 3 pixels are missing and 1000001 lost, out of 1000000" },
	{ "INFO", 128, 1, '\n', "INFO: byte 0 of the builder's name is not text" },
	{ "INFO", 158, 1, 'x', "INFO: byte 30 of the builder's name is not text" },
	{ "INFO", 160, 8, D_NAN, "INFO: up is nan,0.6,0.8; it must have length 1" },
	{ "INFO", 168, 8, D_MINUS_1, "INFO: up is 0,-1,0.8; it must have length 1" },
	{ "CAMS", 0, 1, 0, "CAMS: the name of camera 0 is empty" },
	{ "CAMS", 4, 1, 0x80, "CAMS: byte 4 of the name of camera 0 is not UTF-8, or a control character" },
	{ "CAMS", 168 + 1, 1, 0xc1, "CAMS: byte 1 of the name of camera 1 is not UTF-8, or a control character" },
	{ "CAMS", 168 + 8, 1, 0xc3, "CAMS: byte 8 of the name of camera 1 is not UTF-8, or a control character" },
	{ "CAMS", 0, 4, 0xbfbf90f4, "CAMS: byte 0 of the name of camera 0 is not UTF-8" },    /* U+110000 */
	{ "CAMS", 0, 3, 0x80a0ed, "CAMS: byte 0 of the name of camera 0 is not UTF-8" },      /* a surrogate */
	{ "CAMS", 0, 3, 0xbf9fe0, "CAMS: byte 0 of the name of camera 0 is not UTF-8" },      /* longer than it need be */
	{ "CAMS", 2, 1, '\n', "CAMS: byte 2 of the name of camera 0 is not UTF-8, or a control character" },
	{ "CAMS", 63, 1, 'x', "CAMS: camera 0: unused bytes are not zero" },
	{ "CAMS", 64, 8, D_NAN, "CAMS: camera 0: eye, target and up must be finite and below 1e30" },
	{ "CAMS", 80, 8, 0, "CAMS: camera 0: target and eye are the same point" },
	{ "CAMS", 120, 8, 0, "CAMS: camera 0: up has no length" },
	{ "CAMS", 136, 4, 2, "CAMS: camera 0: unknown kind 2" },
	{ "CAMS", 140, 4, 1, "CAMS: camera 0: unused bytes are not zero" },
	{ "CAMS", 144, 8, 0, "CAMS: camera 0: a field of view of 0 radians" },
	{ "CAMS", 152, 8, 1, "CAMS: camera 0: unused bytes are not zero" },
	{ "CAMS", 168 + 152, 8, D_NAN, "CAMS: camera 1: an orthographic height of nan" },
	{ "CAMS", 160, 8, D_MINUS_1, "CAMS: camera 0: a near distance of -1" },
	{ "LGTS", 168, 1, 0, "LGTS: the name of light 1 is empty" },
	{ "LGTS", 168, 4, 0x6e7573, "LGTS: lights 0 and 1 have the same name" }, /* "sun" */
	{ "LGTS", 64, 4, 3, "LGTS: light 0: unknown kind 3" },
	{ "LGTS", 72, 8, D_2, "LGTS: light 0: unused bytes are not zero" },
	{ "LGTS", 104, 8, 0, "LGTS: light 0: the direction has no length" },
	{ "LGTS", 120, 8, D_INF, "LGTS: light 0: colour times intensity must be within 0..1e9" },
	{ "LGTS", 168 + 72, 8, D_NAN, "LGTS: light 1: the position must be finite" },
	{ "LGTS", 168 + 160, 8, D_INF, "LGTS: light 1: a reference distance of inf" },
	{ "LGTS", 2 * 168 + 144, 8, D_2, "LGTS: light 2: half angles 2 and 0.5" },
	{ "BLKS", 0, 4, 0, "BLKS: 143 samples do not fit 0 blocks" },
	{ "BLKS", 0, 4, 5, "SPHX at byte" },
	{ "BLKS", 0, 4, UINT32_MAX, "RUNS at byte" },
	{ "BLKS", 4, 4, 0, "PROJ at byte" },
	{ "BLKS", 4, 4, UINT32_MAX, "PROJ at byte" },
	{ "BLKS", 8, 4, 4, "CLUS at byte" },
	{ "BLKS", 12, 4, 0, "BLKS: 0 levels; it must be 1 to 8" },
	{ "BLKS", 12, 4, 9, "BLKS: 9 levels; it must be 1 to 8" },
	{ "BLKS", 12, 4, 1, "CLUS: cluster 2 is of level 1 of 1" },
	{ "BLKS", 16, 8, 142, "DPTH at byte" },
	{ "BLKS", 16, 8, UINT64_MAX / 8 + 144, "BLKS: 2305843009213694095 samples do not fit 6 blocks" },
	{ "BLKS", 24, 4, 2, "VISM at byte" },
	{ "BLKS", 28, 1, 1, "BLKS: reserved bytes are not zero" },
	{ "PROJ", 0, 4, F_NAN, "PROJ: the axes of projection 0 are not orthonormal" },
	{ "PROJ", 0, 4, F_1_01, "PROJ: the axes of projection 0 are not orthonormal" },
	{ "PROJ", 44, 4, 0x3c23d70a, "PROJ: the axes of projection 1 are not orthonormal" }, /* 0.01 beside (0, 1, 0) */
	{ "PROJ", 0, 4, F_MINUS_1, "PROJ: the axes of projection 0 are left-handed" },
	{ "PROJ", 36, 4, 0, "PROJ: the spacing of projection 0 is 0; it must be from 6.10352e-05 to 1024" },
	{ "PROJ", 36, 4, 0x387fffff, "PROJ: the spacing of projection 0 is 6.10352e-05; it must be from" }, /* below 2^-14 */
	{ "PROJ", 76, 4, F_2000, "PROJ: the spacing of projection 1 is 2000; it must be from 6.10352e-05 to 1024" },
	{ "PROJ", 76, 4, F_NAN, "PROJ: the spacing of projection 1 is nan; it must be from 6.10352e-05 to 1024" },
	{ "CLUS", 0, 4, F_INF, "CLUS: the sphere of cluster 0 is not one" },
	{ "CLUS", 40, 4, F_NAN, "CLUS: the sphere of cluster 1 is not one" },
	{ "CLUS", 12, 4, F_MINUS_1, "CLUS: the sphere of cluster 0 is not one" },
	{ "CLUS", 16, 4, 1, "CLUS: cluster 0 has 3 blocks from 1 on; the next free one is 0 of 6" },
	{ "CLUS", 48, 4, 2, "CLUS: cluster 1 has 2 blocks from 2 on; the next free one is 3 of 6" },
	{ "CLUS", 48, 4, 4, "CLUS: cluster 1 has 2 blocks from 4 on; the next free one is 3 of 6" },
	{ "CLUS", 20, 4, 0, "CLUS: cluster 0 has 0 blocks from 0 on; the next free one is 0 of 6" },
	{ "CLUS", 84, 4, 2, "CLUS: cluster 2 has 2 blocks from 5 on; the next free one is 5 of 6" },
	{ "CLUS", 84, 4, UINT32_MAX, "CLUS: cluster 2 has 4294967295 blocks from 5 on; the next free one is 5 of 6" },
	{ "CLUS", 24, 4, 3, "CLUS: cluster 0 is of group 3; groups are below the number of clusters, 3" },
	{ "CLUS", 56, 4, 0, "CLUS: cluster 1 is the second of group 0 at level 0" },
	{ "CLUS", 28, 1, 2, "CLUS: cluster 0 is of level 2 of 2" },
	{ "CLUS", 29, 1, 1, "CLUS: reserved bytes of cluster 0 are not zero" },
	{ "RUNS", 0, 4, 1, "RUNS: the attributes of run 0 begin at 1 instead of 0" },
	{ "RUNS", 4, 4, 4, "RUNS: the visibility masks of run 0 begin at 4 of 3" },
	{ "RUNS", 4, 4, 3, "VISI: block 0 has visibility mask 3 of 3" },
	{ "VISI", 4, 1, 3, "VISI: block 4 has visibility mask 3 of 3" },
	{ "BPRJ", 3, 1, 2, "BPRJ: block 3 is of projection 2 of 2" },
	{ "BFLG", 1, 1, 1, "BFLG: block 1 is of level 1, and its cluster 0 of level 0" },
	{ "BFLG", 5, 1, 255, "BFLG: block 5 is of level 7, and its cluster 2 of level 1" },
	{ "MASK", 24, 8, 0, "MASK: block 3 has no valid sample" },
	{ "MASK", 24, 8, 1, "AOFF: the attributes of block 4 begin at 99 instead of 98" },
	{ "MASK", 40, 8, UINT64_MAX, "MASK: 171 samples are valid, and BLKS counts 143" },
	{ "AOFF", 0, 2, 1, "AOFF: the attributes of block 0 begin at 1 instead of 0" },
	{ "AOFF", 10, 2, UINT16_MAX, "AOFF: the attributes of block 5 begin at 65535 instead of 107" },
	{ "CONX", 0, 1, 126, "CONX, CONY, CONZ: the greatest component of the axis of block 0 is 126 instead of 127" },
	{ "CONX", 3, 1, 0, "CONX, CONY, CONZ: the greatest component of the axis of block 3 is 60 instead of 127" },
	{ "CONY", 4, 1, 0, "CONX, CONY, CONZ: the greatest component of the axis of block 4 is 80 instead of 127" },
	{ "CONZ", 0, 1, 0x80, "CONX, CONY, CONZ: the greatest component of the axis of block 0 is 128 instead of 127" },
	{ "TRTS", 2, 1, 16, "TRTS: block 2 has unknown traits 16" },
	{ "TRTS", 2, 1, 4, "TRTS: block 2 is thin, but not sheer" },
};

static void each_violated_rule_is_refused_by_its_name(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof violations / sizeof violations[0]; i++) {
		const struct violation *v = &violations[i];
		uint8_t *bytes = copy_original();
		struct psr_error err = { 0 };

		file_put(bytes + file_get(entry_of(bytes, v->section) + ENTRY_OFFSET, 8) + v->at, v->size, v->value);
		assert_int_equal(parse_sealed(bytes, n_bytes, &err), PSR_ERR_FORMAT);
		if (strstr(err.text, v->text) == NULL)
			fail_msg("%s+%d: '%s' instead of '%s'", v->section, v->at, err.text, v->text);
	}
}

static void values_at_the_edge_of_a_rule_are_taken(void **state)
{
	static const struct violation edges[] = {
		{ "INFO", 88, 8, 0, NULL },             /* tolerance 0 */
		{ "BLKS", 12, 4, 8, NULL },            /* levels that are not used */
		{ "PROJ", 0, 4, 0x3f800001, NULL },     /* an axis of 1 + 2^-23 */
		{ "PROJ", 36, 4, 0x44800000, NULL },    /* spacing 1024 */
		{ "PROJ", 36, 4, 0x38800000, NULL },    /* 2^-14 */
		{ "CLUS", 12, 4, 0, NULL },             /* radius 0 */
		{ "CLUS", 56, 4, 2, NULL },             /* a group of its own */
		{ "CLUS", 0, 4, 0xc4800000, NULL },     /* center -1024 */
		{ "SPHX", 0, 2, 0x8000, NULL },         /* center -2 */
		{ "SPHR", 0, 2, 0xffff, NULL },
		{ "SPHR", 0, 2, 0, NULL },
		{ "BFLG", 0, 1, 0, NULL },              /* the greatest step, one-sided */
		{ "BFLG", 0, 1, 0xf8, NULL },           /* the least, two-sided */
		{ "DPTH", 0, 2, 65535, NULL },          /* the deepest */
	{ "INFO", 112, 8, 1000000, NULL },      /* all are missing */
	{ "CAMS", 1, 4, 0xbfbf8ff4, NULL },     /* U+10FFFF, the last one */
		{ "CONX", 0, 1, 0x81, NULL },           /* -127 */
		{ "CONY", 0, 1, 0x81, NULL },           /* two components are the greatest */
		{ "CONS", 0, 1, 0, NULL },
		{ "CONS", 0, 1, PSR_CONE_ANY, NULL },
	};

	(void)state;
	for (size_t i = 0; i < sizeof edges / sizeof edges[0]; i++) {
		uint8_t *bytes = copy_original();
		struct psr_error err = { .text = "" };

		file_put(bytes + file_get(entry_of(bytes, edges[i].section) + ENTRY_OFFSET, 8) + edges[i].at, edges[i].size,
		         edges[i].value);
		if (parse_sealed(bytes, n_bytes, &err) != PSR_OK)
			fail_msg("%s+%d: '%s'", edges[i].section, edges[i].at, err.text);
	}
}

static void versions_are_refused_by_major_and_section(void **state)
{
	struct psr_error err;
	uint8_t *bytes = copy_original();

	(void)state;
	file_put(bytes + HEADER_MINOR, 2, 7);
	assert_int_equal(parse_sealed(bytes, n_bytes, &err), PSR_OK);
	bytes = copy_original();
	file_put(bytes + HEADER_MAJOR, 2, 3);
	assert_int_equal(parse_sealed(bytes, n_bytes, &err), PSR_ERR_VERSION);
	assert_non_null(strstr(err.text, "the file has format 3.6, and this build reads 6.x"));
	bytes = copy_original();
	file_put(entry_of(bytes, "DPTH") + ENTRY_VERSION, 2, 9);
	assert_int_equal(parse_sealed(bytes, n_bytes, &err), PSR_ERR_VERSION);
	assert_non_null(strstr(err.text, "required section DPTH, version 9, at byte"));
	assert_non_null(strstr(err.text, "a newer psr may"));
	bytes = copy_original();
	file_put(entry_of(bytes, "CAMS") + ENTRY_VERSION, 2, 2);
	assert_int_equal(parse_sealed(bytes, n_bytes, &err), PSR_OK);
}

static struct psr_model *open_version(unsigned minor)
{
	uint8_t *bytes = copy_original();
	struct psr_model *model;

	file_put(bytes + HEADER_MINOR, 2, minor);
	assert_int_equal(open_sealed(&model, bytes, n_bytes, NULL), PSR_OK);
	return model;
}

/* Before 6.6 nothing said which samples are far off. */
static void older_versions_have_samples_off_in_any_block(void **state)
{
	struct psr_model *model[3] = { open_version(6), open_version(5), open_version(0) };

	(void)state;
	assert_int_equal(psr_model_blocks(model[0])->n_blocks, 6);
	for (uint32_t b = 0; b < 6; b++) {
		const unsigned traits = psr_blocks_traits(psr_model_blocks(model[0]), b);

		assert_int_equal(traits & (PSR_BLOCK_OFF | PSR_BLOCK_OLD), 0);
		for (int i = 1; i < 3; i++)
			assert_int_equal(psr_blocks_traits(psr_model_blocks(model[i]), b), traits | PSR_BLOCK_OLD);
	}
	for (int i = 0; i < 3; i++)
		psr_model_unref(model[i]);
}

static void unknown_sections_are_skipped_if_optional_and_named_if_required(void **state)
{
	uint8_t *bytes = copy_original();
	struct psr_model *model = NULL;
	struct psr_error err;

	(void)state;
	memcpy(entry_of(bytes, "LGTS"), "NEWS", 4);
	file_seal(bytes, n_bytes);
	assert_int_equal(psr_model_parse(&model, bytes, n_bytes, &err), PSR_OK);
	assert_int_equal(psr_model_presets(model)->n_lights, 0);
	assert_int_equal(psr_model_presets(model)->n_cameras, 2);
	psr_model_unref(model);
	file_put(entry_of(bytes, "NEWS") + ENTRY_FLAGS, 2, ENTRY_REQUIRED);
	assert_int_equal(parse_sealed(bytes, n_bytes, &err), PSR_ERR_UNSUPPORTED);
	assert_non_null(strstr(err.text, "required section NEWS, version 1, at byte"));
}

static void masks_need_their_indices_and_their_number(void **state)
{
	struct psr_model *model = NULL;
	struct psr_error err;
	struct fixture f;

	(void)state;
	for (int i = 0; i < 3; i++) {
		uint8_t *bytes = copy_original();

		if (i < 2)
			memcpy(entry_of(bytes, i == 0 ? "VISI" : "VISM"), "GONE", 4);
		else
			file_put(bytes + file_get(entry_of(bytes, "BLKS") + ENTRY_OFFSET, 8) + 24, 4, 0);
		assert_int_equal(parse_sealed(bytes, n_bytes, &err), PSR_ERR_FORMAT);
		assert_non_null(strstr(err.text, i < 2 ? "of the sections VISI and VISM" : "section VISM at byte"));
		fixture_init(&f, 1);
		if (i == 0)
			f.blocks.visibility_index = NULL;
		else if (i == 1)
			f.blocks.visibility_mask = NULL;
		else
			f.blocks.n_masks = 0;
		assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_ARG);
		assert_non_null(strstr(err.text, "together, or none"));
	}
	fixture_init(&f, 1);
	f.blocks.cone_x = f.blocks.cone_y = f.blocks.cone_z = NULL;
	f.blocks.cone_sine = NULL;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "traits, but no cones"));
	fixture_init(&f, 1);
	f.blocks.traits = NULL;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "opacities, but its blocks have no traits"));
	fixture_init(&f, 1);
	f.run.visibility_first = 1;
	f.visibility_index[5] = FIXTURE_MASKS - 1;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_FORMAT);
	fixture_init(&f, 0);
	f.run.visibility_first = 1;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "RUNS: the visibility masks of run 0 begin at 1 of 0"));
	assert_null(model);
}

static void every_required_section_is_missed(void **state)
{
	(void)state;
	for (int k = 0; k < SECTION_OCTREE; k++) {
		uint8_t *bytes = copy_original();
		struct psr_error err = { .text = "" };
		int expected = k == SECTION_BLOCKS ? PSR_ERR_UNSUPPORTED : PSR_ERR_FORMAT;

		file_put(entry_of(bytes, section_table[k].type) + ENTRY_FLAGS, 2, 0);
		memcpy(entry_of(bytes, section_table[k].type), "GONE", 4);
		/* Of the optional ones a cone needs its four parts, a mask both, opacities the traits. */
		if (k == SECTION_CAMERAS || k == SECTION_LIGHTS || strcmp(section_table[k].type, "OPAC") == 0)
			expected = PSR_OK;
		assert_int_equal(parse_sealed(bytes, n_bytes, &err), expected);
		if (section_table[k].flags & ENTRY_REQUIRED)
			assert_non_null(strstr(err.text, section_table[k].type));
		else if (expected != PSR_OK)
			assert_non_null(strstr(err.text, strcmp(section_table[k].type, "TRTS") == 0 ? "OPAC needs TRTS" : "are missing"));
	}
}

struct edit {
	const char *section; /* whose entry it is in; NULL: the header */
	int at, size;
	uint64_t value;
	const char *text;
};

static void lies_in_header_and_table_are_refused(void **state)
{
	static const struct edit edits[] = {
		{ NULL, HEADER_N_SECTIONS, 4, UINT32_MAX, "the header lists 4294967295 sections, more than the 256" },
		{ NULL, HEADER_N_SECTIONS, 4, 256, "within its section table" },
		{ NULL, HEADER_N_CHUNKS, 4, UINT32_MAX, "within its section table" },
		{ NULL, HEADER_N_CHUNKS, 4, 8, "section INFO begins at byte" },
		{ NULL, HEADER_FILE_SIZE, 8, UINT64_MAX, "the header says 18446744073709551615 bytes" },
		{ NULL, HEADER_FILE_SIZE, 8, 64, "section INFO at byte 896 has 184 bytes, which reach beyond the file's end" },
		{ NULL, 28, 4, 1, "5120 bytes follow the end of the file's last chunk" }, /* it is packed, says byte 28 */
		{ NULL, 48, 8, 1, "reserved bytes of the header are not zero" },
		{ "MASK", ENTRY_OFFSET, 8, 0, "section MASK begins at byte 0 instead of" },
		{ "MASK", ENTRY_OFFSET, 8, UINT64_MAX, "section MASK begins at byte 18446744073709551615 instead of" },
		{ "MASK", ENTRY_LENGTH, 8, UINT64_MAX, "reach beyond the file's end" },
		{ "MASK", ENTRY_LENGTH, 8, 40, "is not zero" },
		{ "MASK", ENTRY_LENGTH, 8, 49, "has 49 bytes and should have 48" },
		{ "OPAC", ENTRY_LENGTH, 8, FIXTURE_SAMPLES + 201, "reach beyond the file's end" },
		{ "MASK", ENTRY_TYPE, 4, 0x58485053, "there are two sections SPHX" },
		{ "MASK", ENTRY_FLAGS, 2, 3, "has unknown flags 0x3" },
		{ "MASK", ENTRY_FLAGS, 2, 0, "section MASK at byte" },
		{ "VISM", ENTRY_FLAGS, 2, 1, "must not be marked as required" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof edits / sizeof edits[0]; i++) {
		uint8_t *bytes = copy_original(), *base = edits[i].section ? entry_of(bytes, edits[i].section) : bytes;
		struct psr_error err = { .text = "" };

		file_put(base + edits[i].at, edits[i].size, edits[i].value);
		assert_int_equal(parse_sealed(bytes, n_bytes, &err), PSR_ERR_FORMAT);
		if (strstr(err.text, edits[i].text) == NULL)
			fail_msg("edit %zu: '%s' instead of '%s'", i, err.text, edits[i].text);
	}
}

static void stray_bytes_between_sections_are_refused(void **state)
{
	uint8_t *bytes = copy_original();
	size_t end = file_get(entry_of(bytes, "INFO") + ENTRY_OFFSET, 8) + INFO_BYTES;
	struct psr_error err;

	(void)state;
	bytes[end + 3] = 1;
	assert_int_equal(parse_sealed(bytes, n_bytes, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "after section INFO is not zero"));
}

static void create_refuses_what_a_file_may_not_hold(void **state)
{
	struct psr_model *model = NULL;
	struct psr_error err;
	struct fixture f;

	(void)state;
	fixture_init(&f, 1);
	assert_int_equal(psr_model_create(&model, NULL, &f.blocks, NULL, &err), PSR_ERR_ARG);
	assert_int_equal(psr_model_create(&model, &f.info, NULL, NULL, &err), PSR_ERR_ARG);
	f.blocks.cone_y = NULL;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_ARG);
	fixture_init(&f, 1);
	f.blocks.mask = NULL;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "MASK"));
	fixture_init(&f, 0);
	f.blocks.n_blocks = MODEL_MAX_BLOCKS + 1;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_LIMIT);
	fixture_init(&f, 0);
	f.blocks.n_samples = UINT64_MAX;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_LIMIT);
	fixture_init(&f, 0);
	memset(f.info.builder, 'x', sizeof f.info.builder);
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_ARG);
	fixture_init(&f, 0);
	f.mask[2] = 0;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_FORMAT);
	f.blocks.n_blocks = f.blocks.n_clusters = 0;
	f.blocks.n_samples = 0;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "0 blocks; it must be 1 to 67108864"));
	fixture_init(&f, 0);
	f.blocks.n_projections = 0;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "0 projections; it must be 1 to 256"));
	fixture_init(&f, 0);
	f.blocks.n_clusters = 0;
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "0 clusters; it must be 1 to the number of blocks"));
	assert_null(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(each_violated_rule_is_refused_by_its_name),
		cmocka_unit_test(values_at_the_edge_of_a_rule_are_taken),
		cmocka_unit_test(versions_are_refused_by_major_and_section),
		cmocka_unit_test(older_versions_have_samples_off_in_any_block),
		cmocka_unit_test(unknown_sections_are_skipped_if_optional_and_named_if_required),
		cmocka_unit_test(masks_need_their_indices_and_their_number),
		cmocka_unit_test(every_required_section_is_missed),
		cmocka_unit_test(lies_in_header_and_table_are_refused),
		cmocka_unit_test(stray_bytes_between_sections_are_refused),
		cmocka_unit_test(create_refuses_what_a_file_may_not_hold),
	};

	return cmocka_run_group_tests(tests, setup, teardown);
}
