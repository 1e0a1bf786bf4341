/* Accuracy: the ray-traced truth of a mesh, and how a frame's depth differs from it. */
#ifndef PSR_MEASURE_MEASURE_H
#define PSR_MEASURE_MEASURE_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/frame.h"
#include "psr/mesh.h"
#include "psr/scene.h"

/* A mesh behind a ray tracer. Rays meet the surfaces that the sampler sees: alpha cut-outs and the backs of one-sided
 * faces let rays through. */
struct psr_truth;

int psr_truth_create(struct psr_truth **out, const struct psr_mesh *mesh, struct psr_error *err);
void psr_truth_destroy(struct psr_truth *truth);

/* Until this call, a translucent surface stops rays where it lets less than half of the light through. From now on rays
 * pass it in proportion to that light, by a pattern much finer than this spacing, in world units: the mean of many rays
 * has the light that is left. */
void psr_truth_stipple(struct psr_truth *truth, double spacing);

/* A picture of the mesh. The caller owns truth and camera. width, height: pixels; n_threads: as for
 * psr_pool_create(). */
struct psr_truth_shot {
	struct psr_truth *truth;
	const struct psr_camera *camera;
	uint32_t width, height;
	int n_threads;
};

/* Traces one ray through each of side * side positions of every pixel (position i at (i + 0.5) / side). depth: z' in
 * world units, +inf where the ray meets nothing; normal: unit, towards the eye, world; both width * side by height *
 * side; normal and color may be NULL. color: in ambient light 1, seen from the eye, sRGB, 3
 * bytes; then by how many codes it would change if the normal leaned 10 degrees further from the eye. */
int psr_truth_draw(const struct psr_truth_shot *shot, uint32_t side, float *depth, float (*normal)[3],
                   uint8_t (*color)[4], struct psr_error *err);

/* How far a frame's depth is from the truth; `spacing` is the distance of the samples on the surface in world units. */
struct psr_accuracy {
	uint64_t n_truth;        /* pixels whose centre ray meets the object */
	uint64_t n_inside;       /* pixels whose whole 3x3 neighbourhood meets the object */
	uint64_t n_outside_drawn;/* drawn more than a pixel outside of the silhouette: no ray of the 3x3 neighbourhood
	                          * meets it */
	uint64_t n_inside_empty; /* pixels inside that the frame left empty */
	uint64_t n_holes;        /* pixels inside that are behind every surface point of the 3x3 neighbourhood by over
	                          * `tolerance`, or empty, though no ray of it misses the object */
	uint64_t n_compared;     /* drawn pixels with truth in their 3x3 neighbourhood */
	/* In units of spacing, from the point of the pixel's centre ray at the frame's depth: along the normal of the
	 * nearest of the surfaces that the centre rays of the 3x3 neighbourhood meet, or to the nearest point of the mesh
	 * if that is less (walls along the line of sight). A point on a surface that another surface hides counts as a
	 * hole, however near it is to the mesh. */
	double distance_p50, distance_p99, distance_p999, distance_max;
};
int psr_accuracy_measure(struct psr_accuracy *out, const struct psr_truth_shot *shot, const float *depth,
                         double spacing, struct psr_error *err);

/* How far the colours of a frame drawn with --ambient 1 and no light are from the truth, the mean of 4x4 rays a pixel
 * in linear light. Counts pixels where all rays of the 3x3 neighbourhood meet the object where its colour is steady,
 * each with the most similar of the nine, since a sample may be anywhere in its pixel. What reflects is brighter aslant,
 * and half a pixel is many degrees at the rim of what is round: a colour is steady if it changes by at most
 * PSR_COLOR_WRONG where the normal leans by 10 degrees. */
#define PSR_COLOR_WRONG 16 /* codes of sRGB, in any channel */
struct psr_color_accuracy {
	uint64_t n_compared;
	uint64_t n_wrong; /* pixels that differ by more than PSR_COLOR_WRONG */
	double mean;      /* difference in the channel that differs most, codes */
};
int psr_accuracy_measure_color(struct psr_color_accuracy *out, const struct psr_truth_shot *shot, const uint8_t *rgb,
                               struct psr_error *err);

/* How far shadows are from the truth. Compares a frame with no ambient and one light that casts shadows with the same
 * frame without shadows, and both with shadow rays, 4x4 a pixel; either side of a face stops a ray. Counts pixels that
 * are lit without shadows, by at least a twentieth, linear, and whose 5x5 neighbourhood shows only faces that the light
 * meets at over 6 degrees. */
#define PSR_SHADOW_WRONG 0.5 /* of the light without shadows */
struct psr_shadow_accuracy {
	uint64_t n_compared, n_shadow; /* n_shadow: less than half of their rays reach the light */
	uint64_t n_wrong;              /* pixels whose light differs by more than PSR_SHADOW_WRONG */
	uint64_t n_misplaced;          /* pixels in shadow that should be lit, or lit that should be in shadow, by halves */
	double mean;                   /* difference of light, 0..1 */
	double seam_p99, seam_max;     /* distance in pixels from a misplaced pixel to the nearest one that should look so;
	                                * up to PSR_SHADOW_FAR */
};
#define PSR_SHADOW_FAR 16
int psr_accuracy_measure_shadow(struct psr_shadow_accuracy *out, const struct psr_truth_shot *shot,
                                const struct psr_light *light, const uint8_t *shadowed, const uint8_t *lit,
                                struct psr_error *err);

