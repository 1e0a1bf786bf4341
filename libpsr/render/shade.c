#include "psr/direction.h"
#include "render/render.h"

#define TIMED_EVERY 16 /* strips: clocks cost, too */

/* Whether any of the bricks of a part of row y is wanted in linear light. Pixels of weight 0 are filled later, whatever they
 * get here. */
static int is_wanted(const struct plan *plan, const uint8_t *wants, uint32_t x, uint32_t y, uint32_t n)
{
	const uint8_t *row = wants + (size_t)(y / BRICK) * ((plan->width + BRICK - 1) / BRICK);
	for (uint32_t b = x / BRICK; b <= (x + n - 1) / BRICK; b++)
		if (row[b])
			return 1;
	return 0;
}

/* A table costs as much as lighting so many pixels; it saves nothing where there are few lights to add up. */
#define TABLE_LIGHTS 3
#define TABLE_PIXELS (8 * PSR_DIRECTIONS)

enum psr_why shade_wants_table(const struct plan *plan)
{
	if (plan->n_lights == 0)
		return PSR_WHY_NOTHING;
	if (plan->view.needs & (STRIP_POSITION | STRIP_TWO_SIDED))
		return PSR_WHY_VOID;
	if (plan->n_lights < TABLE_LIGHTS || plan->n_instances > 1 || (uint64_t)plan->width * plan->height < TABLE_PIXELS)
		return PSR_WHY_COST;
	return PSR_WHY_RAN;
}

struct tabulating {
	const struct simd *simd;
	const struct plan *plan;
	float (*lit)[4];
};

static void tabulate_part(int part, void *userdata)
{
	const struct tabulating *t = userdata;
	t->simd->strip_lit(t->lit, &t->plan->view, t->plan->light, t->plan->n_lights, t->plan->ambient, (uint32_t)part * STRIP, STRIP);
}

void shade_tabulate(const struct simd *simd, const struct plan *plan, struct psr_pool *pool, float (*lit)[4])
{
	struct tabulating tabulating = { simd, plan, lit };
	_Static_assert(PSR_DIRECTIONS % STRIP == 0, "parts are whole strips");
	psr_pool_for(pool, PSR_DIRECTIONS / STRIP, tabulate_part, &tabulating);
}

static void add_light(const struct simd *simd, const struct plan *plan, struct strip *strip, uint32_t l)
{
	float reaches[STRIP];
	if (!plan->shadow || !plan->shadow[l].n_maps)
		simd->strip_light(strip, &plan->light[l], NULL);
	else if (simd->strip_shadow(strip, &plan->shadow[l], reaches))
		simd->strip_light(strip, &plan->light[l], reaches);
}

_Static_assert(STRIP == TILE_WIDTH, "a strip lies in one tile");

void shade_row(const struct simd *simd, const struct plan *plan, const struct shade_target *target, const uint64_t *word,
               const uint16_t *weight, uint32_t y, struct shade_counts *counts)
{
	struct strip_target part = { plan->width, target->rgb, target->srgb, NULL, NULL, NULL,
		                         { plan->background[0], plan->background[1], plan->background[2] } };
	struct strip strip;
	strip.y = y;
	for (uint32_t x = 0; x < plan->width; x += STRIP) {
		const uint32_t n = plan->width - x < STRIP ? plan->width - x : STRIP;
		const int keeps_linear = target->wants && is_wanted(plan, target->wants, x, y, n);
		strip.x0 = x;
		if (plan->is_quiet && plan->is_quiet[y / TILE_HEIGHT * plan->tiles_x + x / TILE_WIDTH])
			strip.n = 0;
		else
			simd->strip_list(&strip, word + x, weight + x, n);
		const int is_timed = (x / STRIP + y) % TIMED_EVERY == 0;
		uint64_t start = is_timed ? now_ns() : 0, middle = start;
		if (strip.n) {
			simd->strip_resolve(&strip, &plan->view, plan->ambient);
			middle = is_timed ? now_ns() : 0;
			for (uint32_t l = 0; l < plan->n_lights && !(plan->view.lit && !strip.is_specular); l++)
				add_light(simd, plan, &strip, l);
			simd->strip_color(&strip);
			counts->n_pixels += strip.n;
			counts->n_specular += strip.is_specular ? strip.n : 0;
		}
		part.r = keeps_linear ? target->r : NULL;
		part.g = keeps_linear ? target->g : NULL;
		part.b = keeps_linear ? target->b : NULL;
		simd->strip_write(&strip, &part, n);
		if (is_timed) {
			counts->resolve_ns += middle - start;
			counts->shade_ns += now_ns() - middle;
		}
	}
}
