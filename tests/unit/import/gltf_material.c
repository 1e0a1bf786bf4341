#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "gltf_build.h"

/* Accessors 1 and 2 are TEXCOORD_0 and _1, 3 is NORMAL, 4 is another set; views 5 and 6 are images of 4 x 1
 * and 8 x 1. */
static void put_textured(struct built *b)
{
	static const float uv[6] = { 0, 0, 1, 0, 0, 1 }, other_uv[6] = { 0.5, 0, 1, 0.5, 0, 1 };
	static const float normal[9] = { 0, 0, 1, 0, 0, 1, 0, 0, 1 }, third[6] = { 7, 7, 7, 7, 7, 7 };
	static const uint8_t black[24];
	uint8_t bmp[128];

	put_triangle(b);
	PUT(b, uv, F32, "VEC2", 3);
	PUT(b, other_uv, F32, "VEC2", 3);
	PUT(b, normal, F32, "VEC3", 3);
	PUT(b, third, F32, "VEC2", 3);
	assert_int_equal(put_view(b, bmp, make_bmp(bmp, 4, 1, black, 12), 0), 5);
	assert_int_equal(put_view(b, bmp, make_bmp(bmp, 8, 1, black, 24), 0), 6);
}

#define DRAWN \
	"'meshes':[{'primitives':[{'attributes':{'POSITION':0,'TEXCOORD_0':1,'TEXCOORD_1':2,'NORMAL':3,'TEXCOORD_4':4}," \
	"'material':0}]}],'nodes':[{'mesh':0}],'images':[{'bufferView':5},{'bufferView':6}],'samplers':[{}," \
	"{'wrapS':33071,'wrapT':33648,'magFilter':9728,'minFilter':9984},{'wrapS':33648,'wrapT':10497,'magFilter':9729}]," \
	"'textures':[{'source':0},{'source':1,'sampler':1},{'source':0,'sampler':2}],"

static struct psr_mesh *import_material(const char *material)
{
	struct built b;
	char rest[4096];

	put_textured(&b);
	snprintf(rest, sizeof rest, DRAWN "'materials':[{%s}]", material);
	return import_built(&b, rest);
}

static void assert_texture(const struct psr_mesh *m, const struct psr_texture *t, uint32_t width, int set,
                           enum psr_wrap s, enum psr_wrap w, int is_nearest)
{
	assert_true(t->image >= 0 && t->image < (int)m->n_images);
	assert_int_equal(m->image[t->image].width, width);
	assert_int_equal(t->uv_set, set);
	assert_int_equal(t->wrap_s, s);
	assert_int_equal(t->wrap_t, w);
	assert_int_equal(t->is_nearest, is_nearest);
}

static void every_texture_keeps_its_own_coordinates_and_sampler(void **state)
{
	(void)state;
	static const double identity[6] = { 1, 0, 0, 0, 1, 0 };
	struct psr_mesh *m = import_material(
		"'pbrMetallicRoughness':{'baseColorTexture':{'index':0},'metallicRoughnessTexture':{'index':1,'texCoord':1}},"
		"'normalTexture':{'index':2,'texCoord':1,'scale':0.5,'extensions':{'KHR_texture_transform':{'offset':[3,4]}}},"
		"'occlusionTexture':{'index':1,'strength':0.25},"
		"'emissiveTexture':{'index':1,'extensions':{'KHR_texture_transform':{'scale':[2,-3],'texCoord':1}}},"
		"'emissiveFactor':[1,1,1]");
	const struct psr_material *a = &m->material[0];

	assert_int_equal(m->n_images, 2);
	assert_texture(m, &a->base_texture, 4, 0, PSR_WRAP_REPEAT, PSR_WRAP_REPEAT, 0);
	assert_texture(m, &a->metallic_roughness_texture, 8, 1, PSR_WRAP_CLAMP, PSR_WRAP_MIRROR, 1);
	assert_texture(m, &a->normal_texture, 4, 1, PSR_WRAP_MIRROR, PSR_WRAP_REPEAT, 0);
	assert_texture(m, &a->occlusion_texture, 8, 0, PSR_WRAP_CLAMP, PSR_WRAP_MIRROR, 1);
	assert_texture(m, &a->emissive_texture, 8, 1, PSR_WRAP_CLAMP, PSR_WRAP_MIRROR, 1);
	assert_near_f(a->base_texture.transform, identity, 6, 0);
	NEAR_F(a->normal_texture.transform, 0, 1, 0, 3, 0, 1, 4);
	NEAR_F(a->emissive_texture.transform, 0, 2, 0, 0, 0, -3, 0);
	assert_true(a->normal_scale == 0.5f && a->occlusion_strength == 0.25f);
	assert_true(a->metallic == 1.0f && a->roughness == 1.0f);
	assert_int_equal(a->specular_texture.image, -1);
	/* coordinates stay as they are written */
	NEAR_F(m->uv[0][vertex_at(m, 1, 0, 0)], 0, 1, 0);
	NEAR_F(m->uv[1][vertex_at(m, 1, 0, 0)], 0, 1, 0.5);
	assert_string_equal(m->warning, "");
	psr_mesh_destroy(m);
}

