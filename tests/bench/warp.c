/* How fast points are warped, by instructions and threads. */
#include <stdio.h>
#include "isolate.h"
#include "ours.h"
#include "parts.h"
#include "simd/isa.h"
#include "report.h"

#define SIDE 1024

struct job {
	struct scene_film film;
	enum psr_isa isa;
	int n_threads;
	struct ours_result result;
};

static void scene(struct psr_scene *out, int frame, const void *userdata)
{
	scene_film_frame(out, userdata, frame);
}

static void draw(void *arg)
{
	struct job *job = arg;
	const struct ours_settings settings = {
		.width = SIDE, .height = SIDE, .n_threads = job->n_threads, .least_ms = 150, .most_ms = 1000,
		.n_frames = SCENE_FRAMES, .scene = scene, .userdata = &job->film,
	};

	psr_isa_cap(job->isa);
	ours_measure(&job->result, &settings, NULL);
}

/* The clock while a core works, by a chain of additions that wait for each other: one a cycle. 0 where not known. */
static double gigahertz(void)
{
	double best = 0;

#ifdef __x86_64__
	for (int round = 0; round < 40; round++) {
		const long n = 2000000;
		long x = 0;
		double start = report_ms(), rate;

		for (long i = 0; i < n; i += 4)
			__asm__ volatile("add %1, %0\n\tadd %1, %0\n\tadd %1, %0\n\tadd %1, %0" : "+r"(x) : "r"(n));
		rate = (double)n / (report_ms() - start) / 1e6;
		best = rate > best ? rate : best;
	}
#endif
	return best;
}

static void add_json(const struct job *job, double rate)
{
	cJSON *item = report_add(report_array("warp"));

	report_text(item, "isa", psr_isa_name(job->isa));
	report_number(item, "x", job->n_threads);
	report_number(item, "ms", job->result.ms);
	report_number(item, "points", job->result.count[PSR_STAGE_WARP]);
	report_number(item, psr_isa_name(job->isa), rate); /* a line of the plot */
	for (int s = 0; s < PSR_N_STAGES; s++)
		report_number(item, psr_stage_name((enum psr_stage)s), job->result.stage_ms[s]);
}

static void print_row(const struct job *job, double one_ms, double rate, double ghz)
{
	const struct ours_result *r = &job->result;
	const double cull = r->stage_ms[PSR_STAGE_CULL], warp = r->stage_ms[PSR_STAGE_WARP];

	printf("%-7s %7d | %9.3f %8.2f | %8.0f %8.3f %8.2f | %8.3f %8.3f %8.3f\n", psr_isa_name(job->isa), job->n_threads,
	       r->ms, one_ms / r->ms, rate, report_ratio(1e3, rate), report_ratio(1e3, rate) * ghz * job->n_threads, cull,
	       warp, r->ms - cull - warp);
	fflush(stdout);
}

static void add_target(const struct job *job, double rate)
{
	if (job->isa == psr_isa_get() && job->n_threads == 1)
		report_target("warp on one thread, binning included", rate, "Mpt/s", REPORT_AT_LEAST, 900);
	if (job->isa == psr_isa_get() && job->n_threads == 2)
		report_target("warp on two threads, binning included", rate, "Mpt/s", REPORT_AT_LEAST, 1400);
}

static int more_threads(int n, int most)
{
	return n < most && 2 * n > most ? most : 2 * n;
}

void warp_run(const struct part *part, const struct subject *subject)
{
	static const struct scene_picture picture = { "", SIDE, SIDE, 0.5 };
	struct job *job = isolate_alloc(sizeof *job);
	struct psr_model *model = scene_model(part->psr_model, part->models, subject->file, subject->source,
	                                      subject->resolution[1]);
	const double ghz = gigahertz();
	double one_ms = 0;

	scene_film_init(&job->film, &picture, model, (const double[3]){ 0, 0, 0 });
	printf("\nWarp: %s at %d, %dx%d half covered; a core makes %.2f GHz. Rates include culling and binning.\n",
	       subject->name, subject->resolution[1], SIDE, SIDE, ghz);
	printf("%-7s %7s | %9s %8s | %8s %8s %8s | %8s %8s %8s\n", "isa", "threads", "frame", "speedup", "rate", "ns a",
	       "cycles", "cull", "warp", "rest");
	printf("%-7s %7s | %9s %8s | %8s %8s %8s | %8s %8s %8s\n", "", "", "ms", "", "Mpt/s", "point", "a point", "ms",
	       "ms", "ms");
	for (int isa = 0; isa <= (int)psr_isa_get(); isa++) {
		for (int n = 1; n <= part->n_threads; n = more_threads(n, part->n_threads)) {
			double rate;

			job->isa = (enum psr_isa)isa;
			job->n_threads = n;
			isolate_run(draw, job);
			one_ms = n == 1 ? job->result.ms : one_ms;
			rate = report_ratio(job->result.count[PSR_STAGE_WARP],
			                    job->result.stage_ms[PSR_STAGE_CULL] + job->result.stage_ms[PSR_STAGE_WARP]) / 1e3;
			add_json(job, rate);
			print_row(job, one_ms, rate, ghz);
			add_target(job, rate);
		}
	}
	psr_model_unref(model);
	isolate_free(job, sizeof *job);
}
