#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/cli.h"
#include "base/maths.h"
#include "camera.h"


static int parse_option(struct psr_msg_light *light, const char **at, struct psr_error *err)
{
	const char *text = *at;

	if (strncmp(text, "color=", 6) == 0)
		return psr_parse_color(text + 6, light->color, at, err);
	if (strncmp(text, "shadow", 6) == 0 && (text[6] == ',' || text[6] == '\0')) {
		light->flags |= PSR_WIRE_LIGHT_SHADOW;
		*at = text + 6;
		return PSR_OK;
	}
	if (strncmp(text, "intensity=", 10) == 0) {
		if (psr_parse_real(text + 10, &light->intensity, at, NULL) != PSR_OK || light->intensity < 0
		    || light->intensity > PSR_WIRE_MAX_INTENSITY)
			return psr_fail(err, PSR_ERR_ARG, "intensity is a number of 0 to %g, not '%.40s'", PSR_WIRE_MAX_INTENSITY,
			                text + 10);
		return PSR_OK;
	}
	if (strncmp(text, "ref=", 4) == 0) {
		if (light->kind == PSR_WIRE_LIGHT_DIRECTIONAL)
			return psr_fail(err, PSR_ERR_ARG, "a directional light has no distance: leave ref= out");
		if (psr_parse_real(text + 4, &light->reference, at, NULL) != PSR_OK
		    || !(light->reference >= 1 / PSR_WIRE_MAX_LENGTH && light->reference <= PSR_WIRE_MAX_LENGTH))
			return psr_fail(err, PSR_ERR_ARG, "ref is a distance above 0, not '%.40s'", text + 4);
		return PSR_OK;
	}
	return psr_fail(err, PSR_ERR_ARG, "unknown part '%.40s'; there are color=#rrggbb, intensity=I, shadow and ref=R",
	                text);
}

static int check_length(const double v[3], struct psr_error *err)
{
	for (int i = 0; i < 3; i++)
		if (fabs(v[i]) > PSR_WIRE_MAX_LENGTH)
			return psr_fail(err, PSR_ERR_ARG, "the coordinate %g is beyond 1e30", v[i]);
	return PSR_OK;
}

static int check_direction(const double v[3], const char *what, struct psr_error *err)
{
	if (!(hypot(hypot(v[0], v[1]), v[2]) >= 1 / PSR_WIRE_MAX_LENGTH))
		return psr_fail(err, PSR_ERR_ARG, "%s", what);
	return PSR_OK;
}

static int parse_spot(struct psr_msg_light *light, const char **at, struct psr_error *err)
{
	double target[3], angle;
	const char *text;
	int code;

	if (**at != ':')
		return psr_fail(err, PSR_ERR_ARG, "a spot is spot:X,Y,Z:TX,TY,TZ:ANGLE; the point it shines at is missing");
	code = psr_parse_vec3(*at + 1, target, at, err);
	if (code == PSR_OK)
		code = check_length(target, err);
	if (code != PSR_OK)
		return code;
	if (**at != ':')
		return psr_fail(err, PSR_ERR_ARG, "a spot is spot:X,Y,Z:TX,TY,TZ:ANGLE; the angle is missing");
	text = *at + 1;
	if (psr_parse_real(text, &angle, at, NULL) != PSR_OK || !(angle > 0 && angle <= 90))
		return psr_fail(err, PSR_ERR_ARG,
		                "the angle of a spot is half that of its cone, above 0 and at most 90 degrees, not "
		                "'%.40s'",
		                text);
	for (int i = 0; i < 3; i++)
		light->direction[i] = target[i] - light->position[i];
	light->outer = angle * PSR_DEGREE;
	light->inner = 0.9 * light->outer;
	return check_direction(light->direction, "a spot cannot shine at its own position", err);
}

int psr_light_parse(struct psr_msg_light *light, const char *text, struct psr_error *err)
{
	static const struct {
		const char *name;
		uint8_t kind;
	} kinds[] = { { "dir:", PSR_WIRE_LIGHT_DIRECTIONAL },
		          { "point:", PSR_WIRE_LIGHT_POINT },
		          { "spot:", PSR_WIRE_LIGHT_SPOT } };
	const char *at = text;
	double v[3];
	int code;

	memset(light, 0, sizeof *light);
	memset(light->color, 255, sizeof light->color);
	light->intensity = 1;
	for (size_t i = 0; i < sizeof kinds / sizeof kinds[0] && light->kind == 0; i++) {
		if (strncmp(text, kinds[i].name, strlen(kinds[i].name)) == 0) {
			light->kind = kinds[i].kind;
			at = text + strlen(kinds[i].name);
		}
	}
	if (light->kind == 0)
		return psr_fail(err, PSR_ERR_ARG,
		                "'%.80s' is no light; there are dir:X,Y,Z, point:X,Y,Z and spot:X,Y,Z:TX,TY,TZ:ANGLE", text);
	code = psr_parse_vec3(at, v, &at, err);
	if (code == PSR_OK)
		code = check_length(v, err);
	if (code != PSR_OK)
		return code;
	memcpy(light->kind == PSR_WIRE_LIGHT_DIRECTIONAL ? light->direction : light->position, v, sizeof v);
	if (light->kind == PSR_WIRE_LIGHT_DIRECTIONAL)
		code = check_direction(v, "the direction of a light cannot be 0,0,0", err);
	else if (light->kind == PSR_WIRE_LIGHT_SPOT)
		code = parse_spot(light, &at, err);
	while (code == PSR_OK && *at == ',') {
		at++;
		code = parse_option(light, &at, err);
	}
	if (code == PSR_OK && *at != '\0')
		code = psr_fail(err, PSR_ERR_ARG, "'%.40s' does not belong to a light", at);
	return code;
}

int psr_codec_parse(uint8_t *codec, uint8_t *quality, const char *text, struct psr_error *err)
{
	double q;

	*quality = 0;
	if (strcmp(text, "lossless") == 0) {
		*codec = PSR_CODEC_ZSTD;
	} else if (strcmp(text, "raw") == 0) {
		*codec = PSR_CODEC_RAW;
	} else if (strncmp(text, "jpeg:", 5) == 0 && psr_parse_real(text + 5, &q, NULL, NULL) == PSR_OK && q >= 1
	           && q <= 100 && q == floor(q)) {
		*codec = PSR_CODEC_JPEG;
		*quality = (uint8_t)q;
	} else {
		return psr_fail(err, PSR_ERR_ARG, "'%.40s' is no codec; there are jpeg:Q with Q of 1 to 100, lossless, and raw",
		                text);
	}
	return PSR_OK;
}
