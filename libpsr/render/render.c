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
		                                  .gap_method = PSR_GAPS_BILINEAR };
}

int psr_render(struct psr_renderer *renderer, const struct psr_scene *scene, const struct psr_settings *asked,
               struct psr_pool *pool, struct psr_frame *frame, struct psr_error *err)
{
	struct refiner **refiner = renderer_refiner(renderer);
	struct render_settings settings;

	render_settings_default(&settings, asked->width, asked->height);
	settings.spacing_px = asked->spacing_px;
	settings.is_smooth = asked->is_smooth;
	settings.pass = asked->pass;
	settings.is_cancelled = asked->is_cancelled;
	settings.userdata = asked->userdata;
	if (settings.pass == 0)
		return renderer_draw(renderer, scene, &settings, pool, frame, err);
	const int rc = *refiner != NULL ? PSR_OK : refiner_create(refiner, renderer, err);
	return rc ? rc : refiner_draw(*refiner, scene, &settings, pool, frame, err);
}
