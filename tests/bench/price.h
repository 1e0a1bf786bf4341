/* What a frame costs more than another, both drawn in turn: machines drift, differences of neighbours less. Of one thread that
 * is its processor time, which others on the machine take less from, else wall time. */
#ifndef TESTS_BENCH_PRICE_H
#define TESTS_BENCH_PRICE_H

#include "render/stages.h"

struct price_side {
	struct render_settings settings;
	int has_depth; /* the plane is asked for */
	/* The scene of frame i; it must stay until the next call. */
	void (*scene)(struct psr_scene *scene, int frame, const void *userdata);
	const void *userdata;
};

/* Of the frames `with`: medians. more_ms: the median of the differences between two frames of the same number. */
struct price {
	double ms, more_ms;
	double stage_ms[PSR_N_STAGES];
	struct psr_report report; /* of the last frame */
};

/* n_frames pairs, after one that is not counted; each side has a renderer of its own. */
void price_measure(struct price *out, const struct price_side *with, const struct price_side *without, int n_frames,
                   int n_threads);

#endif
