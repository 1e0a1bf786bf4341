#include "render/render.h"

static const struct {
	const char *name, *why[PSR_WHY_COST + 1];
} effects[PSR_N_EFFECTS] = {
	[PSR_EFFECT_CONES] = { "cones", { "", "the settings leave it out", "no model in the scene has cones", "", "" } },
	[PSR_EFFECT_MASKS] = { "masks", { "", "the settings leave it out", "no model in the scene has masks",
	                                  "the eye is within a model's sphere, or the model was measured to lose something by them", "" } },
	[PSR_EFFECT_OCCLUSION] = { "occlusion", { "", "the settings leave it out", "", "", "no tile has eight samples a pixel" } },
	[PSR_EFFECT_FACING] = { "facing", { "", "", "cones tell of all blocks in view how they face", "", "" } },
	[PSR_EFFECT_LEVELS] = { "levels", { "", "", "the samples of every block in view are within a pixel of each other", "", "" } },
	[PSR_EFFECT_FILL] = { "fill", { "", "", "no pixel's weight is below 1", "", "" } },
	[PSR_EFFECT_TWO_SIDED] = { "two-sided", { "", "", "no block in view is two-sided", "", "" } },
	[PSR_EFFECT_SPECULAR] = { "specular", { "", "", "no sample in view is specular, or no light shines", "", "" } },
	[PSR_EFFECT_POSITIONS] = { "positions", { "", "", "no light is near or casts shadows", "", "" } },
	[PSR_EFFECT_SHADOWS] = { "shadows", { "", "", "no light that casts any reaches what is in view", "", "" } },
	[PSR_EFFECT_TABLE] = { "table", { "", "", "no light shines", "a light is near or casts shadows, or a block in view is two-sided",
	                                  "too few lights and pixels, or several instances" } },
};

const char *psr_effect_name(enum psr_effect effect)
{
	return (unsigned)effect < PSR_N_EFFECTS ? effects[effect].name : "?";
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
