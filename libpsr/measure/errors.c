#include <math.h>
#include <string.h>
#include "base/mem.h"
#include "base/stats.h"
#include "compare/compare.h"
#include "measure.h"

#define SURFACE_SPACINGS 3
#define WHOLE (1 - 1e-5f) /* of coverage: it is a sum of floats */

struct errors {
	const struct psr_frame *frame;
	const struct psr_source_planes *truth;
	double spacing;
	uint8_t *inside, *right, *textured; /* by pixel */
	double *value;                      /* of pixels, to be sorted */
};

/* What the truth has in the 3x3 neighbourhood of a pixel, as far as it is within the picture. */
struct around {
	double near, far;
	float coverage, textured; /* the least */
};

static struct around look_around(const struct errors *e, uint32_t x, uint32_t y)
{
	const struct psr_frame *f = e->frame;
	struct around around = { INFINITY, -INFINITY, 1, 1 };

	for (uint32_t v = y ? y - 1 : 0; v <= y + 1 && v < f->height; v++)
		for (uint32_t u = x ? x - 1 : 0; u <= x + 1 && u < f->width; u++) {
			const size_t at = (size_t)v * f->width + u;

			around.near = fmin(around.near, (double)e->truth->range[at][0]);
			around.far = fmax(around.far, (double)e->truth->range[at][1]);
			around.coverage = fminf(around.coverage, e->truth->coverage[at]);
			around.textured = e->truth->textured != NULL ? fminf(around.textured, e->truth->textured[at]) : 0;
		}
	return around;
}

/* Whether depths along the row and the column go on evenly: second differences are those of one surface. */
static int is_smooth_at(const struct errors *e, uint32_t x, uint32_t y)
{
	const size_t width = e->frame->width, at = y * width + x;
	const float *z = e->truth->depth;

	if (x == 0 || y == 0 || x + 1 == width || y + 1 == e->frame->height)
		return 0;
	return fabsf(z[at - 1] + z[at + 1] - 2 * z[at]) <= SURFACE_SPACINGS * e->spacing &&
	       fabsf(z[at - width] + z[at + width] - 2 * z[at]) <= SURFACE_SPACINGS * e->spacing;
}

static double squares(const uint8_t *a, const uint8_t *b)
{
	double sum = 0;

	for (int c = 0; c < 3; c++)
		sum += (a[c] - b[c]) * (a[c] - b[c]);
	return sum;
}

static void sort_pixels(struct errors *e, struct psr_errors *out)
{
	const struct psr_frame *f = e->frame;
	double all = 0, wrong = 0;

	for (size_t at = 0; at < (size_t)f->width * f->height; at++) {
		const uint32_t x = (uint32_t)(at % f->width), y = (uint32_t)(at / f->width);
		const struct around around = look_around(e, x, y);
		const double z = (double)f->depth[at], off = SURFACE_SPACINGS * e->spacing;
		const double error = squares(f->rgb + 3 * at, e->truth->rgb[at]);
		const int is_inside = around.coverage >= WHOLE && isfinite(around.far), is_drawn = isfinite(z);

		e->inside[at] = (uint8_t)is_inside;
		e->right[at] = is_inside && is_drawn && z >= around.near - off && z <= around.far + off;
		e->textured[at] = is_inside && around.textured >= WHOLE && is_smooth_at(e, x, y);
		out->n_covered += e->truth->coverage[at] > 0;
		out->n_inside += (uint64_t)is_inside;
		out->n_textured += e->textured[at];
		out->n_holes += is_inside && !is_drawn;
		out->n_leaks += is_inside && is_drawn && z > around.far + off;
		all += e->truth->coverage[at] > 0 ? error : 0;
		wrong += e->truth->coverage[at] > 0 && !e->right[at] ? error : 0;
	}
	out->geometry = all > 0 ? wrong / all : 0;
}

static void compare_colors(const struct errors *e, struct psr_errors *out)
{
	const struct psr_frame *f = e->frame;
	const uint64_t n = (uint64_t)f->width * f->height;
	const uint8_t *truth = (const uint8_t *)e->truth->rgb;
	uint8_t *covered = (uint8_t *)e->value;

	for (uint64_t at = 0; at < n; at++)
		covered[at] = e->truth->coverage[at] > 0;
	out->psnr = compare_psnr(f->rgb, truth, covered, n);
	out->psnr_inside = compare_psnr(f->rgb, truth, e->inside, n);
	out->psnr_textured = compare_psnr(f->rgb, truth, e->textured, n);
	out->psnr_shading = compare_psnr(f->rgb, truth, e->right, n);
}

static void compare_depths(const struct errors *e, struct psr_errors *out)
{
	double sum = 0;
	size_t n = 0;

	for (size_t at = 0; at < (size_t)e->frame->width * e->frame->height; at++)
		if (e->inside[at] && isfinite(e->frame->depth[at])) {
			const double z = (double)e->frame->depth[at];

			const double before = (double)e->truth->range[at][0] - z, behind = z - (double)e->truth->range[at][1];

			e->value[n] = fmax(0, fmax(before, behind)) / e->spacing;
			sum += e->value[n] * e->value[n];
			n++;
		}
	stats_sort(e->value, n);
	out->depth_rmse = n > 0 ? sqrt(sum / (double)n) : 0;
	out->depth_p999 = stats_percentile(e->value, n, 0.999);
}

