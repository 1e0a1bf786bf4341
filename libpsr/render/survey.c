#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "cull.h"
#include "groups.h"
#include "renderer.h"
#include "survey.h"

#define MOST_CLUSTERS 8192 /* of all instances: each density looks at them all */
#define MOST_INSTANCES 256
#define MOST_BLOCKS 8192   /* that are tested; of others every second, fourth, ... run */
#define RUN 16             /* blocks in a row: they lie together */
#define GRID 128           /* cells along a side of what is in view */
#define SLANTED 0.5f       /* of a square of the greatest distance of samples: they are closer, and lie aslant */

/* What the tested blocks of a group have in view. */
struct seen {
	float share;  /* of its samples, by those of the first density's level */
	float apart2; /* square of the pixels between samples of level 0; the mean over what is in view */
};

/* A tested block in view: its middle, and half of the side of a square as large as its samples. */
struct spot {
	float x, y, half;
};

struct surveyor {
	struct plan plan;
	struct bins bins;
	struct seen *seen; /* by group, of all instances */
	size_t n_seen;
	double n_in_view, apart2, spread; /* sums over tested samples in view: 1, squares for level 0 and their own */
	uint32_t n_spots;
	struct spot spot[2 * MOST_BLOCKS];
	uint8_t covered[GRID][GRID];
};

struct surveyor *surveyor_create(void)
{
	return calloc(1, sizeof(struct surveyor));
}

void surveyor_destroy(struct surveyor *surveyor)
{
	if (surveyor == NULL)
		return;
	plan_clear(&surveyor->plan);
	bins_clear(&surveyor->bins);
	free(surveyor->seen);
	free(surveyor);
}

size_t surveyor_bytes(void)
{
	return sizeof(struct surveyor);
}

static int make_room(struct surveyor *s)
{
	if (s->plan.n_groups > s->n_seen) {
		free(s->seen);
		s->n_seen = s->plan.n_groups;
		s->seen = malloc(s->n_seen * sizeof *s->seen);
	}
	if (s->seen == NULL)
		s->n_seen = 0;
	return s->seen != NULL && bins_room(&s->bins, group, s->plan.n_groups);
}

static uint64_t leaves_of(const struct psr_cubes *cubes, const struct psr_cluster *k)
{
	const struct psr_cube_level *level = &cubes->level[k->level];
	const uint32_t end = k->first_block + k->n_blocks;

	return (end < level->first + level->n ? psr_cubes_leaf(cubes, level, end) : level->tree->n_leaves)
	       - psr_cubes_leaf(cubes, level, k->first_block);
}

static uint64_t samples_of(const struct plan_instance *in, const struct psr_cluster *k)
{
	const struct psr_blocks *b = in->cull.blocks;
	const uint32_t end = k->first_block + k->n_blocks;

	if (in->cull.cubes != NULL)
		return leaves_of(in->cull.cubes, k);
	if (in->cull.points != NULL) {
		const struct dpoint_set *set = in->cull.points->set;

		return (end < set->n_groups ? set->group[end].first : set->n_points) - set->group[k->first_block].first;
	}
	return (end < b->n_blocks ? psr_blocks_attr_first(b, end) : b->n_samples)
	       - psr_blocks_attr_first(b, k->first_block);
}

/* The kernel's rectangle is about the middle of the block's sphere, but for what the picture cuts off. */
static struct spot spot_of(const struct cull_batch *batch, uint32_t i, uint32_t n_samples, float apart)
{
	return (struct spot){ (float)(batch->x0[i] + batch->x1[i] + 1) / 2, (float)(batch->y0[i] + batch->y1[i] + 1) / 2,
		                  sqrtf((float)n_samples * SLANTED) * apart / 2 };
}

static void add_spot(struct surveyor *s, const struct spot *spot, float grow)
{
	if (s->n_spots == 2 * MOST_BLOCKS)
		return;
	s->spot[s->n_spots] = *spot;
	s->spot[s->n_spots++].half *= grow;
}

