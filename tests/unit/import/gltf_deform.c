#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "gltf_build.h"

/* A triangle with normals +z (1), joints (2), weights (3), and inverse bind matrices (4): the first moves by -1 in x,
 * the second by -2 in y. Vertex 0 hangs on joint 0, 1 on joint 1, 2 on both, 1 : 3. */
static void put_skinned(struct built *b)
{
	static const float normal[9] = { 0, 0, 1, 0, 0, 1, 0, 0, 1 };
	static const uint8_t joint[12] = { 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0 };
	static const float weight[12] = { 1, 0, 0, 0, 1, 0, 0, 0, 0.25, 0.75, 0, 0 };
	static const float inverse[32] = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1,
		                           1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -2, 0, 1 };

	put_triangle(b);
	PUT(b, normal, F32, "VEC3", 3);
	PUT(b, joint, U8, "VEC4", 3);
	PUT(b, weight, F32, "VEC4", 3);
	PUT(b, inverse, F32, "MAT4", 2);
}

#define SKINNED "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1,'JOINTS_0':2,'WEIGHTS_0':3}}]}],"
#define SKIN "'skins':[{'inverseBindMatrices':4,'joints':[2,3]}]"

/* Joint 0: +10 z under a parent that doubles; joint 1: a quarter turn about x, (y, z) -> (-z, y).
 * Vertex 0 (0,0,0): 2 (-1, 0, 10). Vertex 1 (1,0,0): turned (1,-2,0), that is (1,0,-2).
 * Vertex 2 (0,1,0): 1/4 of 2 (-1, 1, 10), 3/4 of turned (0,-1,0) = (0,0,-1). */
static void skins_stand_where_their_joints_hold_them(void **state)
{
	(void)state;
	struct built b;

	put_skinned(&b);
	struct psr_mesh *m = import_built(
		&b, SKINNED SKIN ",'nodes':[{'mesh':0,'skin':0,'translation':[100,0,0],'scale':[7,7,7]},{'children':[2],"
		"'scale':[2,2,2]},{'translation':[0,0,10]},{'rotation':[0.70710678118654752,0,0,0.70710678118654752]}],"
		"'scenes':[{'nodes':[0,1,3]}]");

	assert_int_equal(m->n_triangles, 1);
	/* the rotation's numbers are exact to 2^-53, sums stay below 32 */
	NEAR(m->position[m->triangle[0][0]], 1e-13, -2, 0, 20);
	NEAR(m->position[m->triangle[0][1]], 1e-13, 1, 0, -2);
	NEAR(m->position[m->triangle[0][2]], 1e-13, -0.5, 0.5, 5 - 0.75);
	/* the turned +z is -y; that of vertex 2 goes with the inverse transpose of diag(2,2,2) / 4 + 3/4 of the turn */
	NEAR_F(m->normal[m->triangle[0][0]], 1e-7, 0, 0, 1);
	NEAR_F(m->normal[m->triangle[0][1]], 1e-7, 0, -1, 0);
	/* rows of M: (1.25,0,0) (0,0.5,-0.75) (0,0.75,0.5); cofactors of its last column: (0,-0.75,0.5) * 1.25 */
	NEAR_F(m->normal[m->triangle[0][2]], 1e-7, 0, -0.75 / sqrt(0.8125), 0.5 / sqrt(0.8125));
	assert_string_equal(m->warning, "");
	psr_mesh_destroy(m);
}

static void joints_outside_of_the_scene_still_hold(void **state)
{
	(void)state;
	struct built b;

	put_skinned(&b);
	struct psr_mesh *m = import_built(&b, SKINNED SKIN ",'nodes':[{'mesh':0,'skin':0},{'children':[2],'scale':[2,2,2]},"
	                                      "{'translation':[0,0,10]},{}],'scenes':[{'nodes':[0]}]");

	NEAR(m->position[m->triangle[0][0]], 0, -2, 0, 20);
	NEAR(m->position[m->triangle[0][1]], 0, 1, -2, 0);
	psr_mesh_destroy(m);
}

static void skins_without_inverse_matrices_take_the_joints_alone(void **state)
{
	(void)state;
	struct built b;

	put_skinned(&b);
	struct psr_mesh *m = import_built(&b, SKINNED "'skins':[{'joints':[1,2]}],'nodes':[{'mesh':0,'skin':0},"
	                                      "{'translation':[0,0,8]},{'translation':[0,4,0]}]");

	NEAR(m->position[m->triangle[0][0]], 0, 0, 0, 8);
	NEAR(m->position[m->triangle[0][1]], 0, 1, 4, 0);
	NEAR(m->position[m->triangle[0][2]], 0, 0, 1 + 3, 2);
	psr_mesh_destroy(m);
}

