#include <math.h>
#include <string.h>
#include "groups.h"
#include "render.h"

static const struct {
	const char *name, *why[PSR_WHY_COST + 1];
} effects[PSR_N_EFFECTS] = {
	[PSR_EFFECT_CONES] = { "cones", { "", "the settings turn it off", "no model in the scene has cones", "", "" } },
	[PSR_EFFECT_MASKS] = { "masks",
	                       { "", "the settings turn it off", "no model in the scene has masks",
	                         "the eye is inside a model's sphere, or masks were measured to cull visible parts",
	                         "" } },
	[PSR_EFFECT_OCCLUSION] = { "occlusion",
	                           { "", "the settings turn it off", "", "", "no tile has eight samples a pixel" } },
	[PSR_EFFECT_FACING] = { "facing", { "", "", "cones decide how all blocks in view face", "", "" } },
	[PSR_EFFECT_LEVELS] = { "levels",
	                        { "", "", "the samples of every block in view are within a pixel of each other", "", "" } },
	[PSR_EFFECT_FILL] = { "fill", { "", "", "no pixel's weight is below 1", "", "" } },
	[PSR_EFFECT_TWO_SIDED] = { "two-sided", { "", "", "no block in view is two-sided", "", "" } },
	[PSR_EFFECT_SPECULAR] = { "specular", { "", "", "no sample in view mirrors light", "", "" } },
	[PSR_EFFECT_POSITIONS] = { "positions", { "", "", "no light is near or casts shadows", "", "" } },
	[PSR_EFFECT_SHADOWS] = { "shadows", { "", "", "no light that casts shadows reaches an instance in view", "", "" } },
	[PSR_EFFECT_TABLE] = { "table",
	                       { "", "", "no light shines",
	                         "a light is near or casts shadows, or a block in view is two-sided",
	                         "too few lights and pixels, or several instances" } },
	[PSR_EFFECT_SMOOTH] = { "smooth", { "", "the settings turn it off", "the frame has no colour", "", "" } },
	[PSR_EFFECT_SHEER] = { "sheer",
	                       { "", "the frame has neither colour nor depth", "no block in view lets light through", "",
	                         "" } },
	[PSR_EFFECT_VEILS] = { "veils",
	                       { "", "the frame has neither colour nor depth", "no block in view is of thin things", "",
	                         "" } },
	[PSR_EFFECT_SPLATS] = { "splats",
	                        { "", "the settings turn it off", "no octree is in view; other instances are drawn as without",
	                          "passes draw leaves as discs", "" } },
	[PSR_EFFECT_FINE] = { "fine",
	                      { "", "the settings turn it off", "", "samples are further apart than 1.25 pixels: smooth is nearer to "
	                        "the truth; a finer model mends it", "" } },
};

const char *psr_effect_name(enum psr_effect effect)
{
	return (unsigned)effect < PSR_N_EFFECTS ? effects[effect].name : "?";
}

const char *psr_effect_counts(enum psr_effect effect)
{
	static const char *const counts[PSR_N_EFFECTS] = {
		[PSR_EFFECT_CONES] = "blocks tested",
		[PSR_EFFECT_MASKS] = "blocks that only their mask culls",
		[PSR_EFFECT_OCCLUSION] = "hidden blocks skipped, counted in each tile",
		[PSR_EFFECT_FACING] = "blocks whose samples were tested one by one",
		[PSR_EFFECT_LEVELS] = "depth buffers in addition to the picture's",
		[PSR_EFFECT_FILL] = "pixels whose colour changed",
		[PSR_EFFECT_TWO_SIDED] = "pixels whose normals may be turned to the eye",
		[PSR_EFFECT_SPECULAR] = "pixels tested for highlights",
		[PSR_EFFECT_POSITIONS] = "pixels whose positions were computed",
		[PSR_EFFECT_SHADOWS] = "shadow maps in use",
		[PSR_EFFECT_TABLE] = "normals whose light was tabulated",
		[PSR_EFFECT_SMOOTH] = "pixels at edges",
		[PSR_EFFECT_SHEER] = "pixels with surfaces that let a part of the light through",
		[PSR_EFFECT_SPLATS] = "leaves of octrees, as splats",
		[PSR_EFFECT_FINE] = "pixels of four smooth ones",
		[PSR_EFFECT_VEILS] = "pixels with things that are narrower than a sample's cell",
	};

	return (unsigned)effect < PSR_N_EFFECTS && counts[effect] != NULL ? counts[effect] : "?";
}

const char *psr_effect_why(enum psr_effect effect, enum psr_why why)
{
	return (unsigned)effect < PSR_N_EFFECTS && (unsigned)why <= PSR_WHY_COST ? effects[effect].why[why] : "?";
}

void effect_note(struct psr_report *report, enum psr_effect effect, enum psr_why why, uint64_t count)
{
	report->effect[effect].why = why;
	report->effect[effect].count = why == PSR_WHY_RAN ? count : 0;
}

void representations_note(struct psr_report *report, const struct psr_scene *scene)
{
	for (uint32_t i = 0; i < scene->n_instances; i++) {
		const enum psr_representation as = instance_drawn_as(&scene->instance[i]);

		report->drawn_as[as].n++;
		report->drawn_as[as].n_automatic += scene->instance[i].representation == PSR_AUTOMATIC;
	}
}

void frame_report_add(struct psr_report *sum, const struct psr_report *one, unsigned pass)
{
	for (int s = 0; s < PSR_N_STAGES; s++) {
		sum->ns[s] += one->ns[s];
		sum->count[s] += one->count[s];
	}
	sum->n_blocks = one->n_blocks;
	sum->n_samples = one->n_samples;
	sum->n_blocks_drawn += one->n_blocks_drawn;
	sum->n_samples_drawn += one->n_samples_drawn;
	sum->n_covered += one->n_covered;
	sum->n_filled += one->n_filled;
	sum->levels |= one->levels;
	sum->n_clamped += one->n_clamped;
	memcpy(sum->drawn_as, one->drawn_as, sizeof sum->drawn_as);
	if (one->octree_levels > sum->octree_levels) {
		sum->octree_levels = one->octree_levels;
		sum->of_levels = one->of_levels;
	}
	for (int e = 0; e < PSR_N_EFFECTS; e++) {
		if (one->effect[e].why == PSR_WHY_RAN || sum->effect[e].why != PSR_WHY_RAN)
			sum->effect[e].why = one->effect[e].why;
		sum->effect[e].count += one->effect[e].count;
	}
	sum->error_px = fmax(sum->error_px, ldexp(one->error_px, -(int)pass));
}
