#include "warp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "base/maths.h"
#include "base/mem.h"
#include "base/vec.h"
#include "parts.h"
#include "base/direction.h"

#define N_REPETITIONS 3
#define DISTANCE 1.7320508075688772 /* of the eye, where a field of view of 60 degrees shows the unit sphere */
#define EMPTY UINT64_C(0x7f800000ffffffff)

struct block {
	float apex[3], axis[3]; /* of its visibility cone ([G] 6.4), about the mean normal */
	float cone;             /* sine of the angle from axis to rim; 2: never culled */
	float bias, step;
	int16_t col, row;
	uint16_t view;
};

struct greedy_warp {
	int side, n_views;
	uint32_t resolution;
	float spacing, pitch;
	int is_equilateral;
	float (*axis)[3][3];
	size_t n_blocks;
	struct block *block;
	uint32_t *mask;  /* block by row */
	uint16_t *depth; /* block by row by column */
	uint64_t *word;
	uint64_t n_drawn;
};

/* From a projection's space to the picture, as [G] (7.3). */
struct matrix {
	float m[3][4];
};

/* t0 of [G] (6.7): the apex lies behind all of the samples' tangent planes. */
static float apex_offset(const struct greedy_view *view, const struct greedy_block *from, const struct block *block)
{
	const float (*direction)[3] = psr_direction_table();
	float least = INFINITY;

	for (uint32_t i = from->first; i < from->first + from->n; i++) {
		const float *normal = direction[PSR_ATTR_NORMAL(view->sample[i].attr)];
		float away[3];

		v3f_sub(away, view->sample[i].position, block->apex);
		if (view->sample[i].is_kept)
			least = fminf(least, v3f_dot(away, normal) / v3f_dot(block->axis, normal));
	}
	return least;
}

static void cone(struct block *block, const struct greedy_view *view, const struct greedy_block *from)
{
	const float (*direction)[3] = psr_direction_table();
	float normal[3] = { 0 }, least = 1;
	uint32_t n = 0;

	v3f_set(block->apex, 0, 0, 0);
	for (uint32_t i = from->first; i < from->first + from->n; i++) {
		if (!view->sample[i].is_kept)
			continue;
		v3f_add(normal, normal, direction[PSR_ATTR_NORMAL(view->sample[i].attr)]);
		v3f_add(block->apex, block->apex, view->sample[i].position);
		n++;
	}
	v3f_scale(block->apex, block->apex, 1 / (float)n);
	v3f_normalize(block->axis, normal);
	block->cone = 0;
	for (uint32_t i = from->first; i < from->first + from->n; i++) {
		if (!view->sample[i].is_kept)
			continue;
		least = fminf(least, v3f_dot(block->axis, direction[PSR_ATTR_NORMAL(view->sample[i].attr)]));
		if (view->sample[i].two_sided)
			block->cone = 2;
	}
	if (block->cone == 0)
		block->cone = least > 0 ? sqrtf(fmaxf(1 - least * least, 0)) : 2;
	if (block->cone < 2)
		v3f_add_scaled(block->apex, block->apex, apex_offset(view, from, block), block->axis);
}

static void take_block(struct greedy_warp *warp, uint16_t v, const struct greedy_view *view,
                       const struct greedy_block *from)
{
	size_t b = warp->n_blocks++;
	struct block *block = &warp->block[b];
	uint32_t *mask = warp->mask + b * (size_t)warp->side;
	uint16_t *depth = warp->depth + b * (size_t)(warp->side * warp->side);
	float min = INFINITY, max = -INFINITY;

	for (uint32_t i = from->first; i < from->first + from->n; i++) {
		min = fminf(min, view->sample[i].z);
		max = fmaxf(max, view->sample[i].z);
	}
	*block = (struct block){ .bias = min, .step = (max - min) / 65535, .col = from->col, .row = from->row, .view = v };
	memset(mask, 0, (size_t)warp->side * sizeof *mask);
	memset(depth, 0, (size_t)(warp->side * warp->side) * sizeof *depth);
	for (uint32_t i = from->first; i < from->first + from->n; i++) {
		const struct greedy_sample *sample = &view->sample[i];
		int r = sample->row - from->row, c = sample->col - from->col;

		if (!sample->is_kept)
			continue;
		mask[r] |= UINT32_C(1) << c;
		depth[r * warp->side + c] = block->step > 0 ? (uint16_t)((sample->z - min) / block->step) : 0;
	}
	cone(block, view, from);
}

