#include <stdlib.h>
#include "image_kind.h"

static uint64_t n_pixels(const struct psr_image *image)
{
	return (uint64_t)image->width * image->height;
}

int image_is_normal_map(const struct psr_image *image)
{
	const uint64_t n = n_pixels(image);
	uint64_t n_good = 0, n_gray = 0;

	for (uint64_t i = 0; i < n; i++) {
		const uint8_t *p = image->rgba + 4 * i;
		int x = 2 * p[0] - 255, y = 2 * p[1] - 255, z = 2 * p[2] - 255, square = x * x + y * y + z * z;

		/* a length of 0.8 to 1.2: filters and careless writers change it */
		n_good += z > 0 && square > 255 * 255 * 64 / 100 && square < 255 * 255 * 144 / 100;
		n_gray += p[0] == p[1] && p[1] == p[2];
	}
	return n_good >= n - n / 10 && n_gray < n / 2 + 1;
}

int image_is_cutout(const struct psr_image *image)
{
	const uint64_t n = n_pixels(image);
	uint64_t n_open = 0, n_solid = 0;

	for (uint64_t i = 0; i < n; i++) {
		n_open += image->rgba[4 * i + 3] < 32;
		n_solid += image->rgba[4 * i + 3] > 223;
	}
	return n_open > 0 && n_solid > 0 && n_open + n_solid >= n - n / 10;
}

static int has_alpha(const struct psr_image *image)
{
	const uint64_t n = n_pixels(image);

	for (uint64_t i = 0; i < n; i++)
		if (image->rgba[4 * i + 3] != 255)
			return 1;
	return 0;
}

/* Channel `c` at pixel x, y of the image stretched to w x h, bilinear, borders repeated. */
static uint8_t sample(const struct psr_image *image, uint32_t w, uint32_t h, uint32_t x, uint32_t y, int c)
{
	const uint32_t size[2] = { image->width, image->height };
	const double at[2] = { (x + 0.5) * size[0] / w - 0.5, (y + 0.5) * size[1] / h - 0.5 };
	uint32_t low[2], high[2];
	double f[2];

	for (int k = 0; k < 2; k++) {
		double clamped = at[k] < 0.0 ? 0.0 : at[k] > size[k] - 1.0 ? size[k] - 1.0 : at[k];

		low[k] = (uint32_t)clamped;
		high[k] = low[k] + 1 < size[k] ? low[k] + 1 : low[k];
		f[k] = clamped - low[k];
	}
	const uint8_t *top = image->rgba + 4 * (uint64_t)low[1] * size[0] + c;
	const uint8_t *bottom = image->rgba + 4 * (uint64_t)high[1] * size[0] + c;
	double up = top[4 * (uint64_t)low[0]] * (1.0 - f[0]) + top[4 * (uint64_t)high[0]] * f[0];
	double down = bottom[4 * (uint64_t)low[0]] * (1.0 - f[0]) + bottom[4 * (uint64_t)high[0]] * f[0];

	return (uint8_t)(up * (1.0 - f[1]) + down * f[1] + 0.5);
}

static int create(struct psr_image *out, const struct psr_image *a, const struct psr_image *b)
{
	out->width = a == NULL || (b != NULL && b->width > a->width) ? b->width : a->width;
	out->height = a == NULL || (b != NULL && b->height > a->height) ? b->height : a->height;
	out->rgba = malloc(4 * (size_t)n_pixels(out));
	return out->rgba != NULL;
}

int image_with_opacity(struct psr_image *out, const struct psr_image *base, const struct psr_image *opacity)
{
	const int channel = has_alpha(opacity) ? 3 : 0;

	if (!create(out, base, opacity))
		return 0;
	for (uint32_t y = 0; y < out->height; y++)
		for (uint32_t x = 0; x < out->width; x++) {
			uint8_t *p = out->rgba + 4 * ((uint64_t)y * out->width + x);
			int alpha = sample(opacity, out->width, out->height, x, y, channel);

			for (int c = 0; c < 3; c++)
				p[c] = base == NULL ? 255 : sample(base, out->width, out->height, x, y, c);
			/* If both are the same file, its alpha counts once. */
			if (base != NULL && base != opacity)
				alpha = (alpha * sample(base, out->width, out->height, x, y, 3) + 127) / 255;
			p[3] = (uint8_t)alpha;
		}
	return 1;
}

int image_metallic_roughness(struct psr_image *out, const struct psr_image *metallic, const struct psr_image *roughness)
{
	if (!create(out, metallic, roughness))
		return 0;
	for (uint32_t y = 0; y < out->height; y++)
		for (uint32_t x = 0; x < out->width; x++) {
			uint8_t *p = out->rgba + 4 * ((uint64_t)y * out->width + x);

			p[0] = 0;
			p[1] = roughness == NULL ? 255 : sample(roughness, out->width, out->height, x, y, 0);
			p[2] = metallic == NULL ? 255 : sample(metallic, out->width, out->height, x, y, 0);
			p[3] = 255;
		}
	return 1;
}
