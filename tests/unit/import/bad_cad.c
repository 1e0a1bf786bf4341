/* STEP and IGES files that are whole, with entities that are not. Open CASCADE dereferences null at most of them. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "base/infile.h"
#include "base/random.h"
#include "import/import.h"
#include "files.h"

#define PINS "tests/data/import/pins.step"

static int has_module;

static char *read_text(const char *path)
{
	uint8_t *bytes = NULL;
	size_t n = 0;

	assert_int_equal(infile_read(&bytes, &n, path, 1 << 20, NULL), PSR_OK);
	bytes = realloc(bytes, n + 1);
	assert_non_null(bytes);
	bytes[n] = 0;
	return (char *)bytes;
}

/* Writes the file with `to` for its first n bytes at `at`. */
static void write_changed(const char *name, const char *text, const char *at, size_t n, const char *to)
{
	const size_t before = (size_t)(at - text), after = strlen(at + n), between = strlen(to);
	char *changed = malloc(before + between + after);

	assert_non_null(changed);
	memcpy(changed, text, before);
	memcpy(changed + before, to, between);
	memcpy(changed + before + between, at + n, after);
	write_bytes(path_of(name), changed, before + between + after);
	free(changed);
}

static void change(const char *name, const char *path, const char *from, const char *to)
{
	char *text = read_text(path), *at = strstr(text, from);

	assert_non_null(at);
	write_changed(name, text, at, strlen(from), to);
	free(text);
}

static void entities_without_their_parameters_are_named(void **state)
{
	static const struct {
		const char *from, *to, *why;
	} changed[] = {
		{ "DIRECTION('',(1.,0.,-0.))", "DIRECTION()", "entity #14, read as Direction: Count of Parameters is not 2" },
		{ "DIRECTION('',(1.,0.,-0.))", "DIRECTION((1.,0.,-0.))",
		  "entity #14, read as Direction: Count of Parameters is not 2" },
		{ "DIRECTION('',(1.,0.,-0.))", "DIRECTION('',(1.,'x',-0.))",
		  "entity #14, read as Direction: Parameter 2 (direction_ratios) not a Real" },
		{ "AXIS2_PLACEMENT_3D('',#12,#13,#14)", "AXIS2_PLACEMENT_3D('',#12,#13)",
		  "entity #11, read as Axis2Placement3d: Count of Parameters is not 4" },
		{ "LINE('',#60,#61)", "LINE('',#60,#61,1)", "entity #59, read as Line: Count of Parameters is not 3" },
		{ "VERTEX_POINT('',#45)", "VERTEX_POINT()", "entity #44, read as VertexPoint: Count of Parameters is not 2" },
		{ "CARTESIAN_POINT('',(0.,0.,20.))", "CARTESIAN_POINT('',$)",
		  "entity #49, read as CartesianPoint: Parameter 2 (coordinates) not a LIST" },
		{ "FILL_AREA_STYLE('',(#158))", "FILL_AREA_STYLE('',$)",
		  "entity #157, read as FillAreaStyle: Parameter 2 (fill_styles) not a LIST" },
	};

	(void)state;
	if (!has_module)
		skip();
	for (size_t i = 0; i < sizeof changed / sizeof *changed; i++) {
		change("changed.step", PINS, changed[i].from, changed[i].to);
		refuse("changed.step", PSR_ERR_FORMAT, changed[i].why);
	}
}

