/* The teapot as [K] has it, of patches: its samples, and the fine mesh that the truth is traced in. */
#include <string.h>
#include "models/shapes/surfaces.h"
#include "models/shapes/teapot.h"
#include "study_dpoint.h"

#define TRUTH_STEPS 96 /* a side of a patch: 589,824 triangles, with exact normals */

int study_dpoint_teapot(struct dpoint_surface *surface, const struct dpoint_uniform *like)
{
	static const double bezier[8] = { 0, 0, 0, 0, 1, 1, 1, 1 };
	struct dpoint_uniform uniform = *like;
	int rc = PSR_OK;

	for (uint32_t i = 0; i < TEAPOT_PATCHES && rc == PSR_OK; i++) {
		double place[4][4][3], control[16][4];
		const struct dpoint_patch patch = { { 3, 3 }, { 4, 4 }, { bezier, bezier }, (const double (*)[4])control };

		teapot_patch(i, place);
		for (int k = 0; k < 16; k++) {
			memcpy(control[k], place[k % 4][k / 4], sizeof place[0][0]); /* outside is where Su x Sv points */
			control[k][3] = 1;
		}
		uniform.part = i;
		rc = dpoint_sample_uniform(surface, &patch, &uniform);
	}
	return rc;
}

void study_dpoint_make_teapot(struct shape *shape)
{
	static const struct shape_material glaze = { "glaze", 0x2f7f86, 0, 0.25, 0 };

	shape_material(shape, &glaze);
	for (uint32_t i = 0; i < TEAPOT_PATCHES; i++) {
		double control[4][4][3];

		teapot_patch(i, control);
		surface_patch(shape, (const double (*)[4][3])control, TRUTH_STEPS, TRUTH_STEPS);
	}
}
