/* A mesh in memory: what the importers make and the sampler reads.
 *
 * Everything is flattened: node hierarchies and instances are resolved, faces are triangles, positions are in the
 * coordinates of the source file (right-handed, +Y up for glTF; as written for everything else) and stay doubles until
 * the sampler subtracts the model's origin, so that a scan at survey coordinates loses nothing. */
#ifndef PSR_MESH_H
#define PSR_MESH_H

#include <stddef.h>
#include <stdint.h>
#include "error.h"
#include "view.h"

#ifdef __cplusplus
extern "C" {
#endif

/* 8 bits a channel, RGBA, not premultiplied; row 0 is the top. Whether its colours are sRGB-coded or linear is up to
 * the texture that uses it: base, emissive, specular-glossiness and vertex colours' textures are coded, the rest is
 * linear. */
struct psr_image {
	uint32_t width, height;
	uint8_t *rgba; /* width * height * 4 */
};

enum psr_wrap { PSR_WRAP_REPEAT, PSR_WRAP_CLAMP, PSR_WRAP_MIRROR };

#define PSR_UV_SETS 2

struct psr_texture {
	int image;          /* index into images; -1: no texture, and the rest is not read */
	int uv_set;         /* 0..PSR_UV_SETS - 1; a set that the mesh does not have counts as 0,0 everywhere */
	float transform[6]; /* u' = t[0] u + t[1] v + t[2], v' = t[3] u + t[4] v + t[5] (KHR_texture_transform) */
	enum psr_wrap wrap_s, wrap_t;
	int is_nearest;     /* magnified without interpolation */
};

enum psr_alpha { PSR_ALPHA_OPAQUE, PSR_ALPHA_MASK, PSR_ALPHA_BLEND };

/* glTF 2.0's material (its section 3.9), which other formats are translated to. Factors are linear. A texture
 * multiplies its factor, channel by channel, unless said otherwise. */
struct psr_material {
	float base_color[4];
	struct psr_texture base_texture;        /* alpha too; of specular-glossiness: the diffuse texture */
	float metallic, roughness;
	struct psr_texture metallic_roughness_texture; /* linear; G: roughness, B: metallic */
	float emissive[3];                      /* may exceed 1 */
	struct psr_texture emissive_texture;
	struct psr_texture occlusion_texture;   /* linear; R: 1 is open */
	float occlusion_strength;               /* 0..1 */
	struct psr_texture normal_texture;      /* linear; tangent space, 0..255 is -1..1, +y is up (towards -v) */
	float normal_scale;
	int is_specular_glossiness; /* KHR_materials_pbrSpecularGlossiness: base is diffuse, these are read, metallic
	                             * and roughness are not */
	float specular[3], glossiness;
	struct psr_texture specular_texture;    /* RGB: specular, coded; A: glossiness, linear */
	float alpha_cutoff;                     /* MASK: below it there is nothing */
	enum psr_alpha alpha;
	int two_sided;                          /* 0: rays that meet the back of a face go on, as glTF asks */
	int unlit;
};

/* A material that is white, rough, not metallic, opaque, one-sided, without textures. */
void psr_material_default(struct psr_material *material);

/* Faces, and points of a cloud. Primitive i is triangle i, or from n_triangles on the disc around point i -
 * n_triangles. */
struct psr_mesh {
	uint32_t n_vertices, n_triangles, n_points, n_materials, n_images;
	double (*position)[3];          /* n_vertices, finite */
	float (*normal)[3];             /* n_vertices, unit length; 0,0,0 where the source has none: the face's own is
	                                 * taken */
	float (*tangent)[4]; /* n_vertices, unit length and handedness (+-1), as in glTF; 0,0,0,0 where the source has
	                      * none; or NULL: made of uv */
	float (*uv[PSR_UV_SETS])[2];    /* n_vertices, or NULL; v grows downwards, (0,0) is the image's top left, as in
	                                 * glTF */
	float (*color)[4];              /* n_vertices, linear RGBA, multiplies the base colour; or NULL */
	uint32_t (*triangle)[3];        /* n_triangles, each index < n_vertices, counter-clockwise seen from the front */
	uint32_t *triangle_material;    /* n_triangles, < n_materials */

	double (*point)[3];             /* n_points, finite; NULL if there are none, like the rest of them */
	float (*point_normal)[3];       /* unit length */
	float *point_radius;            /* > 0: a disc of this radius, perpendicular to the normal, takes the point's
	                                 * place */
	float (*point_color)[4];        /* linear RGBA, multiplies the base colour; or NULL */
	uint32_t *point_material;       /* < n_materials; without textures */

	struct psr_material *material;  /* at least one */
	struct psr_image *image;

	double up[3]; /* unit length: +y of glTF; +z of clouds of LAS, of STL, AMF and 3MF, and of all else at survey
	               * coordinates, further from the origin in x or y than ten times its size; else +y */

	uint32_t n_cameras, n_lights;
	struct psr_preset_camera *camera;
	struct psr_preset_light *light;

	/* What was repaired or left out while importing, for the report; never silent. */
	uint32_t n_dropped_triangles;   /* degenerate, twice there, or with a vertex that is not finite */
	uint32_t n_dropped_primitives;  /* lines, and points that are not finite */
	char warning[PSR_ERROR_TEXT];   /* one sentence for a person, or "" */
};

struct psr_import_options {
	double crease; /* radians, 0..pi: faces without normals of their own that meet at a greater angle keep their edge */
	int n_threads; /* 1..256; the result does not depend on it */
};
void psr_import_options_default(struct psr_import_options *options); /* 35 degrees, all cores */

/* Reads any supported file: .gltf and .glb through tinygltf, .ply and .las by readers of our own, all else through
 * Assimp; images through libpng, or through OpenImageIO, whose module psr-image-oiio.so is opened for the first of
 * them (UNSUPPORTED if it is missing). Options of NULL are the defaults. The result is validated as the comments
 * above promise, has at least one triangle or point, and belongs to the caller. ARG, NOT_FOUND, IO, FORMAT (with the
 * place), UNSUPPORTED (names the extension), LIMIT, MEMORY. Never crashes on bad input, throws nothing, reads nothing
 * outside of the file's own folder. */
int psr_mesh_import(struct psr_mesh **out, const char *path, const struct psr_import_options *options,
                    struct psr_error *err);

/* A mesh of the caller's arrays, which are copied: triangles counter-clockwise seen from the front, +Y up, one white
 * rough material, normals as import computes them (smooth up to 35 degrees). Broken triangles are left out, see
 * n_dropped_triangles. The mesh is the caller's, to change and to destroy. FORMAT: an index out of range, or no triangle
 * with an area; LIMIT, MEMORY. */
int psr_mesh_create(struct psr_mesh **out, const double (*position)[3], uint32_t n_vertices,
                    const uint32_t (*triangle)[3], uint32_t n_triangles, struct psr_error *err);

void psr_mesh_destroy(struct psr_mesh *mesh); /* NULL is fine */

#ifdef __cplusplus
}
#endif
#endif
