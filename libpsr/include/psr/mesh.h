/* A mesh in memory: importers and psr_mesh_create() make it, psr_model_build() reads it.
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

/* 8 bits a channel, RGBA, not premultiplied; row 0 is the top. The texture that uses an image decides how to read its
 * colours: sRGB codes in base, emissive, specular-glossiness and vertex colours' textures, linear values in all
 * others. */
struct psr_image {
	uint32_t width, height;
	uint8_t *rgba; /* width * height * 4 */
};

enum psr_wrap { PSR_WRAP_REPEAT, PSR_WRAP_CLAMP, PSR_WRAP_MIRROR };

#define PSR_UV_SETS 2

struct psr_texture {
	int image;          /* index into images; -1: no texture, and the other fields are ignored */
	int uv_set;         /* 0..PSR_UV_SETS - 1; a set that the mesh lacks counts as 0,0 everywhere */
	float transform[6]; /* u' = t[0] u + t[1] v + t[2], v' = t[3] u + t[4] v + t[5] (KHR_texture_transform) */
	enum psr_wrap wrap_s, wrap_t;
	int is_nearest;     /* magnified without interpolation */
};

enum psr_alpha { PSR_ALPHA_OPAQUE, PSR_ALPHA_MASK, PSR_ALPHA_BLEND };

/* glTF 2.0's material (its section 3.9); importers translate other formats to it. Factors are linear. A texture
 * multiplies its factor, channel by channel, unless its comment says otherwise. */
struct psr_material {
	float base_color[4];
	struct psr_texture base_texture;        /* with alpha; specular-glossiness: the diffuse texture */
	float metallic, roughness;
	struct psr_texture metallic_roughness_texture; /* linear; G: roughness, B: metallic */
	float emissive[3];                      /* may exceed 1 */
	struct psr_texture emissive_texture;
	struct psr_texture occlusion_texture;   /* linear; R: 1 is open */
	float occlusion_strength;               /* 0..1 */
	struct psr_texture normal_texture;      /* linear; tangent space, 0..255 is -1..1, +y is up (towards -v) */
	float normal_scale;
	int is_specular_glossiness; /* KHR_materials_pbrSpecularGlossiness: base is diffuse, specular and glossiness
	                             * replace metallic and roughness */
	float specular[3], glossiness;
	struct psr_texture specular_texture;    /* RGB: specular, coded; A: glossiness, linear */
	/* The source's own highlight, of formats without microfacets (OBJ's illum 2): phong * (N.H)^exponent beside the
	 * base colour. Metallic and roughness above are its translation, with 4 % of reflectance. */
	int is_phong;
	float phong[3], phong_exponent; /* 0..1; >= 0 */
	float alpha_cutoff;                     /* MASK: the surface has holes where alpha is less */
	enum psr_alpha alpha;
	int two_sided;                          /* 0: rays that meet the back of a face pass through, as glTF asks */
	int unlit;
};

/* A material that is white, rough, not metallic, opaque, one-sided, without textures. */
void psr_material_default(struct psr_material *material);

/* What there is of an exact surface: a rational B-spline, and triangles in the plane of its parameters, inside of which it
 * is there. It is seen from the side that Su x Sv points to. */
struct psr_patch {
	int degree[2];             /* along u and v */
	uint32_t n[2];             /* control points along u and v, more than the degree */
	double *knot[2];           /* n + degree + 1, which do not fall; the domain is knot[degree]..knot[n] */
	double (*control)[4];      /* n[0] * n[1], v fastest: x, y, z as of the mesh, and the weight, > 0 */
	uint32_t n_corners, n_triangles, material;
	double (*corner)[2];       /* n_corners: u and v, within the domain */
	uint32_t (*triangle)[3];   /* n_triangles, < n_corners: counter-clockwise, u to the right and v up; they do not overlap */
	uint8_t *rim;              /* of each triangle: bit i, the patch ends at the side from corner i to the next; bit
	                            * 3 + i, and nothing goes on there smoothly */
};

/* Faces, and points of a cloud. Primitive i is triangle i, or from n_triangles on the disc around point i -
 * n_triangles. */
