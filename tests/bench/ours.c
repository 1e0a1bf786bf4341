#include "ours.h"

#include <stdlib.h>
#include <string.h>
#include "base/stats.h"
#include "psr/build.h"
#include "proto/proto.h"
#include "report.h"
#include "render/stages.h"
#include "server/frames/codec.h"

#define MAX_FRAMES 512
#define N_WARM 3
#define LEAST_FRAMES 3

struct bench {
	struct psr_pool *pool;
	struct psr_renderer *renderer;
	struct codec *codec;
	struct psr_frame frame;
	struct render_settings settings;
};

int ours_threads(void)
{
	struct psr_build_options options;

	psr_build_options_default(&options);
	return options.n_threads;
}

static void bench_init(struct bench *bench, uint32_t width, uint32_t height, int n_threads)
{
	memset(bench, 0, sizeof *bench);
	if (psr_pool_create(&bench->pool, n_threads, NULL) != PSR_OK || psr_renderer_create(&bench->renderer, NULL) != PSR_OK
	    || codec_create(&bench->codec) != PSR_OK)
		report_die("psr", "cannot be started");
	render_settings_default(&bench->settings, width, height);
	bench->frame = (struct psr_frame){ .width = width, .height = height,
		                               .rgb = report_alloc((size_t)width * height, 3) };
}

static void bench_fini(struct bench *bench)
{
	free(bench->frame.rgb);
	codec_destroy(bench->codec);
	psr_renderer_destroy(bench->renderer);
	psr_pool_destroy(bench->pool);
}

static void draw(struct bench *bench, const struct psr_scene *scene)
{
	struct psr_error err;

	if (renderer_draw(bench->renderer, scene, &bench->settings, bench->pool, &bench->frame, &err) != PSR_OK)
		report_die("psr_render", err.text);
}

static void drop(struct outq_chunk *first, void *userdata)
{
	(void)userdata;
	outq_chunks_destroy(first);
}

static double encode(struct bench *bench)
{
	const struct psr_msg_frame request = {
		.width = bench->frame.width, .height = bench->frame.height, .planes = 1u << PSR_PLANE_COLOR,
		.color_codec = PSR_CODEC_JPEG, .color_quality = OURS_QUALITY,
	};
	static const uint8_t background[3];
	const struct codec_answer answer = { .id = 1, .request = &request, .scale = 1, .background = background,
		                                 .emit = drop };
	struct codec_result result;
	struct psr_error err;

	if (codec_encode(&result, bench->codec, bench->pool, &answer, &bench->frame, &err) != PSR_OK)
		report_die("codec", err.text);
	return (double)result.rect_bytes;
}

struct series {
	double ms[MAX_FRAMES], ms_encoded[MAX_FRAMES], stage_ms[PSR_N_STAGES][MAX_FRAMES];
};

static void add(struct ours_result *out, struct series *series, const struct psr_report *report)
{
	for (int s = 0; s < PSR_N_STAGES; s++) {
		series->stage_ms[s][out->n_frames] = (double)report->ns[s] * 1e-6;
		out->count[s] += (double)report->count[s];
	}
	out->n_samples += (double)report->n_samples;
	out->n_samples_drawn += (double)report->n_samples_drawn;
	out->n_blocks_drawn += (double)report->n_blocks_drawn;
	out->n_covered += (double)report->n_covered;
	out->n_filled += (double)report->n_filled;
	out->n_frames++;
}

static void summarize(struct ours_result *out, struct series *series)
{
	const double n = out->n_frames;
	double *sum[] = { &out->n_samples, &out->n_samples_drawn, &out->n_blocks_drawn, &out->n_covered, &out->n_filled,
		              &out->encoded_bytes };

	for (size_t i = 0; i < sizeof sum / sizeof sum[0]; i++)
		*sum[i] /= n;
	out->ms = stats_median(series->ms, (size_t)out->n_frames);
	out->ms_encoded = stats_median(series->ms_encoded, (size_t)out->n_frames);
	for (int s = 0; s < PSR_N_STAGES; s++) {
		out->count[s] /= n;
		out->stage_ms[s] = stats_median(series->stage_ms[s], (size_t)out->n_frames);
	}
}

static int is_over(double ms, double since)
{
	return report_ms() - since >= ms;
}

static void draw_frame(struct bench *bench, const struct ours_settings *settings, int frame)
{
	struct psr_scene scene;

	settings->scene(&scene, frame, settings->userdata);
	draw(bench, &scene);
}

static void time_frame(struct ours_result *out, struct series *series, struct bench *bench,
                       const struct ours_settings *settings, int frame)
{
	const double before = report_ms();

	draw_frame(bench, settings, frame);
	series->ms[out->n_frames] = report_ms() - before;
	if (settings->is_encoded) {
		out->encoded_bytes += encode(bench);
		series->ms_encoded[out->n_frames] = report_ms() - before;
	}
	add(out, series, &bench->frame.report);
}

void ours_measure(struct ours_result *out, const struct ours_settings *settings, uint8_t *rgb)
{
	struct series *series = report_alloc(1, sizeof *series);
	struct bench bench;
	double start;

	memset(out, 0, sizeof *out);
	bench_init(&bench, settings->width, settings->height, settings->n_threads);
	start = report_ms();
	for (int i = N_WARM; i-- > 0;) {
		if (i == 0 || !is_over(settings->most_ms / N_WARM, start))
			draw_frame(&bench, settings, i);
	}
	if (rgb != NULL)
		memcpy(rgb, bench.frame.rgb, (size_t)3 * settings->width * settings->height);
	start = report_ms();
	do {
		for (int i = 0; i < settings->n_frames && out->n_frames < MAX_FRAMES; i++) {
			if (out->n_frames >= LEAST_FRAMES && is_over(settings->most_ms, start))
				break;
			time_frame(out, series, &bench, settings, i);
		}
	} while (out->n_frames < MAX_FRAMES && !is_over(settings->least_ms, start));
	out->renderer_bytes = psr_renderer_bytes(bench.renderer);
	summarize(out, series);
	bench_fini(&bench);
	free(series);
}

double ours_coverage(const struct scene_film *film, uint32_t reduce)
{
	static const int frame[] = { 0, SCENE_FRAMES / 4, SCENE_FRAMES * 3 / 4 };
	const uint32_t width = film->picture.width / reduce, height = film->picture.height / reduce;
	struct bench bench;
	double covered = 0;

	bench_init(&bench, width, height, ours_threads());
	for (int i = 0; i < 3; i++) {
		struct psr_scene scene;

		scene_film_frame(&scene, film, frame[i]);
		draw(&bench, &scene);
		covered += (double)(bench.frame.report.n_covered + bench.frame.report.n_filled) / 3;
	}
	bench_fini(&bench);
	return covered / ((double)width * height);
}
