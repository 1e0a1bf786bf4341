/* Which surface a pixel shows: a small frame around it, of the planes normal and id. It comes in a round trip over any
 * link, and the view's own frames go on. */
#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "lens.h"
#include "link_inside.h"

#define SIDE 65 /* odd: the middle of the middle pixel is on the axis. Coarse samples leave pixels between them */
#define REACH 8 /* pixels: how far from the middle the nearest sample may be */

/* The camera of SIDE x SIDE pixels of the wish's size, in the middle of which the place lies. */
static void look_at(struct psr_camera *camera, const struct link_place_asked *asked)
{
	struct lens lens;
	double ray[3];

	*camera = asked->camera;
	lens_init(&lens, camera, asked->width, asked->height);
	lens_point(&lens, asked->x, asked->y, 1, ray);
	memcpy(camera->up, lens.up, sizeof camera->up);
	if (camera->kind == PSR_CAMERA_ORTHOGRAPHIC) {
		camera->ortho_height = SIDE * lens_pixel(&lens, 1);
		v3d_add_scaled(camera->eye, ray, -1, lens.forward);
	} else {
		v3d_sub(ray, ray, camera->eye);
		camera->fov_y = 2 * atan(SIDE * lens_pixel(&lens, 1) / 2 / sqrt(v3d_dot(ray, ray)));
		v3d_add_scaled(ray, camera->eye, 1, ray);
	}
	memcpy(camera->target, ray, sizeof ray);
}

uint64_t link_probe(struct link *link, const struct psr_camera *camera, const uint32_t size[2], const double at[2])
{
	uint64_t number;

	pthread_mutex_lock(&link->lock);
	number = link->probe_asked.number + 1;
	link->probe_asked = (struct link_place_asked){ number, *camera, size[0], size[1], at[0], at[1] };
	link_wake(link->wake_fd);
	pthread_mutex_unlock(&link->lock);
	return number;
}

void link_probed(struct link *link, struct link_surface *surface)
{
	pthread_mutex_lock(&link->lock);
	*surface = link->surface;
	pthread_mutex_unlock(&link->lock);
}

static void tell(struct link *link, const struct link_surface *surface)
{
	pthread_mutex_lock(&link->lock);
	link->surface = *surface;
	link_say(link, LINK_NEWS_PROBE);
	pthread_mutex_unlock(&link->lock);
}

int link_probe_ask(struct link_probe *probe, struct link_view *view, const struct link_content *content,
                   struct psr_error *err)
{
	struct link_place_asked asked;
	struct psr_msg_frame frame = {
		.width = SIDE, .height = SIDE, .planes = 1u << PSR_PLANE_NORMAL | 1u << PSR_PLANE_ID,
		.data_codec = PSR_CODEC_ZSTD, .budget = PSR_WIRE_BUDGET_SETTINGS, .flags = PSR_WIRE_FRAME_NO_HASHES,
		.settings = { .scale = 1, .spacing_px = content->wish->spacing_px },
	};
	int code;

	pthread_mutex_lock(&view->link->lock);
	asked = view->link->probe_asked;
	pthread_mutex_unlock(&view->link->lock);
	if (asked.number == probe->number || probe->id != 0 || content->n_places == 0)
		return PSR_OK;
	look_at(&frame.camera, &asked);
	code = link_view_scene(view, content, view->has_sent ? &view->last.camera : &asked.camera, err);
	if (code == PSR_OK)
		code = psr_client_frame(view->client, &frame, &probe->id, err);
	if (code == PSR_ERR_BUSY) /* with the view's next request */
		return PSR_OK;
	probe->number = asked.number;
	for (uint32_t i = 0; i < content->n_places; i++)
		probe->index[i] = content->place[i].index;
	probe->n_places = content->n_places;
	if (code != PSR_OK) { /* such as a server without these planes */
		probe->id = 0;
		tell(view->link, &(struct link_surface){ .number = asked.number });
	}
	return PSR_OK;
}

/* The pixel with a sample of these instances that is nearest to the middle; 0: none is within REACH. */
static int find_sample(size_t *at, const struct psr_frame *frame, uint32_t n_instances)
{
	const int middle = SIDE / 2;
	int best = REACH * REACH + 1;

	for (int y = -REACH; y <= REACH; y++)
		for (int x = -REACH; x <= REACH; x++) {
			const size_t i = (size_t)((middle + y) * SIDE + middle + x);

			if (x * x + y * y >= best || frame->id[i] >= n_instances)
				continue;
			best = x * x + y * y;
			*at = i;
		}
	return best <= REACH * REACH;
}

int link_probe_event(struct link_probe *probe, struct link *link, const struct psr_event *event)
{
	struct link_surface surface = { .number = probe->number };
	size_t at;

	if (probe->id == 0 || event->id != probe->id)
		return 0;
	probe->id = 0;
	if (event->type == PSR_EVENT_FRAME && find_sample(&at, event->picture, probe->n_places)) {
		for (size_t c = 0; c < 3; c++)
			surface.normal[c] = event->picture->normal[3 * at + c];
		surface.has_surface = v3d_normalize(surface.normal, surface.normal) > 0;
		surface.instance = probe->index[event->picture->id[at]];
	}
	tell(link, &surface);
	return 1;
}
