/* Table 1 of [B] again: bits a point, frames a second, beside blocks of the same models, and decibels of both. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/vec.h"
#include "measure/measure.h"
#include "model/tree.h"
#include "octree/pack.h"
#include "psr/build.h"
#include "render/render.h"
#include "render/stages.h"
#include "sample/octree/of_mesh.h"
#include "tables.h"

#define SIDE 512    /* of a picture, as in [B] 6 */
#define RAYS 4      /* along the side of a pixel */
#define VIEWS 3
#define TRIALS 9    /* frames of each view and representation, in turn; the median counts */
#define DISTANCE 4  /* of the eye, in radii */
#define MARGIN 1.05
#define FIRST_LEVEL 9
#define N_LEVELS 3  /* as [B] has them: 9, 10 and 11 */

enum { POINTS, IN_CORE, PACKED, FAST, OFFSETS, NORMALS, COLORS, FPS, RATE, FPS_BLOCKS, RATIO, DB, DB_BLOCKS, WRONG,
       WRONG_BLOCKS, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[POINTS] = { "M pts", "million_points", 2 },    [IN_CORE] = { "codes", "codes", 2 },
	[PACKED] = { "packed", "codes_packed", 2 },     [FAST] = { "fast", "codes_fast", 2 },
	[OFFSETS] = { "offs.", "offsets", 2 },          [NORMALS] = { "norm.", "normals", 2 },
	[COLORS] = { "col.", "colors", 2 },             [FPS] = { "fps", "frames_per_second", 1 },
	[RATE] = { "Mpt/s", "million_points_per_second", 0 },
	[FPS_BLOCKS] = { "blocks", "blocks_frames_per_second", 1 },
	[RATIO] = { "time", "time_over_blocks", 2 },    [DB] = { "dB", "db", 2 },
	[DB_BLOCKS] = { "blocks", "blocks_db", 2 },     [WRONG] = { "wrong", "wrong_pixels_a_million", 0 },
	[WRONG_BLOCKS] = { "blocks", "blocks_wrong_pixels_a_million", 0 },
};

static const double views[VIEWS][3] = { { 0.5, 0.4, 1 }, { -0.9, 0.7, 0.6 }, { 0.3, -0.35, -1 } };

struct subject {
	struct study *study;
	const struct study_model *of;
	struct psr_source *source;
	struct psr_model *blocks, *points;
	struct psr_frame frame;
	int row;
};

static double *value(const struct subject *s, int column)
{
	return study_at(&s->study->table, s->row, 0, column);
}

/* ---- bits ---- */

/* Finds the bytes of each stream of the packed tree. */
static int find_shares(struct octree_shares *shares, const struct subject *s, const struct octree *tree,
                       enum octree_packing packing)
{
	uint8_t *bytes;
	size_t n_bytes;
	const int rc = octree_pack(&bytes, &n_bytes, tree, packing, s->study->pool, s->study->err);

	*shares = (struct octree_shares){ .codes = 0 };
	if (rc != PSR_OK)
		return rc;
	octree_packed_shares(shares, bytes, n_bytes);
	free(bytes);
	return PSR_OK;
}

/* Normals are packed with 13 bits, as [B] has them: the last two of ours are a finer subdivision. */
static int put_bits(const struct subject *s, struct octree *tree)
{
	const double n = (double)tree->n_leaves;
	struct octree_shares small, fast;
	int rc;

	for (uint64_t i = 0; i < tree->n_leaves; i++)
		tree->normal[i] &= (uint16_t)~3u;
	rc = find_shares(&small, s, tree, OCTREE_SMALL);
	if (rc == PSR_OK)
		rc = find_shares(&fast, s, tree, OCTREE_FAST);
	if (rc != PSR_OK)
		return rc;
	*value(s, POINTS) = n * 1e-6;
	*value(s, IN_CORE) = 8.0 * (double)tree->n_codes / n;
	*value(s, PACKED) = 8.0 * (double)small.codes / n;
	*value(s, FAST) = 8.0 * (double)fast.codes / n;
	*value(s, NORMALS) = 8.0 * (double)small.stream[OCTREE_NORMAL_STREAM] / n;
	*value(s, OFFSETS) = 8.0 * (double)small.stream[OCTREE_OFFSET_STREAM] / n;
	*value(s, COLORS) = 8.0 * (double)small.stream[OCTREE_COLOR_STREAM] / n;
	return PSR_OK;
}

