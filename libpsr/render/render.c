#include <stdatomic.h>
#include <string.h>
#include "render.h"

const char *psr_stage_name(enum psr_stage stage)
{
	static const char *const names[PSR_N_STAGES] = { "plan",    "shadow", "cull", "warp",  "gaps",
		                                             "resolve", "shade",  "fill", "smooth" };

	return (unsigned)stage < PSR_N_STAGES ? names[stage] : "?";
}

void psr_settings_default(struct psr_settings *settings, uint32_t width, uint32_t height)
{
	*settings = (struct psr_settings){ .width = width, .height = height, .spacing_px = 1 };
}

void render_settings_default(struct render_settings *settings, uint32_t width, uint32_t height)
{
	*settings = (struct render_settings){ .width = width, .height = height, .spacing_px = 1,
		                                  .cull_tests = PSR_CULL_ALL, .gap_threshold = 3,
		                                  .gap_method = PSR_GAPS_CLOSED, .shadow_side = PSR_MAX_SHADOW_SIDE };
}

int render_cancelled(struct psr_error *err)
{
	return psr_fail(err, PSR_ERR_CANCELLED, "the frame was cancelled");
}

/* Remembers an answer other than 0, so that all later questions get it. */
struct latch {
	struct psr_cancel asked;
	atomic_int is_cancelled;
};

static int is_cancelled(void *userdata)
{
	struct latch *latch = userdata;

	if (atomic_load_explicit(&latch->is_cancelled, memory_order_relaxed))
		return 1;
	if (!latch->asked.is_cancelled(latch->asked.userdata))
		return 0;
	atomic_store_explicit(&latch->is_cancelled, 1, memory_order_relaxed);
	return 1;
}

int psr_render(struct psr_renderer *renderer, const struct psr_scene *scene, const struct psr_settings *asked,
               struct psr_pool *pool, struct psr_frame *frame, struct psr_error *err)
{
	struct refiner **refiner = renderer_refiner(renderer);
	struct latch latch = { .asked = asked->cancel };
	struct render_settings settings;

	render_settings_default(&settings, asked->width, asked->height);
	settings.spacing_px = asked->spacing_px;
	settings.smooth = asked->smooth;
	settings.pass = asked->pass;
	settings.with_ewa = asked->with_splats && asked->pass == 0;
	if (asked->cancel.is_cancelled != NULL)
		settings.cancel = (struct psr_cancel){ is_cancelled, &latch };
	if (settings.pass == 0 && settings.smooth != PSR_SMOOTH_FINE)
		return renderer_draw(renderer, scene, &settings, pool, frame, err);
	int rc = *refiner != NULL ? PSR_OK : refiner_create(refiner, renderer, err);
	if (rc == PSR_OK)
		rc = refiner_draw(*refiner, scene, &settings, pool, frame, err);
	if (rc == PSR_OK && asked->with_splats && asked->pass > 0)
		frame->report.effect[PSR_EFFECT_SPLATS].why = PSR_WHY_VOID;
	return rc;
}
