/* Figure 11 of [B] again: octree_rates [-l LEVELS] [-s SIDE] [-o PICTURE.png] MESH
 *
 * Splats of an octree, points of it, and triangles that Mesa's llvmpipe draws, each with as much of the model as it draws
 * in the time of the splats: points of fine pictures, which are four times as many, and a mesh whose vertices are merged
 * until it is as fast. Prints time and distance from the ray-traced mesh. The picture shows the part that has most
 * detail, splats, points, triangles and the truth from left to right. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/stats.h"
#include "compare/compare.h"
#include "isolate.h"
#include "llvmpipe.h"
#include "measure/measure.h"
#include "model/tree.h"
#include "ours.h"
#include "psr/build.h"
#include "psr/render.h"
#include "report.h"
#include "sample/octree/of_mesh.h"
#include "scene.h"

#define N_FRAMES 6
#define ROUNDS 3     /* of all ways in turn */
#define MOST_SIDE 1024
#define RAYS 4       /* along the side of a pixel */
#define TRIES 6      /* to find how many triangles are as fast */
#define MOST_CELLS 1024
#define PART 128     /* pixels of the picture's parts, a side */
#define ZOOM 2
#define GUTTER 4

enum { SPLATS, POINTS, TRIANGLES, TRUTH, N_CELLS };

struct way {
	const char *name;
	double ms[ROUNDS * N_FRAMES], drawn; /* drawn: millions of points or triangles, culled ones left out of points */
	int n;
	uint8_t *rgb; /* of the first frame */
};

struct bench {
	struct scene_film film;
	struct psr_mesh *mesh;
	struct peer_mesh whole;
	struct psr_renderer *renderer;
	struct psr_pool *pool;
	struct way way[N_CELLS];
	uint8_t *covered, *inside; /* of the truth's pixels */
	uint32_t side;
};

/* ---- psr ---- */

static void draw_ours(struct bench *bench, int kind, int warms)
{
	struct way *way = &bench->way[kind];
	struct psr_frame frame = { .width = bench->side, .height = bench->side,
		                       .rgb = report_alloc((size_t)bench->side * bench->side, 3) };
	struct psr_settings settings;
	struct psr_error err;

	psr_settings_default(&settings, bench->side, bench->side);
	settings.with_splats = kind == SPLATS;
	settings.smooth = kind == POINTS ? PSR_SMOOTH_FINE : PSR_SMOOTH_NONE;
	for (int i = warms ? -1 : 0; i < N_FRAMES; i++) {
		struct psr_scene scene;
		const double begin = report_ms();

		scene_film_frame(&scene, &bench->film, (i < 0 ? 0 : i) * SCENE_FRAMES / N_FRAMES);
		if (psr_render(bench->renderer, &scene, &settings, bench->pool, &frame, &err) != PSR_OK)
			report_die("psr_render", err.text);
		if (i < 0)
			continue;
		way->ms[way->n++] = report_ms() - begin;
		if (i > 0)
			continue;
		memcpy(way->rgb, frame.rgb, (size_t)3 * bench->side * bench->side);
		way->drawn = (double)frame.report.n_samples_drawn * 1e-6;
	}
	free(frame.rgb);
}

/* ---- triangles ---- */

struct peer {
	const struct bench *bench;
	const struct peer_mesh *mesh;
	struct peer_result result;
	uint8_t rgb[3 * MOST_SIDE * MOST_SIDE];
};

static void run_peer(void *arg)
{
	struct peer *peer = arg;

	llvmpipe_measure(&peer->result, LLVMPIPE_MESH, &peer->bench->film, peer->mesh, NULL, N_FRAMES, peer->rgb);
}

static double draw_triangles(struct bench *bench, struct peer *peer, uint32_t cells)
{
	struct way *way = &bench->way[TRIANGLES];
	struct peer_mesh mesh;

	if (cells < MOST_CELLS)
		peer_mesh_merge(&mesh, &bench->whole, cells);
	peer->mesh = cells < MOST_CELLS ? &mesh : &bench->whole;
	isolate_run(run_peer, peer);
	way->drawn = (double)peer->mesh->n_triangles * 1e-6;
	memcpy(way->rgb, peer->rgb, (size_t)3 * bench->side * bench->side);
	if (cells < MOST_CELLS)
		peer_mesh_fini(&mesh);
	return peer->result.ms;
}

