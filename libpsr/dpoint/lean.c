#include "lean.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "bound.h"
#include "seal.h"
#include "sealed.h"

#define DEEP 1.0f      /* of options->height: rays get there between slats, and not through the rim of what is bent */
#define NEAR 4.0f      /* of that depth: a first look */
#define OPEN 0.25f     /* of options->height: how far tiles reach over an open side */
#define WIDE 3.0f      /* likewise: over others, at most */
#define OFF 2          /* likewise: of tiles that are further off, none reaches over more than that */
#define TRIES 5
#define LEAST_ALONG 0.15     /* of a shading normal along that of its face: others count as that, at 80 degrees or so */
#define MOST_TURN 4.0        /* of a lean, from the middle of a tile to its end */

static double clamp(double x, double low, double high)
{
	return fmin(fmax(x, low), high);
}

void lean_make(struct dpoint_lean *lean, const struct dpoint_face *face, const struct dpoint_candidate *of)
{
	const struct dpoint *p = &of->point;
	double edge[2][3], normal[3] = { 0 }, grow[2][3] = { { 0 } }, across[3], away[3], m[2][2], w[2], det, top;
	double u[3], n[3], part[3], dot[3];

	memset(lean, 0, sizeof *lean); /* where there is no normal */
	for (int k = 0; k < 3; k++) {
		u[k] = p->u[k];
		n[k] = p->normal[k];
		edge[0][k] = (double)face->corner[1][k] - face->corner[0][k];
		edge[1][k] = (double)face->corner[2][k] - face->corner[0][k];
		away[k] = (double)p->at[k] - face->corner[0][k];
	}
	v3d_cross(across, n, u);
	/* Corners' weights of a place: those of the middle, and how they grow along u and v. */
	for (int i = 0; i < 2; i++) {
		m[i][0] = v3d_dot(edge[i], u);
		m[i][1] = v3d_dot(edge[i], across);
	}
	det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
	if (!(fabs(det) > 0))
		return;
	top = 1 / det;
	w[0] = (v3d_dot(away, u) * m[1][1] - v3d_dot(away, across) * m[1][0]) * top;
	w[1] = (v3d_dot(away, across) * m[0][0] - v3d_dot(away, u) * m[0][1]) * top;
	/* A tile over what is much narrower has its middle far beyond that; in a twin it is within -1. */
	w[0] = clamp(w[0], -1, 2);
	w[1] = clamp(w[1], -1, 2);
	for (int k = 0; k < 3; k++) {
		const double at[3] = { face->normal[0][k], face->normal[1][k], face->normal[2][k] };

		normal[k] = at[0] + w[0] * (at[1] - at[0]) + w[1] * (at[2] - at[0]);
		grow[0][k] = (m[1][1] * (at[1] - at[0]) - m[0][1] * (at[2] - at[0])) * top;
		grow[1][k] = (m[0][0] * (at[2] - at[0]) - m[1][0] * (at[1] - at[0])) * top;
	}
	part[0] = v3d_dot(normal, u);
	part[1] = v3d_dot(normal, across);
	part[2] = fmax(v3d_dot(normal, n), LEAST_ALONG * v3d_length(normal));
	if (!(part[2] > 0))
		return;
	for (int c = 0; c < 2; c++) {
		const double *axis = c == 0 ? u : across;

		lean->at[c] = (int16_t)lrint(part[c] / part[2] / DPOINT_LEAN_STEP);
		for (int k = 0; k < 2; k++) {
			dot[k] = (v3d_dot(grow[k], axis) * part[2] - part[c] * v3d_dot(grow[k], n)) / (part[2] * part[2]);
			if (fabs(dot[k]) * of->delta[k] > MOST_TURN) /* over less than the tile */
				dot[k] = 0;
			lean->by[c][k] = (uint16_t)((psr_bits_from_float((float)clamp(dot[k], -1e6, 1e6)) + 0x8000) >> 16);
		}
	}
}

/* Whether lids stop all rays that graze a cell's plane on their way to a place behind its middle. Those close by stop
 * most; of what is left one ray that nothing stops will do. */
static int is_shut(const struct sealing *s, struct nearby *nearby, uint32_t at)
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
	nearby_gather(nearby, s, 0, place, NEAR * deep);
	n_open = rays_stop_by(open, n_open, nearby, place, (const float (*)[3])from, 0);
	if (n_open == 0)
		return 1;
	nearby->n = 0;
	nearby_gather(nearby, s, 0, place, 1.2f * deep / GRAZING);
	for (int i = 0; i < n_open; i++)
		if (rays_stop_by(&open[i], 1, nearby, place, (const float (*)[3])from, 0) > 0)
			return 0;
	return 1;
}