static float length_within(float at, float half, uint32_t side)
{
	const float low = at - half, high = at + half;

	return fmaxf((high < (float)side ? high : (float)side) - (low > 0 ? low : 0), 0);
}

/* Returns the part of a spot that is in the picture: little of a block that holds the eye. */
static float part_in_view(const struct surveyor *s, const struct spot *spot)
{
	const float side = 2 * spot->half, width = length_within(spot->x, spot->half, s->plan.width),
				height = length_within(spot->y, spot->half, s->plan.height);

	return side > 0 ? (width / side) * (height / side) : 1;
}

struct axis {
	float from, scale; /* pixels; cells a pixel */
};

static struct axis axis_of(float low, float high, uint32_t side)
{
	const float from = low > 0 ? low : 0, to = high < (float)side ? high : (float)side;

	return (struct axis){ from, to > from ? GRID / (to - from) : 1 };
}

/* The cell whose middle follows a place. */
static int cell_of(const struct axis *axis, float at)
{
	const float cell = (at - axis->from) * axis->scale + 0.5f;

	return cell < 0 ? 0 : cell < GRID ? (int)cell : GRID;
}

/* Returns how many pixels the spots cover: in a grid over what is in view, cells whose middles they cover. */
static double cover(struct surveyor *s)
{
	float low[2] = { INFINITY, INFINITY }, high[2] = { -INFINITY, -INFINITY };
	uint32_t n = 0;

	for (uint32_t i = 0; i < s->n_spots; i++) {
		const struct spot *p = &s->spot[i];

		low[0] = fminf(low[0], p->x - p->half);
		low[1] = fminf(low[1], p->y - p->half);
		high[0] = fmaxf(high[0], p->x + p->half);
		high[1] = fmaxf(high[1], p->y + p->half);
	}
	const struct axis x = axis_of(low[0], high[0], s->plan.width), y = axis_of(low[1], high[1], s->plan.height);

	memset(s->covered, 0, sizeof s->covered);
	for (uint32_t i = 0; i < s->n_spots; i++) {
		const struct spot *p = &s->spot[i];
		const int x0 = cell_of(&x, p->x - p->half), x1 = cell_of(&x, p->x + p->half);
		const int y0 = cell_of(&y, p->y - p->half), y1 = cell_of(&y, p->y + p->half);

		for (int row = y0; row < y1; row++)
			memset(&s->covered[row][x0], 1, (size_t)(x1 - x0));
	}
	for (uint32_t i = 0; i < GRID * GRID; i++)
		n += s->covered[i / GRID][i % GRID];
	return (double)n / ((double)x.scale * (double)y.scale);
}

/* Tests every `stride`th run of a cluster. */
static void see_cluster(struct surveyor *s, const struct plan_instance *in, const struct psr_cluster *k,
                        uint32_t stride)
{
	struct seen *seen = &s->seen[in->first_group + k->group];
	/* Where a block holds the eye, its samples may be a million pixels apart. */
	const float most_apart = (float)(s->plan.width + s->plan.height), grow = sqrtf((float)stride);
	uint64_t n_all = 0, n_left = 0;
	double n_in_view = 0, apart2 = 0;

	for (uint32_t at = 0; at < k->n_blocks; at += stride * RUN) {
		const uint32_t first = k->first_block + at, n = k->n_blocks - at < RUN ? k->n_blocks - at : RUN;
		struct cull_batch batch;

		simd_get()->cull(&batch, &in->cull, first, n);
		for (uint32_t i = 0; i < n; i++) {
			const uint32_t n_samples = cull_n_samples(in, first + i);

			n_all += n_samples;
			if (!batch.is_left[i])
				continue;
			const float apart = fminf(batch.apart[i], most_apart);
			const struct spot spot = spot_of(&batch, i, n_samples, apart);
			const double in_view = (double)n_samples * (double)part_in_view(s, &spot);

			n_left += n_samples;
			n_in_view += in_view;
			apart2 += in_view * (double)(apart * apart) / (double)(1 << 2 * k->level);
			add_spot(s, &spot, grow);
		}
	}
	s->n_in_view += n_in_view;
	s->apart2 += apart2;
	s->spread += apart2 * (1 << 2 * k->level);
	seen->share = n_all > 0 ? (float)n_left / (float)n_all : 0;
	seen->apart2 = n_left > 0 ? (float)(apart2 / (double)n_left) : 0;
}

