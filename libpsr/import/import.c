#define _GNU_SOURCE
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "base/infile.h"
#include "base/pool.h"
#include "import.h"

#define SNIFF_BYTES 65536
#define SURVEY_SIZES 10 /* of a scene, between the origin and the middle of it */
#define MOST_THREADS 256
#define DEFAULT_CREASE 0.6108652381980153 /* 35 degrees */
#define MOST_CREASE 3.1415926535897933    /* a little over pi */

void psr_import_options_default(struct psr_import_options *options)
{
	options->crease = DEFAULT_CREASE;
	options->n_threads = psr_pool_all_cores();
}

static int check_options(const struct psr_import_options *options, struct psr_error *err)
{
	if (!(options->crease >= 0.0 && options->crease <= MOST_CREASE))
		return psr_fail(err, PSR_ERR_ARG, "a crease of %g radians is outside of 0..pi", options->crease);
	if (options->n_threads < 1 || options->n_threads > MOST_THREADS)
		return psr_fail(err, PSR_ERR_ARG, "%d threads are outside of 1..%d", options->n_threads, MOST_THREADS);
	return PSR_OK;
}

static int ends_with(const char *path, const char *ending)
{
	size_t n = strlen(path), m = strlen(ending);

	return n >= m && strcasecmp(path + n - m, ending) == 0;
}

/* A JSON object that speaks of an "asset" early on: glTF lets members stand in any order, but buffers come last in
 * practice, and the file's ending decides where they do not. */
static int is_gltf(const char *path, const uint8_t *bytes, size_t n_bytes)
{
	size_t i = 0, n = n_bytes < SNIFF_BYTES ? n_bytes : SNIFF_BYTES;

	if (n >= 4 && memcmp(bytes, "glTF", 4) == 0)
		return 1;
	if (ends_with(path, ".gltf") || ends_with(path, ".glb"))
		return 1;
	if (n >= 3 && memcmp(bytes, "\xef\xbb\xbf", 3) == 0)
		i = 3;
	while (i < n && strchr(" \t\r\n", bytes[i]) != NULL && bytes[i] != '\0')
		i++;
	return i < n && bytes[i] == '{' && memmem(bytes + i, n - i, "\"asset\"", 7) != NULL;
}

static int is_ply(const char *path, const uint8_t *bytes, size_t n_bytes)
{
	return ends_with(path, ".ply") || (n_bytes >= 3 && strncasecmp((const char *)bytes, "ply", 3) == 0);
}

static int is_las(const char *path, const uint8_t *bytes, size_t n_bytes)
{
	return ends_with(path, ".las") || ends_with(path, ".laz") || (n_bytes >= 4 && memcmp(bytes, "LASF", 4) == 0);
}

/* Survey coordinates count from a far origin, and their z is height. */
static int is_surveyed(const struct psr_mesh *mesh)
{
	double low[3] = { INFINITY, INFINITY, INFINITY }, high[3] = { -INFINITY, -INFINITY, -INFINITY }, size = 0;

	for (uint64_t i = 0; i < (uint64_t)mesh->n_vertices + mesh->n_points; i++) {
		const double *p = i < mesh->n_vertices ? mesh->position[i] : mesh->point[i - mesh->n_vertices];

		for (int k = 0; k < 3; k++) {
			low[k] = fmin(low[k], p[k]);
			high[k] = fmax(high[k], p[k]);
		}
	}
	for (int k = 0; k < 3; k++)
		size = fmax(size, high[k] - low[k]);
	return fabs(low[0] / 2 + high[0] / 2) > SURVEY_SIZES * size || fabs(low[1] / 2 + high[1] / 2) > SURVEY_SIZES * size;
}

/* What psr/mesh.h says of `up`: files do not, but their makers agree on it. */
static void find_up(struct psr_mesh *mesh, const char *path, const uint8_t *bytes, size_t n_bytes)
{
	const int has_z = is_las(path, bytes, n_bytes) || ends_with(path, ".stl") || ends_with(path, ".amf") ||
	                  ends_with(path, ".3mf") || (!is_gltf(path, bytes, n_bytes) && is_surveyed(mesh));

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
		return psr_fail(err, PSR_ERR_ARG, "no mesh file was named");
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
