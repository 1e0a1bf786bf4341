/* Point-sample models in memory, and the .psr file. The byte table of the file is docs/format.md.
 *
 * A model is one object: an origin, a scale, and one or more representations. Inside of it everything is relative to
 * the origin and scaled so that the object fits the unit sphere ([G] 5): object = origin + scale * inner. A model is
 * immutable once made, shared by counting references, and may be read by any number of threads. */
#ifndef PSR_MODEL_H
#define PSR_MODEL_H

#include <stddef.h>
#include <stdint.h>
#include "error.h"
#include "pool.h"
#include "view.h"

#ifdef __cplusplus
extern "C" {
#endif

struct psr_model_info {
	double origin[3]; /* object coordinates of the inner origin */
	double scale;     /* object units an inner unit; > 0 */
	double box_min[3], box_max[3]; /* of the samples, object coordinates */
	double up[3];     /* unit length: the way up of the object, for the default view */
	double spacing;   /* greatest distance of neighbouring samples on the surface at level 0 (ds of [G] 4.4), object
	                   * units */
	double tolerance; /* angle of [G] 4.4, radians */
	uint32_t resolution; /* >= 1; target resolution: pixels across the unit sphere at magnification 1 */

	/* Adequacy ([G] 4.2), measured when the model was built: n_missing of n_trials pixels have no sample. Each
	 * pixel lies around a random visible place of the surface, at the target resolution, seen from a random
	 * direction. 0 of 0: not measured. */
	uint64_t n_trials, n_missing;
	/* Culling loss, measured with as many pixels, each with a sample, in views from random places: in n_lost of
	 * them cones or masks would cull the sample's block though a ray from the eye reaches the sample. */
	uint64_t n_lost;
	char builder[32];    /* printable ASCII: name and version of the program that built it */
};

struct psr_model;

/* Opens a .psr file; psr_model_unref() lets go of the model. `map` reads the file in place, which must not shrink
 * meanwhile; `read` copies it into memory first (huge pages where the system has them), as a daemon needs it. Both
 * check every count, offset, index and hash before they follow any. Of a file that ends early they open what is there,
 * if that is a model: psr_model_is_prefix(). NOT_FOUND, IO, FORMAT, VERSION, UNSUPPORTED (a
 * required section that this build does not know, or no representation that it does), MEMORY. */
int psr_model_map(struct psr_model **out, const char *path, struct psr_error *err);
int psr_model_read(struct psr_model **out, const char *path, struct psr_error *err);

/* A packed octree goes down the file in steps, and what ends with a step is a model of fewer levels, as of a file that
 * is cut off there (psr_model_is_prefix()). Returns bit l for each such beginning, of l levels; the whole is none of
 * them. 0: there are none, or the file is damaged before them. */
uint32_t psr_model_beginnings(const char *path);

/* psr_model_read() of the shortest beginning of at least so many levels; of all, if there is none or levels is 0. A
 * beginning takes time by its own size. `cancel` (NULL: nobody) stops the unpacking of an octree, within some tenths of
 * a second for the largest: CANCELLED. */
int psr_model_read_levels(struct psr_model **out, const char *path, uint32_t levels, const struct psr_cancel *cancel,
                          struct psr_error *err);

/* Reads from the header how much memory the model of this file, or of the beginning that psr_model_read_levels() takes,
 * needs once it is drawn; a packed file takes more than its size. What is drawn of an octree beside its file's sections
 * is an estimate, and so is a beginning; bounds of differential points are not in it. Errors as of psr_model_read(), as
 * far as the header shows them. */
int psr_model_need(uint64_t *n_bytes, const char *path, uint32_t levels, struct psr_error *err);

/* Cameras and lights of the source file, in object coordinates; the model owns them. */
struct psr_presets {
	uint32_t n_cameras, n_lights; /* each at most PSR_MAX_PRESETS */
	const struct psr_preset_camera *camera;
	const struct psr_preset_light *light;
};

/* Writes a temporary file beside `path`, syncs and renames it: `path` is the old file or the whole new one. Replaces
 * regular files only. NOT_FOUND (no such folder), IO (disk full, ...), MEMORY. */
int psr_model_write(const struct psr_model *model, const char *path, struct psr_error *err);

/* psr_model_write() with compressed sections. psr_model_read() and psr_model_map() open such a file, too, and unpack it
 * into memory of their own; the model and its content id are the same as without packing. */
int psr_model_write_packed(const struct psr_model *model, const char *path, struct psr_error *err);

struct psr_model *psr_model_ref(struct psr_model *model);
void psr_model_unref(struct psr_model *model); /* NULL is fine */

const struct psr_model_info *psr_model_info(const struct psr_model *model);
const struct psr_presets *psr_model_presets(const struct psr_model *model); /* never NULL */

/* A packed octree's file that ends early, as a download that broke, opens as a coarser model: that of the levels that
 * are there. Its content id is that of this model. */
struct psr_model_prefix {
	uint32_t levels, of_levels; /* of the octree: there, in the whole file; the same where its scan alone is missing */
	uint64_t of_bytes;          /* of the whole file */
};
int psr_model_is_prefix(const struct psr_model *model, struct psr_model_prefix *prefix); /* whether it is one */

/* XXH128 of the section table (types, versions, lengths, hashes): models of equal content have equal ids. */
void psr_model_content_id(const struct psr_model *model, uint8_t id[16]);
/* Size of the file that the model was opened from, 0 without one; *is_packed tells whether the file is packed. */
uint64_t psr_model_file_bytes(const struct psr_model *model, int *is_packed);
uint64_t psr_model_bytes(const struct psr_model *model); /* memory that the model holds by now, in all */

#ifdef __cplusplus
}
#endif
#endif
