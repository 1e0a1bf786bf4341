#include "base/direction.h"
#include "base/clock.h"
#include "shade.h"
#include "tint.h"

#define TIMED_EVERY 16 /* strips: reading the clock costs time, too */

/* A table costs as much as lighting TABLE_PIXELS pixels, and saves nothing with few lights. */
#define TABLE_LIGHTS 3
#define TABLE_PIXELS (8 * PSR_DIRECTIONS)

enum psr_why shade_wants_table(const struct plan *plan)
{
	if (plan->n_lights == 0)
		return PSR_WHY_NOTHING;
	if (plan->view.needs & (STRIP_POSITION | STRIP_TWO_SIDED) || plan->has_points || plan->with_ewa)
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
	const struct plan *plan = t->plan;
	const struct strip_lights lights = { plan->light, plan->n_lights };

	t->simd->strip_lit(t->lit, &plan->view, &lights, (uint32_t)part * STRIP, STRIP);
}

int shade_tabulate(const struct simd *simd, const struct plan *plan, struct psr_pool *pool, float (*lit)[4])
{
	struct tabulating tabulating = { simd, plan, lit };

	_Static_assert(PSR_DIRECTIONS % STRIP == 0, "parts are whole strips");
	return psr_pool_for_until(pool, &plan->cancel, PSR_DIRECTIONS / STRIP, tabulate_part, &tabulating);
}

/* Takes the share of the light that glass keeps back. */
static void dim(float *reaches, const struct simd *simd, const struct plan *plan, const struct strip *strip,
                const struct shadow_light *shadow)
{
	float passes[STRIP];

	for (int c = SHADOW_OPAQUE + 1; c < SHADOW_CASTERS; c++)
		if (shadow[c].n_maps && simd->strip_shadow(strip, &shadow[c], passes))
			for (uint32_t i = 0; i < strip->n; i++)
				reaches[i] *= 1 - plan->shadow_share[c] * (1 - passes[i]);
}

static void add_light(const struct simd *simd, const struct plan *plan, struct strip *strip, uint32_t l)
{
	const struct shadow_light *shadow = plan->shadow != NULL ? plan->shadow + (size_t)l * SHADOW_CASTERS : NULL;
	float reaches[STRIP];

	if (shadow == NULL || !shadow[SHADOW_OPAQUE].n_maps) {
		simd->strip_light(strip, &plan->light[l], NULL);
	} else if (simd->strip_shadow(strip, &shadow[SHADOW_OPAQUE], reaches)) {
		dim(reaches, simd, plan, strip, shadow);
		simd->strip_light(strip, &plan->light[l], reaches);
	}
}

_Static_assert(PART_WIDTH % STRIP == 0, "a strip lies in one part");
_Static_assert(STRIP_BRICK == BRICK, "`wants` has a flag a brick");

struct shading {
	const struct simd *simd;
	const struct plan *plan;
	const struct shade_picture *picture;
};

/* Lists the samples of a strip, and returns their number. */
static uint32_t list_strip(struct strip_pixels *pixels, const struct shading *s, uint32_t x, uint32_t y)
{
	const struct plan *plan = s->plan;
	const uint32_t left = plan->width - x;

	pixels->x0 = x;
	pixels->y = y;
	if (plan_is_quiet(plan, x, y))
		s->simd->strip_list(pixels, NULL, NULL, 0, 0);
	else
		s->simd->strip_list(pixels, psr_zstack_row(s->picture->stack, y) + x,
		                    s->picture->weight + (size_t)y * plan->width + x, left < STRIP ? left : STRIP,
		                    plan->place_bits);
	return pixels->n;
}

static void begin_strip(struct strip_pixels *pixels, const struct shading *s, uint32_t x, uint32_t y)
{
	if (list_strip(pixels, s, x, y))
		s->simd->strip_find(pixels, &s->plan->view);
}

static void light_strip(struct strip *strip, const struct shading *s)
{
	const struct plan *plan = s->plan;

	for (uint32_t l = 0; l < plan->n_lights && (plan->view.lit == NULL || strip->is_specular); l++)
		add_light(s->simd, plan, strip, l);
	s->simd->strip_color(strip, plan->ambient, plan->is_wide);
}

static void write_strip(const struct strip *strip, const struct shading *s)
{
	static const uint8_t all[STRIP / STRIP_BRICK] = { 1, 1, 1, 1 };
	const struct plan *plan = s->plan;
	const struct shade_picture *to = s->picture;
	const uint32_t x = strip->pixels->x0, y = strip->pixels->y, left = plan->width - x;
	const uint8_t *wants = to->wants;

	if (plan->is_wide)
		wants = all;
	else if (wants != NULL)
		wants += (size_t)(y / BRICK) * ((plan->width + BRICK - 1) / BRICK) + x / BRICK;
	const struct strip_target target = { plan->width, to->rgb, to->srgb, wants, to->r, to->g, to->b,
		                                 { plan->background[0], plan->background[1], plan->background[2] } };
	s->simd->strip_write(strip, &target, left < STRIP ? left : STRIP);
}

