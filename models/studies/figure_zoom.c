/* A zoom path: how far each frame is from the truth, and how much it changes beyond what the truth changes. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "figures.h"

#define FRAMES 96
#define FIRST 4.0         /* magnification */
#define LAST (1.0 / 16)
#define SIDE 256
#define RAYS 4
#define WORST 8
#define BESIDE 4          /* steps before and after one that changes levels */
#define SHOWN 8           /* times a difference is magnified in the picture */

enum { MAGNIFICATION, SAMPLES, DRAWN, TRUTH, PLAIN, N_COLUMNS = PLAIN + 8 };
/* Columns of plain frames, from PLAIN on, and as many of smooth ones behind them. */
enum { PSNR, INSIDE, CHANGE, BEYOND, SMOOTH };

static const struct study_column columns[N_COLUMNS] = {
	{ "magnification", "magnification", 4 }, { "samples/pixel", "samples", 2 }, { "drawn", "drawn", 0 },
	{ "truth's", "truth", 2 }, { "PSNR dB", "psnr", 2 }, { "inside", "inside", 2 }, { "change", "ours", 2 },
	{ "beyond", "beyond", 2 }, { "PSNR dB", "psnr_smooth", 2 }, { "inside", "inside_smooth", 2 },
	{ "change", "ours_smooth", 2 }, { "beyond", "beyond_smooth", 2 },
};

/* Columns of $table: 3 + the table's. */
static const struct study_kind kind = {
	.name = "zoom",
	.plot = "set multiplot layout 3,1\nset logscale x 2\nset xrange [4:0.0625]\nset grid\nset lmargin 9\n"
	        "set style data lines\n"
	        "set format x ''\nset ylabel 'dB'\nset ytics 4\nset key bottom left\n"
	        "plot $table using 3:7 title 'PSNR of all covered pixels' lw 2, "
	        "'' using 3:8 title 'of those inside' lw 2, '' using 3:11 title 'smooth: all' lw 2, "
	        "'' using 3:12 title 'smooth: inside' lw 2\n"
	        "set ylabel 'samples'\nset ytics 20\nset key top left\nset yrange [0:*]\n"
	        "plot $table using 3:4 title 'warped a covered pixel' lw 2\n"
	        "set format x '%g'\nset xlabel 'magnification'\nset ylabel 'codes'\n"
	        "set yrange [0:30]\nset ytics 10\nset key top right horizontal\n"
	        "plot $table using 3:9 title 'change from frame to frame' lw 2, '' using 3:6 title 'of the truth' lw 2, "
	        "'' using 3:10 title 'beyond it' lw 2, '' using 3:14 title 'smooth: beyond it' lw 2\nunset multiplot\n",
};

struct zoom {
	struct figure_model model;
	struct figure_frame frame[2][2]; /* plain and smooth ones: the one before, and this one */
	struct figure_truth truth[2];
};

static int largest(const uint8_t *a, const uint8_t *b)
{
	int most = 0;

	for (int c = 0; c < 3; c++)
		most = abs(a[c] - b[c]) > most ? abs(a[c] - b[c]) : most;
	return most;
}

static double magnification_of(int i)
{
	return FIRST * pow(LAST / FIRST, i / (FRAMES - 1.0));
}

/* Pixels that the object covers wholly in both frames. */
static void compare_step(double *row, const struct zoom *zoom)
{
	uint64_t n = 0, truth = 0, ours[2] = { 0, 0 }, beyond[2] = { 0, 0 };

	for (size_t at = 0; at < (size_t)SIDE * SIDE; at++) {
		int b;

		if (zoom->truth[0].n_met[at] < RAYS * RAYS || zoom->truth[1].n_met[at] < RAYS * RAYS)
			continue;
		b = largest(zoom->truth[0].rgb + 3 * at, zoom->truth[1].rgb + 3 * at);
		n++;
		truth += (uint64_t)b;
		for (int way = 0; way < 2; way++) {
			int a = largest(zoom->frame[way][0].rgb + 3 * at, zoom->frame[way][1].rgb + 3 * at);

			ours[way] += (uint64_t)a;
			beyond[way] += a > b ? (uint64_t)(a - b) : 0;
		}
	}
	row[TRUTH] = (double)truth / (double)n;
	for (int way = 0; way < 2; way++) {
		row[PLAIN + way * SMOOTH + CHANGE] = (double)ours[way] / (double)n;
		row[PLAIN + way * SMOOTH + BEYOND] = (double)beyond[way] / (double)n;
	}
}

