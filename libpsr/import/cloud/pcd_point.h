/* PCD, what its two readers share: points of a whole file in memory (pcd.c), and as they come (points/pcd_points.c). */
#ifndef PSR_IMPORT_CLOUD_PCD_POINT_H
#define PSR_IMPORT_CLOUD_PCD_POINT_H

#include "pcd.h"

enum pcd_role { PCD_X, PCD_Y, PCD_Z, PCD_NORMAL_X, PCD_NORMAL_Y, PCD_NORMAL_Z, PCD_RGB, PCD_INTENSITY, PCD_ROLES };

/* Fields by role; NULL: none. There is either no normal or all of it, and no intensity beside a colour. */
struct pcd_roles {
	const struct pcd_field *field[PCD_ROLES];
};

/* A point's values, 0 where it has no such field; `rgb` has red in bits 16 to 23. */
struct pcd_point {
	double value[PCD_ROLES];
	uint32_t rgb;
};

int pcd_roles_find(struct pcd_roles *roles, const struct pcd *pcd, struct psr_error *err); /* FORMAT: no x, y or z */

/* Reads point i of binary points, compressed ones unpacked. */
void pcd_point_get(struct pcd_point *to, const struct pcd_roles *roles, const struct pcd *pcd, const uint8_t *points,
                   uint64_t i);

/* Reads the next point's words of text, which may be in several lines. Returns 0 if one is missing, or is not a number
 * where one is needed. */
int pcd_point_parse(struct pcd_point *to, const struct pcd_roles *roles, const struct pcd *pcd, const uint8_t **at,
                    const uint8_t *end, locale_t locale);

#define PCD_SIZES 8 /* bytes of compressed points before them: sizes, packed and not */

/* Checks the sizes of compressed points; *packed: bytes of them behind the sizes. FORMAT. */
int pcd_check_sizes(uint64_t *packed, const struct pcd *pcd, const uint8_t sizes[PCD_SIZES], struct psr_error *err);

/* Unpacks LZF: the values of a field for all points, then those of the next field. The caller frees. FORMAT, MEMORY. */
int pcd_unpack(uint8_t **out, const struct pcd *pcd, const uint8_t *bytes, uint64_t packed, struct psr_error *err);

#endif
