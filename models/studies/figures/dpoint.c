/* Table 2 and figure 6 of [K]: the teapot as differential points, and as squares, rectangles and ellipses. */
#include <stdio.h>
#include "figures.h"
#include "models/shapes/teapot.h"
#include "models/studies/dpoint/study_dpoint.h"
#include "models/studies/dpoint/view.h"
#include "models/studies/tables/octree.h"

#define SIDE 70          /* samples along a side of a patch: 156,800, as [K] has */
#define MOST_SIDE 300    /* 2.9 million points */
#define CLOSE 0.4        /* radii: six times as near */
#define LEAST_LEVELS 6
#define MOST_LEVELS 11

static const struct figure_part shown = { 280, 180, 240, 240, 1 };

enum { DIFFUSE, SPECULAR, NEAR, N_VIEWS };

struct splats {
	struct study *study;
	struct study_model of, dull; /* the same, but that `dull` scatters all light */
	struct dpoint_view view[N_VIEWS];
	struct figure_sheet sheet;
};

/* What is drawn for a point, and how well. */
struct drawn {
	struct psr_model *model[2]; /* diffuse, specular */
	int with_ewa;
	uint64_t n_points, n_holes; /* holes of the whole teapot, diffuse */
	double fps, db[N_VIEWS], bright;
};

static void drawn_fini(struct drawn *drawn)
{
	psr_model_unref(drawn->model[0]);
	psr_model_unref(drawn->model[1]);
	*drawn = (struct drawn){ .n_points = 0 };
}

static struct dpoint_way way_of(const struct drawn *drawn, int view)
{
	return (struct dpoint_way){ .model = drawn->model[view != DIFFUSE], .with_ewa = drawn->with_ewa };
}

static int score(struct drawn *drawn, struct splats *s, int view)
{
	const struct dpoint_way way = way_of(drawn, view);
	struct psr_errors errors;
	const int rc = dpoint_view_score(&errors, &drawn->bright, &s->view[view], &way);

	drawn->db[view] = errors.psnr_inside;
	if (view == DIFFUSE)
		drawn->n_holes = errors.n_holes;
	return rc;
}

/* Prints a row, and adds what the last view has to the sheet. */
static int put(struct drawn *drawn, struct splats *s, const char *label)
{
	const struct dpoint_way way = way_of(drawn, DIFFUSE);
	int rc = PSR_OK;

	for (int view = 0; view < N_VIEWS && rc == PSR_OK; view++)
		rc = score(drawn, s, view);
	if (rc == PSR_OK)
		rc = figure_sheet_add(&s->sheet, s->view[NEAR].frame.rgb, DPOINT_VIEW_WIDTH, &shown, s->study->err);
	if (rc == PSR_OK)
		rc = dpoint_view_time(&drawn->fps, &s->view[DIFFUSE], &way, 1);
	if (rc == PSR_OK)
		printf("%-27s %8llu %7.0f %6.1f%9.2f%9.2f%8.2f%8.2f%7llu\n", label, (unsigned long long)drawn->n_points,
		       (double)psr_model_bytes(drawn->model[0]) / 1e3, drawn->fps, drawn->db[DIFFUSE], drawn->db[SPECULAR],
		       drawn->db[NEAR], drawn->bright, (unsigned long long)drawn->n_holes);
	return rc;
}

static int put_truth(struct splats *s)
{
	return figure_sheet_add(&s->sheet, (const uint8_t *)s->view[NEAR].truth.rgb, DPOINT_VIEW_WIDTH, &shown,
	                        s->study->err);
}

/* ---- what is drawn ---- */

static int make_models(struct drawn *out, struct splats *s, struct dpoint_surface *surface,
                       const struct dpoint_choice *choice)
{
	int rc = PSR_OK;

	out->n_points = choice->n_kept;
	for (int k = 0; k < 2 && rc == PSR_OK; k++)
		rc = study_dpoint_model(&out->model[k], s->study, &s->of, surface, choice, k);
	return rc;
}

