#include <math.h>
#include "base/direction.h"
#include "base/mem.h"
#include "base/vec.h"
#include "keep.h"
#include "psr/error.h"
#include "sample/visible/sides.h"
#include "surface/blend.h"

#define MOST_BLENDED 64

/* Diameter of the circle that textures are averaged over, in distances of samples: pictures weigh samples by where they
 * lie, which blurs them once more (decision 0159). */
#define TEXTURE_DIAMETER 1.2

/* Samples are drawn where their normals face the eye. A shading normal further than this from its face's, by a normal
 * map or smoothing at a crease, would open the surface in views along it: such a sample is bent, and faces by a normal
 * that is as near as this. */
#define LEAST_AGREEMENT 0.94f       /* 20 degrees */
#define LEAST_AGREEMENT_WIDE 0.985f /* 10, where a face is so wide that no sample beside it closes the opening */
#define WIDE_PIXELS 3

#define NORMAL_BITS UINT64_C(0x7fff)

static int is_wide(const struct sampling *sampling, uint32_t prim)
{
	const double least = WIDE_PIXELS * sampling->ds;
	double corner[3][3], side[3][3], cross[3], longest2 = 0;

	if (prim >= sampling->mesh->n_triangles)
		return 0;
	ray_scene_corners(sampling->scene, prim, corner);
	for (int i = 0; i < 3; i++) {
		v3d_sub(side[i], corner[(i + 1) % 3], corner[i]);
		longest2 = fmax(longest2, v3d_dot(side[i], side[i]));
	}
	v3d_cross(cross, side[0], side[1]);
	return v3d_dot(cross, cross) > least * least * longest2;
}

static float least_agreement(const struct sampling *sampling, uint32_t prim)
{
	return is_wide(sampling, prim) ? LEAST_AGREEMENT_WIDE : LEAST_AGREEMENT;
}

/* Finds the normal nearest to `normal` within a cosine of the face's. */
static uint16_t agree(uint16_t normal, const float face[3], float least)
{
	const float *n = psr_direction_table()[normal];
	float g = v3f_dot(n, face), aside[3], turned[3];

	if (g >= least)
		return normal;
	v3f_add_scaled(aside, n, -g, face);
	if (v3f_normalize(aside, aside) == 0)
		v3f_set(aside, 0, 0, 0);
	v3f_scale(turned, face, least);
	v3f_add_scaled(turned, turned, sqrtf(1 - least * least), aside);
	return (uint16_t)psr_direction_encode(turned);
}

/* Blends the attributes and facing normals of finer samples, with weights that fall to 0 at a pixel's distance. 0 if
 * there are none, and then `to` is unchanged. */
static int blend(const struct keeper *keeper, const float n[3], const float facing[3], uint32_t prim,
                 struct kept_sample *to)
{
	const struct kept *finer = keeper->finer;
	const double ds = keeper->sampling->ds;
	const float (*direction)[3] = psr_direction_table(), *p = to->position;
	float weight[MOST_BLENDED], reach2 = (float)(ds * ds);
	uint64_t found[MOST_BLENDED], straight[MOST_BLENDED];
	uint32_t first[GRID_MOST_AROUND];
	int n_cells = grid_around(&finer->grid, p, ds, first), count = 0, n_bent = 0;

	for (int c = 0; c < n_cells; c++) {
		for (uint32_t i = first[c]; i != GRID_NONE; i = finer->sample[i].next) {
			const struct kept_sample *point = &finer->sample[i];
			float d[3], w, g = v3f_dot(direction[point->normal], n);

			v3f_sub(d, point->position, p);
			w = 1 - v3f_dot(d, d) / reach2;
			if (!(w > 0) || count == MOST_BLENDED || !(g > 0.1f || (point->two_sided && g < -0.1f)))
				continue;
			weight[count] = w * w;
			straight[count] = (point->attr & ~NORMAL_BITS) | point->normal;
			found[count++] = point->attr;
			n_bent += point->traits & PSR_BLOCK_BENT;
		}
	}
	if (count == 0)
		return 0;
	to->attr = blend_attr(found, weight, count, facing);
	to->normal = (uint16_t)PSR_ATTR_NORMAL(to->attr);
	if (n_bent != 0) {
		uint16_t own = (uint16_t)PSR_ATTR_NORMAL(blend_attr(straight, weight, count, facing));

		if (v3f_dot(direction[to->normal], direction[own]) < least_agreement(keeper->sampling, prim)) {
			to->traits |= PSR_BLOCK_BENT;
			to->normal = own;
		}
	}
	return 1;
}

