#include <math.h>
#include <string.h>
#include <assimp/material.h>
#include "material.h"
#include "texture.h"
#include "base/srgb.h"
#include "import/image/image_kind.h"

float assimp_linear(float c)
{
	int code = c > 0.0f ? c < 1.0f ? (int)(c * 255.0f + 0.5f) : 255 : 0;

	return psr_srgb_to_linear[code];
}

static int get_float(const struct aiMaterial *m, const char *key, float *x)
{
	unsigned n = 1;

	return aiGetMaterialFloatArray(m, key, 0, 0, x, &n) == aiReturn_SUCCESS && n == 1 && isfinite(*x);
}

static int is_made_up(const struct aiMaterial *m)
{
	struct aiString name;

	return aiGetMaterialString(m, AI_MATKEY_NAME, &name) != aiReturn_SUCCESS || name.length == 0 ||
	       strcmp(name.data, AI_DEFAULT_MATERIAL_NAME) == 0;
}

/* Takes the highlight of formats without a roughness, which becomes (2 / (n + 2))^(1/4): its Beckmann lobe is as wide
 * as that of the exponent n, alpha = roughness^2. */
static void set_highlight(struct psr_material *out, const struct aiMaterial *m)
{
	struct aiColor4D specular;
	float x;

	out->roughness = 1.0f;
	if (get_float(m, "$mat.roughnessFactor", &x)) {
		out->roughness = x;
		return;
	}
	if (aiGetMaterialTextureCount(m, aiTextureType_DIFFUSE_ROUGHNESS) > 0)
		return;
	if (!get_float(m, "$mat.shininess", &x) || !(x > 0.0f))
		return;
	if (aiGetMaterialColor(m, AI_MATKEY_COLOR_SPECULAR, &specular) != aiReturn_SUCCESS ||
	    !(specular.r > 0.0f || specular.g > 0.0f || specular.b > 0.0f))
		return;
	out->roughness = sqrtf(sqrtf(2.0f / (x + 2.0f)));
	out->is_phong = 1;
	out->phong[0] = assimp_linear(specular.r);
	out->phong[1] = assimp_linear(specular.g);
	out->phong[2] = assimp_linear(specular.b);
	out->phong_exponent = x;
}

static void set_colors(struct psr_material *out, const struct aiMaterial *m, int has_color)
{
	struct aiColor4D color;
	int mode = 0;
	unsigned n = 1;
	float x;

	if (aiGetMaterialColor(m, AI_MATKEY_BASE_COLOR, &color) == aiReturn_SUCCESS) {
		out->base_color[0] = color.r;
		out->base_color[1] = color.g;
		out->base_color[2] = color.b;
	} else if (aiGetMaterialColor(m, AI_MATKEY_COLOR_DIFFUSE, &color) == aiReturn_SUCCESS) {
		out->base_color[0] = assimp_linear(color.r);
		out->base_color[1] = assimp_linear(color.g);
		out->base_color[2] = assimp_linear(color.b);
	}
	set_highlight(out, m);
	if (get_float(m, "$mat.metallicFactor", &x))
		out->metallic = x;
	else if (aiGetMaterialTextureCount(m, aiTextureType_METALNESS) > 0)
		out->metallic = 1.0f;
	if (is_made_up(m)) {
		out->base_color[0] = out->base_color[1] = out->base_color[2] = has_color ? 1.0f : IMPORT_GRAY;
		out->roughness = IMPORT_ROUGHNESS;
		out->is_phong = 0;
	}
	/* Some writers mean "opaque" by 0. */
	if (get_float(m, "$mat.opacity", &x) && x > 0.0f && x < 1.0f) {
		out->base_color[3] = x;
		out->alpha = PSR_ALPHA_BLEND;
	}
	if (aiGetMaterialIntegerArray(m, AI_MATKEY_SHADING_MODEL, &mode, &n) == aiReturn_SUCCESS && n == 1)
		out->unlit = mode == (int)aiShadingMode_NoShading;
	n = 1;
	if (aiGetMaterialIntegerArray(m, AI_MATKEY_TWOSIDED, &mode, &n) == aiReturn_SUCCESS && n == 1)
		out->two_sided = mode != 0;
}

static int has_texture(const struct aiMaterial *m, enum aiTextureType type)
{
	return aiGetMaterialTextureCount(m, type) > 0;
}

