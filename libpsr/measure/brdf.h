/* How surfaces of the source reflect light: glTF 2.0's model (section 3.9.2 and appendix B.2: a mix of a metal and of a
 * diffuse surface under a dielectric layer; the code of B.3 dims that surface by the metal's Fresnel term too, which
 * Khronos calls a mistake, KhronosGroup/glTF#2386), with the masking of microfacets
 * correlated by height (Heitz 2014), and the highlight of OBJ's materials (illum 2). */
#ifndef PSR_MEASURE_BRDF_H
#define PSR_MEASURE_BRDF_H

#include "psr/error.h"

struct brdf {
	double diffuse[3]; /* albedo under the specular layer */
	double f0[3];      /* reflectance at 0 degrees; that at 90 is 1 */
	double layer[3];   /* the same, of the layer over the diffuse surface alone */
	double alpha;      /* of GGX: the square of the roughness */
	int is_phong;      /* diffuse + phong * (N.H)^exponent, without a Fresnel term, instead */
	double phong[3], exponent;
};

/* Computes pi * f * cos: a white diffuse surface that faces a light of 1 shines with 1, the unit of psr/view.h. n, v
 * and l: unit; l: to the light. 0 for light from behind; eyes behind n see what they would at 0 < n.v << 1. */
void brdf_reflect(const struct brdf *brdf, const double n[3], const double v[3], const double l[3], double out[3]);

/* Tables of the light that a surface reflects out of surroundings of light 1 on all sides: its albedo by direction. */
#define BRDF_STEPS 32
struct brdf_albedo {
	float specular[BRDF_STEPS][BRDF_STEPS][2]; /* [roughness][n.v]: f0 * [0] + [1] */
	float beneath[BRDF_STEPS]; /* [n.v]: mean of Schlick's (1 - v.h)^5 over the diffuse light */
};
void brdf_albedo_init(struct brdf_albedo *albedo);
void brdf_ambient(const struct brdf_albedo *albedo, const struct brdf *brdf, double nv, double out[3]);

#endif