static int draw_frame(struct figures *figures, struct zoom *zoom, int i, int to)
{
	struct figure_shot shot;
	int rc = PSR_OK;

	figure_shot_init(&shot, &zoom->model, figure_view[0], magnification_of(i), SIDE, SIDE);
	for (int way = 0; rc == PSR_OK && way < 2; way++) {
		shot.settings.is_smooth = way;
		rc = figure_draw(&zoom->frame[way][to], figures, &shot);
	}
	return rc == PSR_OK ? figure_truth_draw(&zoom->truth[to], figures, &zoom->model, &shot, RAYS) : rc;
}

static void score_frame(double *row, const struct zoom *zoom, int i)
{
	const struct psr_report *report = &zoom->frame[0][1].report;

	row[MAGNIFICATION] = magnification_of(i);
	row[SAMPLES] = (double)report->count[PSR_STAGE_WARP] / (double)report->n_covered;
	row[DRAWN] = (double)report->n_samples_drawn;
	for (int way = 0; way < 2; way++) {
		struct figure_score score = { .n_met = 0 };

		figure_score_colors(&score, &zoom->frame[way][1], &zoom->truth[1]);
		row[PLAIN + way * SMOOTH + PSNR] = figure_psnr(score.square, score.n_met);
		row[PLAIN + way * SMOOTH + INSIDE] = figure_psnr(score.inside_square, score.n_inside);
	}
}

static void swap(struct zoom *zoom)
{
	const struct figure_truth truth = zoom->truth[0];

	for (int way = 0; way < 2; way++) {
		const struct figure_frame frame = zoom->frame[way][0];

		zoom->frame[way][0] = zoom->frame[way][1];
		zoom->frame[way][1] = frame;
	}
	zoom->truth[0] = zoom->truth[1];
	zoom->truth[1] = truth;
}

static int walk(struct figures *figures, struct zoom *zoom)
{
	struct study_table *table = &figures->study.table;
	int rc = PSR_OK;

	for (int i = 0; rc == PSR_OK && i < FRAMES; i++) {
		double *row = study_at(table, i, 0, 0);

		rc = draw_frame(figures, zoom, i, 1);
		if (rc != PSR_OK)
			break;
		snprintf(table->label[i], sizeof table->label[i], "%d", i);
		score_frame(row, zoom, i);
		if (i > 0)
			compare_step(row, zoom);
		swap(zoom);
	}
	return rc;
}

/* Coarser levels have a quarter of the samples; a model's groups change one by one. */
static int changes_level(const struct study_table *table, int i)
{
	return i > 0 && *study_at(table, i, 0, DRAWN) < 0.8 * *study_at(table, i - 1, 0, DRAWN);
}

static int is_beside(const struct study_table *table, int i)
{
	for (int k = i - BESIDE; k <= i + BESIDE; k++)
		if (k > 0 && k < FRAMES && changes_level(table, k))
			return 1;
	return 0;
}

static void rank(int order[FRAMES], const struct study_table *table)
{
	for (int i = 1; i < FRAMES; i++) {
		int at = i - 1;

		for (; at > 0 && *study_at(table, order[at - 1], 0, PLAIN + BEYOND) < *study_at(table, i, 0, PLAIN + BEYOND); at--)
			order[at] = order[at - 1];
		order[at] = i;
	}
}

static void print_row(const struct study_table *table, int i)
{
	const double *row = study_at(table, i, 0, 0);

	printf("%-5d %7.4f %7.2f %7.2f", i, row[MAGNIFICATION], row[SAMPLES], row[TRUTH]);
	for (const double *way = row + PLAIN; way < row + N_COLUMNS; way += SMOOTH)
		printf(" | %7.2f %7.2f %7.2f %7.2f", way[PSNR], way[INSIDE], way[CHANGE], way[BEYOND]);
	printf("%s\n", changes_level(table, i) ? " *" : "");
}

static void print_means(const struct study_table *table)
{
	static const char *const step[] = { "that change levels", "around them", "others" };
	double sum[3][3] = { { 0 } };
	int n[3] = { 0, 0, 0 };

	for (int i = 1; i < FRAMES; i++) {
		const int kind_of = changes_level(table, i) ? 0 : is_beside(table, i) ? 1 : 2;

		n[kind_of]++;
		sum[kind_of][0] += *study_at(table, i, 0, TRUTH);
		for (int way = 0; way < 2; way++)
			sum[kind_of][1 + way] += *study_at(table, i, 0, PLAIN + way * SMOOTH + BEYOND);
	}
	printf("*: levels change\n\nmean, codes                  truth's change   beyond it   smooth\n");
	for (int k = 0; k < 3; k++)
		printf("%3d steps %-18s %14.2f %11.2f %8.2f\n", n[k], step[k], sum[k][0] / n[k], sum[k][1] / n[k], sum[k][2] / n[k]);
}

