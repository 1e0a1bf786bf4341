/* What drawing an octree costs:
 * octree_draws [-l LEVELS] [-s SIDE] [-n ROUNDS] [-t THREADS] [-p] [-b] MESH|CLOUD.las [BLOCKS.psr]
 *
 * Draws frames of two threads, or as many as -t says, from four directions: as they fit the picture, and nearer. Frames
 * of points, of all points ("whole": down to the leaves, even where the picture needs fewer levels), of EWA splats (-p
 * leaves them out), and with blocks of the same object those of blocks take turns, and their times are medians; then
 * those of stages. Points a second are those that are warped, placed in the picture and not facing away, by the time of
 * cull and warp together, splats likewise. As the object fits the picture they stand beside targets, of two threads at
 * 512x512 and leaves of about a pixel, with the part of the tree that they are. "Whole" is told as [B] tells it there:
 * the leaves of the tree by the time of a whole frame of all of them.
 *
 * The same picture takes samples as dense. Octrees have leaves of a power of two, blocks any resolution: -b builds
 * blocks of the mesh ("even") whose samples are as far apart as those of the leaves, so that frames take a level of
 * either at the same distance (model/cubes.h, CUBES_LEVEL_SPACING). All spacings are printed. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "around.h"
#include "base/stats.h"
#include "import/cloud/las_source.h"
#include "model/blocks.h"
#include "model/cubes.h"
#include "model/tree.h"
#include "psr/build.h"
#include "psr/mesh.h"
#include "psr/render.h"
#include "sample/octree/of_mesh.h"
#include "surface/validate.h"

#define N_THREADS 2
#define MOST_FRAMES 400
#define DIRECTIONS 4
/* Millions a second. */
#define TARGET_SURFACE 400
#define TARGET_CLOUD 230
#define TARGET_SPLATS 30

static const double nearer[] = { 1, 0.5, 0.25 }; /* of the distance at which all fits the picture */
#define N_DISTANCES 3

struct subject {
	const char *name;
	struct psr_model *model;
	enum psr_representation representation;
	int with_splats, is_whole;
};
#define MOST_SUBJECTS 5

struct times {
	double frame[MOST_FRAMES], points[MOST_FRAMES], stage[PSR_N_STAGES][MOST_FRAMES], drawn, warped, covered;
	int n;
};

static int read_cloud(struct octree **tree, const char *path, const struct octree_build_options *options,
                      struct psr_error *err)
{
	struct octree_source source;
	int rc = las_source_open(&source, path, err);

	if (rc != PSR_OK)
		return rc;
	rc = octree_build(tree, &source, options, err);
	las_source_close(&source);
	return rc;
}

static int is_cloud(const char *path)
{
	return strstr(path, ".las") != NULL;
}

/* Blocks whose samples are as dense as the tree's leaves on a plane along an axis, where these are fewest. */
static int build_even(struct psr_model **out, const struct psr_mesh *mesh, const struct octree *tree,
                      struct psr_error *err)
{
	const double spacing = CUBES_LEVEL_SPACING * ldexp(tree->edge, -tree->levels);
	struct psr_build_options options;
	double origin[3], scale;
	int rc = validate_bound_mesh(mesh, origin, &scale, err);

	if (rc != PSR_OK)
		return rc;
	psr_build_options_default(&options);
	options.resolution = (uint32_t)(2 * scale / spacing + 0.5);
	return psr_model_build(out, mesh, &options, NULL, err);
}

/* even: NULL, or blocks as dense. */
static int read_mesh(struct octree **tree, struct psr_model **even, const char *path,
                     const struct octree_build_options *options, struct psr_error *err)
{
	struct octree_mesh_report report;
	struct psr_mesh *mesh;
	int rc = psr_mesh_import(&mesh, path, NULL, err);

	if (rc != PSR_OK)
		return rc;
	rc = octree_of_mesh(tree, &report, mesh, options, err);
	if (rc == PSR_OK)
		printf("%.2f %% of the leaves hold two sides, and the surface is %s\n",
		       100.0 * (double)report.n_both / (double)(*tree)->n_leaves, report.is_closed ? "closed" : "open");
	if (rc == PSR_OK && even != NULL)
		rc = build_even(even, mesh, *tree, err);
	psr_mesh_destroy(mesh);
	return rc;
}

