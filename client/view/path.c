#include "path.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/infile.h"
#include "base/json.h"
#include "base/outfile.h"
#include "psr/message.h"

#define MAX_BYTES (256u << 20)

int path_add(struct path *path, double seconds, const struct hand_pose *pose, struct psr_error *err)
{
	struct path_pose *grown = path->pose;
	const size_t n = path->n;

	if (n >= 2 && memcmp(&grown[n - 1].pose, pose, sizeof *pose) == 0
	    && memcmp(&grown[n - 2].pose, pose, sizeof *pose) == 0) {
		grown[n - 1].seconds = seconds;
		return PSR_OK;
	}
	if ((n & (n - 1)) == 0)
		grown = realloc(grown, (n == 0 ? 1 : 2 * n) * sizeof *grown);
	if (grown == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %zu poses", n + 1);
	path->pose = grown;
	grown[path->n++] = (struct path_pose){ seconds, *pose };
	return PSR_OK;
}

static double mean(double a, double b, double part)
{
	return a + part * (b - a);
}

void path_at(const struct path *path, double seconds, struct hand_pose *pose)
{
	size_t low = 0, high = path->n - 1;
	const struct path_pose *a, *b;
	double part;

	while (low < high) { /* the last pose that is not later */
		const size_t middle = low + (high - low + 1) / 2;

		if (path->pose[middle].seconds <= seconds)
			low = middle;
		else
			high = middle - 1;
	}
	a = &path->pose[low];
	b = low + 1 < path->n ? a + 1 : a;
	part = b->seconds > a->seconds ? fmin(fmax((seconds - a->seconds) / (b->seconds - a->seconds), 0), 1) : 0;
	*pose = a->pose;
	if (part == 0 || (a->pose.fov > 0) != (b->pose.fov > 0))
		return;
	for (int i = 0; i < 3; i++) {
		pose->eye[i] = mean(a->pose.eye[i], b->pose.eye[i], part);
		pose->target[i] = mean(a->pose.target[i], b->pose.target[i], part);
		pose->up[i] = mean(a->pose.up[i], b->pose.up[i], part);
	}
	pose->fov = mean(a->pose.fov, b->pose.fov, part);
	pose->ortho_height = mean(a->pose.ortho_height, b->pose.ortho_height, part);
}

double path_seconds(const struct path *path)
{
	return path->n > 0 ? path->pose[path->n - 1].seconds : 0;
}

void path_fini(struct path *path)
{
	free(path->pose);
	*path = (struct path){ NULL, 0 };
}

/* ---- the file ---- */

static int get_number(double *to, const cJSON *from, const char *name, double least, double most)
{
	const cJSON *item = cJSON_GetObjectItemCaseSensitive(from, name);

	if (!cJSON_IsNumber(item) || !(item->valuedouble >= least && item->valuedouble <= most))
		return 0;
	*to = item->valuedouble;
	return 1;
}

static int get_vector(double to[3], const cJSON *from, const char *name)
{
	const cJSON *array = cJSON_GetObjectItemCaseSensitive(from, name);

	for (int i = 0; i < 3; i++) {
		const cJSON *item = cJSON_GetArrayItem(array, i);

		if (!cJSON_IsNumber(item) || !(fabs(item->valuedouble) <= PSR_WIRE_MAX_LENGTH))
			return 0;
		to[i] = item->valuedouble;
	}
	return cJSON_GetArraySize(array) == 3;
}

/* The member that is missing or wrong; NULL: none is. */
static const char *get_pose(struct path_pose *to, const cJSON *from, double least_seconds)
{
	const int is_ortho = cJSON_HasObjectItem(from, "ortho");

	memset(to, 0, sizeof *to);
	if (!get_number(&to->seconds, from, "seconds", least_seconds, 1e6))
		return "seconds";
	if (!get_vector(to->pose.eye, from, "eye"))
		return "eye";
	if (!get_vector(to->pose.target, from, "target"))
		return "target";
	if (!get_vector(to->pose.up, from, "up"))
		return "up";
	if (is_ortho && !get_number(&to->pose.ortho_height, from, "ortho", 1 / PSR_WIRE_MAX_LENGTH, PSR_WIRE_MAX_LENGTH))
		return "ortho";
	return is_ortho || get_number(&to->pose.fov, from, "fov", 0.001, 179.9) ? NULL : "fov";
}

static int read_poses(struct path *path, const cJSON *poses, const char *file, struct psr_error *err)
{
	const cJSON *item;
	int code = PSR_OK;

	cJSON_ArrayForEach(item, poses) {
		struct path_pose next;
		const char *wrong = get_pose(&next, item, path_seconds(path));

		if (wrong != NULL)
			return psr_fail(err, PSR_ERR_FORMAT, "%.300s: pose %zu has no usable \"%s\"", file, path->n + 1, wrong);
		code = path_add(path, next.seconds, &next.pose, err);
		if (code != PSR_OK)
			return code;
	}
	return path->n > 0 ? PSR_OK
	                   : psr_fail(err, PSR_ERR_FORMAT, "%.300s has no \"poses\": it is no path that --record wrote", file);
}

int path_read(struct path *path, const char *file, struct psr_error *err)
{
	struct psr_error why;
	char *text = NULL;
	int code = infile_read_text(&text, file, MAX_BYTES, &why);
	cJSON *json;

	*path = (struct path){ NULL, 0 };
	if (code != PSR_OK)
		return psr_fail(err, code, "cannot read %s", why.text);
	json = cJSON_Parse(text);
	code = json == NULL ? psr_fail(err, PSR_ERR_FORMAT, "%.300s is no JSON, so no path that --record wrote", file)
	                    : read_poses(path, cJSON_GetObjectItemCaseSensitive(json, "poses"), file, err);
	cJSON_Delete(json);
	free(text);
	if (code != PSR_OK)
		path_fini(path);
	return code;
}

int path_write(const struct path *path, const char *file, struct psr_error *err)
{
	cJSON *json = cJSON_CreateObject(), *poses = cJSON_AddArrayToObject(json, "poses");
	char *text;
	int code;

	for (size_t i = 0; i < path->n; i++) {
		const struct hand_pose *pose = &path->pose[i].pose;
		cJSON *one = cJSON_CreateObject();

		json_add_number(one, "seconds", path->pose[i].seconds);
		json_add_numbers(one, "eye", pose->eye, 3);
		json_add_numbers(one, "target", pose->target, 3);
		json_add_numbers(one, "up", pose->up, 3);
		json_add_number(one, pose->fov > 0 ? "fov" : "ortho", pose->fov > 0 ? pose->fov : pose->ortho_height);
		cJSON_AddItemToArray(poses, one);
	}
	text = json_text(json);
	if (text == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a path of %zu poses", path->n);
	code = outfile_save(file, OUTFILE_PLAIN, text, strlen(text), err);
	free(text);
	return code;
}