/* Many files use bump maps, heights by name, for normals. */
static int set_relief(struct psr_material *out, struct assimp_io *io, const struct aiMaterial *m,
                      int uv_source[PSR_UV_SETS], struct psr_error *err)
{
	static const enum aiTextureType types[] = { aiTextureType_NORMALS, aiTextureType_NORMAL_CAMERA,
		                                    aiTextureType_HEIGHT };

	for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
		struct psr_texture t = out->normal_texture;
		int source[PSR_UV_SETS], rc;

		memcpy(source, uv_source, sizeof source);
		rc = assimp_texture(&t, io, m, types[i], source, err);
		if (rc != PSR_OK)
			return rc;
		if (t.image >= 0 && image_is_normal_map(&io->im->mesh->image[t.image])) {
			out->normal_texture = t;
			memcpy(uv_source, source, sizeof source);
			return PSR_OK;
		}
		if (t.image >= 0)
			import_mesh_warn(io->im, "bump maps that hold heights were left out");
	}
	return PSR_OK;
}

static int set_emission(struct psr_material *out, struct assimp_io *io, const struct aiMaterial *m,
                        int uv_source[PSR_UV_SETS], struct psr_error *err)
{
	struct aiColor4D color;
	int rc;

	if (aiGetMaterialColor(m, AI_MATKEY_COLOR_EMISSIVE, &color) == aiReturn_SUCCESS) {
		out->emissive[0] = assimp_linear(color.r);
		out->emissive[1] = assimp_linear(color.g);
		out->emissive[2] = assimp_linear(color.b);
	}
	rc = assimp_texture(&out->emissive_texture, io, m,
	                    has_texture(m, aiTextureType_EMISSION_COLOR) ? aiTextureType_EMISSION_COLOR
	                                                                 : aiTextureType_EMISSIVE,
	                    uv_source, err);
	/* A map with no color or black counts unchanged. */
	if (out->emissive_texture.image >= 0 && out->emissive[0] <= 0.0f && out->emissive[1] <= 0.0f &&
	    out->emissive[2] <= 0.0f)
		out->emissive[0] = out->emissive[1] = out->emissive[2] = 1.0f;
	return rc;
}

static int set_base(struct psr_material *out, struct assimp_io *io, const struct aiMaterial *m,
                    int uv_source[PSR_UV_SETS], struct psr_error *err)
{
	struct psr_texture opacity = out->base_texture;
	int rc = assimp_texture(&out->base_texture, io, m,
	                        has_texture(m, aiTextureType_BASE_COLOR) ? aiTextureType_BASE_COLOR : aiTextureType_DIFFUSE,
	                        uv_source, err);

	if (rc == PSR_OK)
		rc = assimp_texture(&opacity, io, m, aiTextureType_OPACITY, uv_source, err);
	if (rc != PSR_OK)
		return rc;
	if (opacity.image >= 0)
		return assimp_opacity(out, io, &opacity, err);
	/* Leaves and fences often use their texture's alpha alone. */
	if (out->base_texture.image >= 0 && out->alpha == PSR_ALPHA_OPAQUE &&
	    image_is_cutout(&io->im->mesh->image[out->base_texture.image]))
		out->alpha = PSR_ALPHA_MASK;
	return PSR_OK;
}

static int set_textures(struct psr_material *out, struct assimp_io *io, const struct aiMaterial *m,
                        int uv_source[PSR_UV_SETS], struct psr_error *err)
{
	struct psr_texture metallic = out->base_texture, roughness = out->base_texture;
	int rc = set_base(out, io, m, uv_source, err);

	if (rc != PSR_OK || out->unlit)
		return rc;
	rc = set_relief(out, io, m, uv_source, err);
	if (rc == PSR_OK)
		rc = set_emission(out, io, m, uv_source, err);
	if (rc == PSR_OK)
		rc = assimp_texture(&metallic, io, m, aiTextureType_METALNESS, uv_source, err);
	if (rc == PSR_OK)
		rc = assimp_texture(&roughness, io, m, aiTextureType_DIFFUSE_ROUGHNESS, uv_source, err);
	if (rc == PSR_OK)
		rc = assimp_metallic_roughness(out, io, &metallic, &roughness, err);
	return rc;
}

int assimp_material(struct assimp_io *io, unsigned m, int has_color, int uv_source[PSR_UV_SETS],
                    struct psr_error *err)
{
	const struct aiScene *scene = io->scene;
	struct psr_material out;
	int rc;

	psr_material_default(&out);
	out.two_sided = 1; /* most formats do not tell, and viewers show both sides */
	for (int set = 0; set < PSR_UV_SETS; set++)
		uv_source[set] = -1;
	if (m < scene->mNumMaterials) {
		set_colors(&out, scene->mMaterials[m], has_color);
		rc = set_textures(&out, io, scene->mMaterials[m], uv_source, err);
		if (rc != PSR_OK)
			return rc;
	}
	return import_mesh_add_material(io->im, &out, err);
}
