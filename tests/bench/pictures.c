/* Ours beside the peers, picture by picture. */
#include <stdio.h>
#include <string.h>
#include "compare.h"
#include "embree.h"
#include "isolate.h"
#include "llvmpipe.h"
#include "ours.h"
#include "parts.h"
#include "report.h"

static const struct scene_picture pictures[N_PICTURES] = {
	{ "256x256", 256, 256, 0 },
	{ "1024x1024", 1024, 1024, 0 },
	{ "1024x1024, half covered", 1024, 1024, 0.5 },
	{ "1920x1080, filled", 1920, 1080, 0.8 },
};

#define LLVMPIPE_FRAMES 6
#define EMBREE_FRAMES 12

enum { MESH, POINTS, POINTS_VERTEX, EMBREE, EMBREE_SHADOW, N_PEERS };
static const char *const peer_name[N_PEERS] = { "llvmpipe-mesh", "llvmpipe-points", "llvmpipe-points-vertex", "embree",
	                                            "embree-shadow" };

struct cell { /* of one picture; shared with the child that draws it */
	struct ours_result all, one;
	struct peer_result peer[N_PEERS];
	uint8_t rgb[N_PEERS + 1][3 * 1920 * 1080]; /* the last is ours */
};

struct job {
	const struct part *part;
	const struct scene_film *film;
	const struct peer_mesh *mesh;
	struct cell *cell;
	int peer;
};

static void scene(struct psr_scene *out, int frame, const void *userdata)
{
	scene_film_frame(out, userdata, frame);
}

static void draw_ours(void *arg)
{
	const struct job *job = arg;
	struct ours_settings settings = {
		.width = job->film->picture.width, .height = job->film->picture.height, .n_threads = job->part->n_threads,
		.is_encoded = 1, .least_ms = 400, .most_ms = 1500, .n_frames = SCENE_FRAMES, .scene = scene,
		.userdata = job->film,
	};

	ours_measure(&job->cell->all, &settings, job->cell->rgb[N_PEERS]);
	settings.n_threads = 1;
	ours_measure(&job->cell->one, &settings, NULL);
}

static void draw_llvmpipe(void *arg)
{
	const struct job *job = arg;
	const enum llvmpipe_way way = job->peer == MESH ? LLVMPIPE_MESH : job->peer == POINTS ? LLVMPIPE_POINTS
	                                                                                       : LLVMPIPE_POINTS_VERTEX;
	struct peer_points points = { .n = 0 };

	if (way != LLVMPIPE_MESH)
		peer_points_init(&points, job->film);
	llvmpipe_measure(&job->cell->peer[job->peer], way, job->film, job->mesh, &points, LLVMPIPE_FRAMES,
	                 job->cell->rgb[job->peer]);
	peer_points_fini(&points);
}

static void draw_embree(void *arg)
{
	const struct job *job = arg;

	embree_measure(&job->cell->peer[job->peer], job->film, job->mesh, job->peer == EMBREE_SHADOW, job->part->n_threads,
	               EMBREE_FRAMES, job->cell->rgb[job->peer]);
}

static void draw(struct job *job)
{
	isolate_run(draw_ours, job);
	for (job->peer = 0; job->peer < N_PEERS; job->peer++)
		isolate_run(job->peer >= EMBREE ? draw_embree : draw_llvmpipe, job);
}

/* The faster of the two ways to draw the points. */
static double points_ms(const struct cell *cell)
{
	const double a = cell->peer[POINTS].ms, b = cell->peer[POINTS_VERTEX].ms;

	return a < b ? a : b;
}

static double covered(const struct cell *cell, const struct scene_film *film)
{
	return (cell->all.n_covered + cell->all.n_filled) / ((double)film->picture.width * film->picture.height);
}