/* Attributes of the place itself. */
static void look(const struct sampling *sampling, const struct surface_place *place, const float n[3],
                 const float facing[3], struct kept_sample *to)
{
	const float least = least_agreement(sampling, place->prim);
	uint64_t word;
	float normal[3];

	word = surface_look(sampling->surface, place, TEXTURE_DIAMETER * sampling->ds, normal);
	to->attr = word | psr_direction_encode(normal);
	to->traits |= v3f_dot(normal, n) < least ? PSR_BLOCK_BENT : 0;
	surface_face(normal, facing);
	to->normal = agree((uint16_t)psr_direction_encode(normal), n, least);
	if (!(to->traits & PSR_BLOCK_BENT))
		to->attr = word | to->normal;
}

static int is_sheer(const struct sampling *sampling, const struct surface_place *place)
{
	float rgba[4];

	if (sampling_material(sampling, place->prim)->alpha != PSR_ALPHA_BLEND)
		return 0;
	texture_base_color(sampling->mesh, place->prim, place->u, place->v, rgba);
	return rgba[3] < 1;
}

/* Whether a moved sample ended far off the surface. */
static int is_off(const struct sampling *sampling, const float p[3])
{
	const double point[3] = { (double)p[0], (double)p[1], (double)p[2] };

	return ray_scene_distance(sampling->scene, point, PSR_SAMPLE_OFF * sampling->ds) == INFINITY;
}

static void make_sample(const struct keeper *keeper, const struct sample_ref *ref, struct kept_sample *sample)
{
	const struct sampling *sampling = keeper->sampling;
	const struct sheets *sheets = &keeper->sheets[ref->projection];
	const struct patch *patch = &sheets->patch[ref->at.patch];
	const float *facing = sheets->projection.axis[2];
	uint32_t surface = sheets->sample[ref->at.patch][ref->at.sample].surface, prim = surface & ~SURFACE_BACK;
	struct surface_place place = { .prim = prim, .is_back = (surface & SURFACE_BACK) != 0 };
	struct ray ray;
	double x, y;
	float n[3];

	sheets_point(sheets, PSR_BLOCK_SIDE * patch->row + (int)(ref->at.sample / PSR_BLOCK_SIDE),
	             PSR_BLOCK_SIDE * patch->col + (int)(ref->at.sample % PSR_BLOCK_SIDE), &x, &y);
	sheets_ray(&sheets->projection, x, y, &ray);
	ray_locate(sampling->scene, &ray, prim, &place.u, &place.v);
	sheets_position(sheets, ref->at, sample->position);
	sampling_normal(sampling, surface, n);
	sample->traits = is_sheer(sampling, &place) ? PSR_BLOCK_SHEER : 0;
	sample->opacity = PSR_OPAQUE;
	if (sample->traits == 0 && sampling_is_thin(sampling, prim))
		sample->opacity = thin_opacity(sampling, sample->position, n);
	if (sample->opacity < PSR_OPAQUE)
		sample->traits = PSR_BLOCK_SHEER | PSR_BLOCK_THIN;
	if ((patch->moved >> ref->at.sample & 1) != 0 && is_off(sampling, sample->position))
		sample->traits |= PSR_BLOCK_OFF;
	if (keeper->finer == NULL || !blend(keeper, n, facing, prim, sample))
		look(sampling, &place, n, facing, sample);
	sample->two_sided = (uint8_t)keep_is_two_sided(keeper, prim, sample->position, n);
	sample->sample = (uint8_t)ref->at.sample;
	sample->projection = ref->projection;
	sample->patch = ref->at.patch;
	sample->next = GRID_NONE;
}

int keep_is_two_sided(const struct keeper *keeper, uint32_t prim, const float p[3], const float n[3])
{
	float back[3];

	if (sampling_is_thin(keeper->sampling, prim))
		return 1;
	if (!sampling_material(keeper->sampling, prim)->two_sided)
		return 0;
	v3f_scale(back, n, -1);
	return (keeper->sides[prim] & SIDES_SEEN) == SIDES_SEEN
	       || (visible_set_has(keeper->visible, p, back) && visible_set_has(keeper->visible, p, n));
}

