/* The local surface of each point of a cloud. */
#ifndef PSR_DPOINT_CLOUD_FIT_H
#define PSR_DPOINT_CLOUD_FIT_H

#include "cloud.h"

enum cloud_state {
	CLOUD_FINE,
	CLOUD_ROUGH, /* curvatures are no better than noise, or those of a crease */
	CLOUD_FLAT,  /* there are none */
};

struct cloud_fit {
	struct dpoint_local local;
	double off;              /* how far neighbours are off, root mean square */
	double reach;            /* of the neighbours that it was made of */
	double turn;             /* radians that a normal over the rectangle may be off by */
	float border[2];         /* in the frame of `local`: a unit vector out of the surface, if has_border */
	uint8_t state, has_border;
};

/* Fits all n points. MEMORY. */
int cloud_fit_all(struct cloud_fit *fit, const struct dpoint_cloud *cloud, const struct dpoint_cover_options *cover,
                  float delta, struct psr_pool *pool);

#endif
