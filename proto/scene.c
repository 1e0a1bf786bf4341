#include <math.h>
#include "wire.h"

static void layout_instance(struct wire *w, struct psr_msg_instance *m)
{
	wire_u32(w, &m->handle);
	wire_u8(w, &m->representation);
	wire_u8(w, &m->color_by);
	wire_reserved(w, 2);
	wire_f64(w, m->rotation, 4);
	wire_f64(w, m->translation, 3);
	wire_f64(w, &m->scale, 1);
}

void layout_light(struct wire *w, struct psr_msg_light *m)
{
	wire_u8(w, &m->kind);
	wire_u8(w, &m->flags);
	wire_bytes(w, m->color, 3);
	wire_reserved(w, 3);
	wire_f64(w, &m->intensity, 1);
	wire_f64(w, m->position, 3);
	wire_f64(w, m->direction, 3);
	wire_f64(w, &m->inner, 1);
	wire_f64(w, &m->outer, 1);
	wire_f64(w, &m->reference, 1);
}

static void layout_scene(struct wire *w, void *p)
{
	struct psr_msg_scene *m = p;

	wire_u16(w, &m->slot);
	wire_u16(w, &m->flags);
	wire_u16(w, &m->n_instances);
	wire_u16(w, &m->n_lights);
	wire_f64(w, &m->ambient, 1);
	wire_bytes(w, m->background, 3);
	wire_reserved(w, 5);
	if (m->n_instances > PSR_WIRE_MAX_INSTANCES || m->n_lights > PSR_WIRE_MAX_LIGHTS) {
		wire_fail(w, PSR_ERR_LIMIT, "a scene holds at most 1024 instances and 32 lights");
		return;
	}
	for (unsigned i = 0; i < m->n_instances && w->code == PSR_OK; i++)
		layout_instance(w, &m->instance[i]);
	for (unsigned i = 0; i < m->n_lights && w->code == PSR_OK; i++)
		layout_light(w, &m->light[i]);
}

static int check_instance(const struct psr_msg_instance *m, struct psr_error *err)
{
	const double *q = m->rotation;
	double norm = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];

	if (check_integer("an instance's model handle", m->handle, 1, UINT32_MAX, err) ||
	    check_integer("an instance's representation", m->representation, 0, PSR_WIRE_REP_DPOINT, err) ||
	    check_integer("an instance's colours", m->color_by, 0, PSR_WIRE_COLOR_RETURN, err) ||
	    check_lengths("an instance's translation", m->translation, 3, err) ||
	    check_positive("an instance's scale", m->scale, err))
		return PSR_ERR_ARG;
	if (!(fabs(norm - 1) <= 1e-6))
		return psr_fail(err, PSR_ERR_ARG, "an instance's rotation (%g, %g, %g, %g) is not a unit quaternion", q[0],
		                q[1],
		                q[2], q[3]);
	return PSR_OK;
}

static int is_zero(const double v[3])
{
	return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

int check_light(const struct psr_msg_light *m, struct psr_error *err)
{
	const double *d = m->direction;

	if (check_integer("a light's kind", m->kind, PSR_WIRE_LIGHT_DIRECTIONAL, PSR_WIRE_LIGHT_SPOT, err) ||
	    check_integer("a light's flags", m->flags, 0, PSR_WIRE_LIGHT_SHADOW, err) ||
	    check_range("a light's intensity", m->intensity, 0, PSR_WIRE_MAX_INTENSITY, err) ||
	    check_lengths("a light's position", m->position, 3, err) || check_lengths("a light's direction", d, 3, err))
		return PSR_ERR_ARG;
	if (m->kind == PSR_WIRE_LIGHT_DIRECTIONAL) {
		if (check_zero("the position of a directional light", is_zero(m->position), err) ||
		    check_zero("the reference distance of a directional light", m->reference == 0, err))
			return PSR_ERR_ARG;
	} else if (m->reference != 0 && check_positive("a light's reference distance", m->reference, err)) {
		return PSR_ERR_ARG;
	}
	if (m->kind == PSR_WIRE_LIGHT_POINT)
		return check_zero("the direction of a point light", is_zero(d), err) ||
		       check_zero("the angles of a point light", m->inner == 0 && m->outer == 0, err) ? PSR_ERR_ARG : PSR_OK;
	if (!(sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) >= 1 / PSR_WIRE_MAX_LENGTH))
		return psr_fail(err, PSR_ERR_ARG, "a light's direction (%g, %g, %g) is too short", d[0], d[1], d[2]);
	if (m->kind == PSR_WIRE_LIGHT_DIRECTIONAL)
		return check_zero("the angles of a directional light", m->inner == 0 && m->outer == 0, err);
	if (check_range("a spot light's outer angle", m->outer, 1e-6, M_PI, err) ||
	    check_range("a spot light's inner angle", m->inner, 0, m->outer, err))
		return PSR_ERR_ARG;
	return PSR_OK;
}

static int check_scene(const void *p, struct psr_error *err)
{
	const struct psr_msg_scene *m = p;

	if (m->n_instances > PSR_WIRE_MAX_INSTANCES || m->n_lights > PSR_WIRE_MAX_LIGHTS)
		return psr_fail(err, PSR_ERR_LIMIT, "a scene holds at most %d instances and %d lights, this one %u and %u",
		                PSR_WIRE_MAX_INSTANCES, PSR_WIRE_MAX_LIGHTS, m->n_instances, m->n_lights);
	if (check_integer("a scene's slot", m->slot, 0, PSR_WIRE_MAX_SCENES - 1, err) ||
	    check_integer("a scene's flags", m->flags, 0, PSR_WIRE_SCENE_APPEND, err) ||
	    check_range("the ambient light", m->ambient, 0, PSR_WIRE_MAX_INTENSITY, err))
		return PSR_ERR_ARG;
	for (unsigned i = 0; i < m->n_instances; i++)
		if (check_instance(&m->instance[i], err) != PSR_OK)
			return PSR_ERR_ARG;
	for (unsigned i = 0; i < m->n_lights; i++)
		if (check_light(&m->light[i], err) != PSR_OK)
			return PSR_ERR_ARG;
	return PSR_OK;
}

WIRE_ID(scene, SCENE, check_scene)
