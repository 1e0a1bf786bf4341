#include <assert.h>
#include "base/vec.h"
#include "tree.h"

#define MOST_RAW (2 * RAY_MOST_HITS)
#define SAME_HIT 0x1p-20

/* Keeps the nearest hits of a ray, by distance and then by primitive, in whichever order the tree finds them. */
struct ray_list {
	int n;
	struct ray_hit hit[MOST_RAW];
};

static int comes_before(const struct ray_hit *a, const struct ray_hit *b)
{
	return a->t != b->t ? a->t < b->t : a->prim < b->prim;
}

/* Inserts a hit; a full array of `most` loses its last. Returns the new n. */
static int insert(struct ray_hit *sorted, int n, int most, const struct ray_hit *hit)
{
	int at = n;

	if (n == most && !comes_before(hit, &sorted[n - 1]))
		return n;
	n = n < most ? n + 1 : n;
	at = at < n ? at : n - 1;
	for (; at > 0 && comes_before(hit, &sorted[at - 1]); at--)
		sorted[at] = sorted[at - 1];
	sorted[at] = *hit;
	return n;
}

/* Whether the surface is absent at a hit. Of rays from both ends a face stops at least one, so its side does not count
 * then. */
static int is_absent(const struct ray_packet *packet, const struct ray_hit *hit)
{
	struct ray_hit front = *hit;

	front.is_back = packet->has_ends ? 0 : hit->is_back;
	return ray_hit_is_absent(packet->scene, &front);
}

/* Collects a hit and sends the ray on. */
static void collect(const struct RTCFilterFunctionNArguments *args)
{
	const struct ray_packet *packet = (const struct ray_packet *)(const void *)args->context;
	const struct ray_columns column = ray_columns_of(args);

	for (unsigned i = 0; i < args->N; i++)
		if (args->valid[i] != 0)
			ray_prefetch(packet->scene, ray_prim(packet->scene, column.geometry[i], column.prim[i]));
	for (unsigned i = 0; i < args->N; i++) {
		struct ray_list *list;
		struct ray_hit hit;

		if (args->valid[i] == 0)
			continue;
		args->valid[i] = 0;
		list = &packet->list[column.id[i]];
		hit.prim = ray_prim(packet->scene, column.geometry[i], column.prim[i]);
		hit.u = (double)column.u[i];
		hit.v = (double)column.v[i];
		ray_hit_locate(packet->scene, &packet->ray[column.id[i]], &hit);
		if (!packet->scene->lets_through || !is_absent(packet, &hit))
			list->n = insert(list->hit, list->n, MOST_RAW, &hit);
	}
}

/* Two hits of one side within this distance are one: surfaces coincide, discs overlap. */
static double merge_distance(const struct ray_scene *scene, uint32_t a, uint32_t b)
{
	double center[3], normal[3], ra, rb;

	if (!ray_is_disc(scene, a) || !ray_is_disc(scene, b))
		return SAME_HIT;
	ra = ray_disc(scene, a, center, normal);
	rb = ray_disc(scene, b, center, normal);
	return (ra < rb ? ra : rb) / 2 > SAME_HIT ? (ra < rb ? ra : rb) / 2 : SAME_HIT;
}

static int merge(const struct ray_scene *scene, const struct ray *ray, const struct ray_list *list, int most,
                 struct ray_hit *out)
{
	struct ray_hit group[2]; /* the latest of each side; the group began at `first` */
	double first[2], length = v3d_length(ray->direction);
	int is_open[2] = { 0, 0 }, n = 0;

	for (int i = 0; i < list->n; i++) {
		const struct ray_hit *hit = &list->hit[i];
		struct ray_hit *last = &group[hit->is_back];
		double gap = (hit->t - first[hit->is_back]) * length;

		if (is_open[hit->is_back] && gap <= merge_distance(scene, last->prim, hit->prim)) {
			if (gap <= SAME_HIT && hit->prim < last->prim)
				*last = *hit;
			continue;
		}
		if (is_open[hit->is_back])
			n = insert(out, n, most, last);
		is_open[hit->is_back] = 1;
		first[hit->is_back] = hit->t;
		*last = *hit;
	}
	for (int side = 0; side < 2; side++)
		if (is_open[side])
			n = insert(out, n, most, &group[side]);
	return n;
}

