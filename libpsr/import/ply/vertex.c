#include <stdlib.h>
#include <string.h>
#include "import/cloud/cloud.h"
#include "ply.h"

/* Properties of a row by role; -1: none. */
struct roles {
	int position[3], normal[3], uv[2];
	struct ply_colors colors;
	int has_colors;
};

int ply_colors_find(struct ply_colors *colors, const struct ply_header *header, const struct ply_element *element)
{
	static const char *const names[4][6] = {
		{ "red", "diffuse_red", "r", NULL },
		{ "green", "diffuse_green", "g", NULL },
		{ "blue", "diffuse_blue", "b", NULL },
		{ "alpha", "diffuse_alpha", "a", NULL },
	};

	for (int c = 0; c < 4; c++) {
		const struct ply_property *p;

		colors->property[c] = ply_find_property(header, element, names[c]);
		if (colors->property[c] < 0)
			continue;
		p = &header->property[element->first_property + (unsigned)colors->property[c]];
		if (p->count_type != PLY_NO_TYPE)
			colors->property[c] = -1;
		/* 32-bit integers hold 8-bit codes. */
		colors->scale[c] = p->type >= PLY_FLOAT ? 0.0 : p->type == PLY_UINT16 ? 255.0 / 65535.0 : 1.0;
	}
	return colors->property[0] >= 0 && colors->property[1] >= 0 && colors->property[2] >= 0;
}

void ply_colors_get(float out[4], const struct ply_colors *colors, const struct ply_rows *rows)
{
	for (int c = 0; c < 4; c++) {
		double x = colors->property[c] >= 0 ? rows->scalar[colors->property[c]] : 0.0;

		if (colors->property[c] < 0)
			out[c] = 1.0f;
		else if (colors->scale[c] == 0.0)
			out[c] = (float)x;
		else
			out[c] = c < 3 ? cloud_linear(x * colors->scale[c]) : (float)(x * colors->scale[c] / 255.0);
	}
}

static int find_roles(struct roles *roles, const struct ply_rows *rows, struct psr_error *err)
{
	static const char *const position[3][2] = { { "x", NULL }, { "y", NULL }, { "z", NULL } };
	static const char *const normal[3][3] = {
		{ "nx", "normal_x", NULL }, { "ny", "normal_y", NULL }, { "nz", "normal_z", NULL }
	};
	static const char *const uv[2][6] = { { "s", "u", "texture_u", "texture_s", "tx", NULL },
		                              { "t", "v", "texture_v", "texture_t", "ty", NULL } };
	const struct ply_property *p = &rows->header->property[rows->element->first_property];

	for (int c = 0; c < 3; c++) {
		roles->position[c] = ply_find_property(rows->header, rows->element, position[c]);
		if (roles->position[c] < 0 || p[roles->position[c]].count_type != PLY_NO_TYPE)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: line %u: the element vertex has no property %s", rows->path,
			                rows->element->line, position[c][0]);
		roles->normal[c] = ply_find_property(rows->header, rows->element, normal[c]);
	}
	for (int c = 0; c < 2; c++)
		roles->uv[c] = ply_find_property(rows->header, rows->element, uv[c]);
	roles->has_colors = ply_colors_find(&roles->colors, rows->header, rows->element);
	return PSR_OK;
}

static int has_all(const int *property, int n)
{
	for (int i = 0; i < n; i++)
		if (property[i] < 0)
			return 0;
	return 1;
}

/* Returns NULL if not wanted; sets *ok to 0 without memory. */
static void *array(int wanted, uint64_t n, size_t size, int *ok)
{
	void *block = wanted ? malloc((size_t)(n > 0 ? n : 1) * size) : NULL;

	if (wanted && block == NULL)
		*ok = 0;
	return block;
}

void ply_vertices_fini(struct ply_vertices *vertices)
{
	free(vertices->position);
	free(vertices->normal);
	free(vertices->uv);
	free(vertices->color);
}

static void put_vertex(struct ply_vertices *out, uint32_t at, const struct roles *roles, const struct ply_rows *rows)
{
	for (int c = 0; c < 3; c++)
		out->position[at][c] = rows->scalar[roles->position[c]];
	for (int c = 0; out->normal != NULL && c < 3; c++)
		out->normal[at][c] = (float)rows->scalar[roles->normal[c]];
	if (out->uv != NULL) {
		out->uv[at][0] = (float)rows->scalar[roles->uv[0]];
		out->uv[at][1] = 1.0f - (float)rows->scalar[roles->uv[1]]; /* v points up, as in OBJ */
	}
	if (out->color != NULL)
		ply_colors_get(out->color[at], &roles->colors, rows);
}

int ply_vertices_are_one_color(const struct ply_vertices *vertices)
{
	for (uint32_t i = 1; vertices->color != NULL && i < vertices->n; i++)
		if (memcmp(vertices->color[i], vertices->color[0], sizeof vertices->color[0]) != 0)
			return 0;
	return vertices->color != NULL;
}

int ply_vertices_read(struct ply_vertices *out, struct ply_rows *rows, struct psr_error *err)
{
	const uint64_t n = rows->element->n_rows;
	struct roles roles;
	int rc = find_roles(&roles, rows, err), ok = 1;

	memset(out, 0, sizeof *out);
	if (rc != PSR_OK)
		return rc;
	if (n > IMPORT_MAX_VERTICES)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: line %u: more than %llu vertices", rows->path, rows->element->line,
		                (unsigned long long)IMPORT_MAX_VERTICES);
	out->n = (uint32_t)n;
	out->position = array(1, n, sizeof *out->position, &ok);
	out->normal = array(has_all(roles.normal, 3), n, sizeof *out->normal, &ok);
	out->uv = array(has_all(roles.uv, 2), n, sizeof *out->uv, &ok);
	out->color = array(roles.has_colors, n, sizeof *out->color, &ok);
	if (!ok)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %u vertices", rows->path, out->n);
	for (uint32_t i = 0; i < out->n && rc == PSR_OK; i++) {
		rc = ply_rows_next(rows, err);
		if (rc == PSR_OK)
			put_vertex(out, i, &roles, rows);
	}
	return rc;
}
