#include <ctype.h>
#include <string.h>
#include "check.h"

#define MAX_HEADER 65536

struct text {
	const uint8_t *at, *end;
};

static int skip_blank(struct text *t)
{
	while (t->at < t->end) {
		if (*t->at == '#')
			while (t->at < t->end && *t->at != '\n' && *t->at != '\r')
				t->at++;
		else if (isspace(*t->at))
			t->at++;
		else
			return 1;
	}
	return 0;
}

/* Reads the next word as a number, which saturates; returns 0 if it is not one. */
static int next_number(struct text *t, uint64_t *x)
{
	if (!skip_blank(t) || !isdigit(*t->at))
		return 0;
	for (*x = 0; t->at < t->end && isdigit(*t->at); t->at++)
		*x = *x > UINT64_MAX / 10 - 1 ? *x : *x * 10 + (uint64_t)(*t->at - '0');
	return 1;
}

static void skip_word(struct text *t)
{
	while (t->at < t->end && !isspace(*t->at))
		t->at++;
}

static int check_off(const struct import_mesh *im, struct text t, size_t n_bytes, struct psr_error *err)
{
	uint64_t n;

	if (skip_blank(&t) && !isdigit(*t.at))
		skip_word(&t);
	for (int i = 0; i < 2 && next_number(&t, &n); i++)
		if (n > n_bytes)
			return psr_fail(err, PSR_ERR_FORMAT,
			                "%s: the OFF header promises %llu %s, but the file has only %zu bytes",
			                im->path, (unsigned long long)n, i == 0 ? "vertices" : "faces", n_bytes);
	return PSR_OK;
}

/* Tells the format by the file's ending, or by a first word like OFF, COFF, STCN4OFF. */
static int is_off(const char *path, struct text t)
{
	const uint8_t *start;
	size_t word;

	if (import_path_ends_with(path, ".off"))
		return 1;
	if (!skip_blank(&t))
		return 0;
	start = t.at;
	skip_word(&t);
	word = (size_t)(t.at - start);
	return word >= 3 && word <= 9 && memcmp(t.at - 3, "OFF", 3) == 0;
}

int assimp_check_counts(const struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	struct text t = { bytes, bytes + (n_bytes < MAX_HEADER ? n_bytes : MAX_HEADER) };

	return is_off(im->path, t) ? check_off(im, t, n_bytes, err) : PSR_OK;
}

int assimp_check_faces(const struct import_mesh *im, const struct aiScene *scene, struct psr_error *err)
{
	for (unsigned m = 0; m < scene->mNumMeshes; m++) {
		const struct aiMesh *mesh = scene->mMeshes[m];

		if (mesh == NULL || (mesh->mVertices == NULL && mesh->mNumVertices > 0) ||
		    (mesh->mFaces == NULL && mesh->mNumFaces > 0))
			return psr_fail(err, PSR_ERR_FORMAT, "%s: mesh %u is empty", im->path, m);
		for (unsigned f = 0; f < mesh->mNumFaces; f++)
			for (unsigned i = 0; i < mesh->mFaces[f].mNumIndices; i++)
				if (mesh->mFaces[f].mIndices[i] >= mesh->mNumVertices)
					return psr_fail(err, PSR_ERR_FORMAT,
					                "%s: face %u of mesh %u refers to vertex %u, but there are only %u",
					                im->path, f, m, mesh->mFaces[f].mIndices[i], mesh->mNumVertices);
	}
	return PSR_OK;
}