struct psr_mesh {
	uint32_t n_vertices, n_triangles, n_points, n_materials, n_images;
	double (*position)[3];          /* n_vertices, finite */
	float (*normal)[3];             /* n_vertices, unit length; 0,0,0 where the source has no normal: the face's own
	                                 * counts */
	float (*tangent)[4]; /* n_vertices, unit length and handedness (+-1), as in glTF; 0,0,0,0 where the source has
	                      * none. NULL: made from uv */
	float (*uv[PSR_UV_SETS])[2];    /* n_vertices, or NULL; v grows downwards, (0,0) is the image's top left, as in
	                                 * glTF */
	float (*color)[4];              /* n_vertices, linear RGBA, multiplies the base colour; or NULL */
	uint32_t (*triangle)[3];        /* n_triangles, each index < n_vertices, counter-clockwise seen from the front */
	uint32_t *triangle_material;    /* n_triangles, < n_materials */

	/* Exact surfaces, if they were asked for and the source has any. A patch's triangles are what else there is of it. */
	uint32_t n_patches;
	struct psr_patch *patch;
	uint32_t *triangle_patch;       /* n_triangles: the patch that the triangle is of, or UINT32_MAX; NULL without patches */

	double (*point)[3];             /* n_points, finite; all five arrays are NULL if there are no points */
	float (*point_normal)[3];       /* unit length */
	float *point_radius;            /* > 0: a disc of this radius, perpendicular to the normal, stands for the
	                                 * point */
	float (*point_color)[4];        /* linear RGBA, multiplies the base colour; or NULL */
	uint32_t *point_material;       /* < n_materials; without textures */

	struct psr_material *material;  /* at least one */
	struct psr_image *image;

	double up[3]; /* unit length: +z for LAS and PCD, for STL, AMF, 3MF, STEP and IGES, and for anything else at survey
	               * coordinates (further from the origin in x or y than ten times its size); +y for the rest, glTF
	               * always */

	uint32_t n_cameras, n_lights;
	struct psr_preset_camera *camera;
	struct psr_preset_light *light;

	/* What the importer repaired. */
	uint32_t n_dropped_triangles;   /* degenerate, repeated, or with a vertex that is not finite */
	uint32_t n_dropped_primitives;  /* lines, and points that are not finite */
	char warning[PSR_ERROR_TEXT];   /* one sentence for a person, or "" */
};

struct psr_import_options {
	double crease; /* radians, 0..pi: where faces without normals of their own meet at a greater angle, the edge
	                * stays sharp */
	int n_threads; /* 1..256; the result does not depend on it */
	int is_preview; /* of more than 131,072 triangles, those smaller than a 128th of the mesh's longest side are merged:
	                 * fast, and fine enough for models of PSR_PREVIEW_RESOLUTION pixels. Thinner things may vanish */
	uint32_t resolution; /* 8..8192: exact surfaces of STEP and IGES become triangles that are fine enough for models of so
	                      * many pixels: they are off by an eighth of one at most */
	int has_patches;     /* surfaces of STEP and IGES become patches, too, unless is_preview; triangles of patches are off
	                      * by half a pixel */
};
#define PSR_PREVIEW_RESOLUTION 64

void psr_import_options_default(struct psr_import_options *options); /* 35 degrees, all cores, no preview, 1024 pixels */

/* Reads any supported file: .gltf and .glb through tinygltf, .ply, .las and .pcd by readers of our own, STEP and
 * IGES through Open CASCADE, whose module psr-cad-occ.so is loaded when the first such file comes, all others through
 * Assimp; images through libpng, or through OpenImageIO, whose module psr-image-oiio.so is loaded when the first
 * such image comes (UNSUPPORTED if it is missing). NULL options are the defaults. The mesh keeps the promises above, has at
 * least one triangle or point, and belongs to the caller (psr_mesh_destroy()). ARG, NOT_FOUND, IO, FORMAT (with the
 * place), UNSUPPORTED (names the extension), LIMIT, MEMORY. Bad input never crashes it. It throws no exception and
 * reads only files in the source's own folder. */
int psr_mesh_import(struct psr_mesh **out, const char *path, const struct psr_import_options *options,
                    struct psr_error *err);

/* Makes a mesh from arrays, which it copies: triangles counter-clockwise seen from the front, +Y up, one white rough
 * material, normals computed as for imported files (smooth up to 35 degrees). Leaves out broken triangles and counts
 * them in n_dropped_triangles. The caller owns the mesh and may change it. FORMAT: an index is out of range, or no
 * triangle has an area; LIMIT, MEMORY. */
int psr_mesh_create(struct psr_mesh **out, const double (*position)[3], uint32_t n_vertices,
                    const uint32_t (*triangle)[3], uint32_t n_triangles, struct psr_error *err);

void psr_mesh_destroy(struct psr_mesh *mesh); /* NULL is fine */

#ifdef __cplusplus
}
#endif
#endif
