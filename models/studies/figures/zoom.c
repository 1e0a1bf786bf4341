/* A zoom path: how far each frame is from the truth, and how much more it changes than the truth does. */
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
const char figure_zoom_plot[] =
	 "set multiplot layout 3,1\nset logscale x 2\nset xrange [4:0.0625]\nset grid\nset lmargin 9\n"
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
	"'' using 3:10 title 'beyond it' lw 2, '' using 3:14 title 'smooth: beyond it' lw 2\nunset multiplot\n";

/* Picture i is in slot i & 1, beside the one before. */
struct zoom {
	struct figure_model model;
	struct psr_frame frame[2][2]; /* plain and smooth ones */
	struct figure_truth truth[2];
};

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
		b = figure_difference(zoom->truth[0].rgb + 3 * at, zoom->truth[1].rgb + 3 * at);
		n++;
		truth += (uint64_t)b;
		for (int way = 0; way < 2; way++) {
			int a = figure_difference(zoom->frame[way][0].rgb + 3 * at, zoom->frame[way][1].rgb + 3 * at);

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

static int draw_frame(struct study *study, struct zoom *zoom, int i)
{
	struct figure_shot shot;
	int rc = PSR_OK;

	figure_shot_init(&shot, &zoom->model, figure_view[0], magnification_of(i), SIDE);
	for (int way = 0; rc == PSR_OK && way < 2; way++) {
		shot.settings.smooth = way;
		rc = figure_draw(&zoom->frame[way][i & 1], study, &shot);
	}
	return rc == PSR_OK ? figure_truth_draw(&zoom->truth[i & 1], study, &zoom->model, &shot, RAYS) : rc;
}

static void score_frame(double *row, const struct zoom *zoom, int i)
{
	const struct psr_report *report = &zoom->frame[0][i & 1].report;

	row[MAGNIFICATION] = magnification_of(i);
	row[SAMPLES] = (double)report->count[PSR_STAGE_WARP] / (double)report->n_covered;
	row[DRAWN] = (double)report->n_samples_drawn;
	for (int way = 0; way < 2; way++) {
		struct figure_score score = { .n_met = 0 };

		figure_score_colors(&score, &zoom->frame[way][i & 1], &zoom->truth[i & 1]);
		row[PLAIN + way * SMOOTH + PSNR] = figure_psnr(score.square, score.n_met);
		row[PLAIN + way * SMOOTH + INSIDE] = figure_psnr(score.inside_square, score.n_inside);
	}
}

static int walk(struct study *study, struct zoom *zoom)
{
	int rc = PSR_OK;

	for (int i = 0; rc == PSR_OK && i < FRAMES; i++) {
		double *row = study_at(&study->table, i, 0, 0);

		rc = draw_frame(study, zoom, i);
		if (rc != PSR_OK)
			break;
		study_label(&study->table, i, "%d", i);
		score_frame(row, zoom, i);
		if (i > 0)
			compare_step(row, zoom);
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

static int show_difference(struct study *study, struct figure_sheet *sheet, const uint8_t *a, const uint8_t *b,
                           const struct figure_part *part)
{
	uint8_t *difference = malloc(3 * SIDE * SIDE);
	int rc;

	if (difference == NULL)
		return psr_fail(study->err, PSR_ERR_MEMORY, "no memory for a difference");
	for (size_t i = 0; i < 3 * SIDE * SIDE; i++) {
		const int d = SHOWN * abs(a[i] - b[i]);

		difference[i] = (uint8_t)(d < 255 ? d : 255);
	}
	rc = figure_sheet_add(sheet, difference, SIDE, part, study->err);
	free(difference);
	return rc;
}

/* The step at `i`: before, after, and the difference; above ours, below the truth's. */
static int show_step(struct study *study, struct zoom *zoom, int i)
{
	const uint32_t side = magnification_of(i) < 0.25 ? SIDE / 4 : magnification_of(i) < 0.5 ? SIDE / 2 : SIDE;
	const struct figure_part whole = { (SIDE - side) / 2, (SIDE - side) / 2, side, side, SIDE / side };
	struct figure_sheet sheet;
	int rc = draw_frame(study, zoom, i - 1);

	figure_sheet_init(&sheet, 3, &whole);
	if (rc == PSR_OK)
		rc = draw_frame(study, zoom, i);
	for (int is_truth = 0; rc == PSR_OK && is_truth < 2; is_truth++) {
		const uint8_t *rgb[2];

		for (int k = 0; k < 2; k++)
			rgb[k] = is_truth ? zoom->truth[(i - 1 + k) & 1].rgb : zoom->frame[0][(i - 1 + k) & 1].rgb;
		rc = figure_sheet_add(&sheet, rgb[0], SIDE, &whole, study->err);
		if (rc == PSR_OK)
			rc = figure_sheet_add(&sheet, rgb[1], SIDE, &whole, study->err);
		if (rc == PSR_OK)
			rc = show_difference(study, &sheet, rgb[0], rgb[1], &whole);
	}
	return figure_sheet_finish(&sheet, study, "zoom", rc);
}

int figure_zoom(struct study *study)
{
	struct study_table *table = &study->table;
	struct zoom zoom = { .truth = { { .side = 0 } } };
	int order[FRAMES], shown = 0, rc = figure_model_load(&zoom.model, study, "toybird", NULL, 256);
	char path[1024];

	for (int k = 0; rc == PSR_OK && k < 4; k++)
		rc = psr_frame_alloc(&zoom.frame[k / 2][k % 2], SIDE, SIDE, FIGURE_PLANES, study->err);
	if (rc == PSR_OK)
		rc = study_table_init(table, (struct study_form){ "frame", columns, N_COLUMNS }, FRAMES, 1, study->err);
	if (rc == PSR_OK)
		rc = walk(study, &zoom);
	if (rc == PSR_OK) {
		rank(order, table);
		print(table, order);
		while (shown < FRAMES - 2 && !changes_level(table, order[shown]))
			shown++;
		rc = show_step(study, &zoom, order[shown]);
	}
	if (rc == PSR_OK && snprintf(path, sizeof path, "%s/zoom.svg", study->out) < (int)sizeof path)
		rc = study_plot(study, path, study->err);
	study_table_fini(table);
	for (int k = 0; k < 2; k++) {
		psr_frame_free(&zoom.frame[0][k]);
		psr_frame_free(&zoom.frame[1][k]);
		figure_truth_fini(&zoom.truth[k]);
	}
	figure_model_fini(&zoom.model);
	return rc;
}
