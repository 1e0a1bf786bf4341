/* Names and numbers of equations are those of the paper: Andersson et al., FLIP: A Difference Evaluator for Alternating
 * Images, 2020. */
#include <math.h>
#include "base/maths.h"
#include "base/mem.h"
#include "base/srgb.h"
#include "compare.h"
#include "filter.h"

#define PIXELS_PER_DEGREE (0.7 * 3840 / 0.7 * PSR_DEGREE)
#define EDGE_WIDTH 0.082 /* of the detector, degrees */
#define QC 0.7
#define PC 0.4
#define PT 0.95
#define QF 0.5

static const double white[3] = { 0.950428545, 1, 1.088900371 }; /* D65 */

static void linear_to_xyz(double xyz[3], const double rgb[3])
{
	xyz[0] = (10135552 * rgb[0] + 8788810 * rgb[1] + 4435075 * rgb[2]) / 24577794;
	xyz[1] = (2613072 * rgb[0] + 8788810 * rgb[1] + 887015 * rgb[2]) / 12288897;
	xyz[2] = (1425312 * rgb[0] + 8788810 * rgb[1] + 70074185 * rgb[2]) / 73733382;
}

static void xyz_to_linear(double rgb[3], const double xyz[3])
{
	rgb[0] = 3.241003275 * xyz[0] - 1.537398934 * xyz[1] - 0.498615861 * xyz[2];
	rgb[1] = -0.969224334 * xyz[0] + 1.875930071 * xyz[1] + 0.041554224 * xyz[2];
	rgb[2] = 0.055639423 * xyz[0] - 0.204011202 * xyz[1] + 1.057148933 * xyz[2];
}

/* L*a*b*, or without its roots the opponent space YyCxCz. */
static void opponents(double out[3], const double v[3])
{
	out[0] = 116 * v[1] - 16;
	out[1] = 500 * (v[0] - v[1]);
	out[2] = 200 * (v[1] - v[2]);
}

static void srgb_to_ycxcz(double out[3], const uint8_t *rgb)
{
	double linear[3], xyz[3];

	for (int c = 0; c < 3; c++)
		linear[c] = (double)psr_srgb_to_linear[rgb[c]];
	linear_to_xyz(xyz, linear);
	for (int c = 0; c < 3; c++)
		xyz[c] /= white[c];
	opponents(out, xyz);
}

static void ycxcz_to_linear(double rgb[3], const double from[3])
{
	const double y = (from[0] + 16) / 116;
	const double xyz[3] = { (y + from[1] / 500) * white[0], y * white[1], (y - from[2] / 200) * white[2] };

	xyz_to_linear(rgb, xyz);
}

/* Eq. 4: L*a*b* of linear light within 0..1, with the Hunt effect. */
static void hunt_lab(double lab[3], const double linear[3])
{
	const double delta = 6.0 / 29;
	double v[3];

	linear_to_xyz(v, linear);
	for (int c = 0; c < 3; c++) {
		v[c] /= white[c];
		v[c] = v[c] > delta * delta * delta ? cbrt(v[c]) : v[c] / (3 * delta * delta) + 4.0 / 29;
	}
	opponents(lab, v);
	lab[1] *= 0.01 * lab[0];
	lab[2] *= 0.01 * lab[0];
}

static double hyab(const double a[3], const double b[3])
{
	return fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]);
}

/* Eq. 7: the colour difference, 0..1. */
static double color_difference(const double a[3], const double b[3])
{
	static const double green[3] = { 0, 1, 0 }, blue[3] = { 0, 0, 1 };
	double lab[2][3], most, d;

	hunt_lab(lab[0], green);
	hunt_lab(lab[1], blue);
	most = pow(hyab(lab[0], lab[1]), QC);
	hunt_lab(lab[0], a);
	hunt_lab(lab[1], b);
	d = pow(hyab(lab[0], lab[1]), QC);
	return d < PC * most ? PT / (PC * most) * d : PT + (d - PC * most) / (most - PC * most) * (1 - PT);
}

/* ---- contrast sensitivity, eq. 1 and 2 ---- */

struct sensitivity { /* two Gaussians: their weight in all, and their width */
	double weight[2];
	struct filter filter[2];
};

static void make_sensitivity(struct sensitivity *out, const double a[2], const double b[2])
{
	const double most_b = 0.04; /* of all three channels: one radius for all */
	const int radius = (int)ceil(3 * sqrt(most_b / (2 * M_PI * M_PI)) * PIXELS_PER_DEGREE);

	for (int k = 0; k < 2; k++) {
		const double sigma = sqrt(b[k] / (2 * M_PI * M_PI)) * PIXELS_PER_DEGREE;
		double sum = 0;

		filter_gaussian(&out->filter[k], sigma, radius);
		for (int i = -radius; i <= radius; i++)
			sum += exp(-i * i / (2 * sigma * sigma));
		out->weight[k] = a[k] * sqrt(M_PI / b[k]) * sum * sum;
	}
	const double all = out->weight[0] + out->weight[1];

	for (int k = 0; k < 2; k++)
		out->weight[k] /= all;
}

