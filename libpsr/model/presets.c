#include <inttypes.h>
#include "base/view.h"
#include "file.h"

/* Unused fields are zero in files, so that rules cover every byte. */
static void put_name(char to[PSR_NAME_BYTES], const char from[PSR_NAME_BYTES])
{
	/* Copies a name without an end unchanged; the validator refuses it. */
	size_t length = strnlen(from, PSR_NAME_BYTES);
	memcpy(to, from, length);
	memset(to + length, 0, PSR_NAME_BYTES - length);
}

void preset_put_cameras(struct psr_preset_camera *to, const struct psr_preset_camera *from, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++) {
		const struct psr_camera *c = &from[i].camera;
		struct psr_camera *k = &to[i].camera;

		memset(&to[i], 0, sizeof to[i]);
		put_name(to[i].name, from[i].name);
		memcpy(k->eye, c->eye, sizeof k->eye);
		memcpy(k->target, c->target, sizeof k->target);
		memcpy(k->up, c->up, sizeof k->up);
		k->kind = c->kind;
		k->fov_y = c->kind == PSR_CAMERA_PERSPECTIVE ? c->fov_y : 0;
		k->ortho_height = c->kind == PSR_CAMERA_ORTHOGRAPHIC ? c->ortho_height : 0;
		k->near_z = c->near_z;
	}
}

void preset_put_lights(struct psr_preset_light *to, const struct psr_preset_light *from, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++) {
		const struct psr_light *l = &from[i].light;
		struct psr_light *k = &to[i].light;
		int is_placed = l->kind != PSR_LIGHT_DIRECTIONAL, is_spot = l->kind == PSR_LIGHT_SPOT;

		memset(&to[i], 0, sizeof to[i]);
		put_name(to[i].name, from[i].name);
		k->kind = l->kind;
		memcpy(k->color, l->color, sizeof k->color);
		if (is_placed)
			memcpy(k->position, l->position, sizeof k->position);
		if (l->kind != PSR_LIGHT_POINT)
			memcpy(k->direction, l->direction, sizeof k->direction);
		k->inner = is_spot ? l->inner : 0;
		k->outer = is_spot ? l->outer : 0;
		k->reference = is_placed ? l->reference : 0;
	}
}

/* The length of the UTF-8 character at s; 0 for other bytes and for control characters (C0, DEL, C1). */
static size_t character_bytes(const uint8_t *s, size_t n)
{
	static const uint32_t least[5] = { 0, 0, 0x80, 0x800, 0x10000 };
	size_t length = s[0] < 0x80 ? 1 : s[0] >> 5 == 6 ? 2 : s[0] >> 4 == 14 ? 3 : s[0] >> 3 == 30 ? 4 : 0;
	uint32_t code = length == 1 ? s[0] : s[0] & (0x7fu >> length);

	if (length == 0 || length > n)
		return 0;
	for (size_t i = 1; i < length; i++) {
		if (s[i] >> 6 != 2)
			return 0;
		code = code << 6 | (s[i] & 0x3f);
	}
	if (code < 0x20 || (code >= 0x7f && code < 0xa0) || code < least[length] || (code >= 0xd800 && code < 0xe000)
	    || code > 0x10ffff)
		return 0;
	return length;
}

static int check_name(const char name[PSR_NAME_BYTES], const char *what, uint32_t number, struct psr_error *err)
{
	size_t length = strnlen(name, PSR_NAME_BYTES);

	if (length == 0 || length == PSR_NAME_BYTES)
		return psr_fail(err, PSR_ERR_FORMAT, "the name of %s %" PRIu32 " %s", what, number,
		                length == 0 ? "is empty" : "has no end");
	for (size_t i = 0, n; i < length; i += n) {
		n = character_bytes((const uint8_t *)name + i, length - i);
		if (n == 0)
			return psr_fail(err, PSR_ERR_FORMAT, "byte %zu of the name of %s %" PRIu32 " is not UTF-8, or a control "
			                "character", i, what, number);
	}
	return PSR_OK;
}

/* Names are `stride` bytes apart. */
static int check_unlike(const char *first, size_t stride, uint32_t n, const char *what, struct psr_error *err)
{
	for (uint32_t i = 1; i < n; i++)
		for (uint32_t k = 0; k < i; k++)
			if (memcmp(first + stride * i, first + stride * k, PSR_NAME_BYTES) == 0)
				return psr_fail(err, PSR_ERR_FORMAT, "%ss %" PRIu32 " and %" PRIu32 " have the same name", what, k, i);
	return PSR_OK;
}

static int check_cameras(const struct psr_presets *p, struct psr_error *err)
{
	for (uint32_t i = 0; i < p->n_cameras; i++) {
		struct psr_preset_camera clean;
		struct psr_error what = { 0 };
		int code = check_name(p->camera[i].name, "camera", i, err);

		if (code != PSR_OK)
			return code;
		if (view_check_camera(&p->camera[i].camera, &what) != PSR_OK)
			return psr_fail(err, PSR_ERR_FORMAT, "camera %" PRIu32 ": %s", i, what.text);
		preset_put_cameras(&clean, &p->camera[i], 1);
		if (memcmp(&clean, &p->camera[i], sizeof clean) != 0)
			return psr_fail(err, PSR_ERR_FORMAT, "camera %" PRIu32 ": unused bytes are not zero", i);
	}
	return check_unlike((const char *)p->camera, sizeof *p->camera, p->n_cameras, "camera", err);
}

static int check_lights(const struct psr_presets *p, struct psr_error *err)
{
	for (uint32_t i = 0; i < p->n_lights; i++) {
		struct psr_preset_light clean;
		struct psr_error what = { 0 };
		int code = check_name(p->light[i].name, "light", i, err);

		if (code != PSR_OK)
			return code;
		if (view_check_light(&p->light[i].light, &what) != PSR_OK)
			return psr_fail(err, PSR_ERR_FORMAT, "light %" PRIu32 ": %s", i, what.text);
		preset_put_lights(&clean, &p->light[i], 1);
		if (memcmp(&clean, &p->light[i], sizeof clean) != 0)
			return psr_fail(err, PSR_ERR_FORMAT, "light %" PRIu32 ": unused bytes are not zero", i);
	}
	return check_unlike((const char *)p->light, sizeof *p->light, p->n_lights, "light", err);
}

int presets_validate(const struct psr_presets *presets, const char **section, struct psr_error *err)
{
	int code;

	*section = "CAMS";
	code = check_cameras(presets, err);
	if (code != PSR_OK)
		return code;
	*section = "LGTS";
	return check_lights(presets, err);
}
