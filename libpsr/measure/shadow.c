#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/srgb.h"
#include "base/pool.h"
#include "base/stats.h"
#include "truth.h"

#define RAYS 4 /* along the side of a pixel */
#define APART 2 /* pixels, on each side */
#define LEAST_FACING 0.1 /* 6 degrees */
#define LEAST_LIGHT 0.05 /* linear: 8 bits are too coarse for darker pixels */

struct measure {
	const struct psr_truth *truth;
	const struct psr_light *light;
	struct view view;
	uint32_t width, height;
	const uint8_t *shadowed, *lit;
	float *expected, *got; /* 0..1; -1: nothing to compare */
};

static double grey(const uint8_t rgb[3])
{
	return ((double)psr_srgb_to_linear[rgb[0]] + (double)psr_srgb_to_linear[rgb[1]] +
	        (double)psr_srgb_to_linear[rgb[2]]) /
	       3;
}

static void measure_pixel(const struct measure *m, uint32_t x, uint32_t y)
{
	const size_t at = (size_t)y * m->width + x;
	const double lit = grey(m->lit + 3 * at), shadowed = grey(m->shadowed + 3 * at);
	double place[RAYS * RAYS][2];
	struct truth_light light[RAYS * RAYS];
	int n_reaching = 0;
	m->expected[at] = m->got[at] = -1;
	for (int i = 0; i < RAYS * RAYS; i++) {
		place[i][0] = x + (i % RAYS + 0.5) / RAYS;
		place[i][1] = y + (i / RAYS + 0.5) / RAYS;
	}
	truth_light(m->truth, &m->view, m->light, (const double(*)[2])place, RAYS * RAYS, light);
	for (int i = 0; i < RAYS * RAYS; i++) {
		if (light[i].facing < LEAST_FACING)
			return;
		n_reaching += !light[i].is_shadowed;
	}
	m->expected[at] = (float)n_reaching / (RAYS * RAYS);
	if (lit >= LEAST_LIGHT)
		m->got[at] = (float)fmin(1, shadowed / lit);
}

static void measure_row(int y, void *userdata)
{
	const struct measure *m = userdata;
	for (uint32_t x = 0; x < m->width; x++)
		measure_pixel(m, x, (uint32_t)y);
}

/* Skips edges of the object, which frames show up to some pixels off: darkness there is no shadow. */
static int is_compared(const struct measure *m, uint32_t x, uint32_t y)
{
	if (m->got[(size_t)y * m->width + x] < 0 || x < APART || y < APART || x + APART >= m->width ||
	    y + APART >= m->height)
		return 0;
	for (uint32_t v = y - APART; v <= y + APART; v++)
		for (uint32_t u = x - APART; u <= x + APART; u++)
			if (m->expected[(size_t)v * m->width + u] < 0)
				return 0;
	return 1;
}

/* Returns the distance in pixels to the nearest pixel whose truth equals this one. */
static double seam_at(const struct measure *m, uint32_t x, uint32_t y, int is_lit)
{
	double nearest = PSR_SHADOW_FAR;
	for (int64_t j = -PSR_SHADOW_FAR; j <= PSR_SHADOW_FAR; j++)
		for (int64_t i = -PSR_SHADOW_FAR; i <= PSR_SHADOW_FAR; i++) {
			int64_t u = x + i, v = y + j;
			size_t at = (size_t)(v * m->width + u);
			if (u < 0 || v < 0 || u >= m->width || v >= m->height || m->expected[at] < 0)
				continue;
			if ((m->expected[at] >= 0.5f) == is_lit)
				nearest = fmin(nearest, sqrt((double)(i * i + j * j)));
		}
	return nearest;
}

static int add_up(struct psr_shadow_accuracy *out, const struct measure *m)
{
	const size_t n = (size_t)m->width * m->height;
	double *seam = psr_alloc_array(n, sizeof *seam), sum = 0;
	if (seam == NULL)
		return PSR_ERR_MEMORY;
	for (size_t at = 0; at < n; at++) {
		double off = fabs((double)m->got[at] - (double)m->expected[at]);
		int is_lit = m->got[at] >= 0.5f;
		if (!is_compared(m, (uint32_t)(at % m->width), (uint32_t)(at / m->width)))
			continue;
		out->n_compared++;
		out->n_shadow += m->expected[at] < 0.5f;
		out->n_wrong += off > PSR_SHADOW_WRONG;
		sum += off;
		if (is_lit != (m->expected[at] >= 0.5f))
			seam[out->n_misplaced++] = seam_at(m, (uint32_t)(at % m->width), (uint32_t)(at / m->width), is_lit);
	}
	out->mean = out->n_compared ? sum / (double)out->n_compared : 0;
	stats_sort(seam, out->n_misplaced);
	out->seam_p99 = stats_percentile(seam, out->n_misplaced, 0.99);
	out->seam_max = stats_percentile(seam, out->n_misplaced, 1);
	psr_free(seam);
	return PSR_OK;
}

int psr_accuracy_measure_shadow(struct psr_shadow_accuracy *out, const struct psr_truth_shot *shot,
                                const struct psr_light *light, const uint8_t *shadowed, const uint8_t *lit,
                                struct psr_error *err)
{
	const uint32_t width = shot->width, height = shot->height;
	struct measure m = { .truth = shot->truth, .light = light, .width = width, .height = height,
		                 .shadowed = shadowed, .lit = lit };
	struct psr_pool *pool = NULL;
	int rc = view_init(&m.view, shot->camera, width, height, err);
	memset(out, 0, sizeof *out);
	if (rc != PSR_OK)
		return rc;
	m.expected = psr_alloc_array((size_t)width * height, sizeof *m.expected);
	m.got = psr_alloc_array((size_t)width * height, sizeof *m.got);
	if (m.expected == NULL || m.got == NULL || psr_pool_create(&pool, shot->n_threads, NULL) != PSR_OK) {
		rc = psr_fail(err, PSR_ERR_MEMORY, "no memory to measure %ux%u pixels", width, height);
	} else {
		psr_pool_for(pool, (int)height, measure_row, &m);
		if (add_up(out, &m) != PSR_OK)
			rc = psr_fail(err, PSR_ERR_MEMORY, "no memory to measure %ux%u pixels", width, height);
	}
	psr_pool_destroy(pool);
	psr_free(m.expected);
	psr_free(m.got);
	return rc;
}
