#include <stdarg.h>
#include <stdio.h>
#include "psr/build.h"
#include "price.h"
#include "simd/simd.h"

#define N_BUILT 4 /* models: the usual one, and of a quarter, half and twice its resolution */

/* A rung like the usual one, to change. */
__attribute__((format(printf, 3, 4))) static struct ladder_rung *add(struct price_set *set, const char *knob,
                                                                     const char *format, ...)
{
	struct price_setting *setting = &set->setting[set->n];
	va_list args;

	*setting = (struct price_setting){ .knob = knob, .is_choice = 1 };
	va_start(args, format);
	vsnprintf(setting->name, sizeof setting->name, format, args);
	va_end(args);
	set->rung[set->n] = set->rung[0];
	return &set->rung[set->n++];
}

static struct price_setting *last(struct price_set *set)
{
	return &set->setting[set->n - 1];
}

static void add_usual(struct price_set *set)
{
	struct ladder_rung *usual = &set->rung[0];

	*usual = (struct ladder_rung){ .model = set->model[0], .isa = LADDER_BEST_ISA, .n_threads = 1 };
	render_settings_default(&usual->settings, 1, 1);
	set->setting[0] = (struct price_setting){ .name = "usual", .knob = "usual", .is_exact = 1, .is_choice = 1 };
	set->n = 1;
}

/* What a request can say, and pairs of it. */
static void add_requests(struct price_set *set)
{
	static const double spacing[] = { 0.5, 0.71, 1.41, 2, 2.83, 4, 8 };

	for (size_t i = 0; i < sizeof spacing / sizeof spacing[0]; i++)
		add(set, "spacing", "spacing %g", spacing[i])->settings.spacing_px = spacing[i];
	add(set, "smoothing", "smooth")->settings.smooth = PSR_SMOOTH_EDGES;
	for (int i = 1; i <= 4; i += 2) {
		struct ladder_rung *rung = add(set, "smoothing", "smooth, spacing %g", spacing[i]);

		rung->settings.smooth = PSR_SMOOTH_EDGES;
		rung->settings.spacing_px = spacing[i];
	}
	add(set, "passes", "fine")->settings.smooth = PSR_SMOOTH_FINE;
	for (unsigned pass = 1; pass <= PSR_MAX_PASS; pass++)
		add(set, "passes", "pass %u", pass)->settings.pass = pass;
	for (unsigned pass = 1; pass <= 2; pass++) {
		struct ladder_rung *rung = add(set, "passes", "pass %u, spacing 2", pass);

		rung->settings.pass = pass;
		rung->settings.spacing_px = 2;
	}
}

static int build(struct price_set *set, const struct psr_mesh *mesh, uint32_t resolution, struct psr_error *err)
{
	struct psr_build_options options;
	int rc;

	price_tell("models", set->n_models + 1, N_BUILT);
	psr_build_options_default(&options);
	options.resolution = resolution;
	rc = psr_model_build(&set->model[set->n_models], mesh, &options, NULL, err);
	set->n_models += rc == PSR_OK;
	return rc;
}

static int add_resolutions(struct price_set *set, const struct psr_mesh *mesh, uint32_t usual, struct psr_error *err)
{
	const uint32_t resolution[N_BUILT - 1] = { usual / 4, usual / 2, 2 * usual };
	int rc = PSR_OK;

	for (int i = 0; i < N_BUILT - 1 && rc == PSR_OK; i++) {
		rc = build(set, mesh, resolution[i], err);
		if (rc != PSR_OK)
			break;
		const struct psr_model *model = set->model[set->n_models - 1];
		add(set, "resolution", "model of %u", resolution[i])->model = model;
		struct ladder_rung *rung = add(set, "resolution", "model of %u, smooth", resolution[i]);
		rung->model = model;
		rung->settings.smooth = PSR_SMOOTH_EDGES;
		rung = add(set, "resolution", "model of %u, fine", resolution[i]);
		rung->model = model;
		rung->settings.smooth = PSR_SMOOTH_FINE;
		rung = add(set, "resolution", "model of %u, pass 2", resolution[i]);
		rung->model = model;
		rung->settings.pass = 2;
	}
	return rc;
}

static void add_gaps(struct price_set *set)
{
	static const double threshold[] = { 0.75, 1.5, 6, 12 };

	add(set, "gaps", "bilinear cells")->settings.gap_method = PSR_GAPS_BILINEAR;
	add(set, "gaps", "opaque cells")->settings.gap_method = PSR_GAPS_OPAQUE;
	for (size_t i = 0; i < sizeof threshold / sizeof threshold[0]; i++)
		add(set, "gaps", "threshold %g", threshold[i])->settings.gap_threshold = threshold[i];
	for (int bias = -1; bias <= 1; bias += 2)
		add(set, "gaps", "level bias %+d", bias)->settings.cell_bias = bias;
	add(set, "fill", "no fill")->settings.no_fill = 1;
	add(set, "warp", "discs")->settings.with_splats = 1;
}

