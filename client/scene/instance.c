#include "instance.h"
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "base/vec.h"
#include "base/cli.h"

#define FORM "NAME[,at=X,Y,Z][,rotate=AXIS:DEG][,scale=S][,as=blocks|octree|dpoints]"

/* Rotation a, then b: the quaternion b a. */
static void compose(double out[4], const double a[4], const double b[4])
{
	double v[3], cross[3], w = b[3] * a[3] - v3d_dot(b, a), length;

	v3d_cross(cross, b, a);
	for (int i = 0; i < 3; i++)
		v[i] = b[3] * a[i] + a[3] * b[i] + cross[i];
	length = sqrt(v3d_dot(v, v) + w * w);
	v3d_scale(out, v, 1 / length);
	out[3] = w / length;
}

static int parse_rotation(struct psr_msg_instance *place, const char *text, const char **end, struct psr_error *err)
{
	double axis[3] = { 0, 0, 0 }, degrees, turn[4];
	const char *at = text;

	if (text[0] != '\0' && strchr("xyzXYZ", text[0]) != NULL) {
		axis[(text[0] | 32) - 'x'] = 1;
		at++;
	} else if (psr_parse_vec3(text, axis, &at, NULL) != PSR_OK) {
		return psr_fail(err, PSR_ERR_ARG, "rotate is AXIS:DEG, such as rotate=Y:90 or rotate=1,1,0:45, not '%.40s'",
		                text);
	}
	if (*at != ':' || psr_parse_real(at + 1, &degrees, end, NULL) != PSR_OK)
		return psr_fail(err, PSR_ERR_ARG, "rotate=%.40s: behind the axis come a colon and degrees, such as rotate=Y:90",
		                text);
	if (!(v3d_normalize(axis, axis) > 0))
		return psr_fail(err, PSR_ERR_ARG, "rotate=%.40s: the axis 0,0,0 has no direction", text);
	degrees = fmod(degrees, 720);
	v3d_scale(turn, axis, sin(degrees / 2 * PSR_DEGREE));
	turn[3] = cos(degrees / 2 * PSR_DEGREE);
	compose(place->rotation, place->rotation, turn);
	return PSR_OK;
}

const char *const instance_representations[4] = { "", "blocks", "octree", "dpoints" };

static int parse_representation(struct psr_msg_instance *place, const char *text, const char **end,
                                struct psr_error *err)
{
	const size_t n = strcspn(text, ",");

	*end = text + n;
	for (uint8_t r = PSR_WIRE_REP_BLOCKS; r <= PSR_WIRE_REP_DPOINT; r++) {
		if (strlen(instance_representations[r]) != n || memcmp(text, instance_representations[r], n) != 0)
			continue;
		place->representation = r;
		return PSR_OK;
	}
	return psr_fail(err, PSR_ERR_ARG, "as is blocks, octree or dpoints, not '%.40s'; without it the server chooses",
	                text);
}

static int parse_part(struct psr_msg_instance *place, const char *text, const char **end, struct psr_error *err)
{
	if (strncmp(text, "rotate=", 7) == 0)
		return parse_rotation(place, text + 7, end, err);
	if (strncmp(text, "at=", 3) == 0) {
		if (psr_parse_vec3(text + 3, place->translation, end, err) != PSR_OK)
			return PSR_ERR_ARG;
		for (int i = 0; i < 3; i++)
			if (fabs(place->translation[i]) > PSR_WIRE_MAX_LENGTH)
				return psr_fail(err, PSR_ERR_ARG, "at: the coordinate %g is beyond 1e30", place->translation[i]);
		return PSR_OK;
	}
	if (strncmp(text, "scale=", 6) == 0) {
		if (psr_parse_real(text + 6, &place->scale, end, NULL) != PSR_OK
		    || !(place->scale >= 1 / PSR_WIRE_MAX_LENGTH && place->scale <= PSR_WIRE_MAX_LENGTH))
			return psr_fail(err, PSR_ERR_ARG, "scale is a number above 0, not '%.40s'", text + 6);
		return PSR_OK;
	}
	if (strncmp(text, "as=", 3) == 0)
		return parse_representation(place, text + 3, end, err);
	return psr_fail(err, PSR_ERR_ARG, "unknown part '%.40s'; an instance is " FORM, text);
}

/* Names may have commas: the first `,word=` ends the name. */
static size_t name_length(const char *text)
{
	const char *at = text;

	while ((at = strchr(at, ',')) != NULL) {
		size_t word = strspn(++at, "abcdefghijklmnopqrstuvwxyz");

		if (word > 0 && at[word] == '=')
			return (size_t)(at - 1 - text);
	}
	return strlen(text);
}

int instance_parse(struct instance_wish *wish, const char *text, struct psr_error *err)
{
	size_t length = name_length(text);
	const char *at = text + length;

	if (length == 0 || length > PSR_WIRE_MAX_NAME)
		return psr_fail(err, PSR_ERR_ARG, "a model's name has 1 to %d bytes; an instance is " FORM, PSR_WIRE_MAX_NAME);
	memset(wish, 0, sizeof *wish);
	memcpy(wish->model, text, length);
	wish->place.rotation[3] = wish->place.scale = 1;
	while (*at == ',') {
		int code = parse_part(&wish->place, at + 1, &at, err);

		if (code != PSR_OK)
			return code;
	}
	return *at == '\0' ? PSR_OK
	                   : psr_fail(err, PSR_ERR_ARG, "'%.40s' does not belong to an instance, which is " FORM, at);
}

void instance_rotate(double out[3], const struct psr_msg_instance *place, const double v[3])
{
	const double *q = place->rotation;
	double once[3], twice[3];

	v3d_cross(once, q, v);
	v3d_cross(twice, q, once);
	for (int i = 0; i < 3; i++)
		out[i] = v[i] + 2 * (q[3] * once[i] + twice[i]);
}

void instance_apply(double out[3], const struct psr_msg_instance *place, const double point[3])
{
	double turned[3];

	instance_rotate(turned, place, point);
	v3d_add_scaled(out, place->translation, place->scale, turned);
}

void instance_add_box(double low[3], double high[3], const struct psr_msg_instance *place, const double box_min[3],
                      const double box_max[3])
{
	for (int corner = 0; corner < 8; corner++) {
		double p[3];

		for (int i = 0; i < 3; i++)
			p[i] = corner >> i & 1 ? box_max[i] : box_min[i];
		instance_apply(p, place, p);
		for (int i = 0; i < 3; i++) {
			low[i] = fmin(low[i], p[i]);
			high[i] = fmax(high[i], p[i]);
		}
	}
}
