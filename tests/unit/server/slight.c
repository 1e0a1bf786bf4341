/* Which frames the event loop draws itself. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "server/frames/frame.h"
#include "server/models/catalogue.h"

/* A small picture of one model. */
struct small {
	struct catalogue_model model;
	struct catalogue_model *models[1];
	struct psr_instance instance;
	uint32_t of_instance;
	struct scene scene;
	struct frame frame;
};

static void small_init(struct small *small)
{
	*small = (struct small){ .model.card.n_blocks = 1000, .frame.request.n_frames = 1 };
	small->models[0] = &small->model;
	small->scene = (struct scene){ .scene = { .instance = &small->instance, .n_instances = 1 },
		                           .instance = &small->instance, .of_instance = &small->of_instance,
		                           .model = small->models, .n_models = 1 };
	small->scene.scene.light = small->scene.light;
	small->scene.scene.n_lights = 1;
	small->frame.drawing.scene = &small->scene;
	small->frame.drawing.request.width = small->frame.drawing.request.height = 64;
}

static void a_small_picture_is_slight_with_veils_too(void **state)
{
	struct small small;

	(void)state;
	small_init(&small);
	assert_true(frame_is_slight(&small.frame));
	small.model.card.has_sheer = 1; /* as most models have */
	assert_true(frame_is_slight(&small.frame));
}

static void what_may_take_long_is_not_slight(void **state)
{
	struct small small;

	(void)state;
	small_init(&small);
	small.frame.drawing.request.width = 1024;
	assert_false(frame_is_slight(&small.frame));
	small_init(&small);
	small.frame.request.n_frames = 2;
	assert_false(frame_is_slight(&small.frame));
	small_init(&small);
	small.model.card.n_blocks = 1 << 20;
	assert_false(frame_is_slight(&small.frame));
	small_init(&small);
	small.scene.light[0].casts_shadow = 1;
	assert_false(frame_is_slight(&small.frame));
	small_init(&small);
	small.frame.drawing.settings.splats = 1;
	assert_false(frame_is_slight(&small.frame));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_small_picture_is_slight_with_veils_too),
		cmocka_unit_test(what_may_take_long_is_not_slight),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
