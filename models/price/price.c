#include "price.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/outfile.h"
#include "psr/build.h"

#define RAYS 8           /* a side of a pixel, for the truth */
#define MOST_SECONDS 0.3 /* that a slow setting may take in a view; then it sits out later rounds */

void price_tell(const char *what, uint32_t done, uint32_t total)
{
	const int is_terminal = isatty(STDERR_FILENO);

	fprintf(stderr, "%spsr-model accuracy: %s, %u of %u%s", is_terminal ? "\r\033[K" : "", what, done, total,
	        is_terminal ? "" : "\n");
	if (is_terminal && done == total)
		putc('\n', stderr);
}

static int make_folder(const char *path, struct psr_error *err)
{
	struct stat st;

	if (mkdir(path, 0777) != 0 && (errno != EEXIST || stat(path, &st) != 0 || !S_ISDIR(st.st_mode)))
		return psr_fail(err, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "--out: the folder %.500s cannot be made: %s",
		                path, strerror(errno));
	return PSR_OK;
}

static int measure(struct price *price, const struct ladder_look *look, struct psr_error *err)
{
	const uint32_t n_views = price->options->n_views;
	int rc;

	price->view = calloc(n_views, sizeof *price->view);
	price->row = calloc((size_t)n_views * price->set.n, sizeof *price->row);
	if (price->view == NULL || price->row == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u views", n_views);
	rc = ladder_views_make(price->view, n_views, look, err);
	for (uint32_t v = 0; rc == PSR_OK && v < n_views; v++) {
		price_tell("rays through the source, view", v + 1, n_views);
		rc = ladder_view_trace(&price->view[v], look, RAYS, err);
	}
	for (uint32_t v = 0; rc == PSR_OK && v < n_views; v++) {
		price_tell("frames, view", v + 1, n_views);
		rc = ladder_measure(&price->row[(size_t)v * price->set.n], price->ladder, &price->view[v], price->set.rung,
		                    price->set.n, err);
	}
	return rc;
}

static int write_folder(struct price *price, struct psr_error *err)
{
	struct price_pictures pictures = { .n_rows = 0 };
	int rc = price_write_csv(price, err);

	if (rc == PSR_OK)
		rc = price_write_json(price, err);
	if (rc == PSR_OK)
		rc = price_write_plots(price, err);
	if (rc == PSR_OK)
		rc = price_pictures_make(&pictures, price, err);
	if (rc == PSR_OK)
		rc = price_write_strip(price, &pictures, err);
	if (rc == PSR_OK)
		rc = price_write_page(price, &pictures, err);
	price_pictures_fini(&pictures);
	return rc;
}

/* Settings that have to draw the usual picture and did not. */
static int check_exact(const struct price *price, struct psr_error *err)
{
	for (uint32_t i = 0; i < price->set.n; i++)
		if (price->set.setting[i].is_exact && !price->is_same[i])
			return psr_fail(err, PSR_ERR_INTERNAL, "the setting '%s' drew another picture than the usual one, which it must "
			                "not; please report this", price->set.setting[i].name);
	return PSR_OK;
}

static int run(struct price *price, const struct psr_mesh *mesh, struct ladder_look *look, struct psr_error *err)
{
	const struct price_options *options = price->options;
	const struct ladder_options ladder = { .n_threads = 1, .n_rounds = options->n_rounds, .most_seconds = MOST_SECONDS,
		                                   .seed = options->seed };
	struct psr_build_options build;
	int rc = price_set_make(&price->set, mesh, options, err);

	if (rc == PSR_OK)
		rc = ladder_create(&price->ladder, &ladder, err);
	if (rc != PSR_OK)
		return rc;
	psr_build_options_default(&build);
	look->info = psr_model_info(price->set.model[0]);
	look->width = options->size[0];
	look->height = options->size[1];
	look->seed = options->seed;
	look->n_threads = build.n_threads;
	rc = measure(price, look, err);
	if (rc != PSR_OK)
		return rc;
	price_judge(price);
	price_print(stdout, price);
	rc = outfile_flush_stdout(err);
	if (rc == PSR_OK && options->out != NULL)
		rc = write_folder(price, err);
	return rc == PSR_OK ? check_exact(price, err) : rc;
}

static const char *file_name(const char *path)
{
	const char *slash = strrchr(path, '/');

	return slash != NULL ? slash + 1 : path;
}

int price_run(const struct price_options *options, struct psr_error *err)
{
	struct price *price = calloc(1, sizeof *price);
	struct psr_mesh *mesh = NULL;
	struct ladder_look look = { .truth = NULL };
	int rc = price != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory to measure settings");

	if (rc == PSR_OK && options->out != NULL)
		rc = make_folder(options->out, err);
	if (rc == PSR_OK)
		rc = psr_mesh_import(&mesh, options->source, NULL, err);
	if (rc == PSR_OK)
		rc = psr_truth_create(&look.truth, mesh, err);
	if (rc == PSR_OK)
		rc = psr_source_create(&look.source, mesh, err);
	if (rc == PSR_OK) {
		price->options = options;
		price->title = file_name(options->source);
		rc = run(price, mesh, &look, err);
	}
	for (uint32_t v = 0; price != NULL && price->view != NULL && v < options->n_views; v++)
		ladder_view_fini(&price->view[v]);
	if (price != NULL) {
		ladder_destroy(price->ladder);
		price_set_fini(&price->set);
		free(price->view);
		free(price->row);
	}
	free(price);
	psr_source_destroy(look.source);
	psr_truth_destroy(look.truth);
	psr_mesh_destroy(mesh);
	return rc;
}