static void references_that_crash_are_named(void **state)
{
	static const struct {
		const char *from, *to, *why;
	} changed[] = {
		{ "AXIS2_PLACEMENT_3D('',#12,#13,#14)", "AXIS2_PLACEMENT_3D('',$,#13,#14)",
		  "entity #11, read as Axis2Placement3d: Parameter 2 (location) not an Entity" },
		{ "AXIS2_PLACEMENT_3D('',#49,#50,#51)", "AXIS2_PLACEMENT_3D('',#43,#50,#51)",
		  "entity #48, read as Axis2Placement3d: Parameter 2 (location) : Entity has illegal type" },
		{ "FACE_BOUND('',#41,.T.)", "FACE_BOUND('',*,.T.)",
		  "entity #40, read as FaceBound: Parameter 2 (bound) not an Entity" },
		{ "VERTEX_POINT('',#45)", "VERTEX_POINT('',#38)",
		  "entity #44, read as VertexPoint: Parameter 2 (vertex_geometry) : Entity has illegal type" },
		{ "SURFACE_STYLE_USAGE(.BOTH.,#155)", "SURFACE_STYLE_USAGE(.BOTH.,$)",
		  "entity #154, read as SurfaceStyleUsage: Parameter 2 (style) not an Entity" },
		{ "SHAPE_DEFINITION_REPRESENTATION(#4,#10)", "SHAPE_DEFINITION_REPRESENTATION(#10,#10)",
		  "entity #3, read as ShapeDefinitionRepresentation: Parameter 1 "
		  "(property_definition_representation.definition) : Entity has illegal type" },
		/* Empty lists, circles, and an item of a type that only its user minds. */
		{ "DIRECTION('',(1.,0.,-0.))", "DIRECTION('',())", "while it reads its entities" },
		{ "EDGE_LOOP('',(#42,#76,#99,#126))", "EDGE_LOOP('',())", "while it reads its entities" },
		{ "ORIENTED_EDGE('',*,*,#43,.F.)", "ORIENTED_EDGE('',*,*,#42,.F.)",
		  "while it reads its entities (Segmentation fault): an entity may be empty, or a part of itself" },
		{ "SURFACE_CURVE('',#47,", "SURFACE_CURVE('',#46,",
		  "while it makes shapes of its entities (Segmentation fault): an entity may be empty, or a part of itself" },
		{ "DEFINITIONAL_REPRESENTATION('',(#59),#63)", "DEFINITIONAL_REPRESENTATION('',(#44),#63)",
		  "while it makes shapes of its entities" },
	};

	(void)state;
	if (!has_module)
		skip();
	for (size_t i = 0; i < sizeof changed / sizeof *changed; i++) {
		change("changed.step", PINS, changed[i].from, changed[i].to);
		refuse("changed.step", PSR_ERR_FORMAT, "Open CASCADE crashes ");
		refuse("changed.step", PSR_ERR_FORMAT, changed[i].why);
	}
}

/* What Open CASCADE does without is there, and told. */
static void other_references_are_counted(void **state)
{
	struct psr_mesh *mesh;

	(void)state;
	if (!has_module)
		skip();
	change("changed.step", PINS, "FILL_AREA_STYLE_COLOUR('',#159)", "FILL_AREA_STYLE_COLOUR('',#50)");
	mesh = import("changed.step");
	assert_string_equal(mesh->warning,
	                    "1 of the file's entities refers to nothing or to a wrong type, and may be missing, first #158, "
	                    "read as FillAreaStyleColour: Parameter 2 (fill_colour) : Entity has illegal type");
	psr_mesh_destroy(mesh);
	mesh = NULL;
	assert_int_equal(psr_mesh_import(&mesh, PINS, NULL, NULL), PSR_OK);
	assert_string_equal(mesh->warning, "");
	psr_mesh_destroy(mesh);
}

static void iges_that_is_a_part_of_itself_is_told(void **state)
{
	static const char *const self[][2] = {
		{ "102,4,17,19,21,23;", "102,4,15,19,21,23;" }, { "402,3,5,37,47;", "402,3,3,37,47;" },
		{ "144,7,1,0,13;", "144,5,1,0,13;" },
	};

	(void)state;
	if (!has_module)
		skip();
	for (size_t i = 0; i < sizeof self / sizeof *self; i++) {
		change("self.iges", "tests/data/import/pins.iges", self[i][0], self[i][1]);
		refuse("self.iges", PSR_ERR_FORMAT, "Open CASCADE crashes while it makes shapes of its entities");
	}
}

