#include <assert.h>
#include <math.h>
#include <string.h>
#include "base/clock.h"
#include "base/mem.h"
#include "base/vec.h"
#include "cull.h"
#include "render/stages.h"
#include "psr/scene.h"

#define ROUNDS 3

struct measure {
	struct cull_set *set;
	const struct cull_views *views;
	int n_choices;
	uint8_t *is_kept[CULL_MOST_CHOICES], *spare, *n_seen;    /* of each block */
	double test[CULL_MOST_CHOICES], draw[CULL_MOST_CHOICES]; /* seconds, the least of all rounds */
	double frustum;                                          /* of the frustum alone */
	struct psr_renderer *renderer;
	struct psr_frame frame;
	struct psr_error *err;
};

static void take_least(double *seconds, uint64_t started)
{
	*seconds = fmin(*seconds, (double)(clock_thread_ns() - started) * 1e-9);
}

static void time_test(struct measure *m, const struct cull_eye *eye, const struct cull_choice *choice, double *seconds)
{
	const uint64_t started = clock_thread_ns();

	cull_set_test(m->set, eye, choice, m->spare);
	take_least(seconds, started);
}

static int time_draw(struct measure *m, const struct cull_eye *eye, const struct psr_model *model, double *seconds)
{
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .color = { 0.8, 0.8, 0.8 } };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
		                       .ambient = { 0.2, 0.2, 0.2 } };
	struct render_settings settings;
	uint64_t started;
	int rc;

	scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_PERSPECTIVE, .fov_y = 2 * atan(eye->tangent) };
	v3d_set(scene.camera.eye, eye->place[0], eye->place[1], eye->place[2]);
	v3d_add(scene.camera.target, eye->place, eye->frame[2]);
	v3d_scale(scene.camera.up, eye->frame[1], -1);
	v3d_sub(light.direction, eye->frame[2], eye->frame[0]);
	render_settings_default(&settings, m->frame.width, m->frame.height);
	started = clock_thread_ns();
	rc = renderer_draw(m->renderer, &scene, &settings, NULL, &m->frame, m->err);
	take_least(seconds, started);
	return rc;
}

/* Choices take turns, so that other work on the machine slows all of them. */
static int time_view(struct measure *m, const struct cull_eye *eye)
{
	static const struct cull_choice frustum = { 0, CULL_NO_MASK, 0 };
	struct psr_model *part[CULL_MOST_CHOICES] = { NULL };
	int rc = PSR_OK;

	m->frustum = INFINITY;
	for (int i = 0; i < m->n_choices && rc == PSR_OK; i++) {
		const int is_empty = memchr(m->is_kept[i], 1, m->set->n_blocks) == NULL;

		m->test[i] = INFINITY;
		m->draw[i] = is_empty ? 0 : INFINITY;
		if (!is_empty)
			rc = cull_part(&part[i], m->set->base, m->is_kept[i], NULL, m->err);
	}
	for (int round = 0; round < ROUNDS && rc == PSR_OK; round++) {
		time_test(m, eye, &frustum, &m->frustum);
		for (int i = 0; i < m->n_choices && rc == PSR_OK; i++) {
			time_test(m, eye, &m->views->choice[i], &m->test[i]);
			if (part[i] != NULL)
				rc = time_draw(m, eye, part[i], &m->draw[i]);
		}
	}
	for (int i = 0; i < m->n_choices; i++)
		psr_model_unref(part[i]);
	return rc;
}

/* Adds up numbers of blocks and samples; finish() makes shares of them. */
static void count_view(const struct measure *m, struct cull_result *out)
{
	const struct psr_blocks *blocks = psr_model_blocks(m->set->base);

	for (uint32_t b = 0; b < m->set->n_blocks; b++) {
		int n = __builtin_popcountll(blocks->mask[b]);

		if (m->n_seen != NULL) {
			out->blocks += m->n_seen[b] == 0;
			out->samples += n - m->n_seen[b];
		}
		for (int i = 0; i < m->n_choices; i++) {
			if (m->is_kept[i][b])
				continue;
			out->figures[i].blocks++;
			out->figures[i].samples += n;
			out->figures[i].wrong += m->n_seen != NULL && m->n_seen[b] != 0;
		}
	}
}

