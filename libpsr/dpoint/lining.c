/* Rectangles behind faces that their normals lean from. */
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "seal.h"
#include "sealed.h"

#define DEEP 1.0f    /* of options->height: rays get there between slats, and not through the rim of what is bent */
#define BACK 1.5f    /* likewise: less, and a lining shows where slats meet at a corner of faces */
#define FAR 0.004f   /* inner units: as far as that is behind, it does not show, but coarse models are seen near */
#define OFF 3        /* of options->height: what a lining covers may be off by so much, and lean by LEAN */
#define LEAN 1.0f

static float back_of(const struct dpoint_cover_options *options)
{
	const float back = fmaxf(options->height, fminf(BACK * options->height, FAR));

	return options->error > 0 ? fminf(back, 0.5f * options->error) : back;
}

/* Whether lids stop all rays that graze a cell's plane on their way to a place behind its middle. */
static int is_lined(const struct sealing *s, struct nearby *nearby, uint32_t at)
{
	const struct dpoint_cell *cell = &s->surface->cell[at];
	const float deep = DEEP * s->options->height;
	float from[AROUND_GRAZING][3], axis[3][3], place[3];
	uint8_t open[AROUND_GRAZING];
	int n_open = rays_open(open, AROUND_GRAZING);

	if (!rays_axis(axis, cell))
		return 1;
	rays_graze(from, s, (const float (*)[3])axis);
	dpoint_cell_middle(place, cell);
	v3f_add_scaled(place, place, -deep, axis[2]);
	nearby->n = 0;
	nearby_gather(nearby, s, 0, place, 1.2f * deep / GRAZING);
	for (size_t i = 0; i < nearby->n && n_open > 0; i++) {
		const struct lid *lid = nearby->near[i].lid;
		float seen[3];

		rectangle_sees(seen, &lid->rectangle, place);
		n_open = rays_stop(open, n_open, lid, place, seen, (const float (*)[3])from, 0);
	}
	return n_open == 0;
}

static size_t find_slits(uint8_t *has_slit, const struct dpoint_surface *surface,
                         const struct dpoint_cover_options *options)
{
	size_t n = 0;

	for (size_t i = 0; i < surface->n_cells; i++) {
		const struct dpoint_cell *cell = &surface->cell[i];

		has_slit[i] = cell->part != DPOINT_BEYOND && cell->slit > options->slit &&
		              !dpoint_is_two_sided(options, cell->part);
		n += has_slit[i];
	}
	return n;
}

/* A strip beside a crease begins as much before it: behind a face, what reaches up to the crease would come out of the
 * face beyond it, where both make a wedge. */
static void widen_strip(struct dpoint_cell *strip, float by)
{
	for (int c = 0; c < 2; c++) {
		float in[3];

		v3f_sub(in, strip->corner[c], strip->corner[3 - c]);
		v3f_normalize(in, in);
		v3f_add_scaled(strip->corner[c], strip->corner[c], by, in);
	}
}

/* The same cells on the normals of their planes, and a candidate in the plane of each open one. */
static int make_planes(struct dpoint_surface *planes, const struct dpoint_surface *surface, const uint8_t *is_open,
                       const struct dpoint_cover_options *options, float back)
{
	*planes = (struct dpoint_surface){ .facets = surface->facets, .margin = surface->margin };
	if (!dpoint_surface_reserve(planes, surface->n_cells, 0, 0))
		return PSR_ERR_MEMORY;
	memcpy(planes->cell, surface->cell, surface->n_cells * sizeof *planes->cell);
	planes->n_cells = surface->n_cells;
	for (uint32_t i = 0; i < surface->n_cells; i++) {
		struct dpoint_candidate *candidate;
		float normal[3];

		if (planes->cell[i].part == DPOINT_BEYOND)
			widen_strip(&planes->cell[i], back);
		cell_plane(normal, &surface->cell[i]);
		if (v3f_dot(normal, normal) > 0)
			memcpy(planes->cell[i].normal, normal, sizeof normal);
		if (!is_open[i])
			continue;
		candidate = dpoint_surface_candidate(planes);
		if (candidate == NULL)
			return PSR_ERR_MEMORY;
		if (plane_over(candidate, surface, i, options))
			candidate->delta[0] = candidate->delta[1] = options->delta;
		else
			planes->n_candidates--;
	}
	return PSR_OK;
}

