#include <math.h>
#include "base/vec.h"
#include "lobe.h"

#define LEAST_NV 1e-3
#define LEAST_WIDTH2 4e-6

void lobe_colors(double diffuse[3], double f0[3], const struct look *look)
{
	const double metallic = (double)look->metallic, reflectance = (double)look->reflectance;

	for (int c = 0; c < 3; c++) {
		diffuse[c] = (double)look->base[c] * (1 - metallic) * (1 - reflectance);
		f0[c] = reflectance * (1 - metallic) + (double)look->base[c] * metallic;
	}
}

void lobe_reflect(double light[3], const struct look *look, const double n[3], const double to_light[3],
                  const double to_eye[3])
{
	const double width = (double)look->roughness * (double)look->roughness;
	const double width2 = fmax(width * width, LEAST_WIDTH2);
	const double nl = v3d_dot(n, to_light), nv = fmax(v3d_dot(n, to_eye), LEAST_NV);
	double h[3], diffuse[3], f0[3];

	light[0] = light[1] = light[2] = 0;
	if (!(nl > 0))
		return;
	lobe_colors(diffuse, f0, look);
	v3d_add(h, to_light, to_eye);
	const double h2 = fmax(v3d_dot(h, h), 1e-6), nh2 = fmin((nl + nv) * (nl + nv) / h2, 1);
	const double t = 1 - (1 - width2) * nh2;
	const double seen = sqrt(width2 + (1 - width2) * nv * nv), shadowed = sqrt(width2 + (1 - width2) * nl * nl);
	const int shines = look->metallic > 0 || look->reflectance > 0;
	const double lobe = shines ? width2 / (t * t) / 2 / (nl * seen + nv * shadowed) : 0;
	const double grazing = shines ? pow(fmax(1 - sqrt(h2) / 2, 0), 5) : 0;
	for (int c = 0; c < 3; c++)
		light[c] = nl * (diffuse[c] * (1 - grazing) + lobe * (f0[c] * (1 - grazing) + grazing));
}

void lobe_ambient(double light[3], const struct look *look, const double n[3], const double to_eye[3])
{
	const double roughness = (double)look->roughness, smooth = 1 - roughness, width = roughness * roughness;
	const double nv = fmax(v3d_dot(n, to_eye), LEAST_NV), aside = 1 - nv;
	const int shines = look->metallic > 0 || look->reflectance > 0;
	const double grazing = shines ? smooth * pow(aside, 3) * (0.27 + 0.8 * smooth * smooth * aside * aside) : 0;
	const double loss = width * (0.42 + 1.05 * nv - 1.87 * nv * nv) + width * width * (-0.45 + 1.83 * nv + 1.17 * nv * nv);
	double diffuse[3], f0[3];

	lobe_colors(diffuse, f0, look);
	for (int c = 0; c < 3; c++)
		light[c] = (diffuse[c] + f0[c] * (1 / (1 + loss) - grazing) + grazing) * (double)look->open;
}
