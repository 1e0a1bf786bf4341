/* The masks of quantised EWA splats ([B] 5.2): Gaussians in the picture, averaged over pixels, by shape, place and size.
 *
 * A leaf with a normal is a Gaussian on its plane, exp(-d^2 / (2 s^2)) at the distance d from its place, of which s is
 * EWA_SIGMA edges. Its picture is a Gaussian again: that of a disc whose wider radius has the length of some edge in
 * pixels, as a *tilt* m, a unit vector, sees it: of covariance (1 - m_x^2, -m_x m_y, 1 - m_y^2) times that of the edge.
 * libpsr/simd/masks/make.c computes the table when the library is built. */
#ifndef PSR_SIMD_EWA_MASKS_H
#define PSR_SIMD_EWA_MASKS_H

#include <stdint.h>

#define EWA_SIGMA 0.5f
#define EWA_SHAPES 64 /* tilts of an octant: its face of the octahedron, refined three times */
#define EWA_SECTORS 4 /* quarters of the pixel where the middle may be: 1 for its right half, 2 for its lower one */
#define EWA_SIZES 10
#define EWA_MASKS (EWA_SHAPES * EWA_SECTORS * EWA_SIZES)
#define EWA_MOST_RADIUS 7
#define EWA_SIDE(radius) (2 * (radius) + 1)
#define EWA_BYTES 172544 /* of all masks */
#define EWA_BEYOND 8     /* bytes behind them that vectors may read */

/* A size is for edges up to `edge` pixels, and from the one before; its masks have 2 radius + 1 pixels a side, of which
 * the middle 2 core_radius + 1 hold all cores. From one to the next edges grow by the cube root of 2; up to the first
 * one a pixel's samples leave no pixel of a surface open, see CUBES_SPACING. The others reach 1.2 edges at least. */
struct ewa_size {
	float edge;
	uint32_t radius, core_radius;
	uint32_t first; /* place in ewa_weight */
};
extern const struct ewa_size ewa_size[EWA_SIZES];

/* By size, shape, sector, row and column: 255 times the Gaussian's mean in the pixel. */
extern const uint8_t ewa_weight[EWA_BYTES + EWA_BEYOND];
/* By size, shape and sector: a pixel of this weight is the leaf's own, others' colours are mixed with it alone. */
extern const uint8_t ewa_core[EWA_MASKS];

/* The pixels of cores that reach EWA_CORE_RADIUS pixels at most, of masks up to size EWA_NARROW: bit EWA_CORE_SIDE * row
 * + column, of which the middle one is EWA_CORE_RADIUS in both. */
#define EWA_NARROW 6
#define EWA_CORE_RADIUS 2
#define EWA_CORE_SIDE EWA_SIDE(EWA_CORE_RADIUS)
#define EWA_NARROW_MASKS ((EWA_NARROW + 1) * EWA_SHAPES * EWA_SECTORS)
extern const uint32_t ewa_core_bits[EWA_NARROW_MASKS];

/* For edges beyond the sizes: 255 exp(-q / 2) in the middle of steps of q, 1 / EWA_STEPS each, up to EWA_MOST_SQUARE. */
#define EWA_STEPS 32
#define EWA_MOST_SQUARE 6.25f
#define EWA_BELL 200
extern const uint8_t ewa_bell[EWA_BELL];

/* Returns the number of the mask among all. */
static inline uint32_t ewa_number(uint32_t size, uint32_t shape, uint32_t sector)
{
	return (size * EWA_SHAPES + shape) * EWA_SECTORS + sector;
}

/* Finds a shape's tilt, of any length and 0 or more in all components: the middle of its triangle. Shapes are cells of 8
 * rows by m_y / (m_x + m_y + m_z), columns by m_x. Triangles that fill a cell's lower half are those of the octant's
 * cells; the others' cells have been turned around the middle to fill the square. */
static inline void ewa_tilt(float m[3], uint32_t shape)
{
	const uint32_t row = shape / 8, column = shape % 8;
	const int is_turned = row + column > 7;
	const float third = is_turned ? 2.0f / 3 : 1.0f / 3;

	m[0] = (float)(is_turned ? 7 - column : column) + third;
	m[1] = (float)(is_turned ? 7 - row : row) + third;
	m[2] = (8 - m[0]) - m[1];
}

#endif