static void set_cells(uint8_t *cells, const struct dpoint_face *face, const struct dpoint_surface *surface)
{
	for (uint32_t i = 0; i < face->n_cells; i++)
		cells[face->first_cell + i] = surface->cell[face->first_cell + i].part != DPOINT_BEYOND;
}

/* Leaves out the first n candidates, those before tiles, whose cells are all of tiled faces. */
static void leave_out(struct dpoint_choice *choice, const struct dpoint_cover *cover, size_t n,
                      const uint8_t *is_tiled)
{
	for (uint32_t i = 0; i < n; i++) {
		int is_due = choice->is_kept[i] && cover->n[i] > 0;

		for (uint32_t k = 0; k < cover->n[i] && is_due; k++) {
			const struct cell_node *node = &cover->tree->node[cover->list[i][k]];

			for (uint32_t c = node->begin; c < node->end && is_due; c++)
				is_due = is_tiled[cover->tree->order[c]];
		}
		if (is_due) {
			choice->is_kept[i] = 0;
			choice->n_kept--;
		}
	}
}

/* How far tiles may reach over sides; is_wide: until the next face bends away by a height, if not too far: normals grow
 * differently there. */
static void reach_over(float beyond[3], const struct dpoint_face *face, const struct dpoint_cover_options *options,
                       int is_wide)
{
	const float height = options->error > 0 ? fminf(options->error, options->height) : options->height;

	for (int i = 0; i < 3; i++)
		beyond[i] = height * (is_wide && face->bend[i] < 1 ? fminf(WIDE, 1 / (face->bend[i] + 0.05f)) : OPEN);
}

struct tiling_job {
	struct dpoint_surface *surface;
	const struct dpoint_cover_options *options;
	struct bound_view view;
};

static int are_near(struct tiling_job *job, size_t first)
{
	const struct dpoint_surface *surface = job->surface;
	const struct dpoint_cover_options *options = job->options;
	const double off = (double)(options->error > 0 ? options->error : OFF * options->height);

	for (size_t i = first; i < surface->n_candidates; i++) {
		float extent[2];

		dpoint_candidate_extent(extent, &surface->candidate[i], options->sine);
		if (bound_look(&job->view, &surface->facets, &surface->candidate[i].point, extent, off) != PSR_OK ||
		    !bound_likely_holds(&job->view, extent, off))
			return 0;
	}
	return 1;
}

/* What is tiled at once: a face, or two that are one rectangle and look alike. */
struct tiled {
	const struct dpoint_face *face, *twin; /* twin: or NULL */
	int is_plain;  /* all cells are there, and look alike */
	uint64_t attr; /* of what is plain */
};

/* Joins the looks of a face's cells. Returns whether all are there. */
static int join_looks(struct look_range *all, const struct dpoint_face *face, const struct dpoint_surface *surface)
{
	for (uint32_t i = face->first_cell; i < face->first_cell + face->n_cells; i++) {
		struct look_range look;

		if (surface->cell[i].part == DPOINT_BEYOND)
			return 0;
		look_range_of(&look, surface->cell[i].attr);
		look_range_join(all, &look);
	}
	return 1;
}

static struct tiled tiled_of(const struct dpoint_surface *surface, const struct dpoint_face *face, int looks)
{
	struct tiled t = { .face = face, .twin = face->twin != UINT32_MAX ? &surface->face[face->twin] : NULL };
	struct look_range look;

	look_range_of(&look, surface->cell[face->first_cell].attr);
	if (t.twin != NULL) {
		struct look_range both = look;

		if (join_looks(&both, face, surface) && join_looks(&both, t.twin, surface) && look_range_width(&both) <= looks) {
			t.is_plain = 1;
			t.attr = look_range_middle(&both);
			return t;
		}
		t.twin = NULL;
	}
	t.is_plain = join_looks(&look, face, surface) && look_range_width(&look) <= looks;
	t.attr = look_range_middle(&look);
	return t;
}

/* The least of what may be reached over at the sides that both do not share. */
static float least_beyond(const struct tiled *t, const struct dpoint_cover_options *options, int is_wide)
{
	const struct dpoint_face *const of[2] = { t->face, t->twin };
	float beyond[3], least = INFINITY;

	for (int k = 0; k < 2; k++) {
		reach_over(beyond, of[k], options, is_wide);
		for (int i = 1; i < 3; i++)
			least = fminf(least, beyond[(of[k]->shared + i) % 3]);
	}
	return least;
}

