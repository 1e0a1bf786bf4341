#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/cad_module.h"
#include "dpoint/patch.h"
#include "import/cad/apart.h"
#include "import/cad/iges.h"
#include "import/import.h"

#define PER_PIXEL 8       /* triangles are off by this part of a pixel of the model */
#define ANGLE 0.2         /* radians: colours and highlights between corners stay smooth */
/* Triangles of patches tell how large the model is, and where patches end. */
#define PATCH_PER_PIXEL 2
#define PATCH_ANGLE 0.6
/* Faces that meet end at straight sides of their own between the same places. What differential points cover beyond such
 * a side (dpoint/trimmed.h) is twice as wide. */
#define RIM 2.5e-5
#define HEAD 4096
#define TAIL 65536        /* of a file; its end is in there */

static int is_step_ending(const char *path)
{
	return import_path_ends_with(path, ".step") || import_path_ends_with(path, ".stp");
}

static int is_iges_ending(const char *path)
{
	return import_path_ends_with(path, ".iges") || import_path_ends_with(path, ".igs");
}

/* Buildings in IFC have the same syntax, and other contents. */
static int is_step(const char *path, const uint8_t *bytes, size_t n_bytes)
{
	const size_t n = n_bytes < HEAD ? n_bytes : HEAD;

	return is_step_ending(path) ||
	       (n >= 13 && memcmp(bytes, "ISO-10303-21;", 13) == 0 && memmem(bytes, n, "'IFC", 4) == NULL);
}

static int is_iges(const char *path, const uint8_t *bytes, size_t n_bytes)
{
	return is_iges_ending(path) || import_iges_is(bytes, n_bytes);
}

int import_cad_is(const char *path, const uint8_t *bytes, size_t n_bytes)
{
	return is_step(path, bytes, n_bytes) || is_iges(path, bytes, n_bytes);
}

static int check_step(const struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	const size_t tail = n_bytes < TAIL ? n_bytes : TAIL;

	if (memmem(bytes, n_bytes < HEAD ? n_bytes : HEAD, "ISO-10303-21;", 13) == NULL)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: not a STEP file: it does not begin with ISO-10303-21;", im->path);
	if (memmem(bytes + n_bytes - tail, tail, "END-ISO-10303-21;", 17) == NULL)
		return psr_fail(err, PSR_ERR_FORMAT,
		                "%s: the STEP file ends in the middle: END-ISO-10303-21; is missing after %zu bytes; export it "
		                "again", im->path, n_bytes);
	return PSR_OK;
}

static int add_materials(struct import_mesh *im, const struct cad_module_mesh *cad, struct psr_error *err)
{
	for (uint32_t i = 0; i < cad->n_colors; i++) {
		struct psr_material material;
		const float *color = cad->color[i];
		int rc;

		psr_material_default(&material);
		material.roughness = IMPORT_ROUGHNESS;
		material.two_sided = cad->n_open > 0; /* the insides of solids cannot be seen */
		for (int k = 0; k < 3; k++)
			material.base_color[k] = color[3] < 0 ? IMPORT_GRAY : color[k];
		material.base_color[3] = color[3] < 0 ? 1 : color[3];
		material.alpha = material.base_color[3] < 1 ? PSR_ALPHA_BLEND : PSR_ALPHA_OPAQUE;
		rc = import_mesh_add_material(im, &material, err);
		if (rc < 0)
			return rc;
	}
	return PSR_OK;
}

/* Takes patches over. Those that break a promise stay behind: then their triangles stand for them. */
static int take_patches(struct import_mesh *im, struct cad_module_mesh *cad, uint32_t first, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	uint32_t *number, n_triangle_faces = cad->n_unlike;

	if (cad->n_patches == 0)
		return PSR_OK;
	number = malloc(cad->n_patches * sizeof *number);
	mesh->patch = malloc(cad->n_patches * sizeof *mesh->patch);
	mesh->triangle_patch = malloc(cad->n_triangles * sizeof *mesh->triangle_patch);
	if (number == NULL || mesh->patch == NULL || mesh->triangle_patch == NULL) {
		free(number);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %u NURBS patches", im->path, cad->n_patches);
	}
	for (uint32_t i = 0; i < cad->n_patches; i++) {
		number[i] = UINT32_MAX;
		if (import_patch_check(&cad->patch[i], cad->n_colors, NULL) != PSR_OK) {
			n_triangle_faces++;
			continue;
		}
		number[i] = mesh->n_patches;
		mesh->patch[mesh->n_patches] = cad->patch[i];
		mesh->patch[mesh->n_patches++].material += first;
		memset(&cad->patch[i], 0, sizeof cad->patch[i]);
	}
	for (uint32_t t = 0; t < cad->n_triangles; t++)
		mesh->triangle_patch[t] = cad->patch_of[t] < cad->n_patches ? number[cad->patch_of[t]] : UINT32_MAX;
	if (n_triangle_faces > 0)
		import_mesh_warn(im, "%u of %u faces have no NURBS of their own, and are as their triangles", n_triangle_faces,
		                 cad->n_faces);
	free(number);
	return PSR_OK;
}

