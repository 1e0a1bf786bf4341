/* What a viewer's screen shows: the newest picture, as the present camera sees it. */
#ifndef PSR_CLIENT_VIEW_SHOW_H
#define PSR_CLIENT_VIEW_SHOW_H

#include "client/lib/reproject.h"
#include "client/output/show.h"
#include "link.h"

struct view_show;

struct view_shown {
	int is_exact; /* the received picture itself, bit for bit */
	struct psr_reproject_stats warp;
	double take_ms; /* of the last view_show_take() */
};

/* n_threads as psr_pool_create(). */
int view_show_create(struct view_show **out, int n_threads, struct psr_error *err);
void view_show_destroy(struct view_show *show); /* NULL is fine */

/* Takes over the picture (link_release() follows), and paints this stage in the place of its colours if it has the
 * planes (NULL: its colours). After a failure the picture before stays. MEMORY, the errors of psr_reproject_take(). */
int view_show_take(struct view_show *show, struct link_picture *picture, const struct show *stage,
                   struct psr_error *err);

/* The picture taken last; NULL: none. */
const struct link_picture *view_show_picture(const struct view_show *show);

/* What the camera sees in width x height pixels; valid until the next call. NULL: nothing was taken, or *err. */
const struct psr_frame *view_show_draw(struct view_show *show, const struct psr_camera *camera, uint32_t width,
                                       uint32_t height, struct view_shown *shown, struct psr_error *err);

/* Draws the legend of the picture's colours (client/output/legend.h) onto what view_show_draw() gave last, if they have
 * one: not those of a stage. scene: its models; NULL: not known, and heights have none. */
void view_show_legend(struct view_show *show, const struct link_scene *scene);

/* A place of the picture drawn last, in pixels from its top left corner, as the present camera sees it. */
struct view_probe {
	int has_surface;   /* 0: nothing else is set */
	double point[3];   /* world */
	double depth;      /* z' of the present camera, world units */
};
void view_show_probe(const struct view_show *show, double x, double y, struct view_probe *probe);

#endif
