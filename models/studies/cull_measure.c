#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "base/mem.h"
#include "base/vec.h"
#include "cull.h"
#include "cull_part.h"
#include "cull_set.h"
#include "render/stages.h"
#include "psr/scene.h"

#define ROUNDS 3

struct measure {
	struct cull_set *set;
	const struct cull_choice *choice;
	int n_choices;
	uint8_t **is_kept, *n_seen; /* of each choice; of each block */
	double *test, *draw;        /* seconds, the least of all rounds, of each choice */
	double frustum;             /* of the frustum alone */
	struct psr_model **part;
	struct psr_renderer *renderer;
	struct psr_frame frame;
	struct psr_error *err;
};

static double cpu_seconds(void)
{
	struct timespec t;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
	return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static double time_test(struct measure *m, const struct cull_eye *eye, const struct cull_choice *choice,
                        uint8_t *is_kept)
{
	double started = cpu_seconds();

	cull_set_test(m->set, eye, choice, is_kept);
	return cpu_seconds() - started;
}

static int time_draw(struct measure *m, const struct cull_eye *eye, const struct psr_model *model, double *seconds)
{
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .color = { 0.8, 0.8, 0.8 } };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
		                       .ambient = { 0.2, 0.2, 0.2 } };
	struct render_settings settings;
	double started;
	int rc;

	scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_PERSPECTIVE, .fov_y = 2 * atan(eye->tangent) };
	v3d_set(scene.camera.eye, eye->place[0], eye->place[1], eye->place[2]);
	v3d_add(scene.camera.target, eye->place, eye->frame[2]);
	v3d_scale(scene.camera.up, eye->frame[1], -1);
	v3d_sub(light.direction, eye->frame[2], eye->frame[0]);
	render_settings_default(&settings, m->frame.width, m->frame.height);
	started = cpu_seconds();
	rc = renderer_draw(m->renderer, &scene, &settings, NULL, &m->frame, m->err);
	*seconds = fmin(*seconds, cpu_seconds() - started);
	return rc;
}

/* Choices take turns, so that what else the machine does meets them all. */
static int time_view(struct measure *m, const struct cull_eye *eye)
{
	static const struct cull_choice frustum = { 0, CULL_NO_MASK, 0 };
	uint8_t *spare = psr_alloc_array(m->set->n_blocks, 1);
	int rc = spare != NULL ? PSR_OK : psr_fail(m->err, PSR_ERR_MEMORY, "no memory for a study of culling");

	m->frustum = INFINITY;
	for (int i = 0; i < m->n_choices && rc == PSR_OK; i++) {
		m->test[i] = m->draw[i] = INFINITY;
		if (memchr(m->is_kept[i], 1, m->set->n_blocks) == NULL)
			m->draw[i] = 0; /* there is nothing to draw */
		else
			rc = cull_part(&m->part[i], m->set->base, m->is_kept[i], NULL, m->err);
	}
	for (int round = 0; round < ROUNDS && rc == PSR_OK; round++) {
		m->frustum = fmin(m->frustum, time_test(m, eye, &frustum, spare));
		for (int i = 0; i < m->n_choices && rc == PSR_OK; i++) {
			m->test[i] = fmin(m->test[i], time_test(m, eye, &m->choice[i], spare));
			if (m->part[i] != NULL)
				rc = time_draw(m, eye, m->part[i], &m->draw[i]);
		}
	}
	for (int i = 0; i < m->n_choices; i++) {
		psr_model_unref(m->part[i]);
		m->part[i] = NULL;
	}
	psr_free(spare);
	return rc;
}

/* Adds up what a view shows: numbers of blocks and samples for now. */
static void count_view(const struct measure *m, struct cull_figures *figures, struct cull_truth *truth)
{
	const struct psr_blocks *blocks = psr_model_blocks(m->set->base);

	for (uint32_t b = 0; b < m->set->n_blocks; b++) {
		int n = __builtin_popcountll(blocks->mask[b]);

		if (m->n_seen != NULL) {
			truth->blocks += m->n_seen[b] == 0;
			truth->samples += n - m->n_seen[b];
		}
		for (int i = 0; i < m->n_choices; i++) {
			if (m->is_kept[i][b])
				continue;
			figures[i].blocks++;
			figures[i].samples += n;
			figures[i].wrong += m->n_seen != NULL && m->n_seen[b] != 0;
		}
	}
}

