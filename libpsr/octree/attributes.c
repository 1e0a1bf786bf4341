#include <stdlib.h>
#include "attributes_job.h"
#include "base/direction.h"

static struct odds *odds_make(int is_older)
{
	struct odds *odds = malloc(sizeof *odds);

	for (size_t i = 0; odds != NULL && i < sizeof *odds / sizeof(uint32_t); i++)
		((uint32_t *)odds)[i] = is_older ? CODER_EVEN : CODER_COUNTED_EVEN;
	return odds;
}

static void find_near(struct job *job, const struct octree_near *near)
{
	job->n = 0;
	job->weight = 0;
	for (uint32_t left = near->before; left != 0; left &= left - 1) {
		const int k = __builtin_ctz(left), x = k % 3 - 1, y = k / 3 % 3 - 1, z = k / 9 - 1;
		const int weight = 4 - x * x - y * y - z * z;

		job->near[job->n++] = (struct near_leaf){ octree_near_at(near, (unsigned)k), weight, { x, y, z } };
		job->weight += weight;
	}
}

/* ---- offsets ---- */

/* By how far apart offsets are that neighbours foretell. */
static unsigned range_of(const struct job *job, int64_t least, int64_t most)
{
	const int64_t range = (most - least) * 4 / STEP;

	if (job->is_older)
		return count_of(job);
	return job->n < 2 ? job->n : range < 1 ? 2 : range < 3 ? 3 : range < 6 ? 4 : range < 10 ? 5 : 6;
}

/* The plane through a neighbour's point, across the leaf's normal, tells where the leaf's point is. */
static void code_offset(struct job *job, uint32_t leaf)
{
	const uint16_t *const normal = job->attributes.normal;
	uint8_t *const offset = job->attributes.offset;
	int64_t sum = 0, least = INT64_MAX, most = INT64_MIN;
	int v[3] = { 0, 0, 0 }, bin = BINS / 2;

	if (normal != NULL)
		unit_of(job, normal[leaf], v);
	for (unsigned i = 0; i < job->n; i++) {
		const struct near_leaf *near = &job->near[i];
		int64_t along = UNIT, up = (2 * offset[near->at] - (OCTREE_OFFSETS - 1)) * (STEP / 2);

		if (normal != NULL) {
			int of[3];

			unit_of(job, normal[near->at], of);
			along = ((int64_t)of[0] * v[0] + (int64_t)of[1] * v[1] + (int64_t)of[2] * v[2]) / UNIT;
		}
		up = up * along / UNIT + near->place[0] * v[0] + near->place[1] * v[1] + near->place[2] * v[2];
		sum += near->weight * up;
		least = up < least ? up : least;
		most = up > most ? up : most;
	}
	if (job->n > 0)
		bin += (int)(sum * 4 / ((int64_t)job->weight * STEP));
	bin = bin < 0 ? 0 : bin >= BINS ? BINS - 1 : bin;
	const unsigned range = job->n > 0 ? range_of(job, least, most) : 0;
	const unsigned step = code_bits(job, job->odds->offset[bin][range], 2, job->is_decoding ? 0 : offset[leaf]);
	if (job->is_decoding)
		offset[leaf] = (uint8_t)step;
}

/* ---- colours ---- */

static void code_color(struct job *job, uint32_t leaf)
{
	static const int order[3] = { 1, 0, 2 }; /* green tells most of the others */
	uint8_t(*const color)[3] = job->attributes.color;
	int foretold[3] = { 128, 128, 128 }, error = 0, least = 255, most = 0, spread;

	for (int c = 0; c < 3; c++) {
		int sum = 0;

		for (unsigned i = 0; i < job->n; i++)
			sum += job->near[i].weight * color[job->near[i].at][c];
		if (job->n > 0)
			foretold[c] = (sum + job->weight / 2) / job->weight;
		else if (leaf > 0)
			foretold[c] = color[leaf - 1][c];
	}
	for (unsigned i = 0; i < job->n; i++) {
		const int green = color[job->near[i].at][1];

		least = green < least ? green : least;
		most = green > most ? green : most;
	}
	spread = job->n < 2 ? 7 : log2_floor((uint64_t)(most - least + 1));
	for (int k = 0; k < 3; k++) {
		const int c = order[k], middle = foretold[c] + error;
		const uint8_t from = (uint8_t)(middle < 0 ? 0 : middle > 255 ? 255 : middle);
		const uint8_t step = job->is_decoding ? 0 : (uint8_t)(color[leaf][c] - from + 128);
		const unsigned coded = code_bits(job, job->odds->color[k][spread < 8 ? spread : 7], 8, step);

		if (job->is_decoding)
			color[leaf][c] = (uint8_t)(coded + from - 128);
		if (k == 0)
			error = color[leaf][1] - foretold[1];
	}
}

