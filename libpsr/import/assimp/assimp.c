#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <assimp/cimport.h>
#include <assimp/commonMetaData.h>
#include <assimp/scene.h>
#include "check.h"
#include "material.h"
#include "wall.h"
#include "obj.h"
#include "import/ply/polygon.h"

#define MAX_DEPTH 512 /* of nodes */

struct walk {
	struct assimp_io io;
	struct obj obj; /* n is 0 for the other formats */
	int *material; /* 2 m, 2 m + 1: of the scene's material m without and with vertex colors; -1: not made yet */
	int (*uv_source)[PSR_UV_SETS];
	int ignore_normals;
	int is_plain;  /* the mesh is there, but for its material */
};

typedef double matrix[3][4];

static void multiply(matrix out, const matrix a, const struct aiMatrix4x4 *b)
{
	const double m[4][4] = { { b->a1, b->a2, b->a3, b->a4 }, { b->b1, b->b2, b->b3, b->b4 },
		                 { b->c1, b->c2, b->c3, b->c4 }, { 0.0, 0.0, 0.0, 1.0 } };

	for (int row = 0; row < 3; row++)
		for (int col = 0; col < 4; col++) {
			out[row][col] = col == 3 ? a[row][3] : 0.0;
			for (int k = 0; k < 3; k++)
				out[row][col] += a[row][k] * m[k][col];
		}
}

/* Cofactors times the determinant's sign: the inverse transpose up to length. Returns whether m mirrors. */
static int cofactors(double out[3][3], const matrix m)
{
	double determinant = 0.0;

	for (int row = 0; row < 3; row++)
		for (int col = 0; col < 3; col++) {
			int r1 = (row + 1) % 3, r2 = (row + 2) % 3, c1 = (col + 1) % 3, c2 = (col + 2) % 3;

			out[row][col] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
		}
	for (int col = 0; col < 3; col++)
		determinant += m[0][col] * out[0][col];
	for (int row = 0; determinant < 0.0 && row < 3; row++)
		for (int col = 0; col < 3; col++)
			out[row][col] = -out[row][col];
	return determinant < 0.0;
}

/* The mesh under construction, and scratch memory for its largest face. */
struct target {
	const struct aiMesh *source;
	const struct obj *obj;
	const double (*m)[4];
	double normals[3][3];
	int flip, with_normals, material;
	const int *uv_source;
	uint32_t first, vertex, triangle; /* the next ones */
	unsigned (*cut)[3];
};

static void position_of(double p[3], const struct target *t, unsigned from)
{
	const struct aiVector3D *v = &t->source->mVertices[from];

	p[0] = v->x;
	p[1] = v->y;
	p[2] = v->z;
	if (t->obj->n > 0)
		obj_position(p, t->obj, v->x, v->y);
}

/* Copies a vertex of Assimp's to vertex `to` of the mesh. */
static void put_vertex(struct psr_mesh *mesh, uint32_t to, const struct target *t, unsigned from)
{
	const struct aiMesh *source = t->source;
	const double (*m)[4] = t->m;
	double p[3];

	position_of(p, t, from);
	for (int row = 0; row < 3; row++)
		mesh->position[to][row] = m[row][0] * p[0] + m[row][1] * p[1] + m[row][2] * p[2] + m[row][3];
	if (t->with_normals) {
		const double (*normals)[3] = (const double(*)[3])t->normals;
		const struct aiVector3D *n = &source->mNormals[from];

		for (int row = 0; row < 3; row++)
			mesh->normal[to][row] =
				(float)(normals[row][0] * n->x + normals[row][1] * n->y + normals[row][2] * n->z);
	}
	for (int set = 0; set < PSR_UV_SETS; set++)
		if (t->uv_source[set] >= 0 && source->mTextureCoords[t->uv_source[set]] != NULL) {
			const struct aiVector3D *uv = &source->mTextureCoords[t->uv_source[set]][from];

			mesh->uv[set][to][0] = uv->x;
			mesh->uv[set][to][1] = 1.0f - uv->y; /* Assimp's v points up */
		}
	if (source->mColors[0] != NULL) {
		mesh->color[to][0] = assimp_linear(source->mColors[0][from].r);
		mesh->color[to][1] = assimp_linear(source->mColors[0][from].g);
		mesh->color[to][2] = assimp_linear(source->mColors[0][from].b);
		mesh->color[to][3] = source->mColors[0][from].a;
	}
}