static void print_ratios(const struct scene_film *film, const struct cell *cell)
{
	printf("%-24s | %44s | %8s | %s\n", "times as long as ours", "llvmpipe              Embree", "ours", "ms");
	printf("%-24s | %10s %10s %10s %11s | %8s | %8s %8s %8s %8s %8s | %7s %6s\n", "(nothing encoded)", "mesh", "points",
	       "mesh", "with shadow", "ms", "mesh", "points", "by vert.", "Embree", "shadow", "covered", "magn.");
	for (int i = 0; i < N_PICTURES; i++, film++, cell++) {
		const double ms = cell->all.ms;

		printf("%-24s | %10.1f %10.1f %10.1f %11.1f | %8.3f | %8.1f %8.1f %8.1f %8.1f %8.1f | %5.0f %% %6.2f\n",
		       film->picture.name, cell->peer[MESH].ms / ms, points_ms(cell) / ms, cell->peer[EMBREE].ms / ms,
		       cell->peer[EMBREE_SHADOW].ms / ms, ms, cell->peer[MESH].ms, cell->peer[POINTS].ms,
		       cell->peer[POINTS_VERTEX].ms, cell->peer[EMBREE].ms, cell->peer[EMBREE_SHADOW].ms,
		       100 * covered(cell, film), film->magnification);
	}
}

static void print_ours(const struct part *part, const struct subject *subject, const struct scene_film *film,
                       const struct cell *cell)
{
	printf("\n%-24s | %8s %8s | %8s %8s | %6s %6s | ", "ours, ms", "1 thread", "JPEG", "threads", "JPEG", "kB", "MB");
	for (int s = 0; s < PSR_N_STAGES; s++)
		printf(" %7s", psr_stage_name((enum psr_stage)s));
	printf(" | %6s %7s %6s\n%-24s | %8s %8s | %8d %8s | %6s %6s |\n", "Mpt", "pt a px", "model", "", "", "q90",
	       part->n_threads, "q90", "JPEG", "buffer");
	for (int i = 0; i < N_PICTURES; i++, film++, cell++) {
		const struct ours_result *r = &cell->all;

		printf("%-24s | %8.3f %8.3f | %8.3f %8.3f | %6.0f %6.1f | ", film->picture.name, cell->one.ms,
		       cell->one.ms_encoded, r->ms, r->ms_encoded, r->encoded_bytes / 1e3, (double)r->renderer_bytes / 1e6);
		for (int s = 0; s < PSR_N_STAGES; s++)
			printf(" %7.3f", r->stage_ms[s]);
		printf(" | %6.3f %7.2f %6d\n", r->count[PSR_STAGE_WARP] / 1e6,
		       report_ratio(r->count[PSR_STAGE_WARP], r->n_covered), subject->resolution[i]);
	}
}

/* What the peers drew beside what we drew: silhouette and shading. */
static void print_agreement(const struct part *part, const struct subject *subject, const struct scene_film *film,
                            const struct cell *cell)
{
	printf("\n%-24s | same silhouette, %%; difference of shading, codes of 255\n%-24s |", "the same picture?", "");
	for (int p = 0; p < N_PEERS; p++)
		printf(" %22s", peer_name[p]);
	puts("");
	for (int i = 0; i < N_PICTURES; i++, film++, cell++) {
		printf("%-24s |", film->picture.name);
		for (int p = 0; p <= N_PEERS; p++) {
			const uint32_t w = film->picture.width, h = film->picture.height;
			const struct compare c = compare_pictures(cell->rgb[p], cell->rgb[N_PEERS], w, h);
			char path[4096];

			if (p < N_PEERS)
				printf(" %14.2f %7.2f", 100 * c.overlap, c.difference);
			snprintf(path, sizeof path, "%s/%s-%d-%s.png", part->out, subject->name, i,
			         p < N_PEERS ? peer_name[p] : "psr");
			compare_save(path, cell->rgb[p], w, h);
		}
		puts("");
	}
}

static void add_ours(cJSON *item, const char *name, const struct ours_result *r)
{
	cJSON *ours = cJSON_AddObjectToObject(item, name);

	report_number(ours, "ms", r->ms);
	report_number(ours, "ms_encoded", r->ms_encoded);
	report_number(ours, "encoded_bytes", r->encoded_bytes);
	report_number(ours, "renderer_bytes", (double)r->renderer_bytes);
	report_number(ours, "samples_drawn", r->n_samples_drawn);
	report_number(ours, "pixels_covered", r->n_covered);
	report_number(ours, "frames", r->n_frames);
	for (int s = 0; s < PSR_N_STAGES; s++) {
		cJSON *stage = cJSON_AddObjectToObject(ours, psr_stage_name((enum psr_stage)s));

		report_number(stage, "ms", r->stage_ms[s]);
		report_number(stage, "count", r->count[s]);
	}
}

