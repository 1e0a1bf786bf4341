#include <math.h>
#include "voxels.h"
#include "runs.h"
#include "base/array.h"
#include "base/vec.h"

struct meeting {
	struct runs runs;
	int levels;
	uint32_t triangle;
	double corner[3][3], side[3][3], normal[3]; /* of a triangle, in leaves */
	int first[3], last[3];                      /* leaves that its bounds meet */
	struct psr_error *err;
};

/* Returns whether the triangle's shadow on an axis and the cube's are apart. Corners count from the cube's middle, so that
 * a triangle on one of its faces is met however large the axis is. `half`: the cube's edge, halved. */
static int is_apart(const double corner[3][3], const double axis[3], double half)
{
	const double reach = half * (fabs(axis[0]) + fabs(axis[1]) + fabs(axis[2]));
	const double a = v3d_dot(axis, corner[0]), b = v3d_dot(axis, corner[1]), c = v3d_dot(axis, corner[2]);

	return fmin(a, fmin(b, c)) > reach || fmax(a, fmax(b, c)) < -reach;
}

/* Separating axes: the triangle's normal, and the products of its sides with the cube's. Those of the cube itself are
 * the bounds. */
static int meets(const struct meeting *m, const double middle[3], double half)
{
	double corner[3][3];

	for (int i = 0; i < 3; i++)
		v3d_sub(corner[i], m->corner[i], middle);
	if (is_apart(corner, m->normal, half))
		return 0;
	for (int i = 0; i < 3; i++) {
		const double *s = m->side[i];

		if (is_apart(corner, (const double[3]){ 0.0, s[2], -s[1] }, half) ||
		    is_apart(corner, (const double[3]){ -s[2], 0.0, s[0] }, half) ||
		    is_apart(corner, (const double[3]){ s[1], -s[0], 0.0 }, half))
			return 0;
	}
	return 1;
}

/* at: of the node, in nodes of its size; up: levels above the leaves. */
static int put_leaves(struct meeting *m, const uint32_t at[3], int up)
{
	const double edge = ldexp(1.0, up), middle[3] = { (at[0] + 0.5) * edge, (at[1] + 0.5) * edge, (at[2] + 0.5) * edge };
	int rc = PSR_OK;

	for (int c = 0; c < 3; c++)
		if ((int)(at[c] << up) > m->last[c] || (int)((at[c] + 1) << up) - 1 < m->first[c])
			return PSR_OK;
	if (!meets(m, middle, 0.5 * edge))
		return PSR_OK;
	if (up == 0) {
		const struct record record = { .path = octree_path(at), .triangle = m->triangle };

		return runs_put(&m->runs, &record, m->err);
	}
	for (uint32_t j = 0; j < 8 && rc == PSR_OK; j++)
		rc = put_leaves(m, (const uint32_t[3]){ 2 * at[0] + (j & 1), 2 * at[1] + (j >> 1 & 1), 2 * at[2] + (j >> 2) },
		                up - 1);
	return rc;
}

static int put_triangle(struct meeting *m, const struct octree_surface *s, const uint32_t triangle[3])
{
	const int most = (1 << m->levels) - 1;
	const double edge = ldexp(1.0, m->levels), scale = edge / s->edge;
	uint32_t at[3];
	int up = 0;

	for (int i = 0; i < 3; i++)
		for (int c = 0; c < 3; c++)
			m->corner[i][c] = octree_surface_place(s, triangle[i], c, edge, scale);
	for (int i = 0; i < 3; i++)
		v3d_sub(m->side[i], m->corner[(i + 1) % 3], m->corner[i]);
	v3d_cross(m->normal, m->side[0], m->side[1]);
	for (int c = 0; c < 3; c++) {
		const double low = fmin(m->corner[0][c], fmin(m->corner[1][c], m->corner[2][c]));
		const double high = fmax(m->corner[0][c], fmax(m->corner[1][c], m->corner[2][c]));

		/* A cell is closed: one that ends where the triangle begins is met. */
		m->first[c] = (int)fmin(fmax(ceil(low) - 1.0, 0.0), most);
		m->last[c] = (int)fmin(fmax(floor(high), 0.0), most);
	}
	while (m->first[0] >> up != m->last[0] >> up || m->first[1] >> up != m->last[1] >> up ||
	       m->first[2] >> up != m->last[2] >> up)
		up++;
	for (int c = 0; c < 3; c++)
		at[c] = (uint32_t)m->first[c] >> up;
	return put_leaves(m, at, up);
}

/* The triangles of one leaf. */
struct group {
	uint64_t path;
	uint32_t *triangle;
	size_t n, room;
};

static int merge(struct meeting *m, int (*visit)(uint64_t path, const uint32_t *triangle, size_t n, void *userdata),
                 void *userdata)
{
	struct group group = { 0 };
	const struct record *record;
	int rc = PSR_OK;

	while (rc == PSR_OK && (record = runs_next(&m->runs, &rc, m->err)) != NULL) {
		if (group.n > 0 && record->path != group.path) {
			rc = visit(group.path, group.triangle, group.n, userdata);
			group.n = 0;
		}
		group.path = record->path;
		if (!ARRAY_ROOM(group.triangle, group.n, group.room))
			rc = psr_fail(m->err, PSR_ERR_MEMORY, "no memory for the triangles of a leaf");
		else
			group.triangle[group.n++] = record->triangle;
	}
	if (rc == PSR_OK && group.n > 0)
		rc = visit(group.path, group.triangle, group.n, userdata);
	free(group.triangle);
	return rc;
}

int octree_surface_walk(const struct octree_surface *surface, int levels, const struct octree_room *room,
                        int (*visit)(uint64_t path, const uint32_t *triangle, size_t n, void *userdata), void *userdata,
                        struct psr_error *err)
{
	struct meeting m = { .levels = levels, .err = err };
	int rc;

	if (levels < OCTREE_LEAST_LEVELS || levels > OCTREE_MOST_LEVELS)
		return psr_fail(err, PSR_ERR_ARG, "an octree of %d levels; %d to %d are possible", levels, OCTREE_LEAST_LEVELS,
		                OCTREE_MOST_LEVELS);
	rc = runs_init(&m.runs, room->folder, 3 * levels, 0, room->memory, err);
	for (uint32_t i = 0; i < surface->n_triangles && rc == PSR_OK; i++) {
		m.triangle = i;
		rc = i % 1024 == 0 && psr_is_cancelled(surface->cancel) ? psr_fail(err, PSR_ERR_CANCELLED, "cancelled")
		                                                        : put_triangle(&m, surface, surface->triangle[i]);
	}
	if (rc == PSR_OK)
		rc = runs_end(&m.runs, err);
	if (rc == PSR_OK)
		rc = merge(&m, visit, userdata);
	runs_fini(&m.runs);
	return rc;
}

struct making {
	struct octree_maker maker;
	struct psr_error *err;
};

static int put_leaf(uint64_t path, const uint32_t *triangle, size_t n, void *userdata)
{
	struct making *making = userdata;

	(void)triangle, (void)n;
	return octree_maker_put(&making->maker, path, making->err);
}

int octree_from_surface(struct octree **out, const struct octree_surface *surface, int levels, uint64_t memory,
                        const char *folder, struct psr_error *err)
{
	const struct octree_room room = { memory, folder };
	struct making making = { .err = err };
	int rc = octree_maker_init(&making.maker, levels, err);

	if (rc == PSR_OK)
		rc = octree_surface_walk(surface, levels, &room, put_leaf, &making, err);
	if (rc == PSR_OK)
		*out = octree_maker_take(&making.maker);
	octree_maker_fini(&making.maker);
	return rc;
}
