#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/outfile.h"
#include "models/shapes/generators.h"
#include "models/shapes/glb.h"
#include "psr/build.h"
#include "surface/validate.h"
#include "study.h"
#include "terrain.h"

#define N_TRIAL_VIEWS 200
#define N_TRIALS_A_VIEW 500

/* Through a file, as a user would. */
static int import_shape(struct psr_mesh **mesh, const struct shape *shape, const char *name, struct psr_error *err)
{
	const char *folder = getenv("TMPDIR");
	char place[256], path[300];
	uint8_t *bytes = NULL;
	size_t n_bytes = 0;
	int code = glb_encode(&bytes, &n_bytes, shape, name, err);

	snprintf(place, sizeof place, "%s/psr-study-XXXXXX", folder != NULL && folder[0] != '\0' ? folder : "/tmp");
	if (code == PSR_OK && mkdtemp(place) == NULL)
		code = psr_fail(err, PSR_ERR_IO, "%s: cannot make a folder there for %s.glb; set TMPDIR to one", place, name);
	else if (code == PSR_OK) {
		snprintf(path, sizeof path, "%s/%s.glb", place, name);
		code = outfile_save(path, OUTFILE_DURABLE, bytes, n_bytes, err);
		if (code == PSR_OK)
			code = psr_mesh_import(mesh, path, NULL, err);
		unlink(path);
		rmdir(place);
	}
	free(bytes);
	return code;
}

/* Makes everything that follows from the mesh, if `code` says that there is one. */
static int prepare(struct study_model *model, int code, struct psr_error *err)
{
	if (code == PSR_OK)
		code = validate_mesh(model->mesh, err);
	if (code == PSR_OK)
		code = validate_bound_mesh(model->mesh, model->origin, &model->scale, err);
	if (code == PSR_OK)
		code = ray_scene_create(&model->scene, model->mesh, model->origin, model->scale, err);
	if (code == PSR_OK)
		code = trials_create(&model->trials, model->mesh, model->scene, N_TRIAL_VIEWS, N_TRIALS_A_VIEW, err);
	if (code != PSR_OK)
		study_model_fini(model);
	return code;
}

int study_model_make(struct study_model *model, const char *name, void (*make)(struct shape *), struct psr_error *err)
{
	struct shape shape;
	int code;

	*model = (struct study_model){ .mesh = NULL };
	snprintf(model->name, sizeof model->name, "%s", name);
	shape_init(&shape);
	make(&shape);
	code = import_shape(&model->mesh, &shape, name, err);
	shape_fini(&shape);
	return prepare(model, code, err);
}

static int load(struct study_model *model, const char *name, struct psr_error *err)
{
	const char *slash = strrchr(name, '/');
	const struct generator *generator;

	if (strcmp(name, "terrain") == 0)
		return study_model_make(model, name, make_terrain, err);
	if (strpbrk(name, "./") == NULL) {
		generator = generator_find(name, err);
		return generator != NULL ? study_model_make(model, generator->name, generator->make, err) : err->code;
	}
	*model = (struct study_model){ .mesh = NULL };
	snprintf(model->name, sizeof model->name, "%s", slash != NULL ? slash + 1 : name);
	return prepare(model, psr_mesh_import(&model->mesh, name, NULL, err), err);
}

int study_model_load(struct study_model *model, const char *name, struct psr_error *err)
{
	const int is_scanned = strncmp(name, "scan:", 5) == 0;
	const int code = load(model, is_scanned ? name + 5 : name, err);

	if (code == PSR_OK && is_scanned) {
		memmove(model->name + 5, model->name, sizeof model->name - 5);
		memcpy(model->name, "scan:", 5);
		model->name[sizeof model->name - 1] = '\0';
		model->is_scanned = 1;
	}
	return code;
}

void study_model_fini(struct study_model *model)
{
	trials_destroy(model->trials);
	ray_scene_destroy(model->scene);
	psr_mesh_destroy(model->mesh);
	memset(model, 0, sizeof *model);
}

/* Only a generator's name tells what the model shows. */
static int kept_path(char path[1024], const struct study *study, const struct study_model *model)
{
	return study->keep != NULL && strpbrk(model->name, ".:") == NULL
	       && snprintf(path, 1024, "%s/%s-%u.psr", study->keep, model->name, study->resolution) < 1024;
}

int study_build(struct psr_model **out, double *seconds, const struct study *study, const struct study_model *model)
{
	struct psr_build_options options;
	struct psr_build_report report;
	char path[1024];
	int is_kept = kept_path(path, study, model), rc;

	if (is_kept && seconds == NULL && access(path, F_OK) == 0)
		return psr_model_read(out, path, study->err);
	psr_build_options_default(&options);
	options.resolution = study->resolution;
	options.n_threads = study->n_threads;
	rc = psr_model_build(out, model->mesh, &options, &report, study->err);
	if (rc == PSR_OK && seconds != NULL)
		*seconds = report.seconds_total;
	if (rc == PSR_OK && is_kept && (rc = psr_model_write(*out, path, study->err)) != PSR_OK)
		psr_model_unref(*out);
	return rc;
}