static void finish(const struct measure *m, struct cull_result *out)
{
	const struct psr_blocks *blocks = psr_model_blocks(m->set->base);
	const int n_views = m->views->n;
	double n_blocks = (double)n_views * blocks->n_blocks, n_samples = (double)n_views * (double)blocks->n_samples;

	for (struct cull_figures *figures = out->figures; figures < out->figures + m->n_choices; figures++) {
		figures->blocks /= n_blocks;
		figures->samples /= n_samples;
		figures->wrong /= n_blocks;
		figures->test_seconds /= n_views;
		figures->frame_seconds /= n_views;
	}
	out->blocks /= n_blocks;
	out->samples /= n_samples;
}

static int run_view(struct measure *m, const struct ray_scene *scene, int view, struct psr_pool *pool,
                    struct cull_result *out)
{
	struct cull_eye eye;
	int rc = PSR_OK;

	cull_eye_place(&eye, (uint32_t)view, m->views->zoom);
	for (int i = 0; i < m->n_choices; i++)
		cull_set_test(m->set, &eye, &m->views->choice[i], m->is_kept[i]);
	if (scene != NULL)
		cull_set_look(m->set, scene, &eye, pool, m->n_seen);
	count_view(m, out);
	if (m->views->is_timed)
		rc = time_view(m, &eye);
	for (int i = 0; i < m->n_choices && m->views->is_timed && rc == PSR_OK; i++) {
		out->figures[i].test_seconds += m->test[i];
		out->figures[i].frame_seconds += m->draw[i] + (m->test[i] - m->frustum);
	}
	return rc;
}

static int measure_init(struct measure *m, int has_truth)
{
	const uint32_t resolution = psr_model_info(m->set->base)->resolution, n = m->set->n_blocks;
	int failed;

	m->frame.width = m->frame.height = resolution < PSR_MAX_SIDE / 2 ? resolution : PSR_MAX_SIDE / 2;
	m->frame.rgb = psr_alloc_array((size_t)m->frame.width * m->frame.width, 3);
	m->spare = psr_alloc_array(n, 1);
	m->n_seen = has_truth ? psr_alloc_array(n, 1) : NULL;
	failed = m->frame.rgb == NULL || m->spare == NULL || (has_truth && m->n_seen == NULL);
	for (int i = 0; i < m->n_choices; i++)
		failed |= (m->is_kept[i] = psr_alloc_array(n, 1)) == NULL;
	return failed || psr_renderer_create(&m->renderer, NULL) != PSR_OK ? PSR_ERR_MEMORY : PSR_OK;
}

static void measure_fini(struct measure *m)
{
	for (int i = 0; i < m->n_choices; i++)
		psr_free(m->is_kept[i]);
	psr_free(m->spare);
	psr_free(m->n_seen);
	psr_free(m->frame.rgb);
	psr_renderer_destroy(m->renderer);
}

int cull_measure(struct cull_result *out, struct cull_set *set, const struct ray_scene *scene,
                 const struct cull_views *views, struct psr_pool *pool, struct psr_error *err)
{
	struct measure m = { .set = set, .views = views, .n_choices = views->n_choices, .err = err };
	int rc;

	assert(views->n_choices <= CULL_MOST_CHOICES);
	*out = (struct cull_result){ .blocks = 0 };
	rc = measure_init(&m, scene != NULL);
	if (rc != PSR_OK)
		psr_fail(err, rc, "no memory for a study of culling");
	for (int v = 0; v < views->n && rc == PSR_OK; v++)
		rc = run_view(&m, scene, v, pool, out);
	if (rc == PSR_OK)
		finish(&m, out);
	measure_fini(&m);
	return rc;
}