int greedy_warp_create(struct greedy_warp **out, const struct greedy *greedy, struct psr_error *err)
{
	struct greedy_warp *warp = calloc(1, sizeof *warp);
	size_t n = 0;

	for (int v = 0; v < greedy->n_views; v++)
		for (uint32_t b = 0; b < greedy->view[v].n_blocks; b++)
			n += greedy->view[v].block[b].is_kept;
	if (warp != NULL) {
		*warp = (struct greedy_warp){ .side = greedy->side, .n_views = greedy->n_views,
			                          .resolution = greedy->options.resolution,
			                          .spacing = greedy->view[0].projection.spacing,
			                          .pitch = (float)greedy_row_pitch(greedy->options.lattice),
			                          .is_equilateral = greedy->options.lattice == GREEDY_EQUILATERAL };
		warp->axis = psr_alloc_array((size_t)warp->n_views, sizeof *warp->axis);
		warp->block = psr_alloc_array(n, sizeof *warp->block);
		warp->mask = psr_alloc_array(n * (size_t)warp->side, sizeof *warp->mask);
		warp->depth = psr_alloc_array(n * (size_t)(warp->side * warp->side), sizeof *warp->depth);
		warp->word = psr_alloc_array((size_t)warp->resolution * warp->resolution, sizeof *warp->word);
	}
	if (warp == NULL || warp->axis == NULL || warp->block == NULL || warp->mask == NULL || warp->depth == NULL
	    || warp->word == NULL) {
		greedy_warp_destroy(warp);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to warp %zu blocks", n);
	}
	for (int v = 0; v < greedy->n_views; v++) {
		memcpy(warp->axis[v], greedy->view[v].projection.axis, sizeof warp->axis[v]);
		for (uint32_t b = 0; b < greedy->view[v].n_blocks; b++)
			if (greedy->view[v].block[b].is_kept)
				take_block(warp, (uint16_t)v, &greedy->view[v], &greedy->view[v].block[b]);
	}
	*out = warp;
	return PSR_OK;
}

void greedy_warp_destroy(struct greedy_warp *warp)
{
	if (warp == NULL)
		return;
	psr_free(warp->axis);
	psr_free(warp->block);
	psr_free(warp->mask);
	psr_free(warp->depth);
	psr_free(warp->word);
	free(warp);
}

static inline int clamp_pixel(float u)
{
	u = u > -32768 ? u : -32768;
	return psr_floor_int(u < 32768 ? u : 32768);
}

/* `side` is a constant wherever this is inlined. */
static inline __attribute__((always_inline)) void warp_block(const struct greedy_warp *warp, size_t b,
                                                             const struct matrix *view, int side)
{
	const struct block *block = &warp->block[b];
	const float dx = warp->spacing, dy = warp->spacing * warp->pitch, shift = warp->is_equilateral ? 0.5f : 0;
	const float x = (float)block->col * dx, y = (float)block->row * dy;
	const int size = (int)warp->resolution;
	float origin[3], down[3], step[3], along[3];

	for (int a = 0; a < 3; a++) {
		origin[a] = view->m[a][0] * x + view->m[a][1] * y + view->m[a][2] * block->bias + view->m[a][3];
		down[a] = view->m[a][1] * dy;
		step[a] = view->m[a][0] * dx;
		along[a] = view->m[a][2] * block->step;
	}
	for (int r = 0; r < side; r++) {
		const uint32_t mask = warp->mask[b * (size_t)side + (size_t)r];
		const uint16_t *depth = warp->depth + (b * (size_t)side + (size_t)r) * (size_t)side;
		float base[3], z[GREEDY_MOST_SIDE];
		int u[GREEDY_MOST_SIDE], v[GREEDY_MOST_SIDE];

		if (mask == 0)
			continue;
		for (int a = 0; a < 3; a++)
			base[a] = origin[a] + (float)r * down[a];
		for (int c = 0; c < side; c++) {
			float i = (float)c + (float)(r & 1) * shift, d = (float)depth[c];
			float w = base[2] + i * step[2] + d * along[2];

			u[c] = clamp_pixel((base[0] + i * step[0] + d * along[0]) / w);
			v[c] = clamp_pixel((base[1] + i * step[1] + d * along[1]) / w);
			z[c] = w;
		}
		for (int c = 0; c < side; c++) {
			if ((mask >> c & 1) != 0 && u[c] >= 0 && u[c] < size && v[c] >= 0 && v[c] < size) {
				uint64_t word = (uint64_t)psr_bits_from_float(z[c]) << 32 | (b & 0xffffffff);
				uint64_t *at = &warp->word[(size_t)v[c] * (size_t)size + (size_t)u[c]];

				*at = word < *at ? word : *at;
			}
		}
	}
}