/* Counts triangles after cutting polygons; *most: corners of the largest one. */
static uint64_t count_triangles(struct psr_mesh *mesh, const struct aiMesh *source, unsigned *most)
{
	uint64_t n = 0;

	*most = 3;
	for (unsigned f = 0; f < source->mNumFaces; f++) {
		unsigned corners = source->mFaces[f].mNumIndices;

		if (corners < 3)
			mesh->n_dropped_primitives++;
		else
			n += corners - 2;
		if (corners > *most)
			*most = corners;
	}
	return n;
}

static void add_face(struct psr_mesh *mesh, struct target *t, const struct aiFace *face)
{
	double point[POLYGON_MAX_CLIP][3];
	const unsigned n = face->mNumIndices;

	for (unsigned i = 0; n > 3 && i < n && i < POLYGON_MAX_CLIP; i++)
		position_of(point[i], t, face->mIndices[i]);
	polygon_cut(t->cut, (const double(*)[3])point, n);
	for (unsigned k = 0; k + 2 < n; k++) {
		for (unsigned c = 0; c < 3; c++) {
			unsigned from = face->mIndices[t->cut[k][t->flip ? 2 - c : c]];

			/* Without normals, each corner is a vertex of its own until import_mesh_smooth. */
			mesh->triangle[t->triangle][c] = t->with_normals ? t->first + from : t->vertex;
			if (!t->with_normals)
				put_vertex(mesh, t->vertex++, t, from);
		}
		mesh->triangle_material[t->triangle++] = (uint32_t)t->material;
	}
}