/* Calls for each cluster that is drawn at the levels which were chosen last. */
static uint64_t each_drawn(struct surveyor *s, struct survey_counts *counts, uint32_t stride, double density)
{
	uint64_t n_blocks = 0;

	for (uint32_t i = 0; i < s->plan.n_instances; i++) {
		const struct plan_instance *in = &s->plan.instance[i];
		const struct psr_blocks *b = in->cull.blocks;

		for (uint32_t c = 0; c < b->n_clusters; c++) {
			const struct psr_cluster *k = &b->cluster[c];
			const struct seen *seen = &s->seen[in->first_group + k->group];

			if (!cull_is_chosen(&s->bins, in, k))
				continue;
			n_blocks += k->n_blocks;
			if (stride != 0)
				see_cluster(s, in, k, stride);
			if (counts == NULL)
				continue;
			const double n = (double)samples_of(in, k) * (double)seen->share;

			counts->n_blocks += k->n_blocks;
			counts->n_samples += n;
			counts->spread += n * density * density * (double)seen->apart2 * (double)(1 << 2 * k->level);
		}
	}
	return n_blocks;
}

static void count(struct survey *survey, struct surveyor *s, const double *density, int n)
{
	uint32_t stride = 1;

	s->n_spots = 0;
	s->n_in_view = s->apart2 = s->spread = 0;
	s->plan.finer = 1;
	cull_choose_levels(&s->bins, &s->plan, NULL);
	for (uint64_t left = each_drawn(s, NULL, 0, 1); left > MOST_BLOCKS; left /= 2)
		stride *= 2;
	each_drawn(s, NULL, stride, 1);
	survey->area = s->n_spots > 0 ? cover(s) : 0;
	survey->apart = s->n_in_view > 0 ? sqrt(s->apart2 / s->n_in_view) : 0;
	survey->layers = survey->area > 0 ? (double)SLANTED * stride * s->spread / survey->area : 0;
	for (int i = 0; i < n; i++) {
		struct survey_counts *counts = &survey->at[i];

		*counts = (struct survey_counts){ 0, 0, 0 };
		s->plan.finer = (float)density[i];
		cull_choose_levels(&s->bins, &s->plan, NULL);
		each_drawn(s, counts, 0, density[i]);
	}
}

int survey_scene(struct survey *survey, struct surveyor *surveyor, const struct psr_scene *scene, uint32_t width,
                 uint32_t height, const double *density, int n)
{
	struct psr_scene unlit = *scene;
	struct render_settings settings;
	uint64_t n_clusters = 0;
	fenv_t callers;

	for (uint32_t i = 0; i < scene->n_instances && i <= MOST_INSTANCES; i++)
		n_clusters += instance_groups(&scene->instance[i])->n_clusters;
	if (scene->n_instances > MOST_INSTANCES || n_clusters > MOST_CLUSTERS)
		return 0;
	unlit.n_lights = 0;
	render_settings_default(&settings, width, height);
	set_environment(&callers);
	const int is_made = plan_make(&surveyor->plan, &unlit, &settings, NULL) == PSR_OK && make_room(surveyor);
	if (is_made)
		count(survey, surveyor, density, n);
	fesetenv(&callers);
	return is_made ? 1 : -1;
}
