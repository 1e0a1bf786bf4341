/* The import of mesh files: the mesh under construction, files and paths, images, and the six readers. import.c knows
 * the order of the steps.
 *
 * Readers open files that the source file names through import_path_inside alone, which refuses paths outside of the
 * source's folder, symbolic links resolved. The limits below bound the memory that a small file can claim. */
#ifndef PSR_IMPORT_H
#define PSR_IMPORT_H

#include <locale.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include "psr/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

#define IMPORT_MAX_FILE 0xffffffffull         /* bytes of one file; also the limit of .glb */
#define IMPORT_MAX_VERTICES (UINT64_C(1) << 27)
#define IMPORT_MAX_TRIANGLES (UINT64_C(1) << 28)
#define IMPORT_MAX_POINTS (UINT64_C(1) << 27)
#define IMPORT_MAX_IMAGE_SIDE 16384
#define IMPORT_MAX_PIXELS (UINT64_C(1) << 28) /* of all images of one mesh */
#define IMPORT_MAX_MATERIALS 65536
#define IMPORT_GRAY 0.6f      /* linear; of surfaces without colour */
#define IMPORT_ROUGHNESS 0.5f /* of surfaces without a material */

/* mesh.c: a growing mesh. Owns `mesh` until import_mesh_finish hands it over. */
struct import_mesh {
	struct psr_mesh *mesh;
	const char *path; /* of the source file, for error texts; not owned */
	struct psr_import_options options;
	uint64_t vertex_capacity, triangle_capacity, point_capacity;
	uint64_t n_pixels;
	int is_cut; /* triangles are not the file's own: those without an area, at poles, are left out untold */
};

int import_mesh_init(struct import_mesh *im, const char *path, struct psr_error *err); /* with the default options */
void import_mesh_fini(struct import_mesh *im);

/* Optional attributes of vertices; position and normal always exist. */
enum {
	IMPORT_HAS_UV0 = 1, /* IMPORT_HAS_UV0 << set */
	IMPORT_HAS_UV1 = 2,
	IMPORT_HAS_TANGENT = 4,
	IMPORT_HAS_COLOR = 8,
};

/* Appends vertices (all 0, color 1,1,1,1) and triangles (all 0). Creates uv, tangent and color when `has`, a sum of
 * IMPORT_HAS_*, first asks for them. LIMIT, MEMORY. */
int import_mesh_grow(struct import_mesh *im, uint64_t n_vertices, uint64_t n_triangles, unsigned has,
                     struct psr_error *err);

/* Appends points (all 0, color 1,1,1,1). Creates point_color at the first call with has_color. import_mesh_finish
 * replaces radii of 0 and normals of 0,0,0. LIMIT, MEMORY. */
int import_mesh_grow_points(struct import_mesh *im, uint64_t n_points, int has_color, struct psr_error *err);

/* Lists the existing arrays with an element a vertex, position and normal first: the address of the pointer (a
 * float (**)[3] or the like), and the bytes of an element. Returns how many. */
#define IMPORT_MAX_COLUMNS (4 + PSR_UV_SETS)
struct import_column {
	void *array;
	size_t size;
};
int import_vertex_columns(struct import_column out[IMPORT_MAX_COLUMNS], struct psr_mesh *mesh);
int import_point_columns(struct import_column out[IMPORT_MAX_COLUMNS], struct psr_mesh *mesh);
void *import_column_at(const struct import_column *column, uint64_t i);

/* Changes the size of *array, a pointer of any type, to n elements. Returns 0 without memory; *array stays valid then.
 * Within the limits above n * size cannot overflow. */
int import_resize(void *array, uint64_t n, size_t size);

/* Finds the bounds of all vertices and points; infinite if there are none. */
void import_mesh_bounds(double low[3], double high[3], const struct psr_mesh *mesh);

/* Return the index of the new element, or a negative code. `name` stands for the image in error texts. */
int import_mesh_add_material(struct import_mesh *im, const struct psr_material *material, struct psr_error *err);
int import_mesh_add_image(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, const char *name,
                          struct psr_error *err);
/* Takes ownership of the pixels, on failure too. */
int import_mesh_add_pixels(struct import_mesh *im, struct psr_image *image, struct psr_error *err);

/* presets.c: adds cameras and lights that clients choose by name. Makes the name printable, short (cut between
 * characters) and unique among its kind; "" becomes "camera 1", "light 1", and so on. After PSR_MAX_PRESETS, warns and
 * adds nothing. MEMORY. */
int import_mesh_add_camera(struct import_mesh *im, const char *name, const struct psr_camera *camera,
                           struct psr_error *err);
int import_mesh_add_light(struct import_mesh *im, const char *name, const struct psr_light *light,
                          struct psr_error *err);

