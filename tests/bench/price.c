#include "price.h"

#include <stdlib.h>
#include "base/clock.h"
#include "base/stats.h"
#include "report.h"

struct drawer {
	const struct price_side *side;
	struct psr_pool *pool;
	struct psr_renderer *renderer;
	struct psr_frame frame;
};

static void begin(struct drawer *drawer, const struct price_side *side, struct psr_pool *pool)
{
	const size_t area = (size_t)side->settings.width * side->settings.height;

	*drawer = (struct drawer){ .side = side, .pool = pool };
	drawer->frame.width = side->settings.width;
	drawer->frame.height = side->settings.height;
	drawer->frame.rgb = report_alloc(area, 3);
	drawer->frame.depth = side->has_depth ? report_alloc(area, sizeof(float)) : NULL;
	if (psr_renderer_create(&drawer->renderer, NULL) != PSR_OK)
		report_die("psr", "cannot be started");
}

static void end(struct drawer *drawer)
{
	psr_renderer_destroy(drawer->renderer);
	free(drawer->frame.rgb);
	free(drawer->frame.depth);
}

static double clock_ms(const struct drawer *drawer)
{
	return (double)(drawer->pool != NULL ? clock_ns() : clock_thread_ns()) * 1e-6;
}

static double draw(struct drawer *drawer, int frame)
{
	struct psr_scene scene;
	struct psr_error err;
	double start;

	drawer->side->scene(&scene, frame, drawer->side->userdata);
	start = clock_ms(drawer);
	if (renderer_draw(drawer->renderer, &scene, &drawer->side->settings, drawer->pool, &drawer->frame, &err) != PSR_OK)
		report_die("psr_render", err.text);
	return clock_ms(drawer) - start;
}

void price_measure(struct price *out, const struct price_side *with, const struct price_side *without, int n_frames,
                   int n_threads)
{
	double *ms = report_alloc((size_t)n_frames * (2 + PSR_N_STAGES), sizeof *ms);
	double *more = ms + n_frames, *stage = more + n_frames;
	struct psr_pool *pool = NULL;
	struct drawer a, b;

	if (n_threads > 1 && psr_pool_create(&pool, n_threads, NULL) != PSR_OK)
		report_die("psr", "cannot be started");
	begin(&a, with, pool);
	begin(&b, without, pool);
	draw(&b, 0);
	draw(&a, 0);
	for (int i = 0; i < n_frames; i++) {
		/* Who begins alternates, too. */
		double first = i % 2 ? draw(&b, i + 1) : 0;

		ms[i] = draw(&a, i + 1);
		more[i] = ms[i] - (i % 2 ? first : draw(&b, i + 1));
		for (int s = 0; s < PSR_N_STAGES; s++)
			stage[s * n_frames + i] = (double)a.frame.report.ns[s] * 1e-6;
	}
	out->report = a.frame.report;
	out->ms = stats_median(ms, (size_t)n_frames);
	out->more_ms = stats_median(more, (size_t)n_frames);
	for (int s = 0; s < PSR_N_STAGES; s++)
		out->stage_ms[s] = stats_median(stage + s * n_frames, (size_t)n_frames);
	end(&a);
	end(&b);
	psr_pool_destroy(pool);
	free(ms);
}
