#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include "base/srgb.h"
#include "psr/direction.h"
#include "sample_model.h"

#define RESOLUTION 256 /* levels of 256, 128 and 64 */
#define N_LEVELS 3

static const double zero[3];

static void explore(void **state)
{
	(void)state;
	for (int t = 0; t < 3; t++) {
		double wpx[] = {0.2, 0.5, 1};
		uint32_t n = 20;
		uint64_t seed = 3 + t;
		struct psr_mesh *mesh = meshes_new(4 * n, 2 * n);
		double dir[20][3];
		for (uint32_t i = 0; i < n; i++) {
			double f[3][3], d[3];
			do for (int k = 0; k < 3; k++) d[k] = 2 * meshes_random(&seed) - 1; while (v3d_dot(d, d) > 1 || v3d_normalize(d, d) < 0.1);
			psr_direction_frame(d, f);
			for (int k = 0; k < 3; k++) dir[i][k] = f[0][k];
			for (uint32_t c = 0; c < 4; c++)
				for (int k = 0; k < 3; k++)
					mesh->position[4 * i + c][k] = (c == 1 || c == 2 ? 1 : 0.2) * f[0][k] + (c >= 2 ? 0.5 : -0.5) * wpx[t] * 2 / RESOLUTION * f[1][k];
			for (uint32_t j = 0; j < 2; j++) {
				mesh->triangle[2 * i + j][0] = 4 * i;
				mesh->triangle[2 * i + j][1] = 4 * i + 1 + j;
				mesh->triangle[2 * i + j][2] = 4 * i + 2 + j;
			}
		}
		mesh->material->two_sided = t != 1;
		struct psr_model *model = model_build(mesh, RESOLUTION);
		const struct psr_blocks *b = psr_model_blocks(model);
		struct model_sample *list = model_samples(b);
		for (unsigned l = 0; l < 3; l++) {
			struct cover map; int far[3] = {0}, all = 0;
			double ds = 2.0 / RESOLUTION * (1 << l);
			model_map(&map, list, b->n_samples, l, ds);
			for (uint32_t i = 0; i < n; i++)
				for (double x = 0.2; x < 1; x += 0.1 * ds) {
					const struct psr_model_info *in = psr_model_info(model); float p[3]; for (int k = 0; k < 3; k++) p[k] = (float)((x * dir[i][k] - in->origin[k]) / in->scale);
					float r = model_nearest(&map, p, UINT32_MAX);
					all++; far[0] += r > 0.6 * ds; far[1] += r > 0.75 * ds; far[2] += r > ds;
				}
			printf("# width %g level %u: %d samples, of %d places %d > .6, %d > .75, %d > 1\n", wpx[t], l, (int)map.n_points, all, far[0], far[1], far[2]);
			cover_fini(&map);
		}
		free(list); psr_model_unref(model); meshes_free(mesh);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(explore),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