/* In the inner coordinates of the blocks, or its own. */
static int make_model(struct psr_model **out, struct octree *tree, const struct psr_model *blocks,
                      struct psr_error *err)
{
	struct psr_model_info info = { .up = { 0, 1, 0 }, .resolution = 1u << (tree->levels < 16 ? tree->levels : 16) };

	info.scale = tree->edge * 0.87;
	for (int a = 0; a < 3; a++) {
		info.origin[a] = tree->low[a] + tree->edge / 2;
		info.box_min[a] = tree->low[a];
		info.box_max[a] = tree->low[a] + tree->edge;
	}
	info.spacing = sqrt(3) * ldexp(tree->edge, -tree->levels);
	if (blocks != NULL) {
		const double spacing = info.spacing;

		info = *psr_model_info(blocks);
		info.spacing = spacing;
	}
	for (int a = 0; a < 3; a++)
		tree->low[a] = (tree->low[a] - info.origin[a]) / info.scale;
	tree->edge /= info.scale;
	return psr_model_create_octree(out, &info, tree, NULL, err);
}

struct bench {
	struct psr_renderer *renderer;
	struct psr_pool *pool;
	struct psr_frame frame;
	uint32_t side;
};

static int draw(struct times *times, const struct bench *bench, const struct subject *subject, int direction,
                double distance, struct psr_error *err)
{
	const struct psr_model_info *info = psr_model_info(subject->model);
	struct psr_instance instance = { .model = subject->model, .rotation = { 0, 0, 0, 1 }, .scale = 1,
		                             .representation = subject->representation };
	struct psr_light light;
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
		                       .ambient = { 0.1, 0.1, 0.1 } };
	struct psr_frame frame = bench->frame;
	struct psr_settings settings;
	int rc;

	around_camera(&scene.camera, info, direction, distance, 1);
	psr_light_key(&light, &scene.camera);
	light.casts_shadow = 0;
	psr_settings_default(&settings, bench->side, bench->side);
	settings.with_splats = subject->with_splats;
	if (subject->is_whole)
		settings.spacing_px = PSR_LEAST_SPACING;
	rc = psr_render(bench->renderer, &scene, &settings, bench->pool, &frame, err);
	if (rc != PSR_OK || times == NULL || times->n == MOST_FRAMES)
		return rc;
	const struct psr_report *report = &frame.report;
	double ns = 0;
	for (int s = 0; s < PSR_N_STAGES; s++) {
		times->stage[s][times->n] = (double)report->ns[s] * 1e-6;
		ns += (double)report->ns[s];
	}
	times->frame[times->n] = ns * 1e-6;
	times->points[times->n++] = (double)report->count[PSR_STAGE_WARP] * 1e3
	                            / (double)(report->ns[PSR_STAGE_CULL] + report->ns[PSR_STAGE_WARP]);
	times->drawn += (double)report->n_samples_drawn;
	times->warped += (double)report->count[PSR_STAGE_WARP];
	times->covered += (double)report->n_covered;
	return rc;
}

static void print_head(void)
{
	printf("%-10s %7s %9s %8s %7s %8s %9s ", "nearer by", "", "frame, ms", "M pts/s", "M drawn", "M warped", "pts/pixel");
	for (int s = PSR_STAGE_CULL; s < PSR_N_STAGES; s++)
		printf(" %7s", psr_stage_name((enum psr_stage)s));
	printf("\n");
}

static void print_times(double nearer_by, const char *name, struct times *times)
{
	const size_t n = (size_t)times->n;
	const double frame = stats_median(times->frame, n), points = stats_median(times->points, n);

	printf("%-10g %7s %9.2f %8.0f %7.3f %8.3f %9.1f ", nearer_by, name, frame, points, times->drawn * 1e-6 / (double)n,
	       times->warped * 1e-6 / (double)n, times->warped / times->covered);
	for (int s = PSR_STAGE_CULL; s < PSR_N_STAGES; s++)
		printf(" %7.2f", stats_median(times->stage[s], n));
	printf("\n");
}

