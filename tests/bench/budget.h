/* What the files of `make bench-budget` share: a connection that asks for pictures of views, and what came of them. */
#ifndef TESTS_BENCH_BUDGET_H
#define TESTS_BENCH_BUDGET_H

#include "measure/ladder.h"
#include "psr/client.h"

#define BUDGET_SIDE 256      /* of pictures */
#define BUDGET_RESOLUTION 512 /* of models: around views have magnification 1 or less */
#define BUDGET_VIEWS 8
#define BUDGET_RUNGS 11      /* of psrd's ladder, which PROTOCOL.md leaves to the server */

/* ---- budget_link.c ---- */

struct budget_link {
	struct psr_client *client;
	const struct ladder_view *view; /* BUDGET_VIEWS; view i stands in slot i */
};

/* Connects and sends a scene of the model for each view, or ends the program. */
void budget_link_open(struct budget_link *link, const char *address, const char *model, const struct ladder_view *view);
void budget_link_close(struct budget_link *link);

/* Fills a request for the colour of a view, without loss; budget 0. */
void budget_link_request(struct psr_msg_frame *frame, const struct budget_link *link, uint32_t view);

/* Asks and waits. The event's pointers hold until the next call. */
void budget_link_draw(struct psr_event *event, struct budget_link *link, const struct psr_msg_frame *frame);

/* How far the picture is from the truth: codes of sRGB, by the pixels that the object covers. */
double budget_rmse_of(const struct psr_frame *picture, const struct ladder_view *view);

/* Of a report: 0 if it has no such entry. */
double budget_entry_ms(const struct psr_msg_frame_end *end, unsigned id);

/* A client that draws the first view in a loop, beside what is measured. */
struct budget_other;
struct budget_other *budget_other_start(const char *address, const char *model, const struct ladder_view *view);
void budget_other_stop(struct budget_other *other); /* NULL is fine */

/* ---- budget_times.c ---- */

/* Frames of a model, pooled over all models; see budget_times_print(). */
struct budget_sums {
	uint64_t n_frames, n_within;
	double *behind, *foreseen; /* decibels below the best that met T; foreseen over taken: by frame */
	size_t n_behind, n_foreseen;
};

/* Draws the ladder, then pictures with budgets of time from the fastest setting's time up. */
void budget_times(struct budget_sums *sums, const char *address, const char *model, const struct ladder_view *view,
                  int has_other);
void budget_times_print(struct budget_sums *sums, const char *what); /* beside the targets; frees */

/* ---- budget_rmse.c ---- */

struct budget_likes {
	uint64_t n_frames, n_above;
	double *ratio; /* foreseen over measured: by frame */
	size_t n;
};

/* Draws each view with budgets of RMSE from coarse to fine; calibrations have seen other views. */
void budget_rmse(struct budget_likes *likes, const char *address, const char *model, const struct ladder_view *view);
void budget_rmse_print(struct budget_likes *likes); /* beside the targets; frees */

/* ---- budget_bound.c ---- */

struct budget_bounds {
	uint64_t n_frames, n_broken;
	double *ratio; /* the bound over the 99.9th percentile of the distances: by frame */
	double *plane; /* the same of the plane's 99.9th percentile */
	size_t n;
};

/* Draws each view with each rung that has no pass by a parallel projection, and compares depths with those of rays. */
void budget_bound(struct budget_bounds *bounds, const char *address, const char *model, const struct ladder_view *view,
                  struct psr_truth *truth);
void budget_bound_print(struct budget_bounds *bounds);

/* From the cheapest to the best, as psrd has them. */
extern const struct psr_msg_settings budget_rungs[BUDGET_RUNGS];

#endif
