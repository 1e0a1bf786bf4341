/* A mesh in memory: what the importers make and the sampler reads.
 *
 * Everything is flattened: node hierarchies and instances are resolved, faces are triangles, positions are in the
 * coordinates of the source file (right-handed, +Y up for glTF; as written for everything else) and stay doubles until
 * the sampler subtracts the model's origin, so that a scan at survey coordinates loses nothing. */
#ifndef PSR_MESH_H
#define PSR_MESH_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* 8 bits a channel, RGBA, not premultiplied, sRGB-coded; row 0 is the top. */
struct psr_image {
	uint32_t width, height;
	uint8_t *rgba; /* width * height * 4 */
};

enum psr_wrap { PSR_WRAP_REPEAT, PSR_WRAP_CLAMP, PSR_WRAP_MIRROR };

struct psr_texture {
	int image; /* index into images; -1: no texture */
	enum psr_wrap wrap_s, wrap_t;
};

enum psr_alpha { PSR_ALPHA_OPAQUE, PSR_ALPHA_MASK, PSR_ALPHA_BLEND };

/* glTF's metallic-roughness, which other formats are translated to. Factors are linear. */
struct psr_material {
	float base_color[4];
	struct psr_texture base_texture; /* multiplies base_color; alpha too */
	float metallic, roughness;
	float alpha_cutoff;              /* MASK: below it there is nothing */
	enum psr_alpha alpha;
	int two_sided;                   /* 0: rays that meet the back of a face go on, as glTF asks */
	int unlit;
};

struct psr_mesh {
	uint32_t n_vertices, n_triangles, n_materials, n_images;
	double (*position)[3];          /* n_vertices, finite */
	float (*normal)[3];             /* n_vertices, unit length; 0,0,0 where the source has none: the face's own is taken */
	float (*uv)[2];                 /* n_vertices, or NULL; v grows downwards, (0,0) is the image's top left, as in glTF */
	float (*color)[4];              /* n_vertices, linear RGBA, multiplies the base colour; or NULL */
	uint32_t (*triangle)[3];        /* n_triangles, each index < n_vertices, counter-clockwise seen from the front */
	uint32_t *triangle_material;    /* n_triangles, < n_materials */
	struct psr_material *material;  /* at least one */
	struct psr_image *image;

	/* What was repaired or left out while importing, for the report; never silent. */
	uint32_t n_dropped_triangles;   /* degenerate, or with a vertex that is not finite */
	uint32_t n_dropped_primitives;  /* points and lines */
	char warning[PSR_ERROR_TEXT];   /* one sentence for a person, or "" */
};

/* Reads any supported file: .gltf and .glb through tinygltf, all else through Assimp; images through OpenImageIO.
 * The result is validated as the comments above promise, has at least one triangle, and belongs to the caller.
 * NOT_FOUND, IO, FORMAT (with the place), UNSUPPORTED (names the extension), LIMIT, MEMORY. Never crashes on bad
 * input, throws nothing, reads nothing outside of the file's own folder. */
int psr_mesh_import(struct psr_mesh **out, const char *path, struct psr_error *err);

void psr_mesh_destroy(struct psr_mesh *mesh); /* NULL is fine */

#ifdef __cplusplus
}
#endif
#endif
