/* The ways that the cameras of a load take: the camera of request k is a function of k, of the connection and of the
 * seed. */
#ifndef PSR_CLIENT_BENCH_FLIGHT_H
#define PSR_CLIENT_BENCH_FLIGHT_H

#include "client/scene/view.h"

enum flight_kind { FLIGHT_ORBIT, FLIGHT_ZOOM, FLIGHT_FLICK, FLIGHT_RANDOM, FLIGHT_LIST };

struct flight {
	enum flight_kind kind;
	struct psr_camera start; /* where the way begins */
	double up[3], aspect;
	struct view_wish view;
	const struct scene *scene;
	struct psr_camera *list; /* FLIGHT_LIST: taken in turn */
	uint32_t n_list;
};

/* Finds what is wrong with a path and a view without a scene. ARG. */
int flight_check(const char *path, const struct view_wish *view, struct psr_error *err);

/* Prepares the way in this scene, which must outlive it. flight_fini() is due also after an error. ARG, MEMORY, and
 * what reading the path's file says. */
int flight_make(struct flight *flight, const char *path, const struct view_wish *view, const struct scene *scene,
                double aspect, struct psr_error *err);
void flight_fini(struct flight *flight);

/* The camera of request k of a connection: `part` (0..1) spreads the connections over the way, `random` is a number of
 * its own for each of them. */
void flight_at(struct psr_camera *camera, const struct flight *flight, uint64_t k, double part, uint64_t random);

#endif