static void print_rate(const char *name, double rate, double target)
{
	printf("%s: %.0f M a second, target at least %.0f: %s", name, rate, target, rate >= target ? "met" : "missed");
}

/* As the object fits the picture: what octrees are drawn as, beside targets. */
static void print_targets(const struct subject *subject, struct times *times, int n_subjects, double target)
{
	for (int s = 0; s < n_subjects; s++) {
		const size_t n = (size_t)times[s].n;
		const double frame = stats_median(times[s].frame, n);
		const struct octree *tree = psr_model_octree(subject[s].model);

		if (subject[s].representation != PSR_OCTREE)
			continue;
		print_rate(subject[s].name,
		           subject[s].is_whole ? (double)tree->n_leaves / frame * 1e-3 : stats_median(times[s].points, n),
		           subject[s].with_splats ? TARGET_SPLATS : target);
		printf("; warped are %.1f %% of %.2f M leaves", 100 * times[s].warped / (double)n / (double)tree->n_leaves,
		       (double)tree->n_leaves * 1e-6);
		printf("%s\n", subject[s].is_whole ? ", told as [B] does" : "");
	}
}

static int measure(const struct bench *bench, const struct subject *subject, int n_subjects, double target, int n_rounds,
                   struct psr_error *err)
{
	static struct times times[MOST_SUBJECTS];

	print_head();
	for (int d = 0; d < N_DISTANCES; d++) {
		memset(times, 0, sizeof times);
		for (int round = -1; round < n_rounds; round++)
			for (int direction = 0; direction < DIRECTIONS; direction++)
				for (int s = 0; s < n_subjects; s++) {
					const int rc = draw(round < 0 ? NULL : &times[s], bench, &subject[s], direction, nearer[d], err);

					if (rc != PSR_OK)
						return rc;
				}
		for (int s = 0; s < n_subjects; s++)
			print_times(1 / nearer[d], subject[s].name, &times[s]);
		for (int s = 1; s < n_subjects; s++)
			printf("%-10g %7s %9.2f of %s\n", 1 / nearer[d], "ratio",
			       stats_median(times[0].frame, (size_t)times[0].n) / stats_median(times[s].frame, (size_t)times[s].n),
			       subject[s].name);
		if (nearer[d] == 1)
			print_targets(subject, times, n_subjects, target);
	}
	return PSR_OK;
}

/* What options ask for. */
struct wish {
	struct octree_build_options options;
	uint32_t side;
	int n_rounds, n_threads, without_splats, with_even;
};

/* Takes a reference of its own to the model. */
static void put_subject(struct subject *subject, int *n, struct subject one)
{
	one.representation = psr_model_cubes(one.model) != NULL ? PSR_OCTREE : PSR_BLOCKS;
	psr_model_ref(one.model);
	subject[(*n)++] = one;
}

static void print_spacings(const struct octree *tree, double scale, const struct subject *subject, int n)
{
	const double edge = ldexp(tree->edge, -tree->levels) * scale;

	printf("leaves of %.5f, as dense as samples %.5f apart", edge, CUBES_LEVEL_SPACING * edge);
	for (int s = 0; s < n; s++)
		if (subject[s].representation == PSR_BLOCKS)
			printf("; %s: %.5f apart", subject[s].name, psr_model_info(subject[s].model)->spacing);
	printf("\n");
}

/* Of the tree, which it destroys, and of blocks, which may be NULL. */
static int make_subjects(struct subject *subject, int *n, struct octree *tree, struct psr_model *blocks,
                         struct psr_model *even, const struct wish *wish, struct psr_error *err)
{
	struct psr_model *model = NULL;
	int rc = make_model(&model, tree, blocks != NULL ? blocks : even, err);

