/* A camera and a light: plain data, doubles, in the space of psr/scene.h. */
#ifndef PSR_VIEW_H
#define PSR_VIEW_H

#ifdef __cplusplus
extern "C" {
#endif

enum psr_camera_kind { PSR_CAMERA_PERSPECTIVE, PSR_CAMERA_ORTHOGRAPHIC };

struct psr_camera {
	double eye[3], target[3], up[3]; /* target != eye; up not parallel to target - eye; up need not have unit length */
	enum psr_camera_kind kind;
	double fov_y;        /* perspective: full vertical angle, radians, 1e-6..3.14159 */
	double ortho_height; /* orthographic: world units from the top edge of the picture to its bottom, > 0 */
	double near_z;       /* world units; nearer surfaces are not drawn; 0: chosen from the scene */
};

enum psr_light_kind { PSR_LIGHT_DIRECTIONAL, PSR_LIGHT_POINT, PSR_LIGHT_SPOT };

struct psr_light {
	enum psr_light_kind kind;
	int casts_shadow;    /* 1: surfaces stop the light; 0: it shines through. 0 in presets */
	double position[3];  /* point, spot; world */
	double direction[3]; /* directional, spot: where the light goes; any length but 0 */
	double color[3];     /* linear, intensity included, >= 0 */
	double inner, outer; /* spot: half angles from the axis, radians, 0 <= inner <= outer <= pi, outer > 0: full light
	                      * inside of inner, none outside of outer */
	double reference;    /* point, spot: distance at which the light has this intensity, which falls with the square
	                      * beyond; 0: it does not fall */
};

/* A camera or light of a source file, in the coordinates of its mesh or model. */
#define PSR_NAME_BYTES 64
struct psr_preset_camera {
	char name[PSR_NAME_BYTES]; /* UTF-8, never empty, no two alike */
	struct psr_camera camera;
};
struct psr_preset_light {
	char name[PSR_NAME_BYTES];
	struct psr_light light;
};
#define PSR_MAX_PRESETS 256 /* of each kind; importers leave out further ones with a warning */

#ifdef __cplusplus
}
#endif
#endif