static int add_mesh(struct walk *w, const struct aiMesh *source, const matrix m, struct psr_error *err)
{
	struct import_mesh *im = w->io.im;
	struct psr_mesh *mesh = im->mesh;
	const int has_color = source->mColors[0] != NULL;
	const unsigned key = 2 * (source->mMaterialIndex < w->io.scene->mNumMaterials ? source->mMaterialIndex : 0) +
	                     (unsigned)has_color;
	unsigned most, has = has_color ? IMPORT_HAS_COLOR : 0;
	const uint64_t n = count_triangles(mesh, source, &most);
	struct target t = { .source = source, .obj = &w->obj, .m = m };
	int rc;

	if (w->material[key] < 0)
		w->material[key] = assimp_material(&w->io, key / 2, has_color, w->uv_source[key], err);
	if (w->material[key] < 0)
		return w->material[key];
	t.with_normals = source->mNormals != NULL && !w->ignore_normals;
	t.material = w->material[key];
	t.uv_source = w->uv_source[key];
	t.first = t.vertex = mesh->n_vertices;
	t.triangle = mesh->n_triangles;
	t.flip = cofactors(t.normals, m);
	for (unsigned set = 0; set < PSR_UV_SETS; set++)
		has |= t.uv_source[set] >= 0 ? IMPORT_HAS_UV0 << set : 0;
	rc = import_mesh_grow(im, t.with_normals ? source->mNumVertices : 3 * n, n, has, err);
	if (rc != PSR_OK)
		return rc;
	t.cut = malloc((size_t)most * sizeof *t.cut);
	if (t.cut == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a face of %u corners", im->path, most);
	for (unsigned i = 0; t.with_normals && i < source->mNumVertices; i++)
		put_vertex(mesh, t.first + i, &t, i);
	for (unsigned f = 0; f < source->mNumFaces; f++)
		if (source->mFaces[f].mNumIndices >= 3)
			add_face(mesh, &t, &source->mFaces[f]);
	free(t.cut);
	return PSR_OK;
}

static int add_node(struct walk *w, const struct aiNode *node, const matrix parent, int depth, struct psr_error *err)
{
	matrix m;
	int rc = PSR_OK;
	if (depth > MAX_DEPTH)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: nodes nested deeper than %d", w->io.im->path, MAX_DEPTH);
	multiply(m, parent, &node->mTransformation);
	for (unsigned i = 0; i < node->mNumMeshes && rc == PSR_OK; i++)
		if (node->mMeshes[i] < w->io.scene->mNumMeshes)
			rc = add_mesh(w, w->io.scene->mMeshes[node->mMeshes[i]], (const double(*)[4])m, err);
	for (unsigned i = 0; i < node->mNumChildren && rc == PSR_OK; i++)
		if (node->mChildren[i] != NULL) /* Assimp's RAW reader leaves NULL */
			rc = add_node(w, node->mChildren[i], (const double(*)[4])m, depth + 1, err);
	return rc;
}

/* STL's normals belong to faces; smooth ones suit scans better. */
static int is_stl(const struct aiScene *scene)
{
	const struct aiMetadata *d = scene->mMetaData;

	for (unsigned i = 0; d != NULL && i < d->mNumProperties; i++)
		if (strcmp(d->mKeys[i].data, AI_METADATA_SOURCE_FORMAT) == 0 && d->mValues[i].mType == AI_AISTRING)
			return strstr(((const struct aiString *)d->mValues[i].mData)->data, "Stereolithography") != NULL;
	return 0;
}

static int read_scene(struct walk *w, struct psr_error *err)
{
	static const matrix identity = { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } };
	const size_t n = 2 * ((size_t)w->io.scene->mNumMaterials + 1);
	int rc;
	w->material = malloc(n * sizeof *w->material);
	w->uv_source = malloc(n * sizeof *w->uv_source);
	if (w->material == NULL || w->uv_source == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for materials", w->io.im->path);
	for (size_t i = 0; i < n; i++)
		w->material[i] = -1;
	w->ignore_normals = is_stl(w->io.scene);
	if (w->is_plain)
		rc = assimp_material(&w->io, w->io.scene->mMeshes[0]->mMaterialIndex, 0, w->uv_source[0], err);
	else
		rc = add_node(w, w->io.scene->mRootNode, identity, 0, err);
	if (rc > 0)
		rc = PSR_OK;
	if (rc == PSR_OK)
		rc = import_mesh_merge(w->io.im, err);
	if (rc == PSR_OK)
		rc = import_mesh_smooth(w->io.im, err);
	return rc == PSR_OK ? import_mesh_weld(w->io.im, err) : rc;
}

static int read_file(struct walk *w, struct psr_error *err)
{
	const char *path = w->io.im->path;
	char why[ASSIMP_WHY];
	int rc;

	w->io.scene = assimp_read(w->io.path, &w->io.io, why);
	if (w->io.scene == NULL && strncmp(why, "No suitable reader", 18) == 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "%s: not a mesh file in a supported format (glTF, OBJ, STL, PLY, OFF, Collada, ...)", path);
	if (w->io.scene == NULL)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: cannot be read as a mesh: %s", path, why);
	rc = assimp_check_faces(w->io.im, w->io.scene, err);
	if (rc != PSR_OK)
		return rc;
	if (w->io.scene->mRootNode == NULL || w->io.scene->mNumMeshes == 0)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the file has no surface", path);
	return read_scene(w, err);
}

static int read_obj(struct walk *w, struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	const int rc = obj_read_plain(im, bytes, n_bytes, err);

	w->is_plain = rc == 1;
	if (rc != 0)
		return rc < 0 ? rc : PSR_OK;
	return obj_read(&w->obj, im->path, bytes, n_bytes, err);
}

int import_assimp(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	struct walk w;
	int rc = assimp_check_counts(im, bytes, n_bytes, err);

	if (rc != PSR_OK)
		return rc;
	memset(&w, 0, sizeof w);
	if (obj_is(im->path))
		rc = read_obj(&w, im, bytes, n_bytes, err);
	if (w.is_plain) {
		bytes = (const uint8_t *)OBJ_TRIANGLE;
		n_bytes = sizeof OBJ_TRIANGLE - 1;
	}
	if (rc == PSR_OK && w.obj.n > 0) {
		bytes = w.obj.text;
		n_bytes = w.obj.n_text;
	}
	if (rc == PSR_OK)
		rc = assimp_io_init(&w.io, im, bytes, n_bytes, err);
	if (rc == PSR_OK)
		rc = read_file(&w, err);
	if (w.io.scene != NULL)
		aiReleaseImport(w.io.scene);
	free(w.material);
	free(w.uv_source);
	assimp_io_fini(&w.io);
	obj_fini(&w.obj);
	return rc;
}