static int make_points(struct subject *s, int levels)
{
	struct octree_build_options options;
	struct psr_model_info info;
	struct octree *tree, inner;
	int rc;

	octree_build_options_default(&options);
	options.levels = levels;
	rc = octree_of_mesh(&tree, NULL, s->of->mesh, &options, s->study->err);
	if (rc != PSR_OK)
		return rc;
	psr_octree_info(&info, tree);
	psr_octree_to_inner(&inner, tree, &info);
	rc = psr_model_create_octree(&s->points, &info, &inner, NULL, s->study->err);
	if (rc == PSR_OK)
		rc = put_bits(s, tree);
	octree_destroy(tree);
	return rc;
}

/* ---- pictures ---- */

struct stage {
	struct psr_scene scene;
	struct psr_instance instance;
	struct psr_light light;
};

static void set_stage(struct stage *stage, const struct subject *s, const double toward[3])
{
	const double away = DISTANCE * s->of->scale;
	struct psr_camera *camera = &stage->scene.camera;
	double unit[3], forward[3], right[3];

	memset(stage, 0, sizeof *stage);
	v3d_normalize(unit, toward);
	v3d_scale(forward, unit, -1);
	v3d_normalize(camera->up, s->of->mesh->up);
	v3d_cross(right, forward, camera->up);
	v3d_normalize(right, right);
	memcpy(camera->target, s->of->origin, sizeof camera->target);
	v3d_add_scaled(camera->eye, camera->target, away, unit);
	camera->kind = PSR_CAMERA_PERSPECTIVE;
	camera->fov_y = 2 * asin(MARGIN / DISTANCE);
	stage->instance = (struct psr_instance){ .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	stage->light.kind = PSR_LIGHT_DIRECTIONAL;
	v3d_add_scaled(stage->light.direction, forward, 0.6, right);
	v3d_add_scaled(stage->light.direction, stage->light.direction, -0.5, camera->up);
	v3d_set(stage->light.color, 1, 1, 1);
	v3d_set(stage->scene.ambient, 0.12, 0.12, 0.12);
	stage->scene.instance = &stage->instance;
	stage->scene.light = &stage->light;
	stage->scene.n_instances = stage->scene.n_lights = 1;
}

static int compare_doubles(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

/* Draws the view of points and of blocks in turn, and adds the median seconds of each. */
static int time_view(double seconds[2], const struct subject *s, struct stage *stage, struct psr_frame *frame)
{
	struct render_settings settings;
	double time[2][TRIALS];

	render_settings_default(&settings, SIDE, SIDE);
	for (int trial = 0; trial <= TRIALS; trial++)
		for (int is_blocks = 0; is_blocks < 2; is_blocks++) {
			const uint64_t start = clock_ns();
			int rc;

			stage->instance.model = is_blocks ? s->blocks : s->points;
			rc = renderer_draw(s->study->renderer, &stage->scene, &settings, s->study->pool, frame, s->study->err);
			if (rc != PSR_OK)
				return rc;
			if (trial > 0) /* the first one warms */
				time[is_blocks][trial - 1] = (double)(clock_ns() - start) * 1e-9;
		}
	for (int is_blocks = 0; is_blocks < 2; is_blocks++) {
		qsort(time[is_blocks], TRIALS, sizeof time[0][0], compare_doubles);
		seconds[is_blocks] += time[is_blocks][TRIALS / 2];
	}
	return PSR_OK;
}

/* Sums of squares over covered pixels, for decibels. */
struct sums {
	double square[2];
	uint64_t n, n_wrong[2], n_inside; /* wrong: holes and leaks, of pixels inside */
};

static int judge_view(struct sums *sums, const struct subject *s, struct stage *stage,
                      const struct psr_source_planes *truth)
{
	struct render_settings settings;

	render_settings_default(&settings, SIDE, SIDE);
	for (int is_blocks = 0; is_blocks < 2; is_blocks++) {
		struct psr_errors errors;
		struct psr_frame frame = s->frame;
		int rc;

		stage->instance.model = is_blocks ? s->blocks : s->points;
		rc = renderer_draw(s->study->renderer, &stage->scene, &settings, s->study->pool, &frame, s->study->err);
		if (rc == PSR_OK)
			rc = psr_errors_measure(&errors, &frame, truth, psr_model_info(stage->instance.model)->spacing, s->study->err);
		if (rc != PSR_OK)
			return rc;
		sums->square[is_blocks] += pow(10, -errors.psnr / 10) * (double)errors.n_covered;
		sums->n_wrong[is_blocks] += errors.n_holes + errors.n_leaks;
		sums->n += is_blocks ? 0 : errors.n_covered;
		sums->n_inside += is_blocks ? 0 : errors.n_inside;
	}
	return PSR_OK;
}

static int draw_truth(const struct psr_source_planes *truth, const struct subject *s, const struct stage *stage)
{
	const struct psr_source_shot shot = { s->source, &stage->scene, SIDE, SIDE, RAYS, s->study->n_threads };

	return psr_source_draw(&shot, truth, s->study->err);
}

static int put_pictures(const struct subject *s, const struct psr_source_planes truth[VIEWS])
{
	struct psr_frame quiet = { .width = SIDE, .height = SIDE, .rgb = s->frame.rgb };
	struct sums sums = { .n = 0 };
	double seconds[2] = { 0, 0 };

	for (int v = 0; v < VIEWS; v++) {
		struct stage stage;
		int rc;

		set_stage(&stage, s, views[v]);
		rc = time_view(seconds, s, &stage, &quiet);
		if (rc == PSR_OK)
			rc = judge_view(&sums, s, &stage, &truth[v]);
		if (rc != PSR_OK)
			return rc;
	}
	*value(s, FPS) = VIEWS / seconds[0];
	*value(s, FPS_BLOCKS) = VIEWS / seconds[1];
	*value(s, RATE) = *value(s, POINTS) * *value(s, FPS);
	*value(s, RATIO) = seconds[0] / seconds[1];
	*value(s, DB) = -10 * log10(sums.square[0] / (double)sums.n);
	*value(s, DB_BLOCKS) = -10 * log10(sums.square[1] / (double)sums.n);
	*value(s, WRONG) = 1e6 * (double)sums.n_wrong[0] / (double)sums.n_inside;
	*value(s, WRONG_BLOCKS) = 1e6 * (double)sums.n_wrong[1] / (double)sums.n_inside;
	return PSR_OK;
}

/* ---- a model ---- */

static void free_truth(struct psr_source_planes *truth)
{
	free(truth->rgb);
	free(truth->coverage);
	free(truth->depth);
	free(truth->range);
}

static int make_truth(struct psr_source_planes truth[VIEWS], const struct subject *s)
{
	const size_t n = (size_t)SIDE * SIDE;

	for (int v = 0; v < VIEWS; v++) {
		struct stage stage;
		int rc;

		truth[v] = (struct psr_source_planes){ .rgb = malloc(n * sizeof *truth->rgb),
			                                   .coverage = malloc(n * sizeof *truth->coverage),
			                                   .depth = malloc(n * sizeof *truth->depth),
			                                   .range = malloc(n * sizeof *truth->range) };
		if (truth[v].rgb == NULL || truth[v].coverage == NULL || truth[v].depth == NULL || truth[v].range == NULL)
			return psr_fail(s->study->err, PSR_ERR_MEMORY, "no memory for pictures");
		set_stage(&stage, s, views[v]);
		rc = draw_truth(&truth[v], s, &stage);
		if (rc != PSR_OK)
			return rc;
	}
	return PSR_OK;
}

static int run_model(struct subject *s)
{
	struct psr_source_planes truth[VIEWS] = { { .rgb = NULL } };
	int rc = psr_source_create(&s->source, s->of->mesh, s->study->err);

	if (rc == PSR_OK)
		rc = study_build(&s->blocks, NULL, s->study, s->of);
	if (rc == PSR_OK)
		rc = make_truth(truth, s);
	for (int l = 0; rc == PSR_OK && l < N_LEVELS; l++, s->row++) {
		study_label(&s->study->table, s->row, "%.20s %d", s->of->name, FIRST_LEVEL + l);
		rc = make_points(s, FIRST_LEVEL + l);
		if (rc == PSR_OK)
			rc = put_pictures(s, truth);
		psr_model_unref(s->points);
		s->points = NULL;
		study_step(s->study, s->of->name);
	}
	for (int v = 0; v < VIEWS; v++)
		free_truth(&truth[v]);
	psr_model_unref(s->blocks);
	psr_source_destroy(s->source);
	return rc;
}

int table_octree(struct study *study)
{
	const struct study_form form = { "model, levels", columns, N_COLUMNS };
	struct subject s = { .study = study };
	int rc = study_table_init(&study->table, form, study->n_models * N_LEVELS, 1, study->err);

	study->total = study->n_models * N_LEVELS;
	if (rc == PSR_OK)
		rc = psr_renderer_create(&study->renderer, study->err);
	if (rc == PSR_OK)
		rc = psr_frame_alloc(&s.frame, SIDE, SIDE, 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH, study->err);
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++) {
		s.of = &study->model[m];
		s.source = NULL;
		s.blocks = s.points = NULL;
		rc = run_model(&s);
	}
	psr_frame_free(&s.frame);
	psr_renderer_destroy(study->renderer);
	return rc;
}
