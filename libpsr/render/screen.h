/* Visibility masks of screen regions ([G] 6.3). */
#ifndef PSR_RENDER_SCREEN_H
#define PSR_RENDER_SCREEN_H

#include <stdint.h>

#define SCREEN_WORDS 8
#define SCREEN_MOST 6 /* subdivisions */
#define SCREEN_NODES (2 << 2 * SCREEN_MOST)

/* A binary tree over 2^n x 2^n regions of the screen, -1..1 in x and y. Node 1 is the screen; node i has children 2i
 * and 2i + 1, halves in x at even depths and in y at odd ones. Bit t of a node's mask is set iff, from some point seen
 * in the node, the direction to the eye lies in triangle t. */
struct screen {
	int n;
	uint64_t (*mask)[SCREEN_WORDS]; /* SCREEN_NODES; owned by the caller */
};

/* Makes the tree of an eye whose ray through screen point x, y is (x * tangent[0], y * tangent[1], 1) in the axes
 * right, down, forward. Triangles are those of level `level` of base/direction.h. */
void screen_make(struct screen *screen, int n, const double axes[3][3], const double tangent[2], int level);

/* Finds the smallest node that contains a rectangle of the screen. */
int screen_node(const struct screen *screen, double x0, double y0, double x1, double y1);

#endif