static int take(struct import_mesh *im, struct cad_module_mesh *cad, struct psr_error *err)
{
	const uint32_t first = im->mesh->n_materials;
	struct psr_mesh *mesh = im->mesh;
	int rc = add_materials(im, cad, err);

	im->is_cut = 1;
	if (rc == PSR_OK)
		rc = import_mesh_grow(im, cad->n_vertices, cad->n_triangles, 0, err);
	if (rc != PSR_OK)
		return rc;
	memcpy(mesh->position, cad->position, cad->n_vertices * sizeof *cad->position);
	memcpy(mesh->normal, cad->normal, cad->n_vertices * sizeof *cad->normal);
	memcpy(mesh->triangle, cad->triangle, cad->n_triangles * sizeof *cad->triangle);
	for (uint32_t t = 0; t < cad->n_triangles; t++)
		mesh->triangle_material[t] = first + cad->color_of[t];
	if (cad->n_left_out > 0)
		import_mesh_warn(im, "%u of %u faces could not be cut into triangles and were left out, first face %s",
		                 cad->n_left_out, cad->n_faces, cad->first_left_out);
	rc = take_patches(im, cad, first, err);
	if (rc != PSR_OK)
		return rc;
	if (cad->n_open > 0)
		import_mesh_warn(im, "%u shell%s open: faces do not meet all around", cad->n_open,
		                 cad->n_open == 1 ? " is" : "s are");
	rc = import_mesh_merge(im, err);
	return rc == PSR_OK ? import_mesh_weld(im, err) : rc;
}

int import_cad(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	const struct cad_module_source source = {
		.path = im->path, .is_iges = !is_step(im->path, bytes, n_bytes), .angle = ANGLE,
		.deflection = 1.0 / (PER_PIXEL * (double)im->options.resolution),
		.rim = im->options.has_patches && !im->options.is_preview ? RIM : 0,
		.patch_deflection = 1.0 / (PATCH_PER_PIXEL * (double)im->options.resolution), .patch_angle = PATCH_ANGLE,
		.most_degree = DPOINT_MOST_DEGREE, .n_threads = im->options.n_threads,
		.max_triangles = IMPORT_MAX_TRIANGLES / 4,
	};
	const struct cad_module *module;
	struct cad_module_report report;
	struct cad_module_mesh *cad;
	struct psr_error why;
	char message[400] = "";
	int rc = source.is_iges ? import_iges_check(im, bytes, n_bytes, err) : check_step(im, bytes, n_bytes, err);

	if (rc != PSR_OK)
		return rc;
	rc = cad_module_open(&module, &why);
	if (rc != PSR_OK)
		return psr_fail(err, rc,
		                "%s: %s; STEP and IGES are read through Open CASCADE: install libocct-data-exchange-dev and "
		                "build psr again, or convert the file to glTF or STL", im->path, why.text);
	rc = import_cad_apart(&cad, &report, module, &source, message, sizeof message);
	if (rc != PSR_OK)
		return psr_fail(err, rc, "%s: the %s file cannot be read: %s", im->path, source.is_iges ? "IGES" : "STEP",
		                message);
	if (report.n_lacking > 0)
		import_mesh_warn(im, "%u of the file's entities %s to nothing or to a wrong type, and may be missing, first %s",
		                 report.n_lacking, report.n_lacking == 1 ? "refers" : "refer", report.first_lacking);
	rc = take(im, cad, err);
	module->destroy(cad);
	return rc;
}
