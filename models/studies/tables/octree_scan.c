/* A model as a scanner sees it: where random lines first meet its surface, with noise along them, and no normals. */
#include <math.h>
#include <string.h>
#include "base/random.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "measure/truth.h"
#include "octree.h"
#include "octree/build/build.h"
#include "surface/lobe.h"

#define LINES 8000000 /* through the unit sphere; a terrain meets a third of them */
#define RUN 64        /* traced together */
#define NOISE 3e-4    /* of the radius, either way: a third of an edge at 10 levels */
#define AWAY 2        /* radii from where a line begins to the middle */

struct scanner {
	const struct study_model *of;
	struct psr_truth *truth;
	uint64_t random, n_lines;
};

static int scan_rewind(void *userdata, struct psr_error *err)
{
	struct scanner *scanner = userdata;

	(void)err;
	scanner->random = 1;
	scanner->n_lines = 0;
	return PSR_OK;
}

/* Within the unit sphere, or on it. */
static void random_place(double p[3], uint64_t *random, int is_on)
{
	do
		for (int a = 0; a < 3; a++)
			p[a] = random_in(random, -1, 1);
	while (v3d_dot(p, p) > 1 || v3d_dot(p, p) < 1e-6);
	if (is_on)
		v3d_normalize(p, p);
}

/* Lines in a random direction, each through a random place: what is met is as dense as its surface, where it is open to
 * all sides. */
static void random_line(struct ray *ray, uint64_t *random)
{
	double place[3];

	random_place(ray->direction, random, 1);
	random_place(place, random, 0);
	v3d_add_scaled(ray->origin, place, -AWAY, ray->direction);
}

static void put_point(struct octree_point *point, struct scanner *scanner, const struct ray *ray,
                      const struct ray_hit *hit)
{
	const double t = hit->t + random_in(&scanner->random, -NOISE, NOISE);
	struct look look;

	material_decode(&look, truth_attr(scanner->truth, ray, hit));
	*point = (struct octree_point){ .time = 0 };
	for (int a = 0; a < 3; a++) {
		point->at[a] = scanner->of->origin[a] + scanner->of->scale * (ray->origin[a] + t * ray->direction[a]);
		point->color[a] = psr_linear_to_srgb(look.base[a]);
	}
}

static int scan_read(size_t *n, struct octree_point *points, size_t room, void *userdata, struct psr_error *err)
{
	struct scanner *scanner = userdata;

	(void)err;
	*n = 0;
	while (*n + RUN <= room && scanner->n_lines < LINES) {
		struct ray ray[RUN];
		struct ray_hit hit[RUN];

		for (int i = 0; i < RUN; i++)
			random_line(&ray[i], &scanner->random);
		truth_trace(scanner->truth, ray, RUN, 0, hit);
		for (int i = 0; i < RUN; i++)
			if (hit[i].prim != RAY_NONE)
				put_point(&points[(*n)++], scanner, &ray[i], &hit[i]);
		scanner->n_lines += RUN;
	}
	return PSR_OK;
}

int octree_scanned(struct octree **tree, struct study *study, const struct study_model *of, int levels)
{
	struct scanner scanner = { .of = of };
	const struct octree_source source = { .name = of->name, .has_color = 1, .n_points = LINES, .rewind = scan_rewind,
		                                  .read = scan_read, .userdata = &scanner };
	struct octree_build_options options;
	int rc = psr_truth_create(&scanner.truth, of->mesh, study->err);

	octree_build_options_default(&options);
	options.levels = levels;
	if (rc == PSR_OK)
		rc = octree_build(tree, &source, &options, study->err);
	psr_truth_destroy(scanner.truth);
	return rc;
}