/* Without a skin the joints of a primitive say nothing; one mesh may stand both ways. */
static void a_node_without_the_skin_holds_the_mesh_itself(void **state)
{
	(void)state;
	struct built b;

	put_skinned(&b);
	struct psr_mesh *m = import_built(&b, SKINNED "'skins':[{'joints':[2,2]}],'nodes':[{'mesh':0,'skin':0,"
	                                      "'translation':[9,9,9]},{'mesh':0,'translation':[0,0,5]},"
	                                      "{'translation':[0,0,-5]}]");

	assert_int_equal(m->n_triangles, 2);
	NEAR(m->position[m->triangle[0][1]], 0, 1, 0, -5);
	NEAR(m->position[m->triangle[1][1]], 0, 1, 0, 5);
	psr_mesh_destroy(m);
}

/* Weights are shares of their sum, whatever their kind; two sets; none at all: the first joint. */
static void weights_are_shares_of_their_sum(void **state)
{
	(void)state;
	static const uint16_t joint[12] = { 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0 }, joint_1[12] = { 0 };
	static const uint8_t weight[12] = { 51, 0, 0, 0, 51, 51, 0, 0, 0, 0, 0, 0 };
	static const uint16_t weight_1[12] = { 0, 0, 13107, 0, 0, 39321, 0, 0, 0, 0, 0, 0 };
	struct built b;

	put_triangle(&b);
	PUT(&b, joint, U16, "VEC4", 3);
	PUT_NORMALIZED(&b, weight, 0, U8, "VEC4", 3);
	PUT(&b, joint_1, U16, "VEC4", 3);
	PUT_NORMALIZED(&b, weight_1, 0, U16, "VEC4", 3);
	struct psr_mesh *m = import_built(
		&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':1,'WEIGHTS_0':2,'JOINTS_1':3,"
		"'WEIGHTS_1':4}}]}],'skins':[{'joints':[1,2]}],'nodes':[{'mesh':0,'skin':0},{},{'translation':[0,0,10]}]");

	/* joint 1 at z = 10: shares 1/2, 1/5, and all by the first; weights are floats, 2^-24 of themselves off */
	NEAR(m->position[m->triangle[0][0]], 10 * 0x1p-23, 0, 0, 5);
	NEAR(m->position[m->triangle[0][1]], 10 * 0x1p-23, 1, 0, 2);
	NEAR(m->position[m->triangle[0][2]], 10 * 0x1p-23, 0, 1, 10);
	psr_mesh_destroy(m);
}

static void mirrored_skins_keep_their_faces_on_one_side(void **state)
{
	(void)state;
	struct built b;

	put_skinned(&b);
	struct psr_mesh *m = import_built(&b, SKINNED "'skins':[{'joints':[1,1]}],'nodes':[{'mesh':0,'skin':0},"
	                                      "{'scale':[-1,1,1]}]");
	const double *p[3];

	for (int c = 0; c < 3; c++)
		p[c] = m->position[m->triangle[0][c]];
	/* z of the face's normal, which was 1 and stays so, like the vertices' */
	assert_true((p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]) == 1.0);
	NEAR_F(m->normal[0], 0, 0, 0, 1);
	psr_mesh_destroy(m);
}

/* Accessor 1 NORMAL (+z); target 0: x + 4 for all (2), normals + (1,0,0) (3); target 1: sparse, z of vertex 2 is 8 more
 * (4, no view of its own). */
static void put_morphed(struct built *b)
{
	static const float normal[9] = { 0, 0, 1, 0, 0, 1, 0, 0, 1 };
	static const float moved[9] = { 4, 0, 0, 4, 0, 0, 4, 0, 0 }, turned[9] = { 1, 0, 0, 1, 0, 0, 1, 0, 0 };
	static const float value[3] = { 0, 0, 8 };
	static const uint8_t index[1] = { 2 };
	int at;
	size_t end;

	put_triangle(b);
	PUT(b, normal, F32, "VEC3", 3);
	PUT(b, moved, F32, "VEC3", 3);
	PUT(b, turned, F32, "VEC3", 3);
	at = put_view(b, index, sizeof index, 0);
	put_view(b, value, sizeof value, 0);
	end = strlen(b->accessors);
	snprintf(b->accessors + end, sizeof b->accessors - end,
	         ",{'componentType':5126,'type':'VEC3','count':3,'sparse':{'count':1,'indices':{'bufferView':%d,"
	         "'componentType':5121},'values':{'bufferView':%d}}}", at, at + 1);
	b->n_accessors++;
}

