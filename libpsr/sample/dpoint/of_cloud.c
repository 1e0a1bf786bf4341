/* The points of a mesh that has no triangles. */
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "building.h"
#include "dpoint/cloud.h"
#include "import/cloud/cloud.h"
#include "model/blocks.h"

_Static_assert(CLOUD_NEIGHBOURS <= DPOINT_MOST_NEAR, "all neighbours count");

/* Points in the order of the tree's slots, in inner units. */
struct points {
	double (*at)[3];
	float (*normal)[3], *radius;
	uint32_t *part;
	uint64_t *attr;
};

static int points_init(struct points *p, uint32_t n)
{
	p->at = malloc(n * sizeof *p->at);
	p->normal = malloc(n * sizeof *p->normal);
	p->radius = malloc(n * sizeof *p->radius);
	p->part = malloc(n * sizeof *p->part);
	p->attr = malloc(n * sizeof *p->attr);
	return p->at != NULL && p->normal != NULL && p->radius != NULL && p->part != NULL && p->attr != NULL;
}

static void points_fini(struct points *p)
{
	free(p->at);
	free(p->normal);
	free(p->radius);
	free(p->part);
	free(p->attr);
}

static void take(struct points *p, const struct building *b, const struct cloud *tree)
{
	const struct psr_mesh *mesh = b->mesh;

	for (uint32_t i = 0; i < tree->n; i++) {
		const uint32_t id = tree->point[i].id;
		const struct surface_place place = { .prim = id };
		float normal[3];

		v3d_sub(p->at[i], mesh->point[id], b->info->origin);
		v3d_scale(p->at[i], p->at[i], 1 / b->info->scale);
		memcpy(p->normal[i], mesh->point_normal[id], sizeof p->normal[i]);
		p->radius[i] = (float)((double)mesh->point_radius[id] / b->info->scale);
		p->part[i] = mesh->point_material[id];
		p->attr[i] = surface_look(&b->look, &place, 0, normal) & ~(uint64_t)PSR_ATTR_NORMAL(UINT64_MAX);
	}
}

static int put(struct building *b, const struct cloud *tree, const struct points *p)
{
	const struct dpoint_cloud cloud = { tree->n, tree->k, (const double (*)[3])p->at, (const float (*)[3])p->normal,
		                                p->radius, tree->near, p->part, p->attr };
	const struct dpoint_cover_options cover = building_cover(b->options);
	struct dpoint_cloud_report report;
	int rc = dpoint_sample_cloud(&b->surface, &report, &cloud, &cover, cover.delta, b->options->pool);

	if (rc == PSR_OK && report.n_flat == tree->n)
		return psr_fail(b->err, PSR_ERR_FORMAT, "no point of %u has a surface around it, of seven points that are not on a"
		                " line; build an octree", tree->n);
	b->n_flat = report.n_flat;
	for (uint32_t m = 0; m < b->mesh->n_materials; m++)
		b->two_sided[m] = b->mesh->material[m].two_sided && !report.is_closed;
	return rc;
}

int building_put_cloud(struct building *b)
{
	struct cloud tree = { .n = b->mesh->n_points, .pool = b->options->pool };
	struct points points = { 0 };
	int rc = PSR_OK;

	if (tree.n > DPOINT_MOST_CLOUD)
		return psr_fail(b->err, PSR_ERR_LIMIT, "the cloud has %u points, and differential points are made of %u at most; build"
		                " an octree", tree.n, DPOINT_MOST_CLOUD);
	if (!points_init(&points, tree.n))
		rc = PSR_ERR_MEMORY;
	if (rc == PSR_OK)
		rc = cloud_tree_build(&tree, (const double (*)[3])b->mesh->point);
	if (rc == PSR_OK) {
		cloud_tree_nearest(&tree);
		take(&points, b, &tree);
		rc = put(b, &tree, &points);
	}
	points_fini(&points);
	free(tree.point);
	free(tree.near);
	free(tree.node);
	return rc == PSR_ERR_MEMORY ? psr_fail(b->err, rc, "no memory for the curvatures of %u points", tree.n) : rc;
}
