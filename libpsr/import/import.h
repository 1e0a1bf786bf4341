/* What the files of this folder share: the mesh under construction, files and paths, images, and the four readers.
 *
 * Everything that a source file names is looked up by import_path_inside: it lies, symbolic links resolved, in the
 * folder of the source file or below it. Limits below bound what a small file can make the importer allocate. */
#ifndef PSR_IMPORT_H
#define PSR_IMPORT_H

#include <locale.h>
#include <stddef.h>
#include <stdint.h>
#include "psr/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

#define IMPORT_MAX_FILE 0xffffffffull         /* bytes of one file; a .glb cannot say more */
#define IMPORT_MAX_VERTICES (UINT64_C(1) << 27)
#define IMPORT_MAX_TRIANGLES (UINT64_C(1) << 28)
#define IMPORT_MAX_POINTS (UINT64_C(1) << 27)
#define IMPORT_MAX_IMAGE_SIDE 16384
#define IMPORT_MAX_PIXELS (UINT64_C(1) << 28) /* of all images of one mesh */
#define IMPORT_MAX_MATERIALS 65536
#define IMPORT_GRAY 0.6f      /* linear; of what has no color */
#define IMPORT_ROUGHNESS 0.5f /* of surfaces without a material */

/* mesh.c: a mesh that grows. `mesh` is owned until import_mesh_finish hands it over. */
struct import_mesh {
	struct psr_mesh *mesh;
	const char *path; /* of the source file, for error texts; the caller's */
	struct psr_import_options options;
	uint64_t vertex_capacity, triangle_capacity, point_capacity;
	uint64_t n_pixels;
};

int import_mesh_init(struct import_mesh *im, const char *path, struct psr_error *err); /* with the default options */
void import_mesh_fini(struct import_mesh *im);

/* What vertices may have beside a position and a normal. */
enum {
	IMPORT_HAS_UV0 = 1, /* IMPORT_HAS_UV0 << set */
	IMPORT_HAS_UV1 = 2,
	IMPORT_HAS_TANGENT = 4,
	IMPORT_HAS_COLOR = 8,
};

/* Adds vertices (all 0, color 1,1,1,1) and triangles (all 0) at the end. uv, tangent and color exist from the first
 * call whose `has`, a sum of IMPORT_HAS_*, asks for them. LIMIT, MEMORY. */
int import_mesh_grow(struct import_mesh *im, uint64_t n_vertices, uint64_t n_triangles, unsigned has,
                     struct psr_error *err);

/* Adds points (all 0, color 1,1,1,1) at the end. point_color exists from the first call with has_color. A radius of 0
 * and a normal of 0,0,0 are filled in before the mesh is handed over. LIMIT, MEMORY. */
int import_mesh_grow_points(struct import_mesh *im, uint64_t n_points, int has_color, struct psr_error *err);

/* The arrays that exist with an element a vertex: where the pointer is (a float (**)[3] or the like), and the bytes of
 * an element; position and normal come first. Returns how many. */
#define IMPORT_MAX_COLUMNS (4 + PSR_UV_SETS)
struct import_column {
	void *array;
	size_t size;
};
int import_vertex_columns(struct import_column out[IMPORT_MAX_COLUMNS], struct psr_mesh *mesh);
int import_point_columns(struct import_column out[IMPORT_MAX_COLUMNS], struct psr_mesh *mesh);
void *import_column_at(const struct import_column *column, uint64_t i);

/* Return the index of what was added, or a negative code. `name` is what error texts call the image. */
int import_mesh_add_material(struct import_mesh *im, const struct psr_material *material, struct psr_error *err);
int import_mesh_add_image(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, const char *name,
                          struct psr_error *err);
int import_mesh_add_pixels(struct import_mesh *im, struct psr_image *image, struct psr_error *err); /* takes the pixels,
                                                                                                     * on failure too */

/* presets.c: adds what a client can ask for by name. A name is made printable, short enough (cut at a character) and
 * unlike the others of its kind; "" becomes "camera 1" or "light 1", and so on. Beyond PSR_MAX_PRESETS nothing is
 * added, with a warning. MEMORY. */