/* The finest grid at which triangles take no longer than splats, measured beside each other. */
static uint32_t find_cells(struct bench *bench, struct peer *peer)
{
	struct way *splats = &bench->way[SPLATS];
	double low = 16, high = MOST_CELLS;

	for (int i = 0; i < TRIES; i++) {
		const uint32_t cells = i == 0 ? MOST_CELLS : (uint32_t)sqrt(low * high);
		double triangles, ours;

		splats->n = 0;
		draw_ours(bench, SPLATS, 1);
		triangles = draw_triangles(bench, peer, cells);
		draw_ours(bench, SPLATS, 1);
		ours = stats_median(splats->ms, (size_t)splats->n);
		if (triangles <= ours)
			low = cells;
		else
			high = cells;
		if (low >= MOST_CELLS)
			break;
	}
	splats->n = 0;
	return (uint32_t)low;
}

/* ---- the truth ---- */

static int is_inside(const float *coverage, uint32_t side, uint32_t x, uint32_t y)
{
	if (x == 0 || y == 0 || x + 1 == side || y + 1 == side)
		return 0;
	for (uint32_t v = y - 1; v <= y + 1; v++)
		for (uint32_t u = x - 1; u <= x + 1; u++)
			if (coverage[(size_t)v * side + u] < 1)
				return 0;
	return 1;
}

static void draw_truth(struct bench *bench)
{
	const size_t n = (size_t)bench->side * bench->side;
	struct psr_source_planes planes = { .rgb = (uint8_t(*)[3])bench->way[TRUTH].rgb,
		                                .coverage = report_alloc(n, sizeof *planes.coverage) };
	struct psr_source *source = NULL;
	struct psr_error err;
	struct psr_scene scene;

	scene_film_frame(&scene, &bench->film, 0);
	if (psr_source_create(&source, bench->mesh, &err) != PSR_OK)
		report_die("the truth", err.text);
	const struct psr_source_shot shot = { source, &scene, bench->side, bench->side, RAYS, ours_threads() };
	if (psr_source_draw(&shot, &planes, &err) != PSR_OK)
		report_die("the truth", err.text);
	psr_source_destroy(source);
	for (uint32_t y = 0; y < bench->side; y++)
		for (uint32_t x = 0; x < bench->side; x++) {
			const size_t at = (size_t)y * bench->side + x;

			bench->covered[at] = planes.coverage[at] > 0;
			bench->inside[at] = (uint8_t)is_inside(planes.coverage, bench->side, x, y);
		}
	free(planes.coverage);
}

/* ---- what is shown ---- */

/* How much neighbours within a part of the truth differ, where the object covers it. */
static uint64_t detail_at(const struct bench *bench, uint32_t left, uint32_t top)
{
	uint64_t sum = 0;

	for (uint32_t y = top; y + 1 < top + PART; y++)
		for (uint32_t x = left; x + 1 < left + PART; x++) {
			const size_t at = (size_t)y * bench->side + x;
			const uint8_t *rgb = bench->way[TRUTH].rgb + 3 * at;

			if (bench->inside[at])
				sum += (uint64_t)(abs(rgb[1] - rgb[4]) + abs(rgb[1] - rgb[3 * bench->side + 1]));
		}
	return sum;
}

static void write_picture(const struct bench *bench, const char *path)
{
	const uint32_t cell = PART * ZOOM + GUTTER;
	struct psr_frame frame;
	struct psr_error err;
	uint64_t most = 0;
	uint32_t left = 0, top = 0;

	for (uint32_t y = 0; y + PART <= bench->side; y += 8)
		for (uint32_t x = 0; x + PART <= bench->side; x += 8) {
			const uint64_t detail = detail_at(bench, x, y);

			left = detail > most ? x : left;
			top = detail > most ? y : top;
			most = detail > most ? detail : most;
		}
	if (psr_frame_alloc(&frame, N_CELLS * cell - GUTTER, PART * ZOOM, 1u << PSR_PLANE_COLOR, &err) != PSR_OK)
		report_die(path, err.text);
	memset(frame.rgb, 0xff, (size_t)3 * frame.width * frame.height);
	for (uint32_t y = 0; y < frame.height; y++)
		for (uint32_t x = 0; x < frame.width; x++)
			if (x % cell < PART * ZOOM)
				memcpy(frame.rgb + 3 * ((size_t)y * frame.width + x),
				       bench->way[x / cell].rgb
				           + 3 * ((size_t)(top + y / ZOOM) * bench->side + left + x % cell / ZOOM), 3);
	if (psr_image_write(&frame, path, &err) != PSR_OK)
		report_die(path, err.text);
	psr_frame_free(&frame);
}

