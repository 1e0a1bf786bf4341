/* A load with its models found and its cameras placed: what every connection opens and asks for. Never changes while a
 * load runs. */
#ifndef PSR_CLIENT_BENCH_PLAN_H
#define PSR_CLIENT_BENCH_PLAN_H

#include "flight.h"
#include "mix.h"

struct bench_model {          /* a model at one size of pictures, or its first levels */
	char name[PSR_WIRE_MAX_NAME + 1];
	uint32_t pixels;         /* OPEN's resolution */
	uint8_t levels;          /* OPEN's */
	uint8_t content_id[16];
};

struct bench_kind {           /* of requests; a line of the mix */
	struct scene *scene;     /* its handles are those of the first connection, and of no use */
	struct psr_msg_frame frame; /* all fields but the camera and what a view needs; slot is the kind's number */
	struct flight flight;
	uint32_t *model;         /* of each instance of the scene: its place in plan.model */
	double up_to;            /* requests whose random number (0..1) is below this, and not below the kind's before */
};

struct bench_request {        /* of a recording */
	uint64_t due_ns;         /* from the start of the load */
	uint32_t client, kind;
	uint64_t hash;           /* of the colour; 0: none was recorded */
	struct psr_camera camera;
};

struct bench_plan {
	struct bench_kind kind[MIX_MAX];
	uint32_t n_kinds;
	struct bench_model *model;
	uint32_t n_models;
	uint64_t seed;
	struct bench_request *request; /* of a recording, by due_ns; else NULL */
	uint64_t n_requests;
	uint32_t n_clients;      /* of the recording */
};

/* Opens all models of the mix on a connection of its own, which waits while the server builds, and closes it.
 * bench_plan_fini() is due also after an error. The errors of scene_open(), flight_make() and psr_client_connect(). */
int bench_plan_make(struct bench_plan *plan, const struct mix *mix, const char *server, int timeout_ms,
                    struct psr_error *err);
void bench_plan_fini(struct bench_plan *plan);

/* Adds the models of the kind's scene. MEMORY. */
int bench_plan_add_models(struct bench_plan *plan, struct bench_kind *kind, const uint32_t *pixels,
                          struct psr_error *err);

/* Which kind request k of a client is, and its camera. */
uint32_t bench_kind_of(const struct bench_plan *plan, uint32_t client, uint64_t k);
void bench_plan_camera(struct psr_camera *camera, const struct bench_plan *plan, uint32_t client, uint32_t n_clients,
                       uint64_t k);

#endif
