#include "report.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/infile.h"
#include "base/maths.h"

#define MOST_BYTES (4 << 20)

/* Returns whether there are n finite numbers of this name: one alone, several in an array. */
static int take(double *v, int n, const cJSON *object, const char *name)
{
	const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);

	if (n > 1 && cJSON_GetArraySize(item) != n)
		return 0;
	for (int i = 0; i < n; i++) {
		const cJSON *number = n > 1 ? cJSON_GetArrayItem(item, i) : item;

		if (!cJSON_IsNumber(number) || !isfinite(number->valuedouble))
			return 0;
		v[i] = number->valuedouble;
	}
	return 1;
}

static int take_camera(struct psr_camera *camera, const cJSON *report)
{
	const cJSON *item = cJSON_GetObjectItemCaseSensitive(report, "camera");
	const char *kind = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, "kind"));
	int is_orthographic = kind != NULL && strcmp(kind, "orthographic") == 0;
	double extent;

	*camera = (struct psr_camera){ .kind = is_orthographic ? PSR_CAMERA_ORTHOGRAPHIC : PSR_CAMERA_PERSPECTIVE };
	if (!take(camera->eye, 3, item, "eye") || !take(camera->target, 3, item, "target") || !take(camera->up, 3, item, "up")
	    || !take(&camera->near_z, 1, item, "near") || !take(&extent, 1, item, is_orthographic ? "height" : "fov_deg"))
		return 0;
	if (is_orthographic)
		camera->ortho_height = extent;
	else
		camera->fov_y = extent * PSR_DEGREE;
	return 1;
}

/* The picture must have one instance, at its place in the source file; a report without instances is of such a
 * picture. */
static int is_plain(const cJSON *report)
{
	static const double rotation[4] = { 0, 0, 0, 1 }, translation[3] = { 0, 0, 0 };
	const cJSON *request = cJSON_GetObjectItemCaseSensitive(report, "request");
	const cJSON *instances = cJSON_GetObjectItemCaseSensitive(request, "instances"), *first;
	double q[4], t[3], scale;

	if (instances == NULL)
		return 1;
	first = cJSON_GetArrayItem(instances, 0);
	return cJSON_GetArraySize(instances) == 1 && take(q, 4, first, "rotation") && take(t, 3, first, "translation")
	       && take(&scale, 1, first, "scale") && memcmp(q, rotation, sizeof q) == 0
	       && memcmp(t, translation, sizeof t) == 0 && scale == 1;
}

int accuracy_report_read(struct accuracy_report *out, const char *path, struct psr_error *err)
{
	char *text = NULL;
	cJSON *report;
	double size[2] = { 0, 0 };
	int code = infile_read_text(&text, path, MOST_BYTES, err);

	if (code != PSR_OK)
		return code;
	report = cJSON_Parse(text);
	free(text);
	if (!take_camera(&out->camera, report) || !take(size, 2, report, "size")
	    || !take(&out->spacing, 1, cJSON_GetObjectItemCaseSensitive(report, "model"), "spacing")
	    || !take(&out->spacing_px, 1, report, "spacing_px") || !(size[0] >= 1 && size[0] <= 65536)
	    || !(size[1] >= 1 && size[1] <= 65536))
		code = psr_fail(err, PSR_ERR_FORMAT, "%s: is no report of psr shot --report: it lacks the camera, the size, or the "
		                "spacing of the model", path);
	else if (!is_plain(report))
		code = psr_fail(err, PSR_ERR_UNSUPPORTED, "%s: is of a picture of several models, or of one that was moved; accuracy "
		                "compares pictures of one model where its source has it", path);
	out->width = (uint32_t)size[0];
	out->height = (uint32_t)size[1];
	out->is_smooth = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(report, "smooth"));
	out->is_fine = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(report, "fine"));
	cJSON_Delete(report);
	return code;
}