/* The example of KHR_texture_transform: the lower left quadrant, so that (0,0) shows (0,1), (1,0) shows (0,0.5), and
 * (0,1) shows (0.5,1). The same for any number of turns. */
static void texture_transforms_turn_as_their_specification_says(void **state)
{
	(void)state;
	static const char *const angle[] = { "1.5707963267948966", "7.8539816339744828", "-4.7123889803846899" };

	for (int i = 0; i < 3; i++) {
		char text[256];

		snprintf(text, sizeof text, "'pbrMetallicRoughness':{'baseColorTexture':{'index':0,'extensions':{"
		         "'KHR_texture_transform':{'offset':[0,1],'rotation':%s,'scale':[0.5,0.5]}}}}", angle[i]);
		struct psr_mesh *m = import_material(text);

		/* reducing an angle below 8 by turns in doubles leaves it 2e-15 off, and sine and cosine 1e-15 more */
		NEAR_F(m->material[0].base_texture.transform, 4e-15, 0, 0.5, 0, -0.5, 0, 1);
		psr_mesh_destroy(m);
	}
	/* an eighth: u' = (u + v) / sqrt 2, v' = (v - u) / sqrt 2; and back */
	for (int sign = -1; sign <= 1; sign += 2) {
		char text[256];
		const double h = sqrt(0.5);

		snprintf(text, sizeof text, "'pbrMetallicRoughness':{'baseColorTexture':{'index':0,'extensions':{"
		         "'KHR_texture_transform':{'rotation':%.17g}}}}", sign * M_PI / 4);
		struct psr_mesh *m = import_material(text);

		/* floats between 1/2 and 1 are up to 2^-25 off */
		NEAR_F(m->material[0].base_texture.transform, 0x1p-25, h, sign * h, 0, -sign * h, h, 0);
		psr_mesh_destroy(m);
	}
}

static void a_material_of_set_1_leaves_set_0_out(void **state)
{
	(void)state;
	struct psr_mesh *m = import_material("'pbrMetallicRoughness':{'baseColorTexture':{'index':0,'texCoord':1}}");

	assert_int_equal(m->material[0].base_texture.uv_set, 1);
	assert_null(m->uv[0]);
	NEAR_F(m->uv[1][vertex_at(m, 0, 0, 0)], 0, 0.5, 0);
	psr_mesh_destroy(m);
}

static void sets_beyond_the_second_take_a_free_place(void **state)
{
	(void)state;
	struct psr_mesh *m = import_material("'pbrMetallicRoughness':{'baseColorTexture':{'index':0,'texCoord':4}}");

	assert_int_equal(m->material[0].base_texture.uv_set, 0);
	NEAR_F(m->uv[0][0], 0, 7, 7);
	assert_string_equal(m->warning, "");
	psr_mesh_destroy(m);
	m = import_material("'pbrMetallicRoughness':{'baseColorTexture':{'index':0}},"
	                    "'normalTexture':{'index':0,'texCoord':1},'occlusionTexture':{'index':1,'texCoord':4}");
	assert_int_equal(m->material[0].occlusion_texture.image, -1);
	assert_non_null(strstr(m->warning, "materials[0].occlusionTexture was left out"));
	psr_mesh_destroy(m);
}

