#include "ladder.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/random.h"
#include "base/stats.h"
#include "render/render.h"

#define MOST_THREADS 256

struct ladder {
	struct ladder_options options;
	struct psr_renderer *renderer[PSR_N_ISAS + 1]; /* by enum psr_isa; NULL until a rung needs it */
	struct psr_pool *pool[MOST_THREADS + 1];       /* by number of threads, from 2 on */
	uint8_t *rgb, *first;                          /* the frame in progress; the first rung's */
	size_t n_pixels;                               /* that these have room for */
};

int ladder_create(struct ladder **out, const struct ladder_options *options, struct psr_error *err)
{
	*out = calloc(1, sizeof **out);
	if (*out == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to measure settings");
	(*out)->options = *options;
	return PSR_OK;
}

void ladder_destroy(struct ladder *ladder)
{
	if (ladder == NULL)
		return;
	for (int i = 0; i <= PSR_N_ISAS; i++)
		psr_renderer_destroy(ladder->renderer[i]);
	for (int i = 0; i <= MOST_THREADS; i++)
		psr_pool_destroy(ladder->pool[i]);
	free(ladder->rgb);
	free(ladder->first);
	free(ladder);
}

/* Finds or makes what a rung draws with. *pool NULL: one thread. */
static int equip(struct ladder *ladder, const struct ladder_rung *rung, struct psr_renderer **renderer,
                 struct psr_pool **pool, struct psr_error *err)
{
	const int n_threads = rung->n_threads != 0 ? rung->n_threads : ladder->options.n_threads;
	int rc = PSR_OK;

	if (ladder->renderer[rung->isa] == NULL) {
		rc = psr_renderer_create(&ladder->renderer[rung->isa], err);
		if (rc == PSR_OK && rung->isa != LADDER_BEST_ISA)
			renderer_use(ladder->renderer[rung->isa], simd_of(rung->isa));
	}
	*renderer = ladder->renderer[rung->isa];
	if (rc == PSR_OK && n_threads > 1 && ladder->pool[n_threads] == NULL
	    && psr_pool_create(&ladder->pool[n_threads], n_threads, NULL) != PSR_OK)
		rc = psr_fail(err, PSR_ERR_MEMORY, "cannot start %d threads", n_threads);
	*pool = ladder->pool[n_threads];
	return rc;
}

/* A call of ladder_measure() or ladder_draw(). */
struct call {
	struct ladder *ladder;
	const struct ladder_view *view;
	struct psr_error *err;
};

/* Draws a frame with an equipped rung. */
static int render(const struct call *call, const struct ladder_rung *rung, const struct psr_scene *scene,
                  struct psr_renderer *renderer, struct psr_pool *pool, struct psr_frame *frame)
{
	struct refiner **refiner = renderer_refiner(renderer);
	struct render_settings settings = rung->settings;
	int rc = PSR_OK;

	settings.width = frame->width;
	settings.height = frame->height;
	settings.cancel = (struct psr_cancel){ NULL, NULL };
	if (settings.pass == 0 && settings.smooth != PSR_SMOOTH_FINE)
		return renderer_draw(renderer, scene, &settings, pool, frame, call->err);
	if (*refiner == NULL)
		rc = refiner_create(refiner, renderer, call->err);
	return rc == PSR_OK ? refiner_draw(*refiner, scene, &settings, pool, frame, call->err) : rc;
}

struct drawn {
	uint64_t ns;        /* of drawing with shadow maps that stand, and of encoding */
	uint64_t shadow_ns; /* wall time of drawing the maps */
	uint64_t n_bytes;
};

static uint64_t clock_of(const struct psr_pool *pool)
{
	return pool != NULL ? clock_ns() : clock_thread_ns();
}

static int check_coding(int rc, struct psr_error *err)
{
	return rc == PSR_OK ? PSR_OK : psr_fail(err, rc, "a picture could not be coded");
}

/* Draws a frame into the ladder's room, and encodes it. is_first: shadow maps of earlier frames are dropped before. */
static int draw(struct drawn *drawn, const struct call *call, const struct ladder_rung *rung, int is_first)
{
	const struct psr_instance instance = { .model = rung->model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	const struct ladder_coder *coder = rung->coder;
	struct psr_light light = call->view->light;
	struct psr_frame frame = { .width = call->view->width, .height = call->view->height, .rgb = call->ladder->rgb };
	struct psr_renderer *renderer;
	struct psr_pool *pool;
	struct psr_scene scene;
	int rc = equip(call->ladder, rung, &renderer, &pool, call->err);

	*drawn = (struct drawn){ .n_bytes = 0 };
	ladder_scene(&scene, call->view, &instance);
	light.casts_shadow &= !rung->no_shadows;
	scene.light = &light;
	if (rc == PSR_OK && is_first && light.casts_shadow) {
		scene.n_lights = 0;
		rc = render(call, rung, &scene, renderer, pool, &frame);
		scene.n_lights = 1;
	}
	uint64_t start = clock_of(pool);
	if (rc == PSR_OK)
		rc = render(call, rung, &scene, renderer, pool, &frame);
	if (rc == PSR_OK && (frame.report.n_shadow_maps_drawn > 0 || rung->no_shadows)) {
		/* Once more: now the maps stand, or those of other rungs are gone. */
		drawn->shadow_ns = frame.report.n_shadow_maps_drawn > 0 ? frame.report.ns[PSR_STAGE_SHADOW] : 0;
		start = clock_of(pool);
		rc = render(call, rung, &scene, renderer, pool, &frame);
	}
	if (rc == PSR_OK && coder != NULL)
		rc = check_coding(coder->encode(&drawn->n_bytes, frame.rgb, frame.width, frame.height, coder->userdata),
		                  call->err);
	drawn->ns = clock_of(pool) - start;
	return rc;
}

static int draw_decoded(struct drawn *drawn, const struct call *call, const struct ladder_rung *rung)
{
	const struct ladder_coder *coder = rung->coder;
	const int rc = draw(drawn, call, rung, 1);

	if (rc != PSR_OK || coder == NULL)
		return rc;
	return check_coding(coder->decode(call->ladder->rgb, call->view->width, call->view->height, coder->userdata),
	                    call->err);
}

static double error_of(const uint8_t *rgb, const struct ladder_view *view)
{
	const size_t n = (size_t)view->width * view->height * 3;
	uint64_t sum = 0;

	for (size_t i = 0; i < n; i++) {
		const int d = rgb[i] - view->truth[i];

		sum += (uint64_t)(d * d);
	}
	return sqrt((double)sum / (3.0 * (double)(view->n_covered > 0 ? view->n_covered : 1)));
}

static int make_room(const struct call *call)
{
	const uint32_t width = call->view->width, height = call->view->height;
	const size_t n = (size_t)width * height;
	struct ladder *ladder = call->ladder;

	if (n <= ladder->n_pixels)
		return PSR_OK;
	free(ladder->rgb);
	free(ladder->first);
	ladder->rgb = malloc(3 * n);
	ladder->first = malloc(3 * n);
	ladder->n_pixels = ladder->rgb != NULL && ladder->first != NULL ? n : 0;
	return ladder->n_pixels > 0 ? PSR_OK
	                            : psr_fail(call->err, PSR_ERR_MEMORY, "no memory for a picture of %ux%u", width, height);
}

/* Draws a frame of each rung that is not timed: it warms the caches, and its picture is compared. */
static int look(struct ladder_row *row, const struct call *call, const struct ladder_rung *rung, uint32_t n)
{
	const size_t n_bytes = (size_t)call->view->width * call->view->height * 3;
	struct ladder *ladder = call->ladder;
	int rc = PSR_OK;

	for (uint32_t i = 0; rc == PSR_OK && i < n; i++) {
		struct drawn drawn;

		rc = draw_decoded(&drawn, call, &rung[i]);
		if (rc == PSR_OK && i == 0)
			memcpy(ladder->first, ladder->rgb, n_bytes);
		if (rc == PSR_OK)
			row[i] = (struct ladder_row){
				.rmse = error_of(ladder->rgb, call->view), .n_bytes = drawn.n_bytes,
				.shadow_ms = (double)drawn.shadow_ns * 1e-6,
				.is_same = memcmp(ladder->first, ladder->rgb, n_bytes) == 0,
			};
	}
	return rc;
}

static void shuffle(uint32_t *order, uint32_t n, uint64_t *random)
{
	for (uint32_t i = n; i > 1; i--) {
		const uint32_t k = random_below(random, i), kept = order[k];

		order[k] = order[i - 1];
		order[i - 1] = kept;
	}
}

/* The rungs' times in one view: rounds of a rung follow each other. */
struct times {
	uint32_t n, n_rounds;
	double *ms, *ratio; /* n_rounds a rung */
	double *round;      /* by rung, of the round in progress; NAN: it sits the round out */
	double *sum;        /* by rung, seconds */
	uint32_t *order;
};

static int times_make(struct times *times, uint32_t n, uint32_t n_rounds, struct psr_error *err)
{
	const size_t n_times = (size_t)n * n_rounds;

	*times = (struct times){ .n = n, .n_rounds = n_rounds };
	times->ms = calloc(2 * n_times + 2 * (size_t)n, sizeof *times->ms);
	times->order = calloc(n, sizeof *times->order);
	if (times->ms == NULL || times->order == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the times of %u settings", n);
	times->ratio = times->ms + n_times;
	times->round = times->ratio + n_times;
	times->sum = times->round + n;
	for (uint32_t i = 0; i < n; i++)
		times->order[i] = i;
	return PSR_OK;
}

static void times_fini(struct times *times)
{
	free(times->ms);
	free(times->order);
}

/* The first rung takes part in every round, since the others are compared with it. */
static int run_round(struct ladder_row *row, struct times *times, const struct call *call,
                     const struct ladder_rung *rung)
{
	const double most = call->ladder->options.most_seconds;
	int rc = PSR_OK;

	for (uint32_t k = 0; rc == PSR_OK && k < times->n; k++) {
		const uint32_t i = times->order[k];
		struct drawn drawn;

		times->round[i] = NAN;
		if (i > 0 && times->sum[i] > most)
			continue;
		rc = draw(&drawn, call, &rung[i], 0);
		times->round[i] = (double)drawn.ns * 1e-6;
		times->sum[i] += times->round[i] * 1e-3;
	}
	for (uint32_t i = 0; rc == PSR_OK && i < times->n; i++) {
		const size_t at = (size_t)i * times->n_rounds + row[i].n_rounds;

		if (isnan(times->round[i]))
			continue;
		times->ms[at] = times->round[i];
		times->ratio[at] = times->round[i] / times->round[0];
		row[i].n_rounds++;
	}
	return rc;
}

static void summarize(struct ladder_row *row, const struct times *times)
{
	for (uint32_t i = 0; i < times->n; i++) {
		double *ms = times->ms + (size_t)i * times->n_rounds, *ratio = times->ratio + (size_t)i * times->n_rounds;
		const size_t n = row[i].n_rounds;

		row[i].ms = stats_median(ms, n); /* sorts */
		row[i].ms_low = stats_percentile(ms, n, 0.25);
		row[i].ms_high = stats_percentile(ms, n, 0.75);
		row[i].ratio = stats_median(ratio, n);
		row[i].ratio_low = stats_percentile(ratio, n, 0.25);
		row[i].ratio_high = stats_percentile(ratio, n, 0.75);
	}
}

int ladder_measure(struct ladder_row *row, struct ladder *ladder, const struct ladder_view *view,
                   const struct ladder_rung *rung, uint32_t n, struct psr_error *err)
{
	const struct call call = { ladder, view, err };
	uint64_t random = ladder->options.seed;
	struct times times;
	int rc = make_room(&call);

	if (rc != PSR_OK)
		return rc;
	rc = times_make(&times, n, ladder->options.n_rounds, err);
	if (rc == PSR_OK)
		rc = look(row, &call, rung, n);
	for (uint32_t round = 0; rc == PSR_OK && round < times.n_rounds; round++) {
		shuffle(times.order, n, &random);
		rc = run_round(row, &times, &call, rung);
	}
	if (rc == PSR_OK)
		summarize(row, &times);
	times_fini(&times);
	return rc;
}

int ladder_draw(uint8_t *rgb, struct ladder *ladder, const struct ladder_view *view, const struct ladder_rung *rung,
                struct psr_error *err)
{
	const struct call call = { ladder, view, err };
	struct drawn drawn;
	int rc = make_room(&call);

	if (rc == PSR_OK)
		rc = draw_decoded(&drawn, &call, rung);
	if (rc == PSR_OK)
		memcpy(rgb, ladder->rgb, (size_t)view->width * view->height * 3);
	return rc;
}
