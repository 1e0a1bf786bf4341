#include "render.h"

static const struct {
	const char *name, *why[PSR_WHY_COST + 1];
} effects[PSR_N_EFFECTS] = {
	[PSR_EFFECT_CONES] = { "cones", { "", "the settings leave it out", "no model in the scene has cones", "", "" } },
	[PSR_EFFECT_MASKS] = { "masks",
	                       { "", "the settings leave it out", "no model in the scene has masks",
	                         "the eye is within a model's sphere, or the model was measured to lose something by them",
	                         "" } },
	[PSR_EFFECT_OCCLUSION] = { "occlusion",
	                           { "", "the settings leave it out", "", "", "no tile has eight samples a pixel" } },
	[PSR_EFFECT_FACING] = { "facing", { "", "", "cones tell of all blocks in view how they face", "", "" } },
	[PSR_EFFECT_LEVELS] = { "levels",
	                        { "", "", "the samples of every block in view are within a pixel of each other", "", "" } },
	[PSR_EFFECT_FILL] = { "fill", { "", "", "no pixel's weight is below 1", "", "" } },
	[PSR_EFFECT_TWO_SIDED] = { "two-sided", { "", "", "no block in view is two-sided", "", "" } },
	[PSR_EFFECT_SPECULAR] = { "specular", { "", "", "no sample in view is specular, or no light shines", "", "" } },
	[PSR_EFFECT_POSITIONS] = { "positions", { "", "", "no light is near or casts shadows", "", "" } },
	[PSR_EFFECT_SHADOWS] = { "shadows", { "", "", "no light that casts any reaches what is in view", "", "" } },
	[PSR_EFFECT_TABLE] = { "table",
	                       { "", "", "no light shines",
	                         "a light is near or casts shadows, or a block in view is two-sided",
	                         "too few lights and pixels, or several instances" } },
	[PSR_EFFECT_SMOOTH] = { "smooth", { "", "the settings leave it out", "no colour is wanted", "", "" } },
	[PSR_EFFECT_SHEER] = { "sheer",
	                       { "", "neither colour nor depth is wanted", "no block in view lets light through", "", "" } },
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
		[PSR_EFFECT_OCCLUSION] = "blocks left out, once in each tile",
		[PSR_EFFECT_FACING] = "blocks whose samples were asked one by one",
		[PSR_EFFECT_LEVELS] = "depth buffers beside the picture's own",
		[PSR_EFFECT_FILL] = "pixels whose color changed",
		[PSR_EFFECT_TWO_SIDED] = "pixels whose normals may be turned to the eye",
		[PSR_EFFECT_SPECULAR] = "pixels looked at for highlights",
		[PSR_EFFECT_POSITIONS] = "pixels whose positions were worked out",
		[PSR_EFFECT_SHADOWS] = "shadow maps in use",
		[PSR_EFFECT_TABLE] = "normals whose light was tabulated",
		[PSR_EFFECT_SMOOTH] = "pixels at edges",
		[PSR_EFFECT_SHEER] = "pixels with surfaces that let a part of the light through",
	};
	return (unsigned)effect < PSR_N_EFFECTS && counts[effect] ? counts[effect] : "?";
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