#define TARGETS "'targets':[{'POSITION':2,'NORMAL':3},{'POSITION':4}]"

static void morph_targets_are_added_by_weight(void **state)
{
	(void)state;
	struct built b;

	put_morphed(&b);
	struct psr_mesh *m = import_built(&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1}," TARGETS
	                                      "}],'weights':[0.75,-0.5]}],'nodes':[{'mesh':0,'translation':[0,0,100]}]");

	NEAR(m->position[m->triangle[0][0]], 0, 3, 0, 100);
	NEAR(m->position[m->triangle[0][1]], 0, 4, 0, 100);
	NEAR(m->position[m->triangle[0][2]], 0, 3, 1, 96);
	/* (0.75, 0, 1) has the length 1.25 */
	NEAR_F(m->normal[0], 0x1p-24, 0.6, 0, 0.8);
	assert_string_equal(m->warning, "");
	psr_mesh_destroy(m);
}

static void weights_of_the_node_go_before_those_of_the_mesh(void **state)
{
	(void)state;
	struct built b;

	put_morphed(&b);
	struct psr_mesh *m = import_built(&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0}," TARGETS
	                                      "}],'weights':[1,0]}],'nodes':[{'mesh':0,'weights':[0,1]},{'mesh':0}]");

	NEAR(m->position[m->triangle[0][2]], 0, 0, 1, 8);
	NEAR(m->position[m->triangle[1][2]], 0, 4, 1, 0);
	/* without normals in the file there are none */
	for (uint32_t v = 0; v < m->n_vertices; v++)
		NEAR_F(m->normal[v], 0, 0, 0, 0);
	psr_mesh_destroy(m);
	/* without any, the mesh stands as it is */
	m = import_built(&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0}," TARGETS "}]}]");
	NEAR(m->position[m->triangle[0][2]], 0, 0, 1, 0);
	psr_mesh_destroy(m);
}

static void tangents_are_morphed_but_not_their_handedness(void **state)
{
	(void)state;
	static const float tangent[12] = { 1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1 }, more[9] = { 0, 1, 0, 0, 1, 0, 0, 1, 0 };
	static const uint8_t black[12];
	uint8_t bmp[80];
	struct built b;

	put_morphed(&b);
	PUT(&b, tangent, F32, "VEC4", 3);
	PUT(&b, more, F32, "VEC3", 3);
	assert_int_equal(put_view(&b, bmp, make_bmp(bmp, 4, 1, black, 12), 0), 8);
	struct psr_mesh *m = import_built(
		&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1,'TANGENT':5},'targets':[{'TANGENT':6}],"
		"'material':0}],'weights':[0.75]}],'images':[{'bufferView':8}],'textures':[{'source':0}],"
		"'materials':[{'normalTexture':{'index':0}}]");

	NEAR_F(m->tangent[0], 0x1p-24, 0.8, 0.6, 0, -1);
	psr_mesh_destroy(m);
}

static void morphing_comes_before_the_skin(void **state)
{
	(void)state;
	static const uint8_t joint[12] = { 0 };
	static const float weight[12] = { 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0 };
	struct built b;

	put_morphed(&b);
	PUT(&b, joint, U8, "VEC4", 3);
	PUT(&b, weight, F32, "VEC4", 3);
	struct psr_mesh *m = import_built(
		&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':5,'WEIGHTS_0':6}," TARGETS "}],"
		"'weights':[1,1]}],'skins':[{'joints':[1]}],'nodes':[{'mesh':0,'skin':0},{'scale':[10,1,2]}]");

	NEAR(m->position[m->triangle[0][2]], 0, 40, 1, 16);
	psr_mesh_destroy(m);
}