/* Draws what a still of the mesh at the world's origin must show ([G] 9.1.1): the mean of side x side rays a pixel in
 * linear light, each lit as in frames, without shadows, over the scene's background. Ignores the scene's camera
 * and instances. rgb: sRGB, 3 bytes a pixel; covered: 1 where a ray meets the mesh. side: 1..32. UNSUPPORTED unless all
 * lights are directional. */
int psr_truth_still(const struct psr_truth_shot *shot, const struct psr_scene *scene, uint32_t side, uint8_t *rgb,
                    uint8_t *covered, struct psr_error *err);

/* A mesh behind a ray tracer that evaluates the materials of its source, for pictures with all effects. Shares no code
 * with the modeller's surface/. The mesh must outlive it. MEMORY, and as psr_truth_create(). */
struct psr_source;

int psr_source_create(struct psr_source **out, const struct psr_mesh *mesh, struct psr_error *err);
void psr_source_destroy(struct psr_source *source); /* NULL is fine */

/* What a picture of the scene would be without samples, levels, quantisation and shadow maps.
 *
 * Every instance of the scene shows the source, whatever its model; with none the source stands at the world's origin.
 * Materials are those of glTF 2.0 (appendix B), specular-glossiness, or OBJ's; units of light are those of psr/view.h:
 * a white diffuse surface that faces a light of 1 shows 1. Ambient is light that comes from all sides, which metals
 * mirror. Lights that cast shadows are traced, also through glass. A pixel is the mean of side x side rays in linear
 * light, over the background; each sees the surfaces of BLEND materials in the order of depth. */
struct psr_source_shot {
	struct psr_source *source;
	const struct psr_scene *scene;
	uint32_t width, height; /* pixels */
	uint32_t side;          /* 1..16 */
	int n_threads;          /* as for psr_pool_create(); the picture does not depend on it */
};

/* Where the picture goes; each is width * height, or NULL. */
struct psr_source_planes {
	uint8_t (*rgb)[3];   /* sRGB of `light`, clamped to 1 */
	float (*light)[3];   /* linear, may exceed 1 */
	float *coverage;     /* 0..1: share of the pixel that hides the background */
	float *textured;     /* 0..1: share of its rays that meet a surface whose base colour has an image */
	float *depth;        /* z' of the ray through the pixel's centre, +inf where it meets nothing; as in frames the
	                      * nearest surface that holds back half of the light or more */
	float (*range)[2];   /* nearest and farthest such z' of the pixel's other rays; +inf, -inf: no ray meets one */
	float (*normal)[3];  /* shading normal at `depth`, world, unit, on the side that is seen; 0,0,0 */
};
int psr_source_draw(const struct psr_source_shot *shot, const struct psr_source_planes *to, struct psr_error *err);

/* How far a frame is from the truth. A pixel is covered if a ray of it meets the object, inside if all rays of its 3x3
 * neighbourhood do. Decibels are of sRGB codes; +inf: no difference, or no such pixel. */
struct psr_errors {
	uint64_t n_covered, n_inside, n_textured;
	double psnr, psnr_inside; /* of covered pixels; of those inside */
	double psnr_textured;     /* of those inside whose neighbourhood is one surface with images: no step in depth */
	double ssim, flip;        /* of the whole picture (compare/compare.h) */
	/* Of the frame's depth. A place is right if its depth is that of a ray of the 3x3 neighbourhood, within three
	 * spacings ([G] 7.2). */
	uint64_t n_holes, n_leaks; /* pixels inside that are empty; that show what lies behind all of the neighbourhood */
	double depth_rmse, depth_p999; /* of drawn pixels inside, beyond the range of the pixel's rays, in spacings */
	uint64_t n_outline;        /* drawn where less than half is covered, or empty where more is */
	double outline_mean, outline_max; /* pixels from these to the nearest that should look so; up to PSR_OUTLINE_FAR */
	double normal_mean, normal_p99; /* degrees, at right places inside; 0 without the frame's normals */
	/* Of the squared error over covered pixels: the part at the object's edges and at wrong places, 0..1, and the rest,
	 * which is the shading's; decibels of the pixels inside that are at the right place. */
	double geometry, psnr_shading;
};
#define PSR_OUTLINE_FAR 16

/* Compares a frame, which has colour and depth, with the planes of psr_source_draw() of its size: rgb, coverage, depth
 * and range; textured and normal may be NULL. spacing: of the model's samples, world units. MEMORY. */
int psr_errors_measure(struct psr_errors *out, const struct psr_frame *frame, const struct psr_source_planes *truth,
                       double spacing, struct psr_error *err);

/* Returns the root of the mean square, in codes, by which a pixel changes otherwise from one picture to the next than
 * the truth does, over both pictures' pixels where all rays meet the object: shimmer along a path. rgb[0], coverage[0]:
 * of the first picture; 0 if there is no such pixel. */
struct psr_step {
	const uint8_t (*rgb[2])[3], (*truth[2])[3];
	const float *coverage[2];
};
double psr_errors_shimmer(const struct psr_step *step, uint64_t n_pixels);

#endif
