#include <stdlib.h>
#include <string.h>
#include "base/infile.h"
#include "ply.h"

static int load_image(int *image, struct import_mesh *im, const char *name, struct psr_error *err)
{
	char *folder = NULL, *path = NULL;
	uint8_t *bytes = NULL;
	size_t n_bytes = 0;
	int rc = import_path_folder(&folder, im->path, err);

	if (rc == PSR_OK && import_path_inside(&path, folder, name, NULL) != PSR_OK) {
		import_mesh_warn(im, "the texture \"%.100s\" is not in the folder of the file and was left out", name);
	} else if (rc == PSR_OK) {
		rc = infile_read(&bytes, &n_bytes, path, IMPORT_MAX_FILE, err);
		if (rc == PSR_OK)
			rc = *image = import_mesh_add_image(im, bytes, n_bytes, path, err);
	}
	free(bytes);
	free(path);
	free(folder);
	return rc < 0 ? rc : PSR_OK;
}

/* *image: -1 if the file names no texture or a missing one; a broken one is an error. */
static int find_texture(int *image, struct import_mesh *im, const struct ply_name *texture, struct psr_error *err)
{
	size_t n = texture->n;
	char *name;
	int rc;

	*image = -1;
	while (n > 0 && (texture->at[n - 1] == ' ' || texture->at[n - 1] == '\t'))
		n--;
	if (n == 0)
		return PSR_OK;
	name = strndup(texture->at, n);
	if (name == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for the name of a texture", im->path);
	rc = load_image(image, im, name, err);
	free(name);
	return rc;
}

/* Two-sided, since most files do not tell. Clouds are rough: their normals are estimates. */
static int add_material(struct import_mesh *im, const struct ply_header *h, int is_cloud, int has_colors,
                        struct psr_error *err)
{
	struct psr_material material;
	int image = -1, rc = PSR_OK;

	psr_material_default(&material);
	material.two_sided = 1;
	material.roughness = is_cloud ? 1.0f : IMPORT_ROUGHNESS;
	if (!is_cloud)
		rc = find_texture(&image, im, &h->texture, err);
	if (rc != PSR_OK)
		return rc;
	material.base_texture.image = image;
	for (int c = 0; c < 3 && !has_colors && image < 0; c++)
		material.base_color[c] = IMPORT_GRAY;
	return import_mesh_add_material(im, &material, err);
}

static int has_colors(const struct ply_header *h, const struct ply_vertices *vertices, const struct ply_element *faces)
{
	struct ply_colors colors;

	return vertices->color != NULL || (faces != NULL && ply_colors_find(&colors, h, faces));
}

static int add_points(struct import_mesh *im, const struct ply_vertices *v, uint32_t material, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	const uint32_t first = mesh->n_points;
	int rc = import_mesh_grow_points(im, v->n, v->color != NULL, err);

	if (rc != PSR_OK || v->n == 0)
		return rc;
	memcpy(mesh->point + first, v->position, v->n * sizeof *v->position);
	if (v->normal != NULL)
		memcpy(mesh->point_normal + first, v->normal, v->n * sizeof *v->normal);
	if (v->color != NULL)
		memcpy(mesh->point_color + first, v->color, v->n * sizeof *v->color);
	for (uint32_t i = 0; i < v->n; i++)
		mesh->point_material[first + i] = material;
	return PSR_OK;
}

static int has_rows(const struct ply_element *element)
{
	return element != NULL && element->n_rows > 0;
}

/* Skips to the vertices: elements have the order of the header, but faces need the vertices. */
static int read_vertices(struct ply_vertices *vertices, struct ply_rows *rows, struct psr_error *err)
{
	const struct ply_header *h = rows->header;
	const struct ply_element *vertex = ply_find_element(h, "vertex");
	int rc = PSR_OK;

	if (vertex == NULL)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the PLY header has no element vertex", rows->path);
	for (const struct ply_element *e = h->element; e < vertex && rc == PSR_OK; e++) {
		ply_rows_begin(rows, e);
		rc = ply_rows_skip(rows, err);
	}
	if (rc != PSR_OK)
		return rc;
	ply_rows_begin(rows, vertex);
	return ply_vertices_read(vertices, rows, err);
}

static int read_surface(struct import_mesh *im, struct ply_rows *rows, const struct ply_vertices *vertices,
                        struct psr_error *err)
{
	const struct ply_header *h = rows->header;
	const struct ply_element *vertex = ply_find_element(h, "vertex"), *faces = ply_find_element(h, "face"),
	                         *strips = ply_find_element(h, "tristrips");
	const struct ply_element *e = vertex + 1;
	int rc, material;

	material = add_material(im, h, 0, has_colors(h, vertices, has_rows(faces) ? faces : strips), err);
	if (material < 0)
		return material;
	if ((has_rows(faces) && faces < vertex) || (has_rows(strips) && strips < vertex)) {
		e = h->element;
		rows->cursor.at = rows->cursor.start + h->body;
	}
	for (rc = PSR_OK; e < h->element + h->n_elements && rc == PSR_OK; e++) {
		ply_rows_begin(rows, e);
		if (e == faces && has_rows(e))
			rc = ply_faces_read(im, rows, vertices, (uint32_t)material, err);
		else if (e == strips && has_rows(e))
			rc = ply_strips_read(im, rows, vertices, (uint32_t)material, err);
		else
			rc = ply_rows_skip(rows, err);
	}
	if (rc == PSR_OK)
		rc = import_mesh_merge(im, err);
	if (rc == PSR_OK)
		rc = import_mesh_smooth(im, err);
	return rc == PSR_OK ? import_mesh_weld(im, err) : rc;
}

static int read_all(struct import_mesh *im, struct ply_rows *rows, struct psr_error *err)
{
	const struct ply_element *edges = ply_find_element(rows->header, "edge");
	struct ply_vertices vertices;
	int rc, material;

	if (rows->header->odd_line > 0)
		import_mesh_warn(im, "line %u is not a line of a PLY header and was left out", rows->header->odd_line);
	memset(&vertices, 0, sizeof vertices);
	rc = read_vertices(&vertices, rows, err);
	if (rc != PSR_OK) {
		ply_vertices_fini(&vertices);
		return rc;
	}
	if (has_rows(edges)) {
		im->mesh->n_dropped_primitives += (uint32_t)edges->n_rows;
		import_mesh_warn(im, "lines were left out: %llu", (unsigned long long)edges->n_rows);
	}
	if (has_rows(ply_find_element(rows->header, "face")) || has_rows(ply_find_element(rows->header, "tristrips"))) {
		rc = read_surface(im, rows, &vertices, err);
	} else {
		material = add_material(im, rows->header, 1, vertices.color != NULL, err);
		rc = material < 0 ? material : add_points(im, &vertices, (uint32_t)material, err);
	}
	ply_vertices_fini(&vertices);
	return rc;
}

int import_ply(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	struct ply_header *header = malloc(sizeof *header);
	struct ply_rows *rows = malloc(sizeof *rows);
	int rc;

	if (header == NULL || rows == NULL) {
		rc = psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a header", im->path);
	} else {
		rc = ply_header_read(header, im->path, bytes, n_bytes, n_bytes, err);
		if (rc == PSR_OK) {
			rc = ply_rows_init(rows, im->path, header, bytes, n_bytes, err);
			if (rc == PSR_OK)
				rc = read_all(im, rows, err);
			ply_rows_fini(rows);
		}
	}
	free(header);
	free(rows);
	return rc;
}