static int is_culled(const struct block *block, const float eye[3])
{
	float to_eye[3], g;

	v3f_sub(to_eye, eye, block->apex);
	g = v3f_dot(to_eye, block->axis);
	return g < 0 && g * g > block->cone * block->cone * v3f_dot(to_eye, to_eye);
}

/* Rows of frame: the picture's right, down and forward. */
static void make_matrices(const struct greedy_warp *warp, const double frame[3][3], struct matrix *matrix)
{
	double focal = warp->resolution / 2.0 * DISTANCE, middle = warp->resolution / 2.0;

	for (int v = 0; v < warp->n_views; v++) {
		double m[3][4] = { { 0 } };

		for (int a = 0; a < 3; a++) {
			for (int k = 0; k < 3; k++)
				for (int j = 0; j < 3; j++)
					m[a][k] += frame[a][j] * (double)warp->axis[v][k][j];
			m[a][3] = a == 2 ? DISTANCE : 0;
		}
		for (int k = 0; k < 4; k++) {
			matrix[v].m[0][k] = (float)(focal * m[0][k] + middle * m[2][k]);
			matrix[v].m[1][k] = (float)(focal * m[1][k] + middle * m[2][k]);
			matrix[v].m[2][k] = (float)m[2][k];
		}
	}
}

static void draw(struct greedy_warp *warp, const struct matrix *matrix, const float eye[3])
{
#define DRAW(side) \
	for (size_t b = 0; b < warp->n_blocks; b++) { \
		if (is_culled(&warp->block[b], eye)) \
			continue; \
		warp_block(warp, b, &matrix[warp->block[b].view], side); \
		warp->n_drawn++; \
	}
	if (warp->side == 4)
		DRAW(4)
	else if (warp->side == 8)
		DRAW(8)
	else if (warp->side == 16)
		DRAW(16)
	else
		DRAW(32)
#undef DRAW
}

static double processor_time(void)
{
	struct timespec t;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
	return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

int greedy_warp_run(struct greedy_warp *warp, int n_frames, struct greedy_warp_time *time, struct psr_error *err)
{
	struct matrix *matrix = psr_alloc_array((size_t)warp->n_views, sizeof *matrix);
	double total = 0;

	if (matrix == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to warp blocks");
	warp->n_drawn = 0;
	for (int f = 0; f < n_frames; f++) {
		double out[3], back[3][3], frame[3][3], best = INFINITY;
		float eye[3];

		psr_direction_center(6, (unsigned)((uint64_t)f * PSR_DIRECTIONS / (uint64_t)n_frames), out);
		psr_direction_basis(out, back);
		for (int k = 0; k < 3; k++) {
			frame[0][k] = back[0][k];
			frame[1][k] = -back[1][k];
			frame[2][k] = -back[2][k];
			eye[k] = (float)(DISTANCE * out[k]);
		}
		make_matrices(warp, frame, matrix);
		for (int i = 0; i < N_REPETITIONS; i++) {
			double started;

			for (size_t k = 0; k < (size_t)warp->resolution * warp->resolution; k++)
				warp->word[k] = EMPTY;
			started = processor_time();
			draw(warp, matrix, eye);
			best = fmin(best, processor_time() - started);
		}
		total += best;
	}
	psr_free(matrix);
	time->seconds = total / n_frames;
	time->culled = 1 - (double)warp->n_drawn / ((double)warp->n_blocks * n_frames * N_REPETITIONS);
	return PSR_OK;
}
