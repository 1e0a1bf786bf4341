#include <math.h>
#include <string.h>
#include "../base/maths.h"
#include "../base/mem.h"
#include "cover.h"
#include "psr/direction.h"
#include "psr/error.h"

int cover_reserve(struct cover *cover, size_t n)
{
	size_t capacity = n > cover->capacity + cover->capacity / 2 ? n : cover->capacity + cover->capacity / 2;
	struct cover_point *point;
	struct cover_seen *seen;
	uint32_t *n_seen;

	if (n <= cover->capacity)
		return PSR_OK;
	point = psr_alloc_array(capacity, sizeof *point);
	seen = psr_alloc_array(capacity, sizeof *seen);
	n_seen = psr_alloc_array(capacity / COVER_CHUNK + 1, sizeof *n_seen);
	if (point == NULL || seen == NULL || n_seen == NULL) {
		psr_free(point);
		psr_free(seen);
		psr_free(n_seen);
		return PSR_ERR_MEMORY;
	}
	if (cover->n_points != 0)
		memcpy(point, cover->point, cover->n_points * sizeof *point);
	psr_free(cover->point);
	psr_free(cover->seen);
	psr_free(cover->n_seen);
	cover->point = point;
	cover->seen = seen;
	cover->n_seen = n_seen;
	cover->capacity = capacity;
	return PSR_OK;
}

void cover_fini(struct cover *cover)
{
	psr_free(cover->point);
	psr_free(cover->seen);
	psr_free(cover->n_seen);
	memset(cover, 0, sizeof *cover);
}

struct look {
	struct cover *cover;
	const float (*axis)[3];
	uint64_t faces[PSR_DIRECTIONS / 64]; /* bit n: normal n is turned to the viewer */
};

static int n_chunks(const struct cover *cover)
{
	return (int)((cover->n_points + COVER_CHUNK - 1) / COVER_CHUNK);
}

static void look_at_chunk(int i, void *userdata)
{
	struct look *look = userdata;
	size_t first = (size_t)i * COVER_CHUNK, end = first + COVER_CHUNK;
	uint32_t n = 0;

	end = end < look->cover->n_points ? end : look->cover->n_points;
	for (size_t k = first; k < end; k++) {
		const struct cover_point *point = &look->cover->point[k];

		look->cover->seen[first + n] = cover_project(look->axis, point->position);
		n += (uint32_t)(look->faces[point->normal / 64] >> point->normal % 64 & 1) | (uint32_t)(point->two_sided != 0);
	}
	look->cover->n_seen[i] = n;
}

void cover_look(struct cover *cover, const float axis[3][3], struct psr_pool *pool)
{
	const float (*normal)[3] = psr_direction_table();
	struct look look = { .cover = cover, .axis = axis };

	for (uint32_t n = 0; n < PSR_DIRECTIONS; n++)
		look.faces[n / 64] |= (uint64_t)(cover_project(axis, normal[n]).z > 0) << n % 64;
	psr_pool_for(pool, n_chunks(cover), look_at_chunk, &look);
}

void cover_grid_init(struct cover_grid *grid, double angle, double shift_x, double shift_y, double ds)
{
	/* A pixel more on each side for the shift and one for rounding. */
	uint32_t middle = (uint32_t)ceil(1 / ds) + 2;
	double sine, cosine;

	psr_sincos(angle, &sine, &cosine);
	grid->cosine = (float)(cosine / ds);
	grid->sine = (float)(sine / ds);
	grid->shift[0] = (float)(middle + shift_x);
	grid->shift[1] = (float)(middle + shift_y);
	grid->side = 2 * middle;
}

void cover_draw(const struct cover *cover, const struct cover_grid *grid, float *z)
{
	for (size_t i = 0; i < (size_t)grid->side * grid->side; i++)
		z[i] = -INFINITY;
	for (int i = 0; i < n_chunks(cover); i++) {
		const struct cover_seen *seen = cover->seen + (size_t)i * COVER_CHUNK;

		for (uint32_t k = 0; k < cover->n_seen[i]; k++) {
			float *pixel = &z[cover_pixel(grid, &seen[k])];

			*pixel = seen[k].z > *pixel ? seen[k].z : *pixel;
		}
	}
}
