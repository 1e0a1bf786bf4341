#include "figures.h"

#include <string.h>
#include "models/commands.h"
#include "psr/build.h"
#include "base/cli.h"

#define PROGRAM "psr-model figures"

static const struct figure_kind {
	const char *name, *figure, *what;
	int (*run)(struct figures *figures);
} kinds[] = {
	{ "gaps", "figure 4.9", "methods of finding gaps", figure_run_gaps },
	{ "fill", "figure 4.11", "gaps before and after they are filled", figure_run_fill },
	{ "threshold", "figure 7.2", "the depth threshold", figure_run_threshold },
	{ "highlights", "figure 7.3", "specular highlights", figure_run_highlights },
	{ "shadows", "figure 7.4", "two directional lights and a spot", figure_run_shadows },
	{ "backs", "figure 7.6", "samples that face away", figure_run_backs },
	{ "set", "figure 8.1", "the fourteen models", figure_run_set },
	{ "edges", "figure 9.1", "rough edges and passes over sub-pixels", figure_run_edges },
	{ "interfaces", "figure 9.3", "interfaces between levels of the depth buffer", figure_run_interfaces },
	{ "thin", "figure 9.4", "thin structures", figure_run_thin },
	{ "stills", "section 9.1.1", "stills: resolution of the model, and passes", figure_run_stills },
	{ "zoom", "section 9.1", "a zoom: error and popping, frame by frame", figure_run_zoom },
};
#define N_KINDS (sizeof kinds / sizeof *kinds)

static const char *name_of(int i)
{
	return kinds[i].name;
}

static const struct figure_kind *find_kind(const char *name, struct psr_error *err)
{
	int i = study_find_name("figure", name, (int)N_KINDS, name_of, err);

	return i < 0 ? NULL : &kinds[i];
}

static int run_figure(struct figures *figures, const struct figure_kind *kind)
{
	int rc = psr_pool_create(&figures->study.pool, figures->study.n_threads, NULL);

	if (rc != PSR_OK)
		return psr_fail(figures->err, rc, "%d threads cannot be started", figures->study.n_threads);
	if (psr_renderer_create(&figures->renderer, NULL) != PSR_OK)
		rc = psr_fail(figures->err, PSR_ERR_MEMORY, "no memory for a renderer");
	if (rc == PSR_OK) {
		printf("%s ([G] %s)\n\n", kind->what, kind->figure);
		rc = kind->run(figures);
	}
	psr_renderer_destroy(figures->renderer);
	psr_pool_destroy(figures->study.pool);
	return rc;
}

static void print_list(void)
{
	for (size_t i = 0; i < N_KINDS; i++)
		printf("%-12s  [G] %-13s  %s\n", kinds[i].name, kinds[i].figure, kinds[i].what);
}

int cmd_figures(int argc, char **argv)
{
	struct psr_build_options defaults;
	struct psr_error err;
	struct figures figures = { .err = &err, .study.err = &err, .out = "." };
	const struct figure_kind *kind = NULL;
	int list = 0, n_operands, code;
	int64_t n_threads;
	const struct psr_opt opts[] = {
		{ .name = "list", .type = PSR_OPT_FLAG, .value = &list, .help = "Prints the names of the figures, and what each shows." },
		{ .name = "out", .type = PSR_OPT_STRING, .value = &figures.out, .arg = "DIR",
		  .help = "The folder that the pictures are written to." },
		{ .name = "keep", .type = PSR_OPT_STRING, .value = &figures.study.keep, .arg = "DIR",
		  .help = "A folder that keeps models that were built, so that another run need not build them." },
		{ .name = "threads", .type = PSR_OPT_INT, .value = &n_threads, .arg = "N",
		  .help = "Processor cores to use; the pictures are the same.", .min = 1, .max = 256 },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr-model figures NAME [options] | psr-model figures --list",
		.summary = "Draws a counterpart of a figure of Grossman's thesis, and prints how far its parts are from the\n"
		           "ray-traced truth.",
		.opts = opts,
		.footer = "Example: psr-model figures gaps --out docs/figures",
	};

	psr_build_options_default(&defaults);
	n_threads = defaults.n_threads;
	code = psr_cli_parse(&cli, argc, argv, &n_operands, &err);
	if (code > 0)
		return 0;
	if (code == PSR_OK && list) {
		print_list();
		return 0;
	}
	if (code == PSR_OK && n_operands != 1)
		code = psr_fail(&err, PSR_ERR_ARG, "one NAME is needed; psr-model figures --list prints them");
	if (code == PSR_OK && (kind = find_kind(argv[1], &err)) == NULL)
		code = err.code;
	if (code == PSR_OK) {
		figures.study.n_threads = (int)n_threads;
		code = run_figure(&figures, kind);
	}
	if (code == PSR_OK && fflush(stdout) != 0)
		code = psr_fail(&err, PSR_ERR_IO, "standard output cannot be written");
	return code == PSR_OK ? 0 : psr_cli_fail(PROGRAM, &err);
}