/* Appends to the mesh's warning after "; ". Skips a text that is there already or does not fit. */
void import_mesh_warn(struct import_mesh *im, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Makes the mesh keep the promises of psr/mesh.h (drops triangles and points, unit normals, no unused vertex), and
 * hands it to *out. FORMAT for an index out of range, or without any triangle or point. */
int import_mesh_finish(struct psr_mesh **out, struct import_mesh *im, struct psr_error *err);

/* repair.c: the first half of import_mesh_finish; n_triangles and n_points may become 0. Keeps radii of points, and
 * normals of 0,0,0. */
int import_mesh_repair(struct import_mesh *im, struct psr_error *err);

/* FORMAT: a triangle's vertex or material is out of range. */
int import_mesh_check_indices(const struct import_mesh *im, struct psr_error *err);

/* Drops vertices that no triangle uses. Indices must be in range. MEMORY. */
int import_mesh_drop_vertices(struct import_mesh *im, struct psr_error *err);

/* patches.c: */
/* Moves a triangle, with all that it has, to a place before its own, or to its own. */
void import_mesh_move_triangle(struct psr_mesh *mesh, uint32_t to, uint32_t from);
/* Checks the promises of psr/mesh.h but for overlaps. FORMAT. */
int import_patch_check(const struct psr_patch *patch, uint32_t n_materials, struct psr_error *err);
void import_patches_destroy(struct psr_patch *patch, uint32_t n); /* NULL is fine */

/* duplicates.c: drops each triangle with the positions, winding and material of an earlier one; *n_dropped: how many.
 * Indices must be in range. MEMORY. */
int import_mesh_drop_duplicates(uint32_t *n_dropped, struct import_mesh *im, struct psr_error *err);

/* material.c: clamps factors and transforms to finite values in range; drops images that no material uses. */
void import_material_tidy(struct psr_material *material);
int import_mesh_drop_images(struct import_mesh *im, struct psr_error *err);

/* weld.c: (*first_of)[v] becomes the first vertex equal to v: in position; nearly so, within 2^-22 of the mesh's
 * longest side (rounding separates some pairs as near); or in all attributes. The caller frees. */
enum import_same { IMPORT_SAME_POSITION, IMPORT_SAME_NEARLY, IMPORT_SAME_ALL };
int import_mesh_groups(uint32_t **first_of, const struct import_mesh *im, enum import_same same,
                       struct psr_error *err);
/* Makes triangles use the first of equal vertices; the others stay, unused. */
int import_mesh_weld(struct import_mesh *im, struct psr_error *err);

/* merge.c: with options.is_preview, and if there are more than 131,072 triangles: moves vertices within a 128th of the
 * mesh's longest side of each other together, and drops triangles that have no area any more, repeated ones, and unused
 * vertices. Vertices keep their other attributes; those near corners of larger triangles stay. Readers call it when all
 * triangles are there, before the next two. Indices must be in range. MEMORY. */
int import_mesh_merge(struct import_mesh *im, struct psr_error *err);

/* normals.c: makes smooth normals for triangles whose vertices have none. Splits vertices whose corners need different
 * normals; the copies are appended. MEMORY, LIMIT. */
int import_mesh_smooth(struct import_mesh *im, struct psr_error *err);

/* cloud/cloud.c: import_mesh_finish calls it if there are points, finite ones. Drops all but one of points at the same
 * position, then estimates radii and normals that are 0; normals point outwards or upwards, where that is clear.
 * MEMORY. */
int import_cloud_finish(struct import_mesh *im, struct psr_error *err);

/* points/mesh_points.c: appends the points of im->path, a file that octree_source_suits(); colours if it has any. Errors
 * as of octree_source_open(), and LIMIT, MEMORY. */
int import_points(struct import_mesh *im, struct psr_error *err);

/* path.c. The caller frees the strings. */
/* Returns the folder of a file, resolved, without a slash at the end. */
int import_path_folder(char **folder, const char *path, struct psr_error *err);

/* Resolves `name`, absolute or relative to `folder`. NOT_FOUND; UNSUPPORTED if it leads outside of the folder. */
int import_path_inside(char **out, const char *folder, const char *name, struct psr_error *err);

/* Returns whether a path has an ending, in any case. */
int import_path_ends_with(const char *path, const char *ending);

/* number.c: converts a word to the nearest double; returns 0 if it is not a number. Takes "nan", "inf" and all that C's
 * printf writes. `locale` must be "C". */
int import_number(double *x, const uint8_t *word, size_t n, locale_t locale);

/* image/image.c: decodes an image, whose magic bytes tell its format (TGA has none: the ending of `name` tells it), by
 * base/image_module.h. FORMAT, UNSUPPORTED, LIMIT, MEMORY, and errors of image_module_open. */
int import_image_decode(struct psr_image *out, const uint8_t *bytes, size_t n_bytes, const char *name,
                        uint64_t max_pixels, struct psr_error *err);

/* image/image_png.c: decodes the most frequent images by libpng, to the same pixels as the module, which takes a
 * quarter of a second to open: PNG of 8 bits, RGB with or without alpha, not interlaced. Returns 0 for other, too large
 * or broken images, and leaves *out alone; the module then reports the error. */
int import_image_plain_png(struct psr_image *out, const uint8_t *bytes, size_t n_bytes, uint64_t max_pixels);

/* Survey coordinates have a far origin, and their z is height. */
int import_is_survey(const double low[3], const double high[3]);

/* The readers append the contents of a source file, `bytes`, to the mesh. */
int import_gltf(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
int import_assimp(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
int import_ply(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
int import_las(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
int import_pcd(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
int import_cad(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);

/* cad/cad.c: returns whether a file is STEP or IGES, by its first bytes or its ending. */
int import_cad_is(const char *path, const uint8_t *bytes, size_t n_bytes);

/* Returns how long the byte order mark is that some programs begin UTF-8 with: IMPORT_MARK, or 0. */
#define IMPORT_MARK 3
static inline size_t import_mark(const uint8_t *bytes, size_t n)
{
	return n >= IMPORT_MARK && memcmp(bytes, "\xef\xbb\xbf", IMPORT_MARK) == 0 ? IMPORT_MARK : 0;
}

#ifdef __cplusplus
}
#endif

#endif
