#include <stdio.h>
#include <string.h>
#include "import.h"

/* Returns the length of the longest start of a UTF-8 text that fits n bytes and ends between characters. */
static size_t cut(const char *text, size_t n)
{
	size_t length = strlen(text);

	if (length <= n)
		return length;
	while (n > 0 && ((unsigned char)text[n] & 0xc0) == 0x80)
		n--;
	return n;
}

/* Makes a name printable, without blanks at its ends, and short enough. */
static void tidy_name(char out[PSR_NAME_BYTES], const char *name)
{
	size_t n;

	while ((unsigned char)*name <= ' ' && *name != '\0')
		name++;
	n = cut(name, PSR_NAME_BYTES - 1);
	for (size_t i = 0; i < n; i++)
		out[i] = (unsigned char)name[i] < ' ' || name[i] == 0x7f ? ' ' : name[i];
	while (n > 0 && out[n - 1] == ' ')
		n--;
	out[n] = '\0';
}

static int is_taken(const char *names, size_t stride, uint32_t n, const char *name)
{
	for (uint32_t i = 0; i < n; i++)
		if (strcmp(names + i * stride, name) == 0)
			return 1;
	return 0;
}

/* `names`: the first of n names, `stride` bytes apart. */
static void choose_name(char out[PSR_NAME_BYTES], const char *wanted, const char *kind, const char *names,
                        size_t stride, uint32_t n)
{
	char base[PSR_NAME_BYTES], suffix[16];
	unsigned number = 1;

	tidy_name(base, wanted);
	if (base[0] == '\0') {
		snprintf(base, sizeof base, "%s", kind);
		snprintf(out, PSR_NAME_BYTES, "%s 1", kind);
	} else {
		snprintf(out, PSR_NAME_BYTES, "%s", base);
	}
	while (is_taken(names, stride, n, out)) {
		size_t room;

		snprintf(suffix, sizeof suffix, " %u", ++number);
		room = cut(base, PSR_NAME_BYTES - 1 - strlen(suffix));
		memcpy(out, base, room);
		strcpy(out + room, suffix);
	}
}

/* Appends a zero element of `size` bytes to *array, a pointer of any type. */
static int make_room(struct import_mesh *im, void *array, uint32_t n, size_t size, struct psr_error *err)
{
	if (!import_resize(array, (uint64_t)n + 1, size))
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a preset", im->path);
	memset(import_column_at(&(struct import_column){ array, size }, n), 0, size);
	return PSR_OK;
}

int import_mesh_add_camera(struct import_mesh *im, const char *name, const struct psr_camera *camera,
                           struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	const uint32_t n = mesh->n_cameras;
	int rc;

	if (n >= PSR_MAX_PRESETS) {
		import_mesh_warn(im, "cameras after the first %d were left out", PSR_MAX_PRESETS);
		return PSR_OK;
	}
	rc = make_room(im, &mesh->camera, n, sizeof *mesh->camera, err);
	if (rc != PSR_OK)
		return rc;
	choose_name(mesh->camera[n].name, name, "camera", mesh->camera[0].name, sizeof *mesh->camera, n);
	mesh->camera[n].camera = *camera;
	mesh->n_cameras++;
	return PSR_OK;
}

int import_mesh_add_light(struct import_mesh *im, const char *name, const struct psr_light *light,
                          struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	const uint32_t n = mesh->n_lights;
	int rc;

	if (n >= PSR_MAX_PRESETS) {
		import_mesh_warn(im, "lights after the first %d were left out", PSR_MAX_PRESETS);
		return PSR_OK;
	}
	rc = make_room(im, &mesh->light, n, sizeof *mesh->light, err);
	if (rc != PSR_OK)
		return rc;
	choose_name(mesh->light[n].name, name, "light", mesh->light[0].name, sizeof *mesh->light, n);
	mesh->light[n].light = *light;
	mesh->n_lights++;
	return PSR_OK;
}