static void print(const struct study_table *table, const int order[FRAMES])
{
	printf("%-5s %7s %7s %7s | plain: %24s | smooth\n%-5s %7s %7s %7s", "", "", "samples", "truth's", "", "frame", "magn.",
	       "a pixel", "change");
	for (int way = 0; way < 2; way++)
		printf(" | %7s %7s %7s %7s", "PSNR dB", "inside", "change", "beyond");
	printf("\n");
	for (int k = 0; k < WORST; k++)
		print_row(table, order[k]);
	printf("every eighth:\n");
	for (int i = 1; i < FRAMES; i += 8)
		print_row(table, i);
	print_means(table);
}

static int show_difference(struct figures *figures, struct figure_sheet *sheet, const uint8_t *a, const uint8_t *b,
                           const struct figure_part *part)
{
	uint8_t *difference = malloc(3 * SIDE * SIDE);
	int rc;

	if (difference == NULL)
		return psr_fail(figures->err, PSR_ERR_MEMORY, "no memory for a difference");
	for (size_t i = 0; i < 3 * SIDE * SIDE; i++) {
		const int d = SHOWN * abs(a[i] - b[i]);

		difference[i] = (uint8_t)(d < 255 ? d : 255);
	}
	rc = figure_sheet_add(sheet, difference, SIDE, part, figures->err);
	free(difference);
	return rc;
}

/* The step at `i`: before, after, and the difference; above ours, below the truth's. */
static int show_step(struct figures *figures, struct zoom *zoom, int i)
{
	const uint32_t side = magnification_of(i) < 0.25 ? SIDE / 4 : magnification_of(i) < 0.5 ? SIDE / 2 : SIDE;
	const struct figure_part whole = { (SIDE - side) / 2, (SIDE - side) / 2, side, side, SIDE / side };
	struct figure_sheet sheet;
	int rc = draw_frame(figures, zoom, i - 1, 0);

	figure_sheet_init(&sheet, 3, &whole);
	if (rc == PSR_OK)
		rc = draw_frame(figures, zoom, i, 1);
	for (int k = 0; rc == PSR_OK && k < 4; k++) {
		const uint8_t *rgb = k < 2 ? zoom->frame[0][k].rgb : zoom->truth[k - 2].rgb;

		rc = figure_sheet_add(&sheet, rgb, SIDE, &whole, figures->err);
		if (rc == PSR_OK && k == 1)
			rc = show_difference(figures, &sheet, zoom->frame[0][0].rgb, zoom->frame[0][1].rgb, &whole);
		if (rc == PSR_OK && k == 3)
			rc = show_difference(figures, &sheet, zoom->truth[0].rgb, zoom->truth[1].rgb, &whole);
	}
	if (rc == PSR_OK)
		rc = figure_sheet_write(&sheet, figures, "zoom");
	figure_sheet_drop(&sheet, 0);
	return rc;
}

int figure_run_zoom(struct figures *figures)
{
	struct study_table *table = &figures->study.table;
	struct zoom zoom;
	int order[FRAMES], shown = 0, rc;
	char path[1024];

	memset(&zoom, 0, sizeof zoom);
	rc = figure_model_load(&zoom.model, figures, "toybird", NULL, 256);
	for (int k = 0; rc == PSR_OK && k < 4; k++)
		rc = figure_frame_init(&zoom.frame[k / 2][k % 2], SIDE, SIDE, figures->err);
	if (rc == PSR_OK)
		rc = study_table_init(table, "frame", columns, N_COLUMNS, FRAMES, 1, figures->err);
	if (rc == PSR_OK)
		rc = walk(figures, &zoom);
	if (rc == PSR_OK) {
		rank(order, table);
		print(table, order);
		figures->study.kind = &kind;
		while (shown < FRAMES - 2 && !changes_level(table, order[shown]))
			shown++;
		rc = show_step(figures, &zoom, order[shown]);
	}
	if (rc == PSR_OK && snprintf(path, sizeof path, "%s/zoom.svg", figures->out) < (int)sizeof path)
		rc = study_plot(&figures->study, path, figures->err);
	study_table_fini(table);
	for (int k = 0; k < 2; k++) {
		figure_frame_fini(&zoom.frame[0][k]);
		figure_frame_fini(&zoom.frame[1][k]);
		figure_truth_fini(&zoom.truth[k]);
	}
	figure_model_fini(&zoom.model);
	return rc;
}
