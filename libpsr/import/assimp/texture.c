#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/infile.h"
#include "texture.h"
#include "import/image/image_kind.h"

static enum psr_wrap wrap_of(enum aiTextureMapMode mode)
{
	return mode == aiTextureMapMode_Clamp ? PSR_WRAP_CLAMP : mode == aiTextureMapMode_Mirror ? PSR_WRAP_MIRROR
	                                                                                         : PSR_WRAP_REPEAT;
}

/* Takes ownership of `path`, on failure too. */
static int add_image(struct assimp_io *io, const uint8_t *bytes, size_t n_bytes, char *path, const char *name,
                     struct psr_error *err)
{
	char place[PSR_ERROR_TEXT];
	int rc;

	if (!import_resize(&io->image_path, (uint64_t)io->im->mesh->n_images + 1, sizeof *io->image_path)) {
		free(path);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for an image", name);
	}
	snprintf(place, sizeof place, "%.300s: %.150s", io->im->path, name);
	rc = import_mesh_add_image(io->im, bytes, n_bytes, place, err);
	if (rc >= 0)
		io->image_path[rc] = path;
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

static int add_embedded(struct assimp_io *io, const char *name, struct psr_error *err)
{
	const struct aiScene *scene = io->scene;
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

/* Looks for files of other machines, like C:\textures\wood.png or /home/someone/wood.png, beside the source. */
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

/* Returns an image's index; -1 with a warning if the file is missing; another negative code if it is broken. */
static int find_or_add(struct assimp_io *io, struct aiString *name, struct psr_error *err)
{
	char *path;
	uint8_t *bytes;
	size_t n_bytes;
	int rc;

	if (name->data[0] == '*')
		return add_embedded(io, name->data, err);
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
	rc = infile_read(&bytes, &n_bytes, path, IMPORT_MAX_FILE, err);
	if (rc != PSR_OK) {
		free(path);
		return rc;
	}
	rc = add_image(io, bytes, n_bytes, path, name->data, err);
	free(bytes);
	return rc;
}

/* Returns the mesh's set for the scene's set n: n if possible, else another free one; -1: none is free. */
static int take_set(int source[PSR_UV_SETS], int n)
{
	for (int set = 0; set < PSR_UV_SETS; set++)
		if (source[set] == n)
			return set;
	for (int k = 0; k < PSR_UV_SETS; k++) {
		int set = n < PSR_UV_SETS ? (n + k) % PSR_UV_SETS : k;

		if (source[set] < 0) {
			source[set] = n;
			return set;
		}
	}
	return -1;
}

/* Assimp's v points up: v' = 1 - (s (1 - v) + t). */
static void set_transform(struct psr_texture *out, struct assimp_io *io, const struct aiMaterial *m,
                          enum aiTextureType type)
{
	struct aiUVTransform t;

	if (aiGetMaterialUVTransform(m, AI_MATKEY_UVTRANSFORM(type, 0), &t) != aiReturn_SUCCESS)
		return;
	if (t.mRotation != 0.0f)
		import_mesh_warn(io->im, "textures are not rotated");
	out->transform[0] = t.mScaling.x;
	out->transform[2] = t.mTranslation.x;
	out->transform[4] = t.mScaling.y;
	out->transform[5] = 1.0f - t.mScaling.y - t.mTranslation.y;
}

int assimp_texture(struct psr_texture *out, struct assimp_io *io, const struct aiMaterial *m, enum aiTextureType type,
                   int uv_source[PSR_UV_SETS], struct psr_error *err)
{
	enum aiTextureMapMode mode[3] = { aiTextureMapMode_Wrap, aiTextureMapMode_Wrap, aiTextureMapMode_Wrap };
	enum aiTextureMapping mapping = aiTextureMapping_UV;
	struct aiString name;
	unsigned set = 0;
	int image;

	if (aiGetMaterialTexture(m, type, 0, &name, &mapping, &set, NULL, NULL, mode, NULL) != aiReturn_SUCCESS ||
	    name.length == 0)
		return PSR_OK;
	if (mapping != aiTextureMapping_UV) {
		import_mesh_warn(io->im, "the texture \"%.100s\" has no coordinates and was left out", name.data);
		return PSR_OK;
	}
	image = find_or_add(io, &name, err);
	if (image < 0)
		return image == -1 ? PSR_OK : image;
	out->uv_set = take_set(uv_source, set < AI_MAX_NUMBER_OF_TEXTURECOORDS ? (int)set : 0);
	if (out->uv_set < 0) {
		out->uv_set = 0;
		import_mesh_warn(io->im, "the texture \"%.100s\" was left out: its material uses more than %d sets of "
		                 "coordinates", name.data, PSR_UV_SETS);
		return PSR_OK;
	}
	out->image = image;
	out->wrap_s = wrap_of(mode[0]);
	out->wrap_t = wrap_of(mode[1]);
	set_transform(out, io, m, type);
	return PSR_OK;
}

/* Returns the image that `make` makes of images a and b (-1: none). Makes each pair once. */
static int add_made(struct assimp_io *io, int a, int b, const char *kind,
                    int (*make)(struct psr_image *, const struct psr_image *, const struct psr_image *),
                    struct psr_error *err)
{
	const struct psr_mesh *mesh = io->im->mesh;
	struct psr_image image;
	char key[64], *copy;
	int rc;

	snprintf(key, sizeof key, "%s of %d and %d", kind, a, b); /* paths begin with a slash or a star */
	rc = find_image(io, key);
	if (rc >= 0)
		return rc;
	copy = strdup(key);
	if (copy == NULL || !import_resize(&io->image_path, (uint64_t)mesh->n_images + 1, sizeof *io->image_path) ||
	    !make(&image, a < 0 ? NULL : &mesh->image[a], b < 0 ? NULL : &mesh->image[b])) {
		free(copy);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for an image", io->im->path);
	}
	rc = import_mesh_add_pixels(io->im, &image, err);
	if (rc >= 0)
		io->image_path[rc] = copy;
	else
		free(copy);
	return rc;
}

int assimp_opacity(struct psr_material *out, struct assimp_io *io, const struct psr_texture *opacity,
                   struct psr_error *err)
{
	int base = out->base_texture.image, image;

	if (base >= 0 && opacity->uv_set != out->base_texture.uv_set) {
		import_mesh_warn(io->im, "an opacity map with coordinates of its own was left out");
		return PSR_OK;
	}
	if (base < 0)
		out->base_texture = *opacity;
	image = add_made(io, base, opacity->image, "opacity", image_with_opacity, err);
	if (image < 0)
		return image;
	out->base_texture.image = image;
	out->alpha = image_is_cutout(&io->im->mesh->image[image]) ? PSR_ALPHA_MASK : PSR_ALPHA_BLEND;
	return PSR_OK;
}

int assimp_metallic_roughness(struct psr_material *out, struct assimp_io *io, const struct psr_texture *metallic,
                              const struct psr_texture *roughness, struct psr_error *err)
{
	int image, metal = metallic->image;

	if (metal < 0 && roughness->image < 0)
		return PSR_OK;
	if (metal >= 0 && roughness->image >= 0 && metallic->uv_set != roughness->uv_set) {
		import_mesh_warn(io->im, "a metallic map with coordinates of its own was left out");
		metal = -1;
	}
	out->metallic_roughness_texture = roughness->image >= 0 ? *roughness : *metallic;
	image = add_made(io, metal, roughness->image, "metal", image_metallic_roughness, err);
	if (image < 0)
		return image;
	out->metallic_roughness_texture.image = image;
	return PSR_OK;
}