uint32_t shade_part(const struct simd *simd, const struct plan *plan, const uint64_t *word, uint32_t n,
                    struct strip_pixels *pixels, struct strip *strip)
{
	const struct shading shading = { simd, plan, NULL };

	strip->pixels = pixels;
	simd->strip_list(pixels, word, NULL, n, 0);
	if (!pixels->n)
		return 0;
	simd->strip_find(pixels, &plan->view);
	simd->strip_read(strip, &plan->view);
	simd->strip_resolve(strip, &plan->view, plan->ambient);
	if (plan->has_tint)
		tint_strip(strip, plan);
	light_strip(strip, &shading);
	return pixels->n;
}

void shade_rows(const struct simd *simd, const struct plan *plan, const struct shade_picture *picture, uint32_t y0,
                uint32_t y1, struct shade_counts *counts)
{
	const struct shading shading = { simd, plan, picture };
	const uint32_t per_row = (plan->width + STRIP - 1) / STRIP, n = (y1 - y0) * per_row;
	struct strip_pixels pixels[2]; /* of this strip and the next */
	struct strip strip;

	if (picture->rgb == NULL && !plan->is_wide) {
		for (uint32_t i = 0; i < n; i++)
			counts->n_pixels += list_strip(&pixels[0], &shading, i % per_row * STRIP, y0 + i / per_row);
		return;
	}
	begin_strip(&pixels[0], &shading, 0, y0);
	for (uint32_t i = 0; i < n; i++) {
		const int is_timed = (i % per_row + i / per_row) % TIMED_EVERY == 0;
		const uint64_t start = is_timed ? clock_ns() : 0;

		if (is_timed && plan_is_cancelled(plan))
			return;
		strip.pixels = &pixels[i % 2];
		if (i + 1 < n)
			begin_strip(&pixels[(i + 1) % 2], &shading, (i + 1) % per_row * STRIP, y0 + (i + 1) / per_row);
		if (strip.pixels->n) {
			simd->strip_read(&strip, &plan->view);
			simd->strip_resolve(&strip, &plan->view, plan->ambient);
			if (plan->has_tint)
				tint_strip(&strip, plan);
		}
		const uint64_t middle = is_timed ? clock_ns() : 0;
		if (strip.pixels->n) {
			light_strip(&strip, &shading);
			counts->n_pixels += strip.pixels->n;
			counts->n_specular += strip.is_specular ? strip.pixels->n : 0;
		}
		write_strip(&strip, &shading);
		if (is_timed) {
			counts->resolve_ns += middle - start;
			counts->shade_ns += clock_ns() - middle;
		}
	}
}

static uint64_t share_of(uint64_t wall, uint64_t one, uint64_t other)
{
	return one ? (uint64_t)((double)one / (double)(one + other) * (double)wall) : 0;
}

void shade_report(const struct plan *plan, const struct shade_counts *rows, uint64_t wall, int has_rgb,
                  struct psr_report *report)
{
	struct shade_counts all = { 0 };

	for (uint32_t i = 0; i < (plan->height + BRICK - 1) / BRICK; i++) {
		const struct shade_counts *row = &rows[i];

		all.n_pixels += row->n_pixels;
		all.n_specular += row->n_specular;
		all.resolve_ns += row->resolve_ns;
		all.shade_ns += row->shade_ns;
		all.row_ns += row->row_ns;
		all.fill_ns += row->fill_ns;
	}
	const unsigned needs = has_rgb ? plan->view.needs : 0;
	const enum psr_why none = has_rgb ? PSR_WHY_NOTHING : PSR_WHY_OFF;
	effect_note(report, PSR_EFFECT_TWO_SIDED, needs & STRIP_TWO_SIDED ? PSR_WHY_RAN : none, all.n_pixels);
	effect_note(report, PSR_EFFECT_POSITIONS, needs & STRIP_POSITION ? PSR_WHY_RAN : none, all.n_pixels);
	effect_note(report, PSR_EFFECT_SPECULAR, all.n_specular ? PSR_WHY_RAN : none, all.n_specular);
	const uint64_t fill_ns = share_of(wall, all.fill_ns, all.row_ns);
	report->n_covered = all.n_pixels;
	report->count[PSR_STAGE_RESOLVE] = report->count[PSR_STAGE_SHADE] = has_rgb ? all.n_pixels : 0;
	report->ns[PSR_STAGE_FILL] += fill_ns;
	report->ns[PSR_STAGE_RESOLVE] = share_of(wall - fill_ns, all.resolve_ns, all.shade_ns);
	report->ns[PSR_STAGE_SHADE] = wall - fill_ns - report->ns[PSR_STAGE_RESOLVE];
}
