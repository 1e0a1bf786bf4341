#include "expect.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "client/output/output.h"

#define HASH_DIGITS 16
#define DEFAULT_DRAWS 9

void expect_init(struct expect *expect)
{
	memset(expect, 0, sizeof *expect);
	for (int i = 0; i < EXPECT_N_METRICS; i++)
		expect->bound[i] = NAN;
}

void expect_begin(struct expect *expect)
{
	memset(expect->is_said, 0, sizeof expect->is_said);
}

void expect_fini(struct expect *expect)
{
	for (int i = 0; i < PSR_N_PLANES; i++)
		free(expect->hash[i].value);
}

/* ---- words ---- */

static int on_hash(const char *text, void *userdata, struct psr_error *err)
{
	struct expect *expect = ((struct expect_reader *)userdata)->expect;
	const size_t n = strcspn(text, ":");
	unsigned plane = PSR_PLANE_COLOR;

	if (text[n] == ':') {
		while (plane < PSR_N_PLANES
		       && (strlen(psr_plane_name(plane)) != n || memcmp(psr_plane_name(plane), text, n) != 0))
			plane++;
		if (plane == PSR_N_PLANES)
			return psr_fail(err, PSR_ERR_ARG, "there is no plane '%.*s'; there are color, depth, normal, id, weight, "
			                "words and block", (int)(n < 40 ? n : 40), text);
		text += n + 1;
	}
	if (strcmp(text, "?") != 0 && strspn(text, "0123456789abcdef,") != strlen(text))
		return psr_fail(err, PSR_ERR_ARG, "'%.40s' is no hash: it has %d digits 0-9 and a-f, or is ? while it is not "
		                "known", text, HASH_DIGITS);
	expect->hash[plane].text = text;
	return PSR_OK;
}

static int on_off(const char *text, void *userdata, struct psr_error *err)
{
	struct expect *expect = ((struct expect_reader *)userdata)->expect;
	const char *at;
	double codes, share;

	if (psr_parse_real(text, &codes, &at, NULL) != PSR_OK || !(codes >= 0 && codes <= 255) || codes != floor(codes)
	    || *at != ':' || psr_parse_real(at + 1, &share, &at, NULL) != PSR_OK || strcmp(at, "%") != 0
	    || !(share >= 0 && share <= 100))
		return psr_fail(err, PSR_ERR_ARG, "'%.40s' is not CODES:SHARE%%, such as 16:0.1%% for at most 0.1 %% of the "
		                "pixels off by more than 16 of 255 codes", text);
	expect->off_codes = (unsigned)codes;
	expect->bound[EXPECT_OFF] = share / 100;
	return PSR_OK;
}

/* Behind the ratio: ,of=TEST[,n=N]. Names of tests have no commas. */
static int on_time(const char *text, void *userdata, struct psr_error *err)
{
	struct expect_reader *reader = userdata;
	struct expect *expect = reader->expect;
	const char *at, *n;
	double draws = DEFAULT_DRAWS;

	if (psr_parse_real(text, &expect->ratio, &at, NULL) != PSR_OK || !(expect->ratio > 0)
	    || strncmp(at, ",of=", 4) != 0 || at[4] == '\0' || at[4] == ',')
		return psr_fail(err, PSR_ERR_ARG, "'%.60s' is not RATIO,of=TEST[,n=N], such as 0.5,of=large for half of the time "
		                "of the test `large`", text);
	expect->of = at + 4;
	n = strchr(expect->of, ',');
	if (n != NULL && (strncmp(n, ",n=", 3) != 0 || psr_parse_real(n + 3, &draws, &at, NULL) != PSR_OK || *at != '\0'
	                  || !(draws >= 1 && draws <= EXPECT_MOST_DRAWS) || draws != floor(draws)))
		return psr_fail(err, PSR_ERR_ARG, "'%.60s': behind the test stands ,n=N, where N draws are 1 to %d", text,
		                EXPECT_MOST_DRAWS);
	expect->n_draws = (int64_t)draws;
	expect->time_line = reader->file->line;
	expect->time_column = reader->file->column;
	return PSR_OK;
}