/* Of the planes' candidates, once they are fitted, keeps few. */
static int choose_planes(struct dpoint_choice *choice, struct dpoint_surface *planes, const uint8_t *is_open,
                         const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	const size_t n = planes->n_candidates;
	struct dpoint_cover cover;
	int rc;

	planes->n_candidates = 0;
	rc = dpoint_cover_init(&cover, planes, options, work->pool, work->cancel);
	planes->n_candidates = n;
	if (rc == PSR_OK)
		rc = fit_candidates(planes, cover.tree, 0, options, work);
	if (rc == PSR_OK)
		rc = cover_candidates(&cover, planes, options, work);
	choice->is_kept = calloc(n + 1, 1);
	if (choice->is_kept == NULL)
		rc = PSR_ERR_MEMORY;
	if (rc == PSR_OK)
		rc = keep_over_open(choice, &cover, is_open);
	dpoint_cover_fini(&cover);
	return rc;
}

static int put_behind(struct dpoint_surface *surface, const struct dpoint_surface *planes, const uint8_t *is_kept,
                      float back)
{
	for (size_t i = 0; i < planes->n_candidates; i++) {
		struct dpoint_candidate *candidate;

		if (!is_kept[i])
			continue;
		candidate = dpoint_surface_candidate(surface);
		if (candidate == NULL)
			return PSR_ERR_MEMORY;
		*candidate = planes->candidate[i];
		v3f_add_scaled(candidate->point.at, candidate->point.at, -back, candidate->point.normal);
	}
	return PSR_OK;
}

static int put_lining(struct dpoint_surface *surface, const uint8_t *is_open,
                      const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	struct dpoint_cover_options flat = *options;
	struct dpoint_choice choice = { .is_kept = NULL };
	const float back = back_of(options);
	struct dpoint_surface planes;
	int rc;

	flat.looks = 255;
	if (options->error > 0)
		flat.error -= back;
	rc = make_planes(&planes, surface, is_open, &flat, back);
	if (rc == PSR_OK && planes.n_candidates > 0)
		rc = choose_planes(&choice, &planes, is_open, &flat, work);
	if (rc == PSR_OK && choice.n_kept > 0)
		rc = put_behind(surface, &planes, choice.is_kept, back);
	dpoint_choice_fini(&choice);
	free(planes.cell);
	free(planes.candidate);
	return rc;
}

/* A lining covers cells, whatever they look like, though it lies behind them and they lean from it. */
static int keep_lining(struct dpoint_surface *surface, struct dpoint_choice *choice, struct dpoint_cover *cover,
                       const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	const size_t before = cover->n_candidates;
	struct dpoint_cover_options lined = *options;
	int rc;

	lined.looks = 255;
	lined.angle = LEAN;
	lined.height = OFF * options->height;
	rc = cover_candidates(cover, surface, &lined, work);
	return rc == PSR_OK ? keep_added(choice, before, surface->n_candidates) : rc;
}

int line_slits(struct dpoint_surface *surface, struct dpoint_choice *choice, struct dpoint_cover *cover,
               const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	struct sealing s;
	int rc = PSR_OK;

	if (choice->n_kept == 0 || surface->is_cloud || options->slit == 0)
		return PSR_OK;
	sealing_init(&s, surface, options);
	s.is_closed = is_lined;
	s.is_open = malloc(surface->n_cells);
	if (s.is_open == NULL)
		return PSR_ERR_MEMORY;
	if (find_slits(s.is_open, surface, options) > 0)
		rc = sealing_look(&s, choice, work);
	if (rc == PSR_OK && memchr(s.is_open, 1, surface->n_cells) != NULL) {
		rc = put_lining(surface, s.is_open, options, work);
		rc = rc == PSR_OK ? keep_lining(surface, choice, cover, options, work) : rc;
	}
	free(s.is_open);
	return rc;
}