/* Room for so many parts would be 8 GB; Open CASCADE looks for each of them. */
static void iges_with_more_parts_than_parameters_is_told(void **state)
{
	static const struct {
		const char *from, *to, *why;
	} changed[] = {
		{ "144,7,1,0,13;         ", "144,7,1,999999999,13; ",
		  "entity D5 of the IGES file, of type 144, tells 999999999 parts by its "
		                                                     "parameter 3, and has 4 parameters" },
		{ "144,7,1,0,13;         ", "144,7,1,99999999999,13", "tells 1000000000 parts" },
		{ "402,3,5,37,47;", "402,5,5,37,47;",
		  "entity D3 of the IGES file, of type 402, tells 5 parts by its parameter 1, and has 4 parameters" },
		{ "144,107,1,0,109;", "128,107,21,3,49;",
		  "entity D105 of the IGES file, of type 128, tells 2247 parts by its parameter 1" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof changed / sizeof *changed; i++) {
		change("many.iges", "tests/data/import/pins.iges", changed[i].from, changed[i].to);
		refuse("many.iges", PSR_ERR_FORMAT, changed[i].why);
	}
}

/* The n-th entity that begins in the text after `at`, up to its semicolon. */
static char *find_entity(char *text, uint32_t n, size_t *length)
{
	char *at = strstr(text, "DATA;");

	for (uint32_t i = 0; at != NULL && i <= n; i++)
		at = strstr(at + 1, "\n#");
	assert_non_null(at);
	*length = (size_t)(strchr(at, ';') - at) + 1;
	return at;
}

/* Without its parameters, or with one that is another. */
static const char *spoil(char out[4000], const char *entity, size_t length, uint64_t *random)
{
	static const char *const by[] = { "$", "*", "#11", "#38", "#43", "#50", "#4", "'x'", "-7", "()", "" };
	const char *to = by[random_below(random, sizeof by / sizeof *by)];
	const uint32_t n = random_below(random, 8);
	const char *open = memchr(entity, '(', length), *at = open, *rest;

	assert_true(length < 3900);
	for (uint32_t i = 0; i < n; i++) {
		const char *next = at + 1 + strcspn(at + 1, ",;");

		if (*next == ';')
			break;
		at = next;
	}
	rest = at + 1 + strcspn(at + 1, ",();");
	if (n == 0)
		snprintf(out, 4000, "%.*s();", (int)(open - entity), entity);
	else
		snprintf(out, 4000, "%.*s%s%.*s", (int)(at + 1 - entity), entity, to, (int)(entity + length - rest), rest);
	return out;
}

/* A hundred and twenty of them: each is read, or refused with words, and nothing else ends. */
static void no_entity_ends_more_than_its_file(void **state)
{
	uint64_t random = 18;
	uint32_t n_refused = 0, n_read = 0;
	char *text, spoiled[4000];

	(void)state;
	if (!has_module)
		skip();
	text = read_text(PINS);
	for (int i = 0; i < 120; i++) {
		struct psr_mesh *mesh = NULL;
		struct psr_error err = { 0, "" };
		size_t length;
		char *at = find_entity(text, random_below(&random, 159), &length);
		int rc;

		write_changed("spoiled.step", text, at, length, spoil(spoiled, at, length, &random));
		rc = psr_mesh_import(&mesh, path_of("spoiled.step"), NULL, &err);
		assert_true(rc == PSR_OK || rc == PSR_ERR_FORMAT);
		assert_true(rc == PSR_OK || err.text[0] != '\0');
		n_refused += rc != PSR_OK;
		n_read += rc == PSR_OK;
		psr_mesh_destroy(mesh);
	}
	assert_true(n_refused > 20 && n_read > 20);
	free(text);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(entities_without_their_parameters_are_named),
		cmocka_unit_test(references_that_crash_are_named),
		cmocka_unit_test(other_references_are_counted),
		cmocka_unit_test(iges_that_is_a_part_of_itself_is_told),
		cmocka_unit_test(iges_with_more_parts_than_parameters_is_told),
		cmocka_unit_test(no_entity_ends_more_than_its_file),
	};
	has_module = has_cad_module();
	return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
