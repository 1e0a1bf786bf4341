#include <liblzf/lzf.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "pcd_point.h"

#define MOST_GROWTH 88 /* three bytes of LZF become at most 264 */

static uint64_t get(const uint8_t *p, unsigned n)
{
	uint64_t x = 0;

	for (unsigned i = 0; i < n; i++)
		x |= (uint64_t)p[i] << 8 * i;
	return x;
}

static uint32_t bits_of(float x)
{
	uint32_t bits;

	memcpy(&bits, &x, sizeof bits);
	return bits;
}

static double number_of(uint64_t bits, const struct pcd_field *f)
{
	const uint32_t low = (uint32_t)bits;
	float single;
	double x;

	if (f->type == 'U')
		return (double)bits;
	if (f->type == 'I')
		return (double)((int64_t)(bits << (64 - 8 * f->size)) >> (64 - 8 * f->size));
	memcpy(&single, &low, sizeof single);
	memcpy(&x, &bits, sizeof x);
	return f->size == 4 ? (double)single : x;
}

/* The bits that stand for a colour in text: of a float, or of an integer of either sign. */
static uint32_t bits_of_text(double x, const struct pcd_field *f)
{
	if (f->type == 'F')
		return bits_of((float)x);
	return x > -0x1p31 && x < 0x1p32 ? (uint32_t)(int64_t)x : 0;
}

static const struct pcd_field *find_single(const struct pcd *pcd, const char *name)
{
	const struct pcd_field *f = pcd_find(pcd, name);

	return f != NULL && f->count == 1 ? f : NULL;
}

int pcd_roles_find(struct pcd_roles *roles, const struct pcd *pcd, struct psr_error *err)
{
	static const char *const names[PCD_ROLES] = { "x", "y", "z", "normal_x", "normal_y", "normal_z", "rgb", "intensity" };
	const struct pcd_field **f = roles->field;

	for (int i = 0; i < PCD_ROLES; i++)
		f[i] = find_single(pcd, names[i]);
	for (int i = PCD_X; i <= PCD_Z; i++)
		if (f[i] == NULL)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: no field %s of one value a point", pcd->path, names[i]);
	if (f[PCD_NORMAL_X] == NULL || f[PCD_NORMAL_Y] == NULL || f[PCD_NORMAL_Z] == NULL)
		f[PCD_NORMAL_X] = f[PCD_NORMAL_Y] = f[PCD_NORMAL_Z] = NULL;
	if (f[PCD_RGB] == NULL)
		f[PCD_RGB] = find_single(pcd, "rgba");
	if (f[PCD_RGB] != NULL && f[PCD_RGB]->size != 4)
		f[PCD_RGB] = NULL;
	if (f[PCD_RGB] != NULL)
		f[PCD_INTENSITY] = NULL;
	return PSR_OK;
}

int pcd_check_sizes(uint64_t *packed, const struct pcd *pcd, const uint8_t sizes[PCD_SIZES], struct psr_error *err)
{
	const uint64_t left = pcd->n_bytes - pcd->body;

	*packed = get(sizes, 4);
	if (left < PCD_SIZES || *packed > left - PCD_SIZES)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the compressed points are cut short", pcd->path);
	if (pcd->n_points > UINT32_MAX / pcd->record || get(sizes + 4, 4) != pcd->n_points * pcd->record ||
	    pcd->n_points * pcd->record > MOST_GROWTH * *packed)
		return psr_fail(err, PSR_ERR_FORMAT,
		                "%s: %llu points of %llu bytes, but %llu compressed bytes promise %llu", pcd->path,
		                (unsigned long long)pcd->n_points, (unsigned long long)pcd->record,
		                (unsigned long long)*packed, (unsigned long long)get(sizes + 4, 4));
	return PSR_OK;
}

int pcd_unpack(uint8_t **out, const struct pcd *pcd, const uint8_t *bytes, uint64_t packed, struct psr_error *err)
{
	const uint64_t size = pcd->n_points * pcd->record;

	*out = malloc(size);
	if (*out == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %llu points", pcd->path,
		                (unsigned long long)pcd->n_points);
	if (lzf_decompress(bytes, (unsigned)packed, *out, (unsigned)size) == size)
		return PSR_OK;
	free(*out);
	*out = NULL;
	return psr_fail(err, PSR_ERR_FORMAT, "%s: the compressed points are damaged", pcd->path);
}

void pcd_point_get(struct pcd_point *to, const struct pcd_roles *roles, const struct pcd *pcd, const uint8_t *points,
                   uint64_t i)
{
	*to = (struct pcd_point){ .rgb = 0 };
	for (int r = 0; r < PCD_ROLES; r++) {
		const struct pcd_field *f = roles->field[r];

		if (f == NULL)
			continue;
		const uint8_t *at = points + (pcd->data == PCD_COMPRESSED ? f->offset * pcd->n_points + i * f->size
		                                                          : i * pcd->record + f->offset);
		const uint64_t bits = get(at, f->size);

		to->value[r] = number_of(bits, f);
		if (r == PCD_RGB)
			to->rgb = (uint32_t)bits;
	}
}

static int is_space(uint8_t c)
{
	return c == ' ' || (c >= '\t' && c <= '\r');
}

int pcd_point_parse(struct pcd_point *to, const struct pcd_roles *roles, const struct pcd *pcd, const uint8_t **at,
                    const uint8_t *end, locale_t locale)
{
	const uint8_t *p = *at;

	*to = (struct pcd_point){ .rgb = 0 };
	for (uint64_t column = 0; column < pcd->columns; column++) {
		while (p < end && is_space(*p))
			p++;
		const uint8_t *word = p;

		while (p < end && !is_space(*p))
			p++;
		*at = p;
		if (p == word)
			return 0;
		for (int r = 0; r < PCD_ROLES; r++) {
			const struct pcd_field *f = roles->field[r];

			if (f == NULL || f->column != column)
				continue;
			if (!import_number(&to->value[r], word, (size_t)(p - word), locale))
				return 0;
			if (r == PCD_RGB)
				to->rgb = bits_of_text(to->value[r], f);
		}
	}
	return 1;
}