/* Only with views that have shadows. */
static void add_shadows(struct price_set *set)
{
	for (uint32_t side = 128; side >= 64; side /= 2)
		add(set, "shadows", "shadow map of %u", side)->settings.shadow_side = side;
	add(set, "shadows", "no shadows")->no_shadows = 1;
}

/* What must not change the picture. */
static void add_exact(struct price_set *set)
{
	static const struct {
		const char *name;
		unsigned test;
	} cull[] = { { "no cones", PSR_CULL_CONES }, { "no masks", PSR_CULL_MASKS }, { "no occlusion", PSR_CULL_OCCLUSION },
		         { "no culling", PSR_CULL_ALL } };

	for (size_t i = 0; i < sizeof cull / sizeof cull[0]; i++) {
		add(set, "culling", "%s", cull[i].name)->settings.cull_tests = PSR_CULL_ALL & ~cull[i].test;
		last(set)->is_exact = 1;
	}
	add(set, "positions", "positions, all")->settings.is_full = 1;
	last(set)->is_exact = 1;
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		if (simd_of((enum psr_isa)isa) == NULL)
			continue;
		add(set, "instructions", "%s", psr_isa_name((enum psr_isa)isa))->isa = (enum psr_isa)isa;
		last(set)->is_exact = 1;
		last(set)->is_choice = 0;
	}
	for (int n = 2; n <= 4; n += 2) {
		add(set, "threads", "%d threads", n)->n_threads = n;
		last(set)->is_exact = 1;
		last(set)->is_choice = 0;
	}
}

/* A model of coarser words is the last one of the set. */
static void add_bits(struct price_set *set, const char *knob, unsigned n_bits)
{
	add(set, knob, "%s of %u bits", knob, n_bits)->model = set->model[set->n_models++];
	last(set)->is_choice = 0;
}

static int add_words(struct price_set *set, struct psr_error *err)
{
	int rc = PSR_OK;

	for (unsigned n_bits = 13; n_bits >= 9 && rc == PSR_OK; n_bits -= 2) {
		rc = price_normal_bits(&set->model[set->n_models], set->model[0], n_bits, err);
		if (rc == PSR_OK)
			add_bits(set, "normals", n_bits);
	}
	for (unsigned n_bits = 14; n_bits >= 8 && rc == PSR_OK; n_bits -= 2) {
		rc = price_depth_bits(&set->model[set->n_models], set->model[0], n_bits, err);
		if (rc == PSR_OK)
			add_bits(set, "depths", n_bits);
	}
	return rc;
}

static int add_coders(struct price_set *set, struct psr_error *err)
{
	static const struct {
		int quality, chroma;
	} jpeg[] = { { 50, 2 }, { 75, 2 }, { 85, 2 }, { 85, 1 }, { 90, 2 }, { 90, 1 }, { 95, 1 } };
	int rc = PSR_OK;

	for (size_t i = 0; i < sizeof jpeg / sizeof jpeg[0] && rc == PSR_OK; i++) {
		struct ladder_coder *coder = &set->coder[set->n_coders];

		rc = price_jpeg_open(coder, jpeg[i].quality, jpeg[i].chroma, err);
		if (rc != PSR_OK)
			break;
		set->n_coders++;
		add(set, "JPEG", "JPEG %d 4:%s", jpeg[i].quality, jpeg[i].chroma == 1 ? "4:4" : "2:0")->coder = coder;
		last(set)->is_choice = 0;
	}
	return rc;
}

int price_set_make(struct price_set *set, const struct psr_mesh *mesh, const struct price_options *options,
                   struct psr_error *err)
{
	int rc;

	set->n = set->n_models = set->n_coders = 0;
	rc = build(set, mesh, options->resolution, err);
	if (rc != PSR_OK)
		return rc;
	add_usual(set);
	add_requests(set);
	rc = add_resolutions(set, mesh, options->resolution, err);
	add_gaps(set);
	if (options->n_views > LADDER_N_KINDS)
		add_shadows(set);
	add_exact(set);
	if (rc == PSR_OK)
		rc = add_words(set, err);
	return rc == PSR_OK ? add_coders(set, err) : rc;
}

void price_set_fini(struct price_set *set)
{
	for (uint32_t i = 0; i < set->n_models; i++)
		psr_model_unref(set->model[i]);
	for (uint32_t i = 0; i < set->n_coders; i++)
		price_jpeg_close(&set->coder[i]);
}