static void finish(const struct measure *m, int n_views, struct cull_figures *figures, struct cull_truth *truth)
{
	const struct psr_blocks *blocks = psr_model_blocks(m->set->base);
	double n_blocks = (double)n_views * blocks->n_blocks, n_samples = (double)n_views * (double)blocks->n_samples;

	for (int i = 0; i < m->n_choices; i++) {
		figures[i].blocks /= n_blocks;
		figures[i].samples /= n_samples;
		figures[i].wrong /= n_blocks;
		figures[i].test_seconds /= n_views;
		figures[i].frame_seconds /= n_views;
	}
	truth->blocks /= n_blocks;
	truth->samples /= n_samples;
}

static int run_views(struct measure *m, const struct ray_scene *scene, const struct cull_views *views,
                     struct psr_pool *pool, struct cull_figures *figures, struct cull_truth *truth)
{
	int rc = PSR_OK;

	for (int v = 0; v < views->n && rc == PSR_OK; v++) {
		struct cull_eye eye;

		cull_eye_place(&eye, (uint32_t)v, views->zoom);
		for (int i = 0; i < m->n_choices; i++)
			cull_set_test(m->set, &eye, &m->choice[i], m->is_kept[i]);
		if (scene != NULL)
			cull_set_look(m->set, scene, &eye, pool, m->n_seen);
		count_view(m, figures, truth);
		if (views->is_timed)
			rc = time_view(m, &eye);
		for (int i = 0; i < m->n_choices && views->is_timed && rc == PSR_OK; i++) {
			figures[i].test_seconds += m->test[i];
			figures[i].frame_seconds += m->draw[i] + (m->test[i] - m->frustum);
		}
	}
	return rc;
}

static int measure_init(struct measure *m, int has_truth)
{
	uint32_t side = psr_model_info(m->set->base)->resolution;
	int failed;

	side = side < PSR_MAX_SIDE / 2 ? side : PSR_MAX_SIDE / 2;
	m->frame.width = m->frame.height = side;
	m->is_kept = calloc((size_t)m->n_choices, sizeof *m->is_kept);
	m->part = calloc((size_t)m->n_choices, sizeof *m->part);
	m->test = calloc((size_t)m->n_choices, sizeof *m->test);
	m->draw = calloc((size_t)m->n_choices, sizeof *m->draw);
	m->n_seen = has_truth ? psr_alloc_array(m->set->n_blocks, 1) : NULL;
	m->frame.rgb = psr_alloc_array((size_t)side * side, 3);
	failed = m->is_kept == NULL || m->part == NULL || m->test == NULL || m->draw == NULL
	         || (has_truth && m->n_seen == NULL) || m->frame.rgb == NULL;
	for (int i = 0; i < m->n_choices && !failed; i++)
		failed = (m->is_kept[i] = psr_alloc_array(m->set->n_blocks, 1)) == NULL;
	return failed || psr_renderer_create(&m->renderer, NULL) != PSR_OK ? PSR_ERR_MEMORY : PSR_OK;
}

static void measure_fini(struct measure *m)
{
	for (int i = 0; i < m->n_choices && m->is_kept != NULL; i++)
		psr_free(m->is_kept[i]);
	free(m->is_kept);
	free(m->part);
	free(m->test);
	free(m->draw);
	psr_free(m->n_seen);
	psr_free(m->frame.rgb);
	psr_renderer_destroy(m->renderer);
}

int cull_measure(struct cull_set *set, const struct ray_scene *scene, const struct cull_views *views,
                 const struct cull_choice *choice, int n_choices, struct psr_pool *pool, struct cull_figures *figures,
                 struct cull_truth *truth, struct psr_error *err)
{
	struct measure m = { .set = set, .choice = choice, .n_choices = n_choices, .err = err };
	int rc = measure_init(&m, scene != NULL);

	if (rc != PSR_OK)
		psr_fail(err, rc, "no memory for a study of culling");
	memset(figures, 0, (size_t)n_choices * sizeof *figures);
	memset(truth, 0, sizeof *truth);
	if (rc == PSR_OK)
		rc = run_views(&m, scene, views, pool, figures, truth);
	if (rc == PSR_OK)
		finish(&m, views->n, figures, truth);
	measure_fini(&m);
	return rc;
}
