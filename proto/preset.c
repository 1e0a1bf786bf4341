#include <string.h>
#include "wire.h"

#define LEAST_BYTES 107 /* size of a preset with a name */

static void layout_presets(struct wire *w, void *p)
{
	struct psr_msg_presets *m = p;

	wire_u32(w, &m->handle);
}

static int check_presets(const void *p, struct psr_error *err)
{
	const struct psr_msg_presets *m = p;

	return check_integer("a model's handle", m->handle, 1, UINT32_MAX, err);
}

WIRE_ID(presets, PRESETS, check_presets)

static void layout_preset(struct wire *w, void *p)
{
	struct psr_msg_preset *m = p;

	if (!w->writing)
		memset(m, 0, sizeof *m);
	wire_u8(w, &m->kind);
	wire_reserved(w, 7);
	if (m->kind == PSR_WIRE_PRESET_LIGHT) {
		layout_light(w, &m->light);
		wire_reserved(w, 8);
	} else {
		layout_camera(w, &m->camera);
	}
	wire_string(w, m->name, sizeof m->name);
}

static int check_preset(const void *p, struct psr_error *err)
{
	const struct psr_msg_preset *m = p;

	if (check_integer("a preset's kind", m->kind, PSR_WIRE_PRESET_CAMERA, PSR_WIRE_PRESET_LIGHT, err)
	    || check_integer("a preset's flags", m->light.flags, 0, 0, err))
		return PSR_ERR_ARG;
	if (m->name[0] == '\0')
		return psr_fail(err, PSR_ERR_ARG, "the name of a preset is empty");
	return m->kind == PSR_WIRE_PRESET_CAMERA ? check_camera(&m->camera, err) : check_light(&m->light, err);
}

int psr_msg_preset_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_preset *msg, struct psr_error *err)
{
	return wire_encode(out, WIRE(PRESET, layout_preset, check_preset), id, 0, msg, err);
}

int psr_msg_preset_decode(struct psr_msg_preset *msg, const uint8_t *payload, size_t n, struct psr_error *err)
{
	if (n >= LEAST_BYTES && payload[0] > PSR_WIRE_PRESET_LIGHT) {
		memset(msg, 0, sizeof *msg);
		return PSR_OK;
	}
	return wire_decode(msg, WIRE(PRESET, layout_preset, check_preset), payload, n, err);
}

static void layout_presets_end(struct wire *w, void *p)
{
	struct psr_msg_presets_end *m = p;

	wire_u32(w, &m->n_cameras);
	wire_u32(w, &m->n_lights);
}

static int check_presets_end(const void *p, struct psr_error *err)
{
	const struct psr_msg_presets_end *m = p;

	return check_integer("the number of cameras", m->n_cameras, 0, PSR_WIRE_MAX_PRESETS, err)
	               || check_integer("the number of lights", m->n_lights, 0, PSR_WIRE_MAX_PRESETS, err)
	           ? PSR_ERR_ARG
	           : PSR_OK;
}

WIRE_ID(presets_end, PRESETS_END, check_presets_end)