static void print(struct bench *bench, const char *path, const char *who)
{
	const uint64_t n = (uint64_t)bench->side * bench->side;
	const char *slash = strrchr(path, '/');

	printf("points, splats and triangles at an equal frame rate ([B] figure 11): %s, %ux%u\n\n",
	       slash != NULL ? slash + 1 : path, bench->side, bench->side);
	printf("%-16s %8s %8s %8s %8s\n", "", "M drawn", "fps", "dB", "inside");
	for (int i = 0; i < TRUTH; i++) {
		struct way *way = &bench->way[i];
		const uint8_t *truth = bench->way[TRUTH].rgb;

		printf("%-16s %8.3f %8.1f %8.2f %8.2f\n", way->name, way->drawn, 1e3 / stats_median(way->ms, (size_t)way->n),
		       compare_psnr(way->rgb, truth, bench->covered, n), compare_psnr(way->rgb, truth, bench->inside, n));
	}
	printf("\nTriangles are drawn by %.80s; the mesh has %.3f M.\n", who, (double)bench->whole.n_triangles * 1e-6);
}

/* ---- all of it ---- */

static struct psr_model *make_model(const struct psr_mesh *mesh, int levels)
{
	struct octree_build_options options;
	struct octree_mesh_report report;
	struct psr_model_info info;
	struct psr_model *model;
	struct octree *tree, inner;
	struct psr_error err;

	octree_build_options_default(&options);
	options.levels = levels;
	if (octree_of_mesh(&tree, &report, mesh, &options, &err) != PSR_OK)
		report_die("an octree", err.text);
	psr_octree_info(&info, tree);
	psr_octree_to_inner(&inner, tree, &info);
	if (psr_model_create_octree(&model, &info, &inner, NULL, &err) != PSR_OK)
		report_die("an octree", err.text);
	octree_destroy(tree);
	return model;
}

static void run(struct bench *bench, const char *path, int levels, const char *picture)
{
	static const char *const name[N_CELLS] = { "splats", "points, fine", "triangles", "truth" };
	static const double middle[3];
	const struct scene_picture what = { "figure 11", bench->side, bench->side, 0 };
	struct peer *peer = isolate_alloc(sizeof *peer);
	struct psr_model *model;
	struct psr_error err;
	uint32_t cells;

	if (psr_mesh_import(&bench->mesh, path, NULL, &err) != PSR_OK)
		report_die(path, err.text);
	model = make_model(bench->mesh, levels);
	scene_film_init(&bench->film, &what, model, middle);
	peer_mesh_init(&bench->whole, bench->mesh, model);
	for (int i = 0; i < N_CELLS; i++) {
		bench->way[i].name = name[i];
		bench->way[i].rgb = report_alloc((size_t)bench->side * bench->side, 3);
	}
	bench->covered = report_alloc((size_t)bench->side * bench->side, 1);
	bench->inside = report_alloc((size_t)bench->side * bench->side, 1);
	if (psr_renderer_create(&bench->renderer, &err) != PSR_OK
	    || psr_pool_create(&bench->pool, ours_threads(), &err) != PSR_OK)
		report_die("psr", "cannot be started");
	draw_truth(bench);
	peer->bench = bench;
	cells = find_cells(bench, peer);
	for (int round = 0; round < ROUNDS; round++) {
		draw_ours(bench, SPLATS, 1);
		draw_ours(bench, POINTS, 1);
		bench->way[TRIANGLES].ms[bench->way[TRIANGLES].n++] = draw_triangles(bench, peer, cells);
	}
	print(bench, path, peer->result.what);
	if (picture != NULL)
		write_picture(bench, picture);
	psr_pool_destroy(bench->pool);
	psr_renderer_destroy(bench->renderer);
	for (int i = 0; i < N_CELLS; i++)
		free(bench->way[i].rgb);
	free(bench->covered);
	free(bench->inside);
	peer_mesh_fini(&bench->whole);
	psr_model_unref(model);
	psr_mesh_destroy(bench->mesh);
	isolate_free(peer, sizeof *peer);
}

int main(int argc, char **argv)
{
	struct bench bench = { .side = 512 };
	const char *picture = NULL;
	int levels = 11, option;

	while ((option = getopt(argc, argv, "l:s:o:")) != -1) {
		if (option == '?')
			return 2;
		levels = option == 'l' ? atoi(optarg) : levels;
		bench.side = option == 's' ? (uint32_t)atoi(optarg) : bench.side;
		picture = option == 'o' ? optarg : picture;
	}
	if (optind + 1 != argc || bench.side < PART || bench.side > MOST_SIDE) {
		fprintf(stderr, "octree_rates [-l LEVELS] [-s SIDE] [-o PICTURE.png] MESH; SIDE is %d to %d\n", PART,
		        MOST_SIDE);
		return 2;
	}
	run(&bench, argv[optind], levels, picture);
	return 0;
}
