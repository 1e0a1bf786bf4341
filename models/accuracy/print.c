#include "print.h"

#include <inttypes.h>
#include <stdio.h>
#include "base/json.h"
#include "base/outfile.h"

static double fraction(uint64_t part, uint64_t whole)
{
	return whole == 0 ? 0 : (double)part / (double)whole;
}

static void print_text(const struct psr_accuracy *a)
{
	printf("pixels that show the object          %" PRIu64 "\n", a->n_truth);
	printf("  inside of the silhouette           %" PRIu64 "\n", a->n_inside);
	printf("  inside and empty                   %" PRIu64 "\n", a->n_inside_empty);
	printf("  holes                              %" PRIu64 " (%.4f %% of the pixels inside)\n", a->n_holes,
	       100 * fraction(a->n_holes, a->n_inside));
	printf("drawn over a pixel outside           %" PRIu64 "\n", a->n_outside_drawn);
	printf("distance to the truth, in spacings   p50 %.4f, p99 %.4f, p99.9 %.4f, max %.4f of %" PRIu64 " pixels\n",
	       a->distance_p50, a->distance_p99, a->distance_p999, a->distance_max, a->n_compared);
}

static void print_color_text(const struct psr_color_accuracy *c)
{
	printf("colour: more than %d codes off          %" PRIu64 " (%.4f %%) of %" PRIu64 " pixels; mean %.3f codes\n",
	       PSR_COLOR_WRONG, c->n_wrong, 100 * fraction(c->n_wrong, c->n_compared), c->n_compared, c->mean);
}

static void print_shadow_text(const struct psr_shadow_accuracy *s)
{
	printf("shadow: light more than %.0f %% off       %" PRIu64 " (%.4f %%) of %" PRIu64 " pixels, %" PRIu64 " of them in shadow; mean %.4f\n",
	       100 * PSR_SHADOW_WRONG, s->n_wrong, 100 * fraction(s->n_wrong, s->n_compared), s->n_compared, s->n_shadow, s->mean);
	printf("  on the wrong side of an edge       %" PRIu64 ", by p99 %.2f, max %.2f pixels\n", s->n_misplaced, s->seam_p99,
	       s->seam_max);
}

static int print_json(const struct accuracy_result *result, struct psr_error *err)
{
	const struct psr_accuracy *a = &result->depth;
	const struct psr_color_accuracy *color = &result->color;
	const struct psr_shadow_accuracy *shadow = &result->shadow;
	cJSON *root = cJSON_CreateObject();

	cJSON_AddNumberToObject(root, "truth", (double)a->n_truth);
	cJSON_AddNumberToObject(root, "inside", (double)a->n_inside);
	cJSON_AddNumberToObject(root, "inside_empty", (double)a->n_inside_empty);
	cJSON_AddNumberToObject(root, "holes", (double)a->n_holes);
	cJSON_AddNumberToObject(root, "holes_fraction", fraction(a->n_holes, a->n_inside));
	cJSON_AddNumberToObject(root, "outside_drawn", (double)a->n_outside_drawn);
	cJSON_AddNumberToObject(root, "compared", (double)a->n_compared);
	cJSON_AddNumberToObject(root, "distance_p50", a->distance_p50);
	cJSON_AddNumberToObject(root, "distance_p99", a->distance_p99);
	cJSON_AddNumberToObject(root, "distance_p999", a->distance_p999);
	cJSON_AddNumberToObject(root, "distance_max", a->distance_max);
	if (result->has_color) {
		cJSON_AddNumberToObject(root, "color_compared", (double)color->n_compared);
		cJSON_AddNumberToObject(root, "color_wrong", (double)color->n_wrong);
		cJSON_AddNumberToObject(root, "color_mean", color->mean);
	}
	if (result->has_shadow) {
		cJSON_AddNumberToObject(root, "shadow_compared", (double)shadow->n_compared);
		cJSON_AddNumberToObject(root, "shadow_in_shadow", (double)shadow->n_shadow);
		cJSON_AddNumberToObject(root, "shadow_wrong", (double)shadow->n_wrong);
		cJSON_AddNumberToObject(root, "shadow_misplaced", (double)shadow->n_misplaced);
		cJSON_AddNumberToObject(root, "shadow_mean", shadow->mean);
		cJSON_AddNumberToObject(root, "shadow_seam_p99", shadow->seam_p99);
		cJSON_AddNumberToObject(root, "shadow_seam_max", shadow->seam_max);
	}
	cJSON_AddStringToObject(root, "verdict", accuracy_verdict_name(result->verdict));
	return json_print(root, err);
}

int accuracy_print(const struct accuracy_result *result, int is_json, struct psr_error *err)
{
	int code = PSR_OK;

	if (is_json) {
		code = print_json(result, err);
		if (result->verdict != ACCURACY_PASS)
			fprintf(stderr, "psr-model accuracy: %s\n", result->text);
	} else {
		print_text(&result->depth);
		if (result->has_color)
			print_color_text(&result->color);
		if (result->has_shadow)
			print_shadow_text(&result->shadow);
		puts(result->text);
	}
	return code == PSR_OK ? outfile_flush_stdout(err) : code;
}
