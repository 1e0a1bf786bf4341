#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "render/block.h"
#include "cull.h"

#define RUN 32 /* blocks */
#define NEAR 0.25 /* steps of the lattice */

struct job {
	const struct psr_blocks *blocks;
	const struct ray_scene *scene;
	const struct cull_eye *eye;
	uint8_t *n_seen;
};

static int is_away(const struct psr_blocks *blocks, uint32_t block, uint32_t sample, const double to_eye[3])
{
	const float v[3] = { (float)to_eye[0], (float)to_eye[1], (float)to_eye[2] };
	const float *normal = psr_direction_table()[PSR_ATTR_NORMAL(block_attr(blocks, block, sample))];

	return (blocks->flags[block] & PSR_BLOCK_TWO_SIDED) == 0
	       && (psr_blocks_traits(blocks, block) & PSR_BLOCK_BENT) == 0 && faces_away(v3f_dot(normal, v), v);
}

/* Aims a ray of unit direction from the eye, which meets fronts as the eye does, and finds the sample's distance.
 * Returns 0 for a sample outside of the picture or facing away. */
static int aim(struct ray *ray, double *distance, const struct job *job, uint32_t block, uint32_t sample)
{
	const struct cull_eye *eye = job->eye;
	double c[3], to_eye[3];
	float p[3];

	block_position(job->blocks, block, sample, p);
	for (int k = 0; k < 3; k++) {
		ray->origin[k] = eye->place[k];
		ray->direction[k] = (double)p[k] - eye->place[k];
		to_eye[k] = -ray->direction[k];
	}
	m3d_apply(c, eye->frame, ray->direction);
	if (fabs(c[0]) > c[2] * eye->tangent || fabs(c[1]) > c[2] * eye->tangent)
		return 0;
	*distance = v3d_normalize(ray->direction, ray->direction);
	return !is_away(job->blocks, block, sample, to_eye);
}

static void look_at_block(const struct job *job, uint32_t block)
{
	const struct psr_projection *projection = &job->blocks->projection[job->blocks->block_projection[block]];
	struct ray ray[PSR_BLOCK_SAMPLES];
	struct ray_hit hit[PSR_BLOCK_SAMPLES];
	double distance[PSR_BLOCK_SAMPLES], near = NEAR * (double)projection->spacing;
	int n = 0;

	for (uint64_t left = job->blocks->mask[block]; left != 0; left &= left - 1)
		n += aim(&ray[n], &distance[n], job, block, (uint32_t)__builtin_ctzll(left));
	job->n_seen[block] = 0;
	if (n == 0)
		return;
	ray_scene_trace(job->scene, ray, n, 0, hit);
	for (int i = 0; i < n; i++)
		job->n_seen[block] += hit[i].prim == RAY_NONE || hit[i].t >= distance[i] - near;
}

static void look_at_run(int run, void *userdata)
{
	const struct job *job = userdata;
	uint32_t end = RUN * ((uint32_t)run + 1);

	for (uint32_t b = RUN * (uint32_t)run; b < end && b < job->blocks->n_blocks; b++)
		look_at_block(job, b);
}

void cull_set_look(const struct cull_set *set, const struct ray_scene *scene, const struct cull_eye *eye,
                   struct psr_pool *pool, uint8_t *n_seen)
{
	struct job job = { psr_model_blocks(set->base), scene, eye, n_seen };

	psr_pool_for(pool, (int)((set->n_blocks + RUN - 1) / RUN), look_at_run, &job);
}