static int make_points(struct drawn *out, struct splats *s, int is_simplified)
{
	struct study_dpoint made;
	int rc = study_dpoint_make(&made, s->study, &s->of, SIDE, is_simplified);

	if (rc == PSR_OK)
		rc = make_models(out, s, &made.surface, &made.choice);
	study_dpoint_fini(&made);
	return rc;
}

/* wide: half a side over the radius of the ball that reaches to a sample's neighbours. */
static int make_flat(struct drawn *out, struct splats *s, uint32_t side, float wide)
{
	struct dpoint_surface surface;
	struct dpoint_choice choice = { NULL, 0, 0 };
	int rc;

	dpoint_surface_init(&surface);
	rc = study_dpoint_flat(&surface, &s->of, side, wide);
	if (rc == PSR_OK)
		rc = study_dpoint_keep_all(&choice, surface.n_candidates);
	rc = rc == PSR_OK ? make_models(out, s, &surface, &choice)
	                  : psr_fail(s->study->err, rc, "no memory for %u samples along a patch", side);
	dpoint_choice_fini(&choice);
	dpoint_surface_fini(&surface);
	return rc;
}

static int make_ellipses(struct drawn *out, struct splats *s, int levels)
{
	int rc = PSR_OK;

	out->with_ewa = 1;
	for (int k = 0; k < 2 && rc == PSR_OK; k++) {
		struct octree *tree = NULL;

		rc = octree_points(&out->model[k], &tree, s->study, k ? &s->of : &s->dull, levels);
		out->n_points = tree != NULL ? tree->n_leaves : 0;
		octree_destroy(tree);
	}
	return rc;
}

/* ---- the tests ---- */

static int put_flat(struct splats *s, const char *label, uint32_t side, float wide)
{
	struct drawn drawn = { .n_points = 0 };
	int rc = make_flat(&drawn, s, side, wide);

	if (rc == PSR_OK)
		rc = put(&drawn, s, label);
	drawn_fini(&drawn);
	return rc;
}

/* Puts the tree of the fewest levels that has at least as many leaves, and as good a picture, or of the most. */
static int put_ellipses(struct splats *s, const char *label, uint64_t n, double db)
{
	struct drawn drawn = { .n_points = 0 };
	int rc = PSR_OK, is_enough = 0;

	for (int levels = LEAST_LEVELS; rc == PSR_OK && levels <= MOST_LEVELS && !is_enough; levels++) {
		drawn_fini(&drawn);
		rc = make_ellipses(&drawn, s, levels);
		if (rc == PSR_OK)
			rc = score(&drawn, s, SPECULAR);
		is_enough = drawn.n_points >= n && drawn.db[SPECULAR] >= db;
	}
	if (rc == PSR_OK)
		rc = put(&drawn, s, label);
	drawn_fini(&drawn);
	return rc;
}

static int is_as_good(int *is, struct splats *s, uint32_t side, float wide, double db)
{
	struct drawn drawn = { .n_points = 0 };
	int rc = make_flat(&drawn, s, side, wide);

	if (rc == PSR_OK)
		rc = score(&drawn, s, SPECULAR);
	*is = drawn.db[SPECULAR] >= db;
	drawn_fini(&drawn);
	return rc;
}

/* Puts the fewest samples whose picture is as good, within a thirtieth along a side, or the most. */
static int put_flat_as_good(struct splats *s, const char *label, float wide, double db)
{
	uint32_t low = SIDE / 4, high = MOST_SIDE;
	int is, rc = is_as_good(&is, s, high, wide, db);

	while (rc == PSR_OK && is && high - low > 1 + high / 32) {
		const uint32_t side = (low + high) / 2;
		int is_good;

		rc = is_as_good(&is_good, s, side, wide, db);
		*(is_good ? &high : &low) = side;
	}
	return rc == PSR_OK ? put_flat(s, label, high, wide) : rc;
}