static int put_tiles(struct tiling_job *job, const struct tiled *t, int is_wide, float delta)
{
	const struct dpoint_face *face = t->face;
	float beyond[3];
	int rc = PSR_OK;

	if (!t->is_plain) {
		for (uint32_t i = face->first_cell; i < face->first_cell + face->n_cells && rc == PSR_OK; i++)
			if (job->surface->cell[i].part != DPOINT_BEYOND)
				rc = tile_cell(job->surface, face, i, job->options);
		return rc;
	}
	if (t->twin != NULL)
		return tile_rectangle(job->surface, face, least_beyond(t, job->options, is_wide), t->attr, delta);
	reach_over(beyond, face, job->options, is_wide);
	return tile_face(job->surface, face, beyond, t->attr, delta);
}

/* With ever smaller tiles until all are near the surface. Leaves none where an error is asked for that they do not
 * keep. */
static int tile(struct tiling_job *job, const struct tiled *t)
{
	struct dpoint_surface *surface = job->surface;
	const size_t n_candidates = surface->n_candidates, n_lean = surface->n_lean;
	float delta = job->options->delta;
	int rc = PSR_OK, is_near = 0;

	for (int i = 0; i < TRIES && !is_near && rc == PSR_OK; i++) {
		surface->n_candidates = n_candidates;
		surface->n_lean = n_lean;
		rc = put_tiles(job, t, i == 0, delta);
		is_near = rc == PSR_OK && are_near(job, n_candidates);
		if (!t->is_plain || (i == 1 && job->options->error == 0))
			break;
		delta *= i > 0 ? 0.5f : 1;
	}
	if (job->view.is_failed)
		return PSR_ERR_MEMORY;
	if (job->options->error > 0 && !is_near) {
		surface->n_candidates = n_candidates;
		surface->n_lean = n_lean;
	}
	return rc;
}

static int has_any(const uint8_t *cells, const struct dpoint_face *face)
{
	return memchr(cells + face->first_cell, 1, face->n_cells) != NULL;
}

int tile_open(uint8_t *is_tiled, struct dpoint_surface *surface, struct dpoint_choice *choice,
              struct dpoint_cover *cover, const struct dpoint_cover_options *options, const uint8_t *is_open,
              const struct dpoint_work *work)
{
	struct tiling_job job = { .surface = surface, .options = options };
	const size_t before = surface->n_candidates;
	int rc = PSR_OK;

	if (surface->n_lean == 0)
		surface->first_lean = before;
	for (uint32_t f = 0; f < surface->n_faces && rc == PSR_OK; f++) {
		const struct tiled t = tiled_of(surface, &surface->face[f], options->looks);
		const size_t n = surface->n_candidates;

		if ((t.twin != NULL && t.face->twin < f) || has_any(is_tiled, t.face))
			continue; /* done with that */
		if (!has_any(is_open, t.face) && (t.twin == NULL || !has_any(is_open, t.twin)))
			continue;
		rc = psr_is_cancelled(work->cancel) ? PSR_ERR_CANCELLED : tile(&job, &t);
		if (surface->n_candidates == n)
			continue;
		set_cells(is_tiled, t.face, surface);
		if (t.twin != NULL)
			set_cells(is_tiled, t.twin, surface);
	}
	bound_view_fini(&job.view);
	if (rc == PSR_OK && surface->n_candidates > before) {
		leave_out(choice, cover, surface->first_lean, is_tiled);
		rc = keep_added(choice, before, surface->n_candidates);
	}
	return rc == PSR_OK ? cover_candidates(cover, surface, options, work) : rc;
}

int tile_faces(uint8_t *is_tiled, struct dpoint_surface *surface, struct dpoint_choice *choice,
               struct dpoint_cover *cover, const struct dpoint_cover_options *options,
               const struct dpoint_work *work)
{
	struct sealing s;
	int rc;

	if (choice->n_kept == 0)
		return PSR_OK;
	sealing_init(&s, surface, options);
	s.is_closed = is_shut;
	s.is_open = calloc(surface->n_cells + 1, 1);
	if (s.is_open == NULL)
		return PSR_ERR_MEMORY;
	for (size_t f = 0; f < surface->n_faces; f++)
		set_cells(s.is_open, &surface->face[f], surface);
	rc = sealing_look(&s, choice, work);
	if (rc == PSR_OK)
		rc = tile_open(is_tiled, surface, choice, cover, options, s.is_open, work);
	free(s.is_open);
	return rc;
}