/* Three planes of a picture, and room for what is made of them. */
struct flip {
	float *plane[3], *spare[2];
	struct filter_plane size;
	size_t n;
};

static void blur(struct flip *flip)
{
	static const double a[3][2] = { { 1, 0 }, { 1, 0 }, { 34.1, 13.5 } };
	static const double b[3][2] = { { 0.0047, 1e-5 }, { 0.0053, 1e-5 }, { 0.04, 0.025 } };

	for (int c = 0; c < 3; c++) {
		struct sensitivity s;

		make_sensitivity(&s, a[c], b[c]);
		for (int k = 0; k < 2; k++)
			if (s.weight[k] > 0)
				filter_run(flip->spare[k], flip->plane[c], &flip->size, &s.filter[k], &s.filter[k]);
		for (size_t i = 0; i < flip->n; i++)
			flip->plane[c][i] = (float)s.weight[0] * flip->spare[0][i]
			                    + (s.weight[1] > 0 ? (float)s.weight[1] * flip->spare[1][i] : 0);
	}
}

static void to_linear(double linear[3], const struct flip *flip, size_t i)
{
	const double v[3] = { (double)flip->plane[0][i], (double)flip->plane[1][i], (double)flip->plane[2][i] };

	ycxcz_to_linear(linear, v);
	for (int c = 0; c < 3; c++)
		linear[c] = fmin(fmax(linear[c], 0), 1);
}

/* ---- features, eq. 8 and 9 ---- */

enum { EDGES, POINTS, N_FEATURES };

/* The first or second derivative of a Gaussian; its positive weights have the sum 1, its negative ones -1. */
static void make_detector(struct filter *out, int feature, double sigma, int radius)
{
	double sum[2] = { 0, 0 }, weight[2 * FILTER_MOST_RADIUS + 1];

	for (int i = -radius; i <= radius; i++) {
		const double g = exp(-i * i / (2 * sigma * sigma));
		const double w = feature == EDGES ? -i * g : (i * i / (sigma * sigma) - 1) * g;

		weight[i + radius] = w;
		sum[w > 0] += fabs(w);
	}
	out->radius = radius;
	for (int i = 0; i <= 2 * radius; i++)
		out->weight[i] = (float)(weight[i] / sum[weight[i] > 0]);
}

/* Strength of the feature at each pixel of the luminance in plane[0], into out. */
static void detect(float *out, struct flip *flip, int feature)
{
	const double sigma = 0.5 * EDGE_WIDTH * PIXELS_PER_DEGREE;
	const int radius = (int)ceil(3 * sigma);
	struct filter along, other;

	make_detector(&along, feature, sigma, radius);
	filter_gaussian(&other, sigma, radius);
	filter_run(flip->spare[0], flip->plane[0], &flip->size, &along, &other);
	filter_run(flip->spare[1], flip->plane[0], &flip->size, &other, &along);
	for (size_t i = 0; i < flip->n; i++) /* Yy is 116 y - 16; derivatives know no offset */
		out[i] = hypotf(flip->spare[0][i], flip->spare[1][i]) / 116;
}

/* ---- both ---- */

static void fill(struct flip *flip, const uint8_t *rgb)
{
	for (size_t i = 0; i < flip->n; i++) {
		double v[3];

		srgb_to_ycxcz(v, rgb + 3 * i);
		for (int c = 0; c < 3; c++)
			flip->plane[c][i] = (float)v[c];
	}
}

int compare_flip(double *out, const uint8_t *rgb, const uint8_t *reference, const uint32_t size[2],
                 struct psr_error *err)
{
	enum { OWN = 3 + N_FEATURES, SHARED = 3 };
	const size_t n = (size_t)size[0] * size[1];
	float *memory = psr_alloc_array(n, (2 * OWN + SHARED) * sizeof *memory), *feature[2][N_FEATURES];
	const uint8_t *const from[2] = { rgb, reference };
	struct flip flip[2];
	double sum = 0;

	if (memory == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to compare pictures of %ux%u", size[0], size[1]);
	for (size_t p = 0; p < 2; p++) {
		float *own = memory + p * OWN * n, *shared = memory + 2 * OWN * n;

		flip[p] = (struct flip){ { own, own + n, own + 2 * n }, { shared, shared + n },
			                     { size[0], size[1], shared + 2 * n }, n };
		fill(&flip[p], from[p]);
		for (int f = 0; f < N_FEATURES; f++) {
			feature[p][f] = own + (size_t)(3 + f) * n;
			detect(feature[p][f], &flip[p], f);
		}
		blur(&flip[p]);
	}
	for (size_t i = 0; i < n; i++) {
		const double edges = fabs((double)feature[0][EDGES][i] - (double)feature[1][EDGES][i]);
		const double points = fabs((double)feature[0][POINTS][i] - (double)feature[1][POINTS][i]);
		double linear[2][3], features = pow(fmax(edges, points) / M_SQRT2, QF);

		to_linear(linear[0], &flip[0], i);
		to_linear(linear[1], &flip[1], i);
		sum += pow(color_difference(linear[0], linear[1]), 1 - features);
	}
	*out = sum / (double)n;
	psr_free(memory);
	return PSR_OK;
}