/* A row of the sheet: differential points, and as many of each other kind. */
static int put_as_many(struct splats *s, struct drawn *points, const char *label)
{
	uint32_t side = 1;
	int rc;

	while ((uint64_t)TEAPOT_PATCHES * side * side < points->n_points)
		side++;
	puts("");
	rc = put(points, s, label);
	if (rc == PSR_OK)
		rc = put_flat(s, "squares, as many", side, 0.5f);
	if (rc == PSR_OK)
		rc = put_flat(s, "rectangles, as many", side, 1);
	if (rc == PSR_OK)
		rc = put_ellipses(s, "ellipses, at least as many", points->n_points, 0);
	return rc == PSR_OK ? put_truth(s) : rc;
}

static int put_as_good(struct splats *s, struct drawn *points, const char *label)
{
	const double db = points->db[SPECULAR];
	int rc;

	puts("");
	rc = put(points, s, label);
	if (rc == PSR_OK)
		rc = put_flat_as_good(s, "squares, as good", 0.5f, db);
	if (rc == PSR_OK)
		rc = put_flat_as_good(s, "rectangles, as good", 1, db);
	if (rc == PSR_OK)
		rc = put_ellipses(s, "ellipses, as good", 0, db);
	return rc == PSR_OK ? put_truth(s) : rc;
}

static int run_tests(struct splats *s)
{
	struct drawn all = { .n_points = 0 }, few = { .n_points = 0 };
	int rc = make_points(&all, s, 0);

	printf("%-27s %8s %7s %6s%9s%9s%8s%8s%7s\n", "", "points", "kB", "fps", "diffuse", "specular", "near", "bright", "holes");
	if (rc == PSR_OK)
		rc = make_points(&few, s, 1);
	if (rc == PSR_OK)
		rc = put_as_many(s, &all, "differential points, all");
	if (rc == PSR_OK)
		rc = put_as_many(s, &few, "the same, simplified");
	if (rc == PSR_OK)
		rc = put_as_good(s, &all, "differential points, all");
	drawn_fini(&all);
	drawn_fini(&few);
	return rc;
}

static int open_views(struct splats *s)
{
	int rc = study_model_make(&s->of, "teapot", study_dpoint_make_teapot, s->study->err);

	if (rc == PSR_OK)
		rc = study_model_make(&s->dull, "teapot", study_dpoint_make_teapot, s->study->err);
	if (rc != PSR_OK)
		return rc;
	study_dpoint_dull(&s->dull.mesh->material[0]);
	for (int i = 0; i < N_VIEWS && rc == PSR_OK; i++) {
		rc = dpoint_view_init(&s->view[i], s->study);
		if (rc == PSR_OK)
			rc = dpoint_view_open(&s->view[i], i == DIFFUSE ? &s->dull : &s->of, DPOINT_VIEW_WHOLE);
	}
	return rc == PSR_OK ? dpoint_view_set(&s->view[NEAR], CLOSE, 1) : rc;
}

int figure_dpoint_splats(struct study *study)
{
	struct splats s = { .study = study };
	int rc;

	figure_sheet_init(&s.sheet, 5, &shown);
	rc = open_views(&s);
	if (rc == PSR_OK)
		rc = run_tests(&s);
	if (rc == PSR_OK)
		puts("\n"
		     "fps: frames of 800x600 a second, diffuse. dB inside the object to the traced patches: diffuse, specular;\n"
		     "near: at the highlight, 0.4 radii high; bright: of the bright pixels there. The most that are tried are\n"
		     "2,880,000 samples and 11 levels: where these have fewer dB, they are not as good.\n\n"
		     "[K]                           points      kB    fps\n"
		     "differential points           156800    9190    2.1\n"
		     "squares, as many              156800    4900   11.8\n"
		     "rectangles, as many           156800    4900   10.5\n"
		     "ellipses, as many             156800    4900    2.4\n"
		     "squares, as good             1411200   44100    1.6\n"
		     "rectangles, as good          1155200   36100    1.5\n"
		     "ellipses, as good             320000   10010    1.2");
	rc = figure_sheet_finish(&s.sheet, study, "dpoint-splats", rc);
	for (int i = 0; i < N_VIEWS; i++)
		dpoint_view_fini(&s.view[i]);
	study_model_fini(&s.of);
	study_model_fini(&s.dull);
	return rc;
}
