/* What psr_render() did, and how long it took. */
#ifndef PSR_REPORT_H
#define PSR_REPORT_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum psr_stage {
	PSR_STAGE_PLAN,    /* count: instances */
	PSR_STAGE_SHADOW,  /* count: samples drawn into the shadow maps that were made for this frame */
	PSR_STAGE_CULL,    /* count: blocks tested, which belong to clusters in view at the chosen levels */
	PSR_STAGE_WARP,    /* count: samples that fell into the picture and do not face away */
	PSR_STAGE_GAPS,    /* count: pixels with a sample whose weight is below 1 */
	PSR_STAGE_RESOLVE, /* count: pixels that have a sample and weight above 0; 0 without colour */
	PSR_STAGE_SHADE,   /* count: pixels shaded; 0 without colour */
	PSR_STAGE_FILL,    /* count: pixels whose colour the fill changed */
	PSR_STAGE_SMOOTH,  /* count: pixels at edges */
	PSR_N_STAGES
};
const char *psr_stage_name(enum psr_stage stage); /* "warp" */

/* An effect runs only where it can change a pixel, or saves more than it costs. PROTOCOL.md has these numbers, too. */
enum psr_effect {
	PSR_EFFECT_CONES,     /* count: blocks tested */
	PSR_EFFECT_MASKS,     /* count: blocks that only their mask culls */
	PSR_EFFECT_OCCLUSION, /* count: blocks left out, once in each tile that they touch */
	PSR_EFFECT_FACING,    /* count: blocks with a test for each sample whether it faces away */
	PSR_EFFECT_LEVELS,    /* count: depth buffers beside the picture's own */
	PSR_EFFECT_FILL,      /* count: pixels whose colour changed */
	PSR_EFFECT_TWO_SIDED, /* count: pixels whose normals may be turned to the eye */
	PSR_EFFECT_SPECULAR,  /* count: pixels looked at for highlights */
	PSR_EFFECT_POSITIONS, /* count: pixels whose samples' positions are computed */
	PSR_EFFECT_SHADOWS,   /* count: shadow maps in use */
	PSR_EFFECT_TABLE,     /* count: normals whose diffuse light is tabulated ([B] 4.1) */
	PSR_EFFECT_SMOOTH,    /* count: pixels at edges, blended with the surface behind */
	PSR_EFFECT_SHEER,     /* count: pixels with translucent surfaces, veils left out */
	PSR_EFFECT_VEILS,     /* count: pixels with things narrower than a sample's cell */
	PSR_EFFECT_SPLATS,    /* count: leaves of octrees in view, drawn as splats ([B] 5.2) */
	PSR_EFFECT_FINE,      /* count: pixels that are means of 2x2 smooth ones */
	PSR_N_EFFECTS
};
enum psr_why {
	PSR_WHY_RAN,
	PSR_WHY_OFF,     /* the settings turn it off */
	PSR_WHY_NOTHING, /* nothing in view calls for it */
	PSR_WHY_VOID,    /* a condition of the effect is not met */
	PSR_WHY_COST,    /* it would cost more than it saves, and changes no pixel */
};
const char *psr_effect_name(enum psr_effect effect); /* "specular" */
const char *psr_effect_counts(enum psr_effect effect); /* the unit of its count: "pixels looked at for highlights" */
/* Why the renderer left an effect out, as the end of a sentence: "no sample in view is specular"; "" if the effect
 * ran. */
const char *psr_effect_why(enum psr_effect effect, enum psr_why why);

struct psr_report {
	uint64_t ns[PSR_N_STAGES];    /* wall time; resolve and shade run together: their own clocks divide the time
	                               * that both took */
	uint64_t count[PSR_N_STAGES];
	uint64_t n_blocks, n_samples; /* of all instances, all levels */
	uint64_t n_blocks_drawn, n_samples_drawn; /* at the drawn levels, after culling; counts all samples of a drawn
	                                           * block */
	uint64_t n_covered;           /* pixels that a sample keeps: weight above 0 before the fill */
	uint64_t n_filled;            /* pixels of weight 0 to which the fill gave a colour of the scene */
	uint32_t levels;              /* bit k: level buffer k was in use */
	uint32_t n_clamped;           /* blocks that needed a coarser depth buffer than psr has: holes are possible */
	uint32_t n_shadow_maps;       /* in use */
	uint32_t n_shadow_maps_drawn; /* how many of these were made for this frame; the others were kept from earlier
	                               * frames */
	struct {
		uint64_t count;
		enum psr_why why;
	} effect[PSR_N_EFFECTS];
	/* By enum psr_representation but PSR_AUTOMATIC: instances of the scene that are drawn as that, and how many of them
	 * the scene left to the plan (psr/scene.h). */
	struct {
		uint32_t n, n_automatic;
	} drawn_as[4];
	/* Of the octree that is drawn down to most levels: these, and all that it has; 0: no octree is in view. */
	uint32_t octree_levels, of_levels;
	double error_px;           /* how far a drawn pixel's centre, at its depth, may be from the surface, in pixels. A bound,
	                            * for models whose samples keep PSR_SAMPLE_OFF; proto/PROTOCOL.md has its parts */
};

#ifdef __cplusplus
}
#endif
#endif
