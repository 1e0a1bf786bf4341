/* Which way is up in a file, and that models keep it. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "files.h"
#include "psr/build.h"

#define PLY(x, y)                                                                                                      \
	"ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\nend_header\n"     \
	x "0 " y "0 0\n" x "1 " y "0 0\n" x "0 " y "1 0\n" x "1 " y "1 0\n"

static const struct {
	const char *name, *text;
	int axis;
} files[] = {
	{ "a.gltf",
	  "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0]}],"
	  "'nodes':[{'mesh':0,'translation':[637000,851000,0]}],"
	  "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],"
	  "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3','min':[0,0,0],'max':[1,1,0]}],"
	  "'bufferViews':[{'buffer':0,'byteLength':36}],'buffers':[{'byteLength':36,'uri':'data:application/octet-stream;"
	  "base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA'}]}",
	  1 },
	{ "a.stl",
	  "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
	  "endsolid a\n",
	  2 },
	{ "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", 1 },
	{ "b.obj", "v 637000 851000 0\nv 637010 851000 0\nv 637000 851010 0\nf 1 2 3\n", 2 },
	{ "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", 1 },
	{ "a.ply", PLY("0", "0"), 1 },
	{ "b.ply", PLY("63700", "85100"), 2 },
};

static struct psr_mesh *import_text(int i)
{
	write_text(files[i].name, files[i].text);
	return import(files[i].name);
}

static void formats_and_survey_coordinates_tell_up(void **state)
{
	(void)state;
	for (int i = 0; i < (int)(sizeof files / sizeof *files); i++) {
		struct psr_mesh *mesh = import_text(i);

		for (int k = 0; k < 3; k++)
			if (mesh->up[k] != (k == files[i].axis))
				fail_msg("%s: up is %g,%g,%g", files[i].name, mesh->up[0], mesh->up[1], mesh->up[2]);
		psr_mesh_destroy(mesh);
	}
}

static void models_keep_up_and_the_builder_may_know_better(void **state)
{
	static const double wish[][3] = { { 0, 0, 0 }, { 0, -3, 4 } }, expected[][3] = { { 0, 0, 1 }, { 0, -0.6, 0.8 } };
	struct psr_mesh *mesh = import_text(1);
	struct psr_build_options options;

	(void)state;
	for (int i = 0; i < 2; i++) {
		struct psr_model *model;

		psr_build_options_default(&options);
		options.resolution = 16;
		memcpy(options.up, wish[i], sizeof options.up);
		assert_int_equal(psr_model_build(&model, mesh, &options, NULL, NULL), PSR_OK);
		for (int k = 0; k < 3; k++)
			assert_true(psr_model_info(model)->up[k] == expected[i][k]);
		psr_model_unref(model);
	}
	options.up[1] = 1e300;
	assert_int_equal(psr_model_build(&(struct psr_model *){ NULL }, mesh, &options, NULL, NULL), PSR_ERR_ARG);
	psr_mesh_destroy(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(formats_and_survey_coordinates_tell_up),
		cmocka_unit_test(models_keep_up_and_the_builder_may_know_better),
	};

	return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
