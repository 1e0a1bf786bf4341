/* Masks of screen regions ([G] 6.3). */
#ifndef PSR_RENDER_SCREEN_H
#define PSR_RENDER_SCREEN_H

#include <stdint.h>

#define SCREEN_WORDS 8
#define SCREEN_MOST 6 /* subdivisions */
#define SCREEN_NODES (2 << 2 * SCREEN_MOST)

/* A binary tree over 2^n x 2^n regions of the screen, which is -1..1 in x and y: node 1 is the screen, children of node
 * i are 2i and 2i + 1, halves in x at even depths and in y at odd ones. Bit t of a node's mask is set iff some
 * direction from a point that is seen in the node to the eye lies in triangle t. */
struct screen {
	int n;
	uint64_t (*mask)[SCREEN_WORDS]; /* SCREEN_NODES; owned by the caller */
};

/* For an eye whose rays go through (x * tangent[0], y * tangent[1], 1) for screen point x, y, in the frame with rows
 * right, down, forward; triangles are those of level `level` of base/direction.h. */
void screen_make(struct screen *screen, int n, const double frame[3][3], const double tangent[2], int level);

/* The smallest node that holds a rectangle of the screen. */
int screen_node(const struct screen *screen, double x0, double y0, double x1, double y1);

#endif
