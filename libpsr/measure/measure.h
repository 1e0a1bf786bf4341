/* Accuracy: the ray-traced truth of a mesh, and how a frame's depth differs from it. */
#ifndef PSR_MEASURE_MEASURE_H
#define PSR_MEASURE_MEASURE_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/mesh.h"
#include "psr/scene.h"

/* A mesh behind a ray tracer; visible surfaces are those that the sampler sees: alpha cut-outs and the backs of
 * one-sided faces let rays through. */
struct psr_truth;

int psr_truth_create(struct psr_truth **out, const struct psr_mesh *mesh, struct psr_error *err);
void psr_truth_destroy(struct psr_truth *truth);

/* From now on rays go through surfaces that let a part of the light through in proportion to it, by a pattern much finer
 * than this spacing, in world units: the mean of many rays has the light that is left. Before, these surfaces stop rays
 * where they let less than half through. */
void psr_truth_stipple(struct psr_truth *truth, double spacing);

/* A picture of the mesh. The caller owns truth and camera. width, height: pixels; n_threads: as for
 * psr_pool_create(). */
struct psr_truth_shot {
	struct psr_truth *truth;
	const struct psr_camera *camera;
	uint32_t width, height;
	int n_threads;
};

/* One ray through each of side * side positions of every pixel (position i at (i + 0.5) / side). depth: z' in
 * world units, +inf where nothing is; normal: unit, towards the eye, world; both width * side by height * side;
 * normal and rgb may be NULL. rgb: flat diffuse colour, sRGB, 3 bytes. */
int psr_truth_draw(const struct psr_truth_shot *shot, uint32_t side, float *depth, float (*normal)[3], uint8_t *rgb,
                   struct psr_error *err);

/* A frame's depth against the truth, `spacing` being the distance of the samples on the surface in world units. */
struct psr_accuracy {
	uint64_t n_truth;        /* pixels whose centre ray meets the object */
	uint64_t n_inside;       /* pixels whose whole 3x3 neighbourhood meets the object: the silhouette less a pixel */
	uint64_t n_outside_drawn;/* drawn more than a pixel outside of the silhouette: no ray of the 3x3 neighbourhood
	                          * meets it */
	uint64_t n_inside_empty; /* not drawn although inside */
	uint64_t n_holes;        /* inside, and empty or behind every surface point of the 3x3 neighbourhood by over
	                          * `tolerance` */
	uint64_t n_compared;     /* drawn pixels with truth in their 3x3 neighbourhood */
	/* In units of spacing, from the point of the pixel's centre ray at the frame's depth: along the normal of the
	 * nearest of the surfaces that the centre rays of the 3x3 neighbourhood meet, or to the nearest point of the
	 * mesh if that is less (walls along the line of sight). What shows a surface that another one hides is counted
	 * as a hole, however near it is to the mesh. */
	double distance_p50, distance_p99, distance_p999, distance_max;
};
int psr_accuracy_measure(struct psr_accuracy *out, const struct psr_truth_shot *shot, const float *depth,
                         double spacing, struct psr_error *err);

/* A frame drawn with --ambient 1 and no light, which shows the flat diffuse colour, against the truth, the
 * mean of 4x4 rays a pixel in linear light: pixels where all rays of the whole 3x3 neighbourhood meet the object, each
 * with the most similar of the nine, since a sample may be anywhere in its pixel. */
#define PSR_COLOR_WRONG 16 /* codes of sRGB, in any channel */
struct psr_color_accuracy {
	uint64_t n_compared;
	uint64_t n_wrong; /* differ by more than PSR_COLOR_WRONG */
	double mean;      /* difference in the channel that differs most, codes */
};
int psr_accuracy_measure_color(struct psr_color_accuracy *out, const struct psr_truth_shot *shot, const uint8_t *rgb,
                               struct psr_error *err);

/* A frame with no ambient and one light that casts shadows against the same frame whose light casts none, and both
 * against shadow rays, 4x4 a pixel, which are stopped by either side of a face. Pixels are compared that are lit
 * without shadows, by at least a twentieth, linear, and whose 5x5 neighbourhood shows nothing but faces that the light
 * meets at over 6 degrees. */
#define PSR_SHADOW_WRONG 0.5 /* of the light without shadows */
struct psr_shadow_accuracy {
	uint64_t n_compared, n_shadow; /* n_shadow: less than half of their rays reach the light */
	uint64_t n_wrong;              /* light differs by more than PSR_SHADOW_WRONG */
	uint64_t n_misplaced;          /* in shadow where it should be lit, or lit where it should not, by halves */
	double mean;                   /* difference of light, 0..1 */
	double seam_p99, seam_max;     /* pixels from a misplaced one to the nearest place that should be as it is; up
	                                * to PSR_SHADOW_FAR */
};
#define PSR_SHADOW_FAR 16
int psr_accuracy_measure_shadow(struct psr_shadow_accuracy *out, const struct psr_truth_shot *shot,
                                const struct psr_light *light, const uint8_t *shadowed, const uint8_t *lit,
                                struct psr_error *err);

/* What a still of the mesh at the world's origin must show ([G] 9.1.1): the mean of side x side rays a pixel in linear
 * light, each lit by ambient and Phong without shadows, over the scene's background. Ignores the scene's camera and
 * instances. rgb: sRGB, 3 bytes a pixel; covered: 1 where a ray meets the mesh. side: 1..32. UNSUPPORTED unless all
 * lights are directional. */
int psr_truth_still(const struct psr_truth_shot *shot, const struct psr_scene *scene, uint32_t side, uint8_t *rgb,
                    uint8_t *covered, struct psr_error *err);

/* Peak signal to noise of the covered pixels, in dB, by their sRGB codes; +inf if they are the same. */
double psr_still_psnr(const uint8_t *rgb, const uint8_t *truth, const uint8_t *covered, uint64_t n_pixels);

#endif
