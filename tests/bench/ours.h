/* Frames of psr_render, with and without the daemon's encoder behind it. */
#ifndef TESTS_BENCH_OURS_H
#define TESTS_BENCH_OURS_H

#include <stdint.h>
#include "psr/render.h"
#include "scene.h"

#define OURS_QUALITY 90

struct ours_settings {
	uint32_t width, height;
	int n_threads, is_encoded;
	int n_frames;             /* of one round */
	double least_ms, most_ms; /* rounds are drawn until the one is over; after the other, no more frames than three */
	/* The scene of frame i; it must stay until the next call. */
	void (*scene)(struct psr_scene *scene, int frame, const void *userdata);
	const void *userdata;
};

/* Medians over the frames of each figure by itself, so stages need not add up to the frame. */
struct ours_result {
	double ms;                       /* psr_render */
	double ms_encoded;               /* and JPEG, q90, as RECT messages; 0 if not asked for */
	double stage_ms[PSR_N_STAGES];
	double count[PSR_N_STAGES];      /* means, like the rest */
	double n_samples, n_samples_drawn, n_blocks_drawn, n_covered, n_filled;
	double encoded_bytes;
	uint64_t renderer_bytes;
	int n_frames;
};

/* rgb: unless NULL, takes frame 0. */
void ours_measure(struct ours_result *out, const struct ours_settings *settings, uint8_t *rgb);

/* The part of the picture, `reduce` times smaller, that is covered: mean of the swing's middle and ends. */
double ours_coverage(const struct scene_film *film, uint32_t reduce);

int ours_threads(void); /* as many as there are processors */

#endif