/* The words of psr_strerror() with dashes. */
static int on_error(const char *text, void *userdata, struct psr_error *err)
{
	struct expect *expect = ((struct expect_reader *)userdata)->expect;

	for (int code = PSR_ERR_ARG; code >= PSR_ERR_INTERNAL; code--) {
		const char *name = psr_strerror(code);
		size_t i = 0;

		while (name[i] != '\0' && text[i] == (name[i] == ' ' ? '-' : name[i]))
			i++;
		if (name[i] == '\0' && text[i] == '\0') {
			expect->error = code;
			return PSR_OK;
		}
	}
	return psr_fail(err, PSR_ERR_ARG, "'%.40s' is no error; there are invalid-argument, not-found, bad-data, "
	                "not-supported, over-a-limit, busy, ...: the words of psr/error.h with dashes", text);
}

void expect_add_options(struct optlist *list, struct expect_reader *reader)
{
	struct expect *e = reader->expect;
	const struct psr_opt opts[] = {
		{ .name = "hash", .type = PSR_OPT_CALL, .value = reader, .arg = "[PLANE:]HASH", .call = on_hash },
		{ .name = "reference", .type = PSR_OPT_STRING, .value = &e->reference, .arg = "FILE" },
		{ .name = "exact", .type = PSR_OPT_FLAG, .value = &e->is_exact, .seen = &e->is_said[EXPECT_EXACT] },
		{ .name = "psnr", .type = PSR_OPT_REAL, .value = &e->bound[EXPECT_PSNR], .arg = "DB", .min = 0, .max = 1000,
		  .seen = &e->is_said[EXPECT_PSNR] },
		{ .name = "ssim", .type = PSR_OPT_REAL, .value = &e->bound[EXPECT_SSIM], .arg = "LEAST", .min = -1, .max = 1,
		  .seen = &e->is_said[EXPECT_SSIM] },
		{ .name = "flip", .type = PSR_OPT_REAL, .value = &e->bound[EXPECT_FLIP], .arg = "MOST", .min = 0, .max = 1,
		  .seen = &e->is_said[EXPECT_FLIP] },
		{ .name = "off", .type = PSR_OPT_CALL, .value = reader, .arg = "CODES:SHARE%", .call = on_off,
		  .seen = &e->is_said[EXPECT_OFF] },
		{ .name = "depth", .type = PSR_OPT_STRING, .value = &e->depth, .arg = "FILE" },
		{ .name = "depth-rmse", .type = PSR_OPT_REAL, .value = &e->bound[EXPECT_DEPTH], .arg = "MOST", .min = 0,
		  .max = PSR_WIRE_MAX_LENGTH, .seen = &e->is_said[EXPECT_DEPTH] },
		{ .name = "time", .type = PSR_OPT_CALL, .value = reader, .arg = "RATIO,of=TEST[,n=N]", .call = on_time },
		{ .name = "error", .type = PSR_OPT_CALL, .value = reader, .arg = "CODE", .call = on_error },
	};

	OPTLIST_ADD(list, opts);
}

/* ---- all words of a test ---- */