static double angle_at(const struct errors *e, size_t at)
{
	double dot = 0, length = 0;

	for (size_t k = 0; k < 3; k++) {
		const double own = e->frame->normal[3 * at + k];

		dot += own * (double)e->truth->normal[at][k];
		length += own * own;
	}
	return acos(fmin(fmax(dot / sqrt(length), -1), 1)) * 180 / 3.14159265358979323846;
}

static void compare_normals(const struct errors *e, struct psr_errors *out)
{
	double sum = 0;
	size_t n = 0;

	if (e->frame->normal == NULL || e->truth->normal == NULL)
		return;
	for (size_t at = 0; at < (size_t)e->frame->width * e->frame->height; at++) {
		const int16_t *own = e->frame->normal + 3 * at;

		if (e->right[at] && (own[0] || own[1] || own[2]) && isfinite(e->truth->depth[at]))
			sum += e->value[n++] = angle_at(e, at);
	}
	stats_sort(e->value, n);
	out->normal_mean = n > 0 ? sum / (double)n : 0;
	out->normal_p99 = stats_percentile(e->value, n, 0.99);
}

/* Returns the distance in pixels to the nearest pixel where the truth is as this one was drawn. */
static double outline_at(const struct errors *e, uint32_t x, uint32_t y, int is_drawn)
{
	const struct psr_frame *f = e->frame;
	double nearest = PSR_OUTLINE_FAR;

	for (int j = -PSR_OUTLINE_FAR; j <= PSR_OUTLINE_FAR; j++)
		for (int i = -PSR_OUTLINE_FAR; i <= PSR_OUTLINE_FAR; i++) {
			const int64_t u = (int64_t)x + i, v = (int64_t)y + j;

			if (u < 0 || v < 0 || u >= f->width || v >= f->height)
				continue;
			if ((e->truth->coverage[(size_t)v * f->width + (size_t)u] >= 0.5f) == is_drawn)
				nearest = fmin(nearest, hypot(i, j));
		}
	return nearest;
}

static void compare_outlines(const struct errors *e, struct psr_errors *out)
{
	double sum = 0;

	for (size_t at = 0; at < (size_t)e->frame->width * e->frame->height; at++) {
		const int is_drawn = isfinite(e->frame->depth[at]) != 0;

		if (is_drawn == (e->truth->coverage[at] >= 0.5f))
			continue;
		const double off =
			outline_at(e, (uint32_t)(at % e->frame->width), (uint32_t)(at / e->frame->width), is_drawn);
		sum += off;
		out->outline_max = fmax(out->outline_max, off);
		out->n_outline++;
	}
	out->outline_mean = out->n_outline > 0 ? sum / (double)out->n_outline : 0;
}

int psr_errors_measure(struct psr_errors *out, const struct psr_frame *frame, const struct psr_source_planes *truth,
                       double spacing, struct psr_error *err)
{
	struct errors e = { .frame = frame, .truth = truth, .spacing = spacing };
	const size_t n = (size_t)frame->width * frame->height;
	const uint32_t size[2] = { frame->width, frame->height };
	int rc = PSR_OK;

	memset(out, 0, sizeof *out);
	e.inside = psr_alloc_array(n, 3);
	e.value = psr_alloc_array(n, sizeof *e.value);
	if (e.inside == NULL || e.value == NULL) {
		rc = psr_fail(err, PSR_ERR_MEMORY, "no memory to compare %ux%u pixels", frame->width, frame->height);
	} else {
		e.right = e.inside + n;
		e.textured = e.right + n;
		sort_pixels(&e, out);
		compare_colors(&e, out);
		compare_depths(&e, out);
		compare_normals(&e, out);
		compare_outlines(&e, out);
		rc = compare_ssim(&out->ssim, frame->rgb, (const uint8_t *)truth->rgb, size, err);
	}
	if (rc == PSR_OK)
		rc = compare_flip(&out->flip, frame->rgb, (const uint8_t *)truth->rgb, size, err);
	psr_free(e.inside);
	psr_free(e.value);
	return rc;
}

double psr_errors_shimmer(const struct psr_step *step, uint64_t n_pixels)
{
	double sum = 0;
	uint64_t n = 0;

	for (uint64_t at = 0; at < n_pixels; at++) {
		if (step->coverage[0][at] < WHOLE || step->coverage[1][at] < WHOLE)
			continue;
		n++;
		for (int c = 0; c < 3; c++) {
			const double change = step->rgb[1][at][c] - step->rgb[0][at][c];
			const double own = step->truth[1][at][c] - step->truth[0][at][c];

			sum += (change - own) * (change - own);
		}
	}
	return n > 0 ? sqrt(sum / (3 * (double)n)) : 0;
}