static void add_json(const struct subject *subject, int i, const struct scene_film *film, const struct cell *cell)
{
	cJSON *item = report_add(report_array("pictures"));

	report_text(item, "model", subject->name);
	report_text(item, "picture", film->picture.name);
	report_number(item, "resolution", subject->resolution[i]);
	report_number(item, "covered", covered(cell, film));
	report_number(item, "magnification", film->magnification);
	add_ours(item, "ours", &cell->all);
	add_ours(item, "ours_one_thread", &cell->one);
	for (int p = 0; p < N_PEERS; p++) {
		const struct compare c = compare_pictures(cell->rgb[p], cell->rgb[N_PEERS], film->picture.width,
		                                          film->picture.height);
		cJSON *peer = cJSON_AddObjectToObject(item, peer_name[p]);

		report_text(peer, "by", cell->peer[p].what);
		report_number(peer, "ms", cell->peer[p].ms);
		report_number(peer, "setup_seconds", cell->peer[p].setup_s);
		report_number(peer, "same_silhouette", c.overlap);
		report_number(peer, "difference", c.difference);
	}
}

static void add_target(const struct subject *subject, const char *what, double value, const char *unit,
                       enum report_bound kind, double bound)
{
	char text[128];

	snprintf(text, sizeof text, "%s, %s", subject->name, what);
	report_target(text, value, unit, kind, bound);
}

static void add_targets(const struct subject *subject, const struct cell *cell)
{
	const struct cell *square = &cell[1];

	add_target(subject, "256x256, JPEG q90", cell[0].all.ms_encoded, "ms", REPORT_AT_MOST, 0.25);
	add_target(subject, "1024x1024 half covered, JPEG q90", cell[2].all.ms_encoded, "ms", REPORT_AT_MOST, 3.5);
	add_target(subject, "1920x1080 filled, JPEG q90", cell[3].all.ms_encoded, "ms", REPORT_AT_MOST, 10);
	if (!subject->is_of_the_targets)
		return;
	add_target(subject, "1024x1024, Embree on the mesh", square->peer[EMBREE].ms / square->all.ms, "times",
	           REPORT_AT_LEAST, 10);
	add_target(subject, "1024x1024, llvmpipe on the mesh", square->peer[MESH].ms / square->all.ms, "times",
	           REPORT_AT_LEAST, 20);
	add_target(subject, "1024x1024, llvmpipe on the points", points_ms(square) / square->all.ms, "times",
	           REPORT_AT_LEAST, 50);
}

static struct psr_mesh *import(const char *path)
{
	struct psr_mesh *mesh;
	struct psr_error err;

	if (psr_mesh_import(&mesh, path, NULL, &err) != PSR_OK)
		report_die(path, err.text);
	return mesh;
}

void pictures_run(const struct part *part, const struct subject *subject)
{
	struct psr_mesh *mesh = import(subject->source);
	struct cell *cell = isolate_alloc(N_PICTURES * sizeof *cell);
	struct scene_film film[N_PICTURES];

	for (int i = 0; i < N_PICTURES; i++) {
		struct psr_model *model = scene_model(part->psr_model, part->models, subject->file, subject->source,
		                                      subject->resolution[i]);
		struct peer_mesh peer;

		peer_mesh_init(&peer, mesh, model);
		scene_film_init(&film[i], &pictures[i], model, subject->aim);
		draw(&(struct job){ .part = part, .film = &film[i], .mesh = &peer, .cell = &cell[i] });
		add_json(subject, i, &film[i], &cell[i]);
		peer_mesh_fini(&peer);
		psr_model_unref(model);
	}
	printf("\n%s: %u triangles; one light, moving camera, %d threads; %s; %s\n", subject->name, mesh->n_triangles,
	       part->n_threads, cell->peer[MESH].what, cell->peer[EMBREE].what);
	print_ratios(film, cell);
	print_ours(part, subject, film, cell);
	print_agreement(part, subject, film, cell);
	add_targets(subject, cell);
	fflush(stdout);
	psr_mesh_destroy(mesh);
	isolate_free(cell, N_PICTURES * sizeof *cell);
}