	if (rc == PSR_OK)
		rc = psr_model_make_cubes(model, err);
	if (rc == PSR_OK) {
		const struct psr_cubes *cubes = psr_model_cubes(model);

		printf("%.2f M leaves, %.1f a cube; %.2f bits a leaf of codes, %.2f more of cubes and coarser levels\n",
		       (double)tree->n_leaves * 1e-6, (double)tree->n_leaves / cubes->level[0].n,
		       8.0 * (double)tree->n_codes / (double)tree->n_leaves, 8.0 * (double)cubes->n_bytes / (double)tree->n_leaves);
		put_subject(subject, n, (struct subject){ .name = "points", .model = model });
		put_subject(subject, n, (struct subject){ .name = "whole", .model = model, .is_whole = 1 });
		if (!wish->without_splats)
			put_subject(subject, n, (struct subject){ .name = "splats", .model = model, .with_splats = 1 });
		if (blocks != NULL)
			put_subject(subject, n, (struct subject){ .name = "blocks", .model = blocks });
		if (even != NULL)
			put_subject(subject, n, (struct subject){ .name = "even", .model = even });
		print_spacings(tree, psr_model_info(model)->scale, subject, *n);
	}
	octree_destroy(tree);
	psr_model_unref(model);
	return rc;
}

static int read_subjects(struct subject *subject, int *n, const char *path, const char *blocks_path,
                         const struct wish *wish, struct psr_error *err)
{
	struct psr_model *blocks = NULL, *even = NULL;
	struct octree *tree = NULL;
	int rc = blocks_path != NULL ? psr_model_read(&blocks, blocks_path, err) : PSR_OK;

	if (rc == PSR_OK && is_cloud(path))
		rc = read_cloud(&tree, path, &wish->options, err);
	else if (rc == PSR_OK)
		rc = read_mesh(&tree, wish->with_even ? &even : NULL, path, &wish->options, err);
	if (rc == PSR_OK)
		rc = make_subjects(subject, n, tree, blocks, even, wish, err);
	psr_model_unref(blocks);
	psr_model_unref(even);
	return rc;
}

static int run(const char *path, const char *blocks, const struct wish *wish, struct psr_error *err)
{
	const uint32_t side = wish->side;
	struct subject subject[MOST_SUBJECTS] = { 0 };
	struct bench bench = { .frame = { .width = side, .height = side }, .side = side };
	int n_subjects = 0, rc = read_subjects(subject, &n_subjects, path, blocks, wish, err);

	bench.frame.rgb = malloc((size_t)3 * side * side);
	bench.frame.depth = malloc((size_t)side * side * sizeof *bench.frame.depth);
	if (rc == PSR_OK)
		rc = psr_renderer_create(&bench.renderer, err);
	if (rc == PSR_OK)
		rc = psr_pool_create(&bench.pool, wish->n_threads, err);
	if (rc == PSR_OK)
		rc = measure(&bench, subject, n_subjects, is_cloud(path) ? TARGET_CLOUD : TARGET_SURFACE, wish->n_rounds, err);
	psr_pool_destroy(bench.pool);
	psr_renderer_destroy(bench.renderer);
	for (int s = 0; s < n_subjects; s++)
		psr_model_unref(subject[s].model);
	free(bench.frame.rgb);
	free(bench.frame.depth);
	return rc;
}

int main(int argc, char **argv)
{
	struct wish wish = { .side = 1024, .n_rounds = 10, .n_threads = N_THREADS };
	struct psr_error err;
	int option, rc;

	octree_build_options_default(&wish.options);
	while ((option = getopt(argc, argv, "l:s:n:t:pb")) != -1) {
		if (option == '?')
			return 2;
		wish.options.levels = option == 'l' ? atoi(optarg) : wish.options.levels;
		wish.side = option == 's' ? (uint32_t)atoi(optarg) : wish.side;
		wish.n_rounds = option == 'n' ? atoi(optarg) : wish.n_rounds;
		wish.n_threads = option == 't' ? atoi(optarg) : wish.n_threads;
		wish.without_splats |= option == 'p';
		wish.with_even |= option == 'b';
	}
	if (optind >= argc || wish.side == 0 || wish.n_rounds * DIRECTIONS > MOST_FRAMES) {
		fprintf(stderr, "octree_draws [-l LEVELS] [-s SIDE] [-n ROUNDS] [-t THREADS] [-p] [-b] MESH|CLOUD.las "
		                "[BLOCKS.psr]\n");
		return 2;
	}
	rc = run(argv[optind], optind + 1 < argc ? argv[optind + 1] : NULL, &wish, &err);
	if (rc != PSR_OK)
		fprintf(stderr, "octree_draws: %s\n", err.text);
	return psr_exit_status(rc);
}