static void emission_is_factor_times_strength(void **state)
{
	(void)state;
	struct psr_mesh *m = import_material("'emissiveFactor':[1,0.5,0.25],'extensions':{"
	                                     "'KHR_materials_emissive_strength':{'emissiveStrength':8}},"
	                                     "'pbrMetallicRoughness':{'baseColorFactor':[0,0,0,1]}");

	NEAR_F(m->material[0].emissive, 0, 8, 4, 2);
	NEAR_F(m->material[0].base_color, 0, 0, 0, 0, 1);
	assert_false(m->material[0].unlit);
	assert_int_equal(m->material[0].emissive_texture.image, -1);
	psr_mesh_destroy(m);
}

static void specular_glossiness_is_kept_whole(void **state)
{
	(void)state;
	struct psr_mesh *m = import_material(
		"'extensions':{'KHR_materials_pbrSpecularGlossiness':{'diffuseFactor':[0.5,0.25,0,0.75],"
		"'specularFactor':[0.1,0.2,0.3],'glossinessFactor':0.75,'diffuseTexture':{'index':1,'texCoord':1},"
		"'specularGlossinessTexture':{'index':2,'extensions':{'KHR_texture_transform':{'offset':[1,2]}}}}},"
		"'pbrMetallicRoughness':{'baseColorTexture':{'index':0},'metallicFactor':1}");
	const struct psr_material *a = &m->material[0];

	assert_int_equal(a->is_specular_glossiness, 1);
	NEAR_F(a->base_color, 0, 0.5, 0.25, 0, 0.75);
	NEAR_F(a->specular, 0x1p-26, 0.1, 0.2, 0.3); /* half a step of floats below 1/2 */
	assert_true(a->glossiness == 0.75f && a->metallic == 0.0f);
	assert_texture(m, &a->base_texture, 8, 1, PSR_WRAP_CLAMP, PSR_WRAP_MIRROR, 1);
	assert_texture(m, &a->specular_texture, 4, 0, PSR_WRAP_MIRROR, PSR_WRAP_REPEAT, 0);
	NEAR_F(a->specular_texture.transform, 0, 1, 0, 1, 0, 1, 2);
	psr_mesh_destroy(m);
	/* what the extension leaves out is 1 */
	m = import_material("'extensions':{'KHR_materials_pbrSpecularGlossiness':{}}");
	NEAR_F(m->material[0].base_color, 0, 1, 1, 1, 1);
	NEAR_F(m->material[0].specular, 0, 1, 1, 1);
	assert_true(m->material[0].glossiness == 1.0f && m->material[0].specular_texture.image == -1);
	psr_mesh_destroy(m);
}

static void unlit_materials_have_a_base_color_alone(void **state)
{
	(void)state;
	struct psr_mesh *m = import_material("'extensions':{'KHR_materials_unlit':{}},'normalTexture':{'index':1},"
	                                     "'pbrMetallicRoughness':{'baseColorTexture':{'index':0}},"
	                                     "'emissiveFactor':[1,1,1],'emissiveTexture':{'index':1}");

	assert_int_equal(m->material[0].unlit, 1);
	assert_int_equal(m->n_images, 1);
	NEAR_F(m->material[0].emissive, 0, 0, 0, 0);
	assert_int_equal(m->material[0].normal_texture.image, -1);
	psr_mesh_destroy(m);
}

static void alpha_modes_and_their_cutoff_are_kept(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		enum psr_alpha alpha;
		float cutoff;
	} modes[] = { { "'doubleSided':true", PSR_ALPHA_OPAQUE, 0.5f },
		      { "'alphaMode':'MASK'", PSR_ALPHA_MASK, 0.5f },
		      { "'alphaMode':'MASK','alphaCutoff':0.125", PSR_ALPHA_MASK, 0.125f },
		      { "'alphaMode':'BLEND'", PSR_ALPHA_BLEND, 0.5f } };

	for (int i = 0; i < 4; i++) {
		struct psr_mesh *m = import_material(modes[i].text);

		assert_int_equal(m->material[0].alpha, modes[i].alpha);
		assert_true(m->material[0].alpha_cutoff == modes[i].cutoff);
		assert_int_equal(m->material[0].two_sided, i == 0);
		psr_mesh_destroy(m);
	}
}

