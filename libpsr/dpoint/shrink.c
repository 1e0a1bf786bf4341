/* Rectangles that end before they leave the surface. */
#include <math.h>
#include "bound.h"
#include "rectangle.h"

/* The delta of the greatest class that leaves the place out. */
static float delta_before(double place, float extent)
{
	unsigned class = dpoint_delta_class(fminf((float)fabs(place), extent));

	while (class + 1 < DPOINT_DELTA_CLASSES && dpoint_delta_of_class(class) >= extent)
		class++;
	return dpoint_delta_of_class(class);
}

/* Each turn makes the side shorter that leaves the larger rectangle. */
static void shrink(struct dpoint_candidate *c, struct bound_view *view, const struct dpoint_cover_options *options)
{
	float extent[2];
	double place[2];

	dpoint_candidate_extent(extent, c, options->sine);
	while (!bound_holds(view, extent, (double)options->error, place) && !view->is_failed) {
		const float u = delta_before(place[0], extent[0]), v = delta_before(place[1], extent[1]);
		const int k = u * extent[1] < v * extent[0];

		c->delta[k] = extent[k] = k == 0 ? u : v;
		if (extent[k] <= options->slack)
			return;
	}
}

static int covers_own(const struct looking *l, const struct dpoint_candidate *c)
{
	struct rectangle r;

	rectangle_of(&r, c, l->options);
	rectangle_shorten(&r, l->options->slack);
	return r.extent[0] > 0 && r.extent[1] > 0 && rectangle_covers(l, &r, &l->surface->cell[c->cell]);
}

static int look(struct bound_view *view, const struct looking *l, const struct dpoint_candidate *c, float extent[2])
{
	dpoint_candidate_extent(extent, c, l->options->sine);
	return bound_look(view, &l->surface->facets, &c->point, extent, (double)l->options->error);
}

int shrink_within(struct dpoint_candidate *c, const struct dpoint_candidate *before, struct bound_view *view,
                  const struct looking *l)
{
	struct dpoint_candidate small = *before;
	float extent[2];

	if (look(view, l, c, extent) != PSR_OK)
		return PSR_ERR_MEMORY;
	shrink(c, view, l->options);
	if (covers_own(l, c) || !rectangle_around(small.delta, before, &l->surface->cell[c->cell], l->options))
		return view->is_failed ? PSR_ERR_MEMORY : PSR_OK;
	if (look(view, l, &small, extent) != PSR_OK)
		return PSR_ERR_MEMORY;
	if (bound_holds(view, extent, (double)l->options->error, NULL))
		*c = small;
	return view->is_failed ? PSR_ERR_MEMORY : PSR_OK;
}