static int read_hashes(struct expect_hash *hash, uint32_t n, struct psr_error *err)
{
	const char *at = hash->text;
	uint32_t k = 0;

	if (strcmp(at, "?") == 0)
		return PSR_OK;
	hash->value = calloc(n, sizeof *hash->value);
	if (hash->value == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u hashes", n);
	for (;; k++) {
		const size_t digits = strcspn(at, ",");

		if (digits != HASH_DIGITS)
			return psr_fail(err, PSR_ERR_ARG, "hash: '%.*s' has %zu digits instead of %d",
			                (int)(digits < 40 ? digits : 40), at, digits, HASH_DIGITS);
		if (k < n)
			hash->value[k] = strtoull(at, NULL, 16); /* stops at the comma */
		at += digits;
		if (*at == '\0')
			break;
		at++;
	}
	if (k + 1 != n)
		return psr_fail(err, PSR_ERR_ARG, "hash: there are %u for %u pictures; ? stands for all of them while they are "
		                "not known", k + 1, n);
	return PSR_OK;
}

static int check_file(const char *word, const char *name, const char *ending, uint32_t n, struct psr_error *err)
{
	int is_numbered = 0;

	if (n > 1 && output_is_numbered(&is_numbered, name, err) != PSR_OK)
		return PSR_ERR_ARG;
	if (n > 1 && !is_numbered)
		return psr_fail(err, PSR_ERR_ARG, "%s: '%.100s' is one file for %u pictures; number them, as in 'a_%%02d%s'",
		                word, name, n, ending);
	if (strlen(name) <= strlen(ending) || strcmp(name + strlen(name) - strlen(ending), ending) != 0)
		return psr_fail(err, PSR_ERR_ARG, "%s: '%.100s' does not end in %s", word, name, ending);
	return PSR_OK;
}

static int says_color_bound(const struct expect *e)
{
	return e->is_said[EXPECT_EXACT] || e->is_said[EXPECT_PSNR] || e->is_said[EXPECT_SSIM] || e->is_said[EXPECT_FLIP]
	       || e->is_said[EXPECT_OFF];
}

static int has_color_bound(const struct expect *e)
{
	return !isnan(e->bound[EXPECT_PSNR]) || !isnan(e->bound[EXPECT_SSIM]) || !isnan(e->bound[EXPECT_FLIP])
	       || !isnan(e->bound[EXPECT_OFF]);
}

int expect_wants_hash(const struct expect *expect)
{
	for (int i = 0; i < PSR_N_PLANES; i++)
		if (expect->hash[i].text != NULL)
			return 1;
	return 0;
}

static int wants_picture(const struct expect *e)
{
	return e->reference != NULL || e->depth != NULL || e->of != NULL || expect_wants_hash(e);
}

int expect_finish(struct expect *e, uint32_t n_pictures, struct psr_error *err)
{
	int code = PSR_OK;

	if (e->error != PSR_OK && wants_picture(e))
		return psr_fail(err, PSR_ERR_ARG, "error excludes hash, reference, depth and time: there is no picture");
	for (int i = 0; i < PSR_N_PLANES && code == PSR_OK; i++)
		if (e->hash[i].text != NULL)
			code = read_hashes(&e->hash[i], n_pictures, err);
	if (code != PSR_OK)
		return code;
	if (e->error == PSR_OK && !wants_picture(e))
		return psr_fail(err, PSR_ERR_ARG, "the test expects nothing; it needs hash, reference, depth, time or error");
	if (e->reference == NULL && says_color_bound(e))
		return psr_fail(err, PSR_ERR_ARG, "exact, psnr, ssim, flip and off compare with a picture; reference=FILE says "
		                "which");
	if (e->depth != NULL ? isnan(e->bound[EXPECT_DEPTH]) : e->is_said[EXPECT_DEPTH])
		return psr_fail(err, PSR_ERR_ARG, "depth=FILE and depth-rmse=MOST go together");
	if (e->reference != NULL && !has_color_bound(e))
		e->is_exact = 1;
	if (e->reference != NULL)
		code = check_file("reference", e->reference, ".png", n_pictures, err);
	if (code == PSR_OK && e->depth != NULL)
		code = check_file("depth", e->depth, ".pfm", n_pictures, err);
	return code;
}

uint32_t expect_planes(const struct expect *expect)
{
	uint32_t planes = expect->depth != NULL ? 1 << PSR_PLANE_DEPTH : 0;

	for (int i = 0; i < PSR_N_PLANES; i++)
		if (expect->hash[i].text != NULL)
			planes |= 1u << i;
	return planes | 1 << PSR_PLANE_COLOR;
}