int keep_sample(const struct keeper *keeper, struct sample_ref ref)
{
	struct kept_sample sample;

	if (sheets_is_kept(&keeper->sheets[ref.projection], ref.at))
		return PSR_OK;
	make_sample(keeper, &ref, &sample);
	sheets_keep(&keeper->sheets[ref.projection], ref.at);
	return kept_add(keeper->kept, &sample);
}

int keep_moved(const struct keeper *keeper, unsigned projection, struct lattice_point at, float z, uint32_t surface)
{
	struct sample_ref ref = { .projection = projection };
	int rc = sheets_add(&keeper->sheets[projection], at, z, surface, sampling_is_sheet(keeper->sampling, surface),
	                    &ref.at);

	return rc != PSR_OK || ref.at.patch == SHEET_NONE ? rc : keep_sample(keeper, ref);
}

struct job {
	const struct keeper *keeper;
	const struct sample_ref *ref;
	struct kept_sample *sample;
	uint32_t n;
};

#define CHUNK 4096

static void make_chunk(int i, void *userdata)
{
	struct job *job = userdata;
	uint32_t end = (uint32_t)(i + 1) * CHUNK < job->n ? (uint32_t)(i + 1) * CHUNK : job->n;

	for (uint32_t k = (uint32_t)i * CHUNK; k < end; k++)
		make_sample(job->keeper, &job->ref[k], &job->sample[k]);
}

int keep_samples(const struct keeper *keeper, const struct sample_ref *ref, uint32_t n)
{
	struct job job = { .keeper = keeper, .ref = ref, .n = n };
	int rc = PSR_OK;

	job.sample = psr_alloc_array(n, sizeof *job.sample);
	if (job.sample == NULL)
		return PSR_ERR_MEMORY;
	psr_pool_for(keeper->sampling->pool, (int)((n + CHUNK - 1) / CHUNK), make_chunk, &job);
	for (uint32_t i = 0; rc == PSR_OK && i < n; i++) {
		sheets_keep(&keeper->sheets[ref[i].projection], ref[i].at);
		rc = kept_add(keeper->kept, &job.sample[i]);
	}
	psr_free(job.sample);
	return rc;
}

/* ref: NULL to count them. */
static uint32_t list_owned(const struct keeper *keeper, const struct ownership *ownership, struct sample_ref *ref)
{
	uint32_t n = 0;

	for (unsigned i = 0; i < N_PROJECTIONS; i++) {
		for (uint32_t p = 0; p < keeper->sheets[i].n_patches; p++) {
			for (uint64_t left = ownership->patch[i][p].mask; left != 0; left &= left - 1, n++)
				if (ref != NULL)
					ref[n] = (struct sample_ref){ i, { p, (uint32_t)__builtin_ctzll(left) } };
		}
	}
	return n;
}

int keep_owned(const struct keeper *keeper, const struct ownership *ownership)
{
	struct sample_ref *ref = psr_alloc_array(list_owned(keeper, ownership, NULL), sizeof *ref);
	int rc;

	if (ref == NULL)
		return PSR_ERR_MEMORY;
	rc = keep_samples(keeper, ref, list_owned(keeper, ownership, ref));
	psr_free(ref);
	return rc;
}

static void look_again(int i, void *userdata)
{
	const struct keeper *keeper = userdata;
	struct kept *kept = keeper->kept;
	uint32_t end = (uint32_t)(i + 1) * CHUNK < kept->n ? (uint32_t)(i + 1) * CHUNK : kept->n;

	for (uint32_t k = (uint32_t)i * CHUNK; k < end; k++) {
		struct kept_sample *sample = &kept->sample[k];
		uint32_t surface = keeper->sheets[sample->projection].sample[sample->patch][sample->sample].surface;
		float n[3];

		sampling_normal(keeper->sampling, surface, n);
		sample->two_sided = (uint8_t)keep_is_two_sided(keeper, surface & ~SURFACE_BACK, sample->position, n);
	}
}

void keep_look_again(const struct keeper *keeper)
{
	struct keeper job = *keeper;

	psr_pool_for(keeper->sampling->pool, (int)((keeper->kept->n + CHUNK - 1) / CHUNK), look_again, &job);
}