static void collect_packet(const struct ray_scene *scene, const struct ray *ray, int n, int has_ends,
                           struct ray_list list[RAY_PACKET])
{
	_Alignas(32) int valid[RAY_PACKET];
	struct RTCRayHit8 rays;
	struct ray_packet packet;

	ray_packet_init(&packet, scene, ray);
	packet.context.filter = collect;
	packet.list = list;
	packet.has_ends = has_ends;
	ray_packet_fill(&rays.ray, valid, ray, n, 0);
	for (int k = 0; k < RAY_PACKET; k++) {
		list[k].n = 0;
		rays.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
		rays.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
	}
	rtcIntersect8(valid, scene->scene, &packet.context, &rays);
}

void ray_scene_trace_all(const struct ray_scene *scene, const struct ray *ray, int n, int most, struct ray_hit *hit,
                         int *n_hits)
{
	assert(most >= 1 && most <= RAY_MOST_HITS);
	for (int i = 0; i < n; i += RAY_PACKET) {
		int part = n - i < RAY_PACKET ? n - i : RAY_PACKET;
		struct ray_list list[RAY_PACKET];

		collect_packet(scene, ray + i, part, 0, list);
		for (int k = 0; k < part; k++)
			n_hits[i + k] = merge(scene, &ray[i + k], &list[k], most, hit + (size_t)(i + k) * (size_t)most);
	}
}

/* Takes from the hits of rays from both ends those that stop rays from one; from the other end, backwards. */
static void choose_end(const struct ray_scene *scene, const struct ray_list *both, int is_other, double length,
                       struct ray_list *list)
{
	list->n = 0;
	for (int i = 0; i < both->n; i++) {
		struct ray_hit *hit = &list->hit[list->n];

		*hit = both->hit[is_other ? both->n - 1 - i : i];
		if (is_other) {
			hit->is_back = !hit->is_back;
			hit->t = length - hit->t;
		}
		list->n += !hit->is_back || ray_is_two_sided(scene, hit->prim);
	}
}

/* A ray that meets more than a list holds is traced again from its other end. */
static int merge_other(const struct ray_scene *scene, const struct ray *ray, const struct ray_list *both, double length,
                       int most, struct ray_hit *hit)
{
	struct ray other = *ray;
	struct ray_list list;
	int n;

	for (int k = 0; k < 3; k++) {
		other.origin[k] = ray->origin[k] + length * ray->direction[k];
		other.direction[k] = -ray->direction[k];
	}
	if (both->n == MOST_RAW) {
		ray_scene_trace_all(scene, &other, 1, most, hit, &n);
		return n;
	}
	choose_end(scene, both, 1, length, &list);
	return merge(scene, &other, &list, most, hit);
}

void ray_scene_trace_ends(const struct ray_scene *scene, const struct ray *ray, int n, double length,
                          const struct ray_hits *hits, const struct ray_hits *other)
{
	const int most = hits->most;

	if (other == NULL) {
		ray_scene_trace_all(scene, ray, n, most, hits->hit, hits->n);
		return;
	}
	assert(most >= 1 && most <= RAY_MOST_HITS && most == other->most);
	for (int i = 0; i < n; i += RAY_PACKET) {
		int part = n - i < RAY_PACKET ? n - i : RAY_PACKET;
		struct ray_list list[RAY_PACKET], one;

		collect_packet(scene, ray + i, part, 1, list);
		for (int k = 0; k < part; k++) {
			size_t at = (size_t)(i + k) * (size_t)most;

			choose_end(scene, &list[k], 0, length, &one);
			hits->n[i + k] = merge(scene, &ray[i + k], &one, most, hits->hit + at);
			other->n[i + k] = merge_other(scene, &ray[i + k], &list[k], length, most, other->hit + at);
		}
	}
}
