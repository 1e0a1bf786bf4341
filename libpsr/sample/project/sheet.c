#include <math.h>
#include <string.h>
#include "base/array.h"
#include "base/cell.h"
#include "base/vec.h"
#include "sheet.h"

#define SIDE PSR_BLOCK_SIDE

void sheets_ray(const struct psr_projection *projection, double x, double y, struct ray *ray)
{
	for (int k = 0; k < 3; k++) {
		ray->origin[k] = x * (double)projection->axis[0][k] + y * (double)projection->axis[1][k]
		                 + SHEET_START * (double)projection->axis[2][k];
		ray->direction[k] = -(double)projection->axis[2][k];
	}
}

void sheets_fini(struct sheets *sheets)
{
	free(sheets->head);
	free(sheets->patch);
	free(sheets->sample);
	memset(sheets, 0, sizeof *sheets);
}

static uint32_t *head_of(const struct sheets *sheets, int col, int row)
{
	int side = 2 * sheets->reach;

	col += sheets->reach;
	row += sheets->reach;
	return col < 0 || row < 0 || col >= side || row >= side ? NULL
	                                                        : &sheets->head[(size_t)row * (size_t)side + (size_t)col];
}

void sheets_link(struct sheets *sheets, uint32_t p)
{
	struct patch *patch = &sheets->patch[p];
	uint32_t *at = head_of(sheets, patch->col, patch->row);

	while (*at != SHEET_NONE)
		at = &sheets->patch[*at].next;
	*at = p;
	patch->next = SHEET_NONE;
}

void sheets_triangle(const struct sheets *sheets, double x, double y, struct lattice_point corner[3])
{
	double spacing = (double)sheets->projection.spacing;
	double v = y / (0.86602540378443864676 * spacing), u = x / spacing;
	int row = cell_floor(v), shift = row & 1;
	double f = v - row, a = u - shift / 2.0, b = u - (1 - shift) / 2.0;
	int ca = cell_floor(a), cb = cell_floor(b);
	double ta = a - ca;

	if (f <= 2 * (ta < 0.5 ? ta : 1 - ta)) {
		corner[0] = (struct lattice_point){ row, ca };
		corner[1] = (struct lattice_point){ row, ca + 1 };
		corner[2] = (struct lattice_point){ row + 1, ca + shift };
	} else {
		corner[0] = (struct lattice_point){ row + 1, cb };
		corner[1] = (struct lattice_point){ row + 1, cb + 1 };
		corner[2] = (struct lattice_point){ row, cb + 1 - shift };
	}
}

static unsigned sample_at(struct lattice_point at)
{
	return (unsigned)(SIDE * (at.row & (SIDE - 1)) + (at.col & (SIDE - 1)));
}

static const uint32_t *head_at(const struct sheets *sheets, struct lattice_point at)
{
	return head_of(sheets, at.col >> 3, at.row >> 3);
}

/* Takes the sample of patch p if it is nearer than the one found before. */
static inline void look_at(const struct sheets *sheets, uint32_t p, float z, float *reach, struct sheet_ref *found)
{
	float d;

	if ((sheets->patch[p].mask >> found->sample & 1) == 0)
		return;
	d = fabsf(sheets->sample[p][found->sample].z - z);
	if (d <= *reach) {
		*reach = d;
		found->patch = p;
	}
}

static int is_near(const struct patch *patch, float z, float reach)
{
	return z - patch->high <= reach && patch->low - z <= reach;
}

struct sheet_ref sheets_find(const struct sheets *sheets, struct lattice_point at, float z, float reach)
{
	const uint32_t *head = head_at(sheets, at);
	struct sheet_ref found = { SHEET_NONE, sample_at(at) };

	for (uint32_t p = head != NULL ? *head : SHEET_NONE; p != SHEET_NONE; p = sheets->patch[p].next)
		if (is_near(&sheets->patch[p], z, reach))
			look_at(sheets, p, z, &reach, &found);
	return found;
}

void sheets_find_corners(const struct sheets *sheets, const struct lattice_point at[3], float z, float reach,
                         struct sheet_ref found[3])
{
	const uint32_t *head = head_at(sheets, at[0]);
	float left[3] = { reach, reach, reach };

	if (head != head_at(sheets, at[1]) || head != head_at(sheets, at[2])) {
		for (int k = 0; k < 3; k++)
			found[k] = sheets_find(sheets, at[k], z, reach);
		return;
	}
	for (int k = 0; k < 3; k++)
		found[k] = (struct sheet_ref){ SHEET_NONE, sample_at(at[k]) };
	for (uint32_t p = head != NULL ? *head : SHEET_NONE; p != SHEET_NONE; p = sheets->patch[p].next)
		for (int k = 0; k < 3 && is_near(&sheets->patch[p], z, reach); k++)
			look_at(sheets, p, z, &left[k], &found[k]);
}

struct sheet_ref sheets_room(const struct sheets *sheets, struct lattice_point at, float z, int two_sided)
{
	const uint32_t *head = head_at(sheets, at);
	struct sheet_ref room = { head != NULL ? *head : SHEET_NONE, sample_at(at) };

	for (; room.patch != SHEET_NONE; room.patch = sheets->patch[room.patch].next) {
		const struct patch *patch = &sheets->patch[room.patch];

		if (patch->kept != 0 && (patch->mask >> room.sample & 1) == 0 && patch->two_sided == two_sided
		    && fabsf(sheets->sample[room.patch][__builtin_ctzll(patch->kept)].z - z)
		       < SHEET_PATCH_STEPS / 2 * sheets->projection.spacing)
			break;
	}
	return room;
}

int sheets_add(struct sheets *sheets, struct lattice_point at, float z, uint32_t surface, int two_sided,
               struct sheet_ref *out)
{
	*out = sheets_room(sheets, at, z, two_sided);
	if (head_at(sheets, at) == NULL)
		return PSR_OK;
	if (out->patch == SHEET_NONE) {
		uint32_t p = sheets->n_patches, capacity = sheets->capacity;

		if (!ARRAY_ROOM(sheets->patch, p, capacity) || !ARRAY_ROOM(sheets->sample, p, sheets->capacity))
			return PSR_ERR_MEMORY;
		sheets->n_patches++;
		memset(&sheets->patch[p], 0, sizeof sheets->patch[p]);
		memset(sheets->sample[p], 0, sizeof sheets->sample[p]);
		sheets->patch[p].col = (int16_t)(at.col >> 3);
		sheets->patch[p].row = (int16_t)(at.row >> 3);
		sheets->patch[p].two_sided = (uint8_t)two_sided;
		sheets_link(sheets, p);
		out->patch = p;
	}
	patch_put(&sheets->patch[out->patch], out->sample, z);
	sheets->patch[out->patch].moved |= UINT64_C(1) << out->sample;
	sheets->sample[out->patch][out->sample] = (struct sheet_sample){ z, surface };
	return PSR_OK;
}

void sheets_position(const struct sheets *sheets, struct sheet_ref ref, float position[3])
{
	const struct patch *patch = &sheets->patch[ref.patch];
	double x, y, inner[3];

	sheets_point(sheets, SIDE * patch->row + (int)(ref.sample / SIDE), SIDE * patch->col + (int)(ref.sample % SIDE), &x,
	             &y);
	projection_inner(&sheets->projection, x, y, (double)sheets->sample[ref.patch][ref.sample].z, inner);
	v3f_set(position, (float)inner[0], (float)inner[1], (float)inner[2]);
}
