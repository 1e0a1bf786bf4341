#include <math.h>
#include "../base/srgb.h"
#include "texture.h"

/* Texel index for an integer coordinate that may lie outside. */
static uint32_t wrap_index(double i, uint32_t n, enum psr_wrap wrap)
{
	double period = wrap == PSR_WRAP_MIRROR ? 2.0 * n : n;

	if (wrap == PSR_WRAP_CLAMP)
		return i <= 0 ? 0 : i >= n - 1 ? n - 1 : (uint32_t)i;
	i -= period * floor(i / period);
	/* Beyond 2^53 there is no fraction left, and the difference may round to the period itself. */
	if (!(i >= 0 && i < period))
		i = 0;
	return i < n ? (uint32_t)i : (uint32_t)(2.0 * n - 1 - i);
}

static void add_texel(const struct psr_image *image, uint32_t x, uint32_t y, float weight, float rgba[4])
{
	const uint8_t *texel = image->rgba + 4 * ((size_t)y * image->width + x);

	for (int c = 0; c < 3; c++)
		rgba[c] += weight * psr_srgb_to_linear[texel[c]];
	rgba[3] += weight * ((float)texel[3] / 255);
}

static void look_up(const struct psr_image *image, const struct psr_texture *texture, double s, double t, float rgba[4])
{
	double x = s * image->width - 0.5, y = t * image->height - 0.5, x0 = floor(x), y0 = floor(y);
	float fx = (float)(x - x0), fy = (float)(y - y0);
	uint32_t xs[2] = { wrap_index(x0, image->width, texture->wrap_s),
		               wrap_index(x0 + 1, image->width, texture->wrap_s) };
	uint32_t ys[2] = { wrap_index(y0, image->height, texture->wrap_t),
		               wrap_index(y0 + 1, image->height, texture->wrap_t) };

	for (int c = 0; c < 4; c++)
		rgba[c] = 0;
	add_texel(image, xs[0], ys[0], (1 - fx) * (1 - fy), rgba);
	add_texel(image, xs[1], ys[0], fx * (1 - fy), rgba);
	add_texel(image, xs[0], ys[1], (1 - fx) * fy, rgba);
	add_texel(image, xs[1], ys[1], fx * fy, rgba);
}

void texture_base_color(const struct psr_mesh *mesh, uint32_t prim, double u, double v, float rgba[4])
{
	const struct psr_material *material = &mesh->material[mesh->triangle_material[prim]];
	const uint32_t *index = mesh->triangle[prim];
	const double weight[3] = { 1 - u - v, u, v };

	for (int c = 0; c < 4; c++)
		rgba[c] = material->base_color[c];
	if (mesh->color != NULL) {
		for (int c = 0; c < 4; c++) {
			double sum = 0;

			for (int i = 0; i < 3; i++)
				sum += weight[i] * (double)mesh->color[index[i]][c];
			rgba[c] *= (float)sum;
		}
	}
	if (mesh->uv[0] != NULL && material->base_texture.image >= 0) {
		double s = 0, t = 0;
		float texel[4];

		for (int i = 0; i < 3; i++) {
			s += weight[i] * (double)mesh->uv[0][index[i]][0];
			t += weight[i] * (double)mesh->uv[0][index[i]][1];
		}
		if (isfinite(s) && isfinite(t)) {
			look_up(&mesh->image[material->base_texture.image], &material->base_texture, s, t, texel);
			for (int c = 0; c < 4; c++)
				rgba[c] *= texel[c];
		}
	}
	for (int c = 0; c < 4; c++)
		rgba[c] = rgba[c] > 0 ? rgba[c] < 1 ? rgba[c] : 1 : 0;
}

int texture_is_absent(const struct psr_mesh *mesh, uint32_t prim, double u, double v)
{
	const struct psr_material *material = &mesh->material[mesh->triangle_material[prim]];
	float rgba[4];

	if (material->alpha == PSR_ALPHA_OPAQUE)
		return 0;
	texture_base_color(mesh, prim, u, v, rgba);
	return rgba[3] < (material->alpha == PSR_ALPHA_MASK ? material->alpha_cutoff : 0.5f);
}