static void deformations_that_lie_are_refused(void **state)
{
	(void)state;
	struct built b;

	put_skinned(&b);
#define NODE "'nodes':[{'mesh':0,'skin':0},{}]"
	refuse_built(&b, SKINNED NODE, PSR_ERR_FORMAT, "skin 0 does not exist");
	refuse_built(&b, SKINNED "'skins':[{'joints':[1]}]," NODE, PSR_ERR_FORMAT, "uses joint 1, but its skin has 1");
	refuse_built(&b, SKINNED "'skins':[{'joints':[1,77]}]," NODE, PSR_ERR_FORMAT, "node 77");
	refuse_built(&b, SKINNED "'skins':[{'joints':[-1]}]," NODE, PSR_ERR_FORMAT, "skins[0].joints[0]");
	refuse_built(&b, SKINNED "'skins':[{'joints':[]}]," NODE, PSR_ERR_FORMAT, "no joints");
	refuse_built(&b, SKINNED "'skins':[{'inverseBindMatrices':4,'joints':[1,1,1]}]," NODE, PSR_ERR_FORMAT,
	             "3 joints, but 2");
	refuse_built(&b, SKINNED "'skins':[{'inverseBindMatrices':0,'joints':[1,1]}]," NODE, PSR_ERR_FORMAT,
	             "3 components, expected 16");
	refuse_built(&b, SKINNED "'skins':[{'joints':[1,2]}],'nodes':[{'mesh':0,'skin':0},{'children':[2]},"
	             "{'children':[1]}],'scenes':[{'nodes':[0]}]", PSR_ERR_FORMAT, "part of a cycle");
	refuse_built(&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':2,'WEIGHTS_0':4}}]}],"
	             "'skins':[{'joints':[1,1]}]," NODE, PSR_ERR_FORMAT, "16 components, expected 4");
	refuse_built(&b,
	             "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'targets':[{'POSITION':4}]}],'weights':[1]}]",
	             PSR_ERR_FORMAT, "targets[0].POSITION has 2 elements where the primitive has 3");
	refuse_built(&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'targets':[{'POSITION':99}]}],"
	             "'weights':[1]}]", PSR_ERR_FORMAT, "accessor 99");
	refuse_built(&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'targets':[{'POSITION':-1}]}],"
	             "'weights':[1]}]", PSR_ERR_FORMAT, "targets[0].POSITION is not an integer");
	refuse_built(&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'targets':[7]}],'weights':[1]}]",
	             PSR_ERR_FORMAT, "targets[0] is not an object");
}

/* 2^28 sums are more than any face has: 2,501 targets of the same 107,375 vertices. */
static void endless_morph_targets_are_refused(void **state)
{
	(void)state;
	const size_t n_vertices = 107375, n_targets = 2501;
	char *json = malloc(64 * n_targets + 4096), *at = json;
	uint8_t *bin = calloc(n_vertices, 12);
	struct psr_mesh *mesh;
	struct psr_error err;

	assert_non_null(json);
	assert_non_null(bin);
	at +=
		sprintf(at,
	            "{'asset':{'version':'2.0'},'buffers':[{'byteLength':%zu,'uri':'many.bin'}],'bufferViews':["
	            "{'buffer':0,'byteLength':%zu}],'accessors':[{'bufferView':0,'componentType':5126,'type':'VEC3',"
	            "'count':%zu},{'bufferView':0,'componentType':5126,'type':'VEC3','count':%zu}],'meshes':[{'weights':[",
	            12 * n_vertices, 12 * n_vertices, n_vertices, n_vertices);
	for (size_t i = 0; i < n_targets; i++)
		at += sprintf(at, "%s1e-9", i > 0 ? "," : "");
	at += sprintf(at, "],'primitives':[{'attributes':{'POSITION':0},'targets':[");
	for (size_t i = 0; i < n_targets; i++)
		at += sprintf(at, "%s{'POSITION':1}", i > 0 ? "," : "");
	sprintf(at, "]}]}]}");
	write_bytes(path_of("many.bin"), bin, 12 * n_vertices);
	write_text("many.gltf", json);
	free(bin);
	free(json);
	assert_int_equal(psr_mesh_import(&mesh, path_of("many.gltf"), NULL, &err), PSR_ERR_LIMIT);
	assert_non_null(strstr(err.text, "too many morph targets"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(skins_stand_where_their_joints_hold_them),
		cmocka_unit_test(joints_outside_of_the_scene_still_hold),
		cmocka_unit_test(skins_without_inverse_matrices_take_the_joints_alone),
		cmocka_unit_test(a_node_without_the_skin_holds_the_mesh_itself),
		cmocka_unit_test(weights_are_shares_of_their_sum),
		cmocka_unit_test(mirrored_skins_keep_their_faces_on_one_side),
		cmocka_unit_test(morph_targets_are_added_by_weight),
		cmocka_unit_test(weights_of_the_node_go_before_those_of_the_mesh),
		cmocka_unit_test(tangents_are_morphed_but_not_their_handedness),
		cmocka_unit_test(morphing_comes_before_the_skin),
		cmocka_unit_test(deformations_that_lie_are_refused),
		cmocka_unit_test(endless_morph_targets_are_refused),
	};

	return cmocka_run_group_tests_name("import_gltf_deform", tests, make_folder, remove_folder);
}
