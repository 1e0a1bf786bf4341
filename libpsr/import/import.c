#define _GNU_SOURCE
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "base/infile.h"
#include "base/pool.h"
#include "import.h"
#include "points/points.h"

#define SNIFF_BYTES 65536
#define SURVEY_SIZES 10 /* sizes of the scene between its middle and the origin */
#define MOST_THREADS 256
#define DEFAULT_CREASE 0.6108652381980153 /* 35 degrees */
#define DEFAULT_RESOLUTION 1024
#define MOST_RESOLUTION 8192
#define MOST_CREASE 3.1415926535897933    /* a little over pi */

void psr_import_options_default(struct psr_import_options *options)
{
	options->crease = DEFAULT_CREASE;
	options->n_threads = psr_pool_all_cores();
	options->is_preview = 0;
	options->resolution = DEFAULT_RESOLUTION;
	options->has_patches = 0;
}

static int check_options(const struct psr_import_options *options, struct psr_error *err)
{
	if (!(options->crease >= 0.0 && options->crease <= MOST_CREASE))
		return psr_fail(err, PSR_ERR_ARG, "a crease of %g radians is not within 0..pi", options->crease);
	if (options->n_threads < 1 || options->n_threads > MOST_THREADS)
		return psr_fail(err, PSR_ERR_ARG, "%d threads are not within 1..%d", options->n_threads, MOST_THREADS);
	if (options->resolution < 8 || options->resolution > MOST_RESOLUTION)
		return psr_fail(err, PSR_ERR_ARG, "a resolution of %u pixels is not within 8..%d", options->resolution,
		                MOST_RESOLUTION);
	return PSR_OK;
}

/* A JSON object with an early "asset". Members may have any order, but in practice buffers come last; the file's ending
 * decides otherwise. */
static int is_gltf(const char *path, const uint8_t *bytes, size_t n_bytes)
{
	const size_t n = n_bytes < SNIFF_BYTES ? n_bytes : SNIFF_BYTES;
	size_t i = import_mark(bytes, n);

	if (n >= 4 && memcmp(bytes, "glTF", 4) == 0)
		return 1;
	if (import_path_ends_with(path, ".gltf") || import_path_ends_with(path, ".glb"))
		return 1;
	while (i < n && strchr(" \t\r\n", bytes[i]) != NULL && bytes[i] != '\0')
		i++;
	return i < n && bytes[i] == '{' && memmem(bytes + i, n - i, "\"asset\"", 7) != NULL;
}

static int is_ply(const char *path, const uint8_t *bytes, size_t n_bytes)
{
	return import_path_ends_with(path, ".ply") || (n_bytes >= 3 && strncasecmp((const char *)bytes, "ply", 3) == 0);
}

static int is_las(const char *path, const uint8_t *bytes, size_t n_bytes)
{
	return import_path_ends_with(path, ".las") || import_path_ends_with(path, ".laz") ||
	       (n_bytes >= 4 && memcmp(bytes, "LASF", 4) == 0);
}

static int is_pcd(const char *path, const uint8_t *bytes, size_t n_bytes)
{
	return import_path_ends_with(path, ".pcd") || (n_bytes >= 6 && memcmp(bytes, "# .PCD", 6) == 0);
}

int import_is_survey(const double low[3], const double high[3])
{
	double size = 0;

	for (int k = 0; k < 3; k++)
		size = fmax(size, high[k] - low[k]);
	return fabs(low[0] / 2 + high[0] / 2) > SURVEY_SIZES * size || fabs(low[1] / 2 + high[1] / 2) > SURVEY_SIZES * size;
}

static int is_surveyed(const struct psr_mesh *mesh)
{
	double low[3], high[3];

	import_mesh_bounds(low, high, mesh);
	return import_is_survey(low, high);
}

/* Sets `up` (psr/mesh.h) by the convention of the format; files do not tell. */
static void find_up(struct psr_mesh *mesh, const char *path, const uint8_t *bytes, size_t n_bytes)
{
	static const char *const endings[] = { ".stl", ".amf", ".3mf" };
	int has_z = is_las(path, bytes, n_bytes) || is_pcd(path, bytes, n_bytes) || import_cad_is(path, bytes, n_bytes) ||
	             (!is_ply(path, bytes, n_bytes) && octree_source_suits(path)) ||
	             (!is_gltf(path, bytes, n_bytes) && is_surveyed(mesh));

	for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
		has_z |= import_path_ends_with(path, endings[i]);
	mesh->up[has_z ? 2 : 1] = 1;
}

int psr_mesh_import(struct psr_mesh **out, const char *path, const struct psr_import_options *options,
                    struct psr_error *err)
{
	struct import_mesh im;
	uint8_t *bytes = NULL;
	size_t n_bytes = 0;
	int rc;

	if (out == NULL || path == NULL || path[0] == '\0')
		return psr_fail(err, PSR_ERR_ARG, "the path of the mesh file is empty");
	*out = NULL;
	rc = options != NULL ? check_options(options, err) : PSR_OK;
	if (rc == PSR_OK)
		rc = infile_read(&bytes, &n_bytes, path, IMPORT_MAX_FILE, err);
	if (rc != PSR_OK)
		return rc;
	if (n_bytes == 0) {
		free(bytes);
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the file is empty", path);
	}
	rc = import_mesh_init(&im, path, err);
	if (options != NULL)
		im.options = *options;
	if (rc == PSR_OK && is_gltf(path, bytes, n_bytes))
		rc = import_gltf(&im, bytes, n_bytes, err);
	else if (rc == PSR_OK && is_ply(path, bytes, n_bytes))
		rc = import_ply(&im, bytes, n_bytes, err);
	else if (rc == PSR_OK && is_las(path, bytes, n_bytes))
		rc = import_las(&im, bytes, n_bytes, err);
	else if (rc == PSR_OK && is_pcd(path, bytes, n_bytes))
		rc = import_pcd(&im, bytes, n_bytes, err);
	else if (rc == PSR_OK && import_cad_is(path, bytes, n_bytes))
		rc = import_cad(&im, bytes, n_bytes, err);
	else if (rc == PSR_OK && octree_source_suits(path))
		rc = import_points(&im, err);
	else if (rc == PSR_OK)
		rc = import_assimp(&im, bytes, n_bytes, err);
	if (rc == PSR_OK)
		rc = import_mesh_finish(out, &im, err);
	if (rc == PSR_OK)
		find_up(*out, path, bytes, n_bytes);
	free(bytes);
	import_mesh_fini(&im);
	return rc;
}