/* ---- materials ---- */

static uint32_t get_material(const struct job *job, uint32_t leaf)
{
	return octree_get_material(job->attributes.material[leaf]);
}

/* Codes each part by how far it is from the mean of the neighbours', round its end. */
static uint32_t code_parts(struct job *job, uint32_t material, uint32_t before)
{
	static const struct {
		int at, n_bits;
	} parts[PARTS] = { { 0, 5 }, { 5, 5 }, { 10, 6 }, { 16, 8 } };
	uint32_t coded = 0;

	for (int k = 0; k < PARTS; k++) {
		const uint32_t most = (1u << parts[k].n_bits) - 1, middle = most / 2 + 1;
		uint32_t sum = 0, low = most, high = 0, from = before >> parts[k].at & most, step;

		for (unsigned i = 0; i < job->n; i++) {
			const uint32_t value = get_material(job, job->near[i].at) >> parts[k].at & most;

			sum += (uint32_t)job->near[i].weight * value;
			low = value < low ? value : low;
			high = value > high ? value : high;
		}
		if (job->n > 0)
			from = (sum + (uint32_t)job->weight / 2) / (uint32_t)job->weight;
		const int spread = job->n < 2 ? 7 : log2_floor(high - low + 1);
		step = ((material >> parts[k].at) - from + middle) & most;
		step = code_bits(job, job->odds->material[k][spread < 8 ? spread : 7], parts[k].n_bits, step);
		coded |= ((step + from - middle) & most) << parts[k].at;
	}
	return coded;
}

/* Most parts of things have one material: that of the nearest leaf is tried first. */
static void code_material(struct job *job, uint32_t leaf)
{
	uint32_t before = leaf > 0 ? get_material(job, leaf - 1) : 0;
	uint32_t material = job->is_decoding ? 0 : get_material(job, leaf);
	int nearest = 0, is_agreed = 1;

	for (unsigned i = 0; i < job->n; i++)
		if (job->near[i].weight > nearest) {
			nearest = job->near[i].weight;
			before = get_material(job, job->near[i].at);
		}
	for (unsigned i = 0; i < job->n; i++)
		is_agreed &= get_material(job, job->near[i].at) == before;
	job->was_same = (int)code_bit(job, &job->odds->same_material[count_of(job)][job->was_same][is_agreed], 5,
	                              material == before);
	material = job->was_same ? before : code_parts(job, material, before);
	if (job->is_decoding)
		octree_put_material(job->attributes.material[leaf], material);
}

/* ---- all ---- */

static void visit_normal(uint32_t leaf, uint64_t path, const struct octree_near *near, void *userdata)
{
	struct job *job = userdata;

	find_near(job, near);
	attributes_code_normal(job, leaf, path);
	job->last_path = path;
}

static void visit_offset(uint32_t leaf, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	find_near(userdata, near);
	code_offset(userdata, leaf);
}

static void visit_color(uint32_t leaf, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	find_near(userdata, near);
	code_color(userdata, leaf);
}

static void visit_material(uint32_t leaf, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	find_near(userdata, near);
	code_material(userdata, leaf);
}

static int code_stream(struct job *job, const struct octree_levels *levels, enum octree_stream stream)
{
	static void (*const visits[OCTREE_STREAMS])(uint32_t, uint64_t, const struct octree_near *, void *) = {
		[OCTREE_NORMAL_STREAM] = visit_normal,
		[OCTREE_OFFSET_STREAM] = visit_offset,
		[OCTREE_COLOR_STREAM] = visit_color,
		[OCTREE_MATERIAL_STREAM] = visit_material,
	};

	job->unit = psr_direction_words();
	job->odds = odds_make(job->is_older);
	if (job->odds == NULL)
		return PSR_ERR_MEMORY;
	for (uint32_t n = 0; n <= LEARNT; n++)
		job->part[n] = (5 << 14) / (5 * n + 8);
	octree_levels_walk(levels, levels->height, visits[stream], job);
	free(job->odds);
	return PSR_OK;
}

int octree_attributes_pack(struct coder *coder, const struct octree_levels *levels,
                           const struct octree_attributes *attributes, enum octree_stream stream)
{
	struct job job = { .coder = coder, .attributes = *attributes };

	return code_stream(&job, levels, stream);
}

int octree_attributes_unpack(struct octree_attributes *attributes, struct coder *coder,
                             const struct octree_levels *levels, enum octree_stream stream, int is_older)
{
	struct job job = { .coder = coder, .attributes = *attributes, .is_decoding = 1, .is_older = is_older };

	return code_stream(&job, levels, stream);
}
