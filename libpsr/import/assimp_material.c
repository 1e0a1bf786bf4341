#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <assimp/material.h>
#include "assimp_material.h"
#include "base/srgb.h"

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

/* (2 / (n + 2))^(1/4): the roughness whose Beckmann lobe is as wide as Phong's with exponent n, alpha = roughness^2. */
static float roughness_of(const struct aiMaterial *m)
{
	struct aiColor4D specular;
	float x;

	if (get_float(m, "$mat.roughnessFactor", &x))
		return x;
	if (!get_float(m, "$mat.shininess", &x) || !(x > 0.0f))
		return 1.0f;
	if (aiGetMaterialColor(m, AI_MATKEY_COLOR_SPECULAR, &specular) != aiReturn_SUCCESS ||
	    !(specular.r > 0.0f || specular.g > 0.0f || specular.b > 0.0f))
		return 1.0f;
	return sqrtf(sqrtf(2.0f / (x + 2.0f)));
}

static enum psr_wrap wrap_of(enum aiTextureMapMode mode)
{
	return mode == aiTextureMapMode_Clamp ? PSR_WRAP_CLAMP : mode == aiTextureMapMode_Mirror ? PSR_WRAP_MIRROR
	                                                                                         : PSR_WRAP_REPEAT;
}

/* Takes `path`, whatever happens. */
static int add_image(struct assimp_io *io, const uint8_t *bytes, size_t n_bytes, char *path, const char *name,
                     struct psr_error *err)
{
	char **paths = realloc(io->image_path, ((size_t)io->im->mesh->n_images + 1) * sizeof *paths);
	char place[PSR_ERROR_TEXT];
	int rc;

	if (paths == NULL) {
		free(path);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for an image", name);
	}
	io->image_path = paths;
	snprintf(place, sizeof place, "%.300s: %.150s", io->im->path, name);
	rc = import_mesh_add_image(io->im, bytes, n_bytes, place, err);
	if (rc >= 0)
		paths[rc] = path;
	else
		free(path);
	return rc;
}

static int find_image(const struct assimp_io *io, const char *path)
{
	for (uint32_t i = 0; i < io->im->mesh->n_images; i++)
		if (io->image_path[i] != NULL && strcmp(io->image_path[i], path) == 0)
			return (int)i;
	return -1;
}

static int add_embedded(struct assimp_io *io, const struct aiScene *scene, const char *name, struct psr_error *err)
{
	unsigned long i = strtoul(name + 1, NULL, 10);
	int image = find_image(io, name);

	if (image >= 0)
		return image;
	if (i >= scene->mNumTextures || scene->mTextures[i]->mHeight != 0) {
		import_mesh_warn(io->im, "the embedded texture %lu is missing or not a file, and was left out", i);
		return -1;
	}
	return add_image(io, (const uint8_t *)scene->mTextures[i]->pcData, scene->mTextures[i]->mWidth, strdup(name),
	                 name, err);
}

/* Written on another machine: C:\textures\wood.png and /home/someone/wood.png are looked for beside the source. */
static int find_texture(char **path, const struct assimp_io *io, char *name, struct psr_error *err)
{
	char *base;
	int rc;

	for (char *c = name; *c != '\0'; c++)
		if (*c == '\\')
			*c = '/';
	rc = import_path_inside(path, io->folder, name, err);
	base = strrchr(name, '/');
	if ((rc == PSR_ERR_NOT_FOUND || rc == PSR_ERR_UNSUPPORTED) && base != NULL && base[1] != '\0')
		rc = import_path_inside(path, io->folder, base + 1, err);
	return rc;
}

/* An image's index, -1 with a warning where there is no such file, another negative code for a broken one. */
static int add_texture(struct assimp_io *io, const struct aiScene *scene, struct aiString *name, struct psr_error *err)
{
	char *path;
	uint8_t *bytes;
	size_t n_bytes;
	int rc;

	if (name->data[0] == '*')
		return add_embedded(io, scene, name->data, err);
	if (find_texture(&path, io, name->data, err) != PSR_OK) {
		import_mesh_warn(io->im, "the texture \"%.100s\" is not in the folder of the file and was left out",
		                 name->data);
		return -1;
	}
	rc = find_image(io, path);
	if (rc >= 0) {
		free(path);
		return rc;
	}
	rc = import_file_read(&bytes, &n_bytes, path, IMPORT_MAX_FILE, err);
	if (rc != PSR_OK) {
		free(path);
		return rc;
	}
	rc = add_image(io, bytes, n_bytes, path, name->data, err);
	free(bytes);
	return rc;
}

static int set_texture(struct psr_material *out, struct assimp_io *io, const struct aiScene *scene,
                       const struct aiMaterial *m, int *uv_set, struct psr_error *err)
{
	enum aiTextureType type = aiGetMaterialTextureCount(m, aiTextureType_BASE_COLOR) > 0 ? aiTextureType_BASE_COLOR
	                                                                                      : aiTextureType_DIFFUSE;
	enum aiTextureMapMode mode[3] = { aiTextureMapMode_Wrap, aiTextureMapMode_Wrap, aiTextureMapMode_Wrap };
	enum aiTextureMapping mapping = aiTextureMapping_UV;
	struct aiString name;
	unsigned set = 0;
	int image;

	if (aiGetMaterialTexture(m, type, 0, &name, &mapping, &set, NULL, NULL, mode, NULL) != aiReturn_SUCCESS ||
	    name.length == 0)
		return PSR_OK;
	image = add_texture(io, scene, &name, err);
	if (image < -1)
		return image;
	out->base_texture.image = image;
	out->base_texture.wrap_s = wrap_of(mode[0]);
	out->base_texture.wrap_t = wrap_of(mode[1]);
	if (image >= 0)
		*uv_set = (int)(set < AI_MAX_NUMBER_OF_TEXTURECOORDS ? set : 0);
	return PSR_OK;
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
	out->roughness = roughness_of(m);
	if (get_float(m, "$mat.metallicFactor", &x))
		out->metallic = x;
	if (is_made_up(m)) {
		out->base_color[0] = out->base_color[1] = out->base_color[2] = has_color ? 1.0f : IMPORT_GRAY;
		out->roughness = IMPORT_ROUGHNESS;
	}
	/* Some writers mean "no transparency" by 0. */
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

int assimp_material(struct assimp_io *io, const struct aiScene *scene, unsigned m, int has_color, int *uv_set,
                    struct psr_error *err)
{
	struct psr_material out;
	int rc;

	psr_material_default(&out);
	out.two_sided = 1; /* most of these formats cannot say, and their viewers show both sides */
	*uv_set = -1;
	if (m < scene->mNumMaterials) {
		set_colors(&out, scene->mMaterials[m], has_color);
		rc = set_texture(&out, io, scene, scene->mMaterials[m], uv_set, err);
		if (rc != PSR_OK)
			return rc;
	}
	return import_mesh_add_material(io->im, &out, err);
}