int import_mesh_add_camera(struct import_mesh *im, const char *name, const struct psr_camera *camera,
                           struct psr_error *err);
int import_mesh_add_light(struct import_mesh *im, const char *name, const struct psr_light *light,
                          struct psr_error *err);

/* Adds to the mesh's warning, separated by "; "; the same text is said once, and what does not fit is left out. */
void import_mesh_warn(struct import_mesh *im, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Repairs and checks what psr/mesh.h promises (drops triangles and points, unit normals, no unused vertex), then hands
 * the mesh to *out. FORMAT for an index out of range or a mesh without a triangle and a point. */
int import_mesh_finish(struct psr_mesh **out, struct import_mesh *im, struct psr_error *err);

/* repair.c: the first half of import_mesh_finish; leaves n_triangles and n_points possibly 0. Radii of points stay as
 * they are, their normals get unit length or stay 0. */
int import_mesh_repair(struct import_mesh *im, struct psr_error *err);

/* duplicates.c: drops each triangle that has the positions, the winding and the material of one before it; returns
 * their number in *n_dropped. No index is out of range. MEMORY. */
int import_mesh_drop_duplicates(uint32_t *n_dropped, struct import_mesh *im, struct psr_error *err);

/* material.c: puts factors and transforms that are not finite, or out of range, right; drops images that no material
 * uses. */
void import_material_tidy(struct psr_material *material);
int import_mesh_drop_images(struct import_mesh *im, struct psr_error *err);

/* weld.c: *first_of[v] is the first vertex that is the same as v: at its position; nearly there, to within 2^-22 of the
 * mesh's longest side (some that are as near count as apart); or with everything the same. The caller frees. */
enum import_same { IMPORT_SAME_POSITION, IMPORT_SAME_NEARLY, IMPORT_SAME_ALL };
int import_mesh_groups(uint32_t **first_of, const struct import_mesh *im, enum import_same same,
                       struct psr_error *err);
int import_mesh_weld(struct import_mesh *im, struct psr_error *err); /* leaves the others unused */

/* normals.c: smooth vertex normals for the triangles whose vertices have none. A vertex whose corners need several is
 * split: the others come at the end. MEMORY, LIMIT. */
int import_mesh_smooth(struct import_mesh *im, struct psr_error *err);

/* import/cloud/cloud.c: called by import_mesh_finish where there are points, which are finite: drops all but one of those at one
 * place, then fills in radii and normals where they are 0. Outwards or upwards, as far as it can be told. MEMORY. */
int import_cloud_finish(struct import_mesh *im, struct psr_error *err);

/* path.c. The strings belong to the caller (free). */
int import_path_folder(char **folder, const char *path, struct psr_error *err); /* resolved, no slash at the end */

/* The resolved path of `name`, which is absolute or relative to `folder`. NOT_FOUND; UNSUPPORTED when it leads
 * outside. */
int import_path_inside(char **out, const char *folder, const char *name, struct psr_error *err);

/* number.c: a word of text as the nearest double; 0 if it is no number. "nan", "inf" and what C writes are; `locale` is
 * "C". */
int import_number(double *x, const uint8_t *word, size_t n, locale_t locale);

/* import/image/image.c: decodes by magic (TGA, which has none, by the ending of `name`), through base/image_module.h. FORMAT,
 * UNSUPPORTED, LIMIT, MEMORY, and what opening the module returns. */
int import_image_decode(struct psr_image *out, const uint8_t *bytes, size_t n_bytes, const char *name,
                        uint64_t max_pixels, struct psr_error *err);

/* import/image/image_png.c: the most common kind by libpng, without the module, which takes a quarter of a second to open: PNG of 8
 * bits, RGB with or without alpha, not interlaced. The same pixels. 0 if it is another kind, over a limit or broken:
 * then *out is not touched, and the module says what it is. */
int import_image_plain_png(struct psr_image *out, const uint8_t *bytes, size_t n_bytes, uint64_t max_pixels);

/* The readers. `bytes` is the source file itself; all leave an unfinished mesh in im. */
int import_gltf(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
int import_assimp(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
int import_ply(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
int import_las(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