static void factors_out_of_range_are_put_right(void **state)
{
	(void)state;
	struct psr_mesh *m = import_material(
		"'pbrMetallicRoughness':{'baseColorFactor':[7,-1,0.5,1e300],'metallicFactor':-2,'roughnessFactor':9},"
		"'emissiveFactor':[-1,1,1e300],'occlusionTexture':{'index':0,'strength':4},"
		"'normalTexture':{'index':0,'scale':1e300,'extensions':{'KHR_texture_transform':{'scale':[1e300,1]}}}");
	const struct psr_material *a = &m->material[0];

	NEAR_F(a->base_color, 0, 1, 0, 0.5, 1);
	assert_true(a->metallic == 0.0f && a->roughness == 1.0f && a->occlusion_strength == 1.0f);
	assert_true(a->emissive[0] == 0.0f && a->emissive[1] == 1.0f && isfinite(a->emissive[2]));
	assert_true(a->normal_scale == 1.0f);
	NEAR_F(a->normal_texture.transform, 0, 1, 0, 0, 0, 1, 0);
	psr_mesh_destroy(m);
}

static void textures_that_change_nothing_are_not_read(void **state)
{
	(void)state;
	struct built b;

	put_textured(&b);
	/* none of them exists */
	struct psr_mesh *m = import_built(&b, DRAWN "'materials':[{'emissiveTexture':{'index':77},"
	                                      "'occlusionTexture':{'index':77,'strength':0},'normalTexture':{'index':77,"
	                                      "'scale':0},'pbrMetallicRoughness':{'metallicRoughnessTexture':{'index':77},"
	                                      "'metallicFactor':0,'roughnessFactor':0}},{'normalTexture':{'index':78}}]");

	assert_int_equal(m->n_images, 0);
	psr_mesh_destroy(m);
	refuse_built(&b, DRAWN "'materials':[{'normalTexture':{'index':77}}]", PSR_ERR_FORMAT,
	             "materials[0].normalTexture: texture 77 does not exist");
	refuse_built(&b, "'textures':[{'source':0,'sampler':3}],'images':[{'bufferView':5}],'materials':["
	             "{'normalTexture':{'index':0}}],'meshes':["
	             "{'primitives':[{'attributes':{'POSITION':0},'material':0}]}]",
	             PSR_ERR_FORMAT, "sampler 3 does not exist");
}

static void extensions_that_are_ignored_are_named(void **state)
{
	(void)state;
	struct built b;

	put_triangle(&b);
#define PLAIN "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]"
	struct psr_mesh *m = import_built(&b, PLAIN ",'extensionsUsed':['KHR_materials_sheen','KHR_texture_transform',"
	                                      "'KHR_materials_variants','EXT_something']");

	assert_string_equal(m->warning,
	                    "unsupported extensions were ignored: KHR_materials_sheen, EXT_something");
	psr_mesh_destroy(m);
	refuse_built(&b, PLAIN ",'extensionsUsed':['KHR_materials_sheen'],'extensionsRequired':['KHR_materials_sheen']",
	             PSR_ERR_UNSUPPORTED, "\"KHR_materials_sheen\"");
	m = import_built(&b, PLAIN ",'extensionsRequired':['KHR_texture_transform','KHR_mesh_quantization',"
	                     "'KHR_materials_unlit','KHR_materials_pbrSpecularGlossiness','KHR_lights_punctual',"
	                     "'KHR_materials_emissive_strength','KHR_draco_mesh_compression','EXT_texture_webp']");
	assert_string_equal(m->warning, "");
	psr_mesh_destroy(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_texture_keeps_its_own_coordinates_and_sampler),
		cmocka_unit_test(texture_transforms_turn_as_their_specification_says),
		cmocka_unit_test(a_material_of_set_1_leaves_set_0_out),
		cmocka_unit_test(sets_beyond_the_second_take_a_free_place),
		cmocka_unit_test(emission_is_factor_times_strength),
		cmocka_unit_test(specular_glossiness_is_kept_whole),
		cmocka_unit_test(unlit_materials_have_a_base_color_alone),
		cmocka_unit_test(alpha_modes_and_their_cutoff_are_kept),
		cmocka_unit_test(factors_out_of_range_are_put_right),
		cmocka_unit_test(textures_that_change_nothing_are_not_read),
		cmocka_unit_test(extensions_that_are_ignored_are_named),
	};

	return cmocka_run_group_tests_name("import_gltf_material", tests, make_folder, remove_folder);
}
