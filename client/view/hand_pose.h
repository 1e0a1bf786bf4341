/* Shared by hand.c and hand_motion.c: the geometry of a pose. */
#ifndef PSR_CLIENT_VIEW_HAND_POSE_H
#define PSR_CLIENT_VIEW_HAND_POSE_H

#include "base/maths.h"
#include "hand.h"

#define PI 3.14159265358979323846

struct hand_frame {
	double right[3], up[3], forward[3]; /* orthonormal */
};
void hand_frame_of(struct hand_frame *frame, const struct hand_pose *pose);

double hand_box_size(const struct hand *hand);                   /* above 0 */
double hand_pixel_at(const struct hand *hand, double depth);     /* world units a pixel */
double hand_usable_depth(const struct hand *hand, double depth); /* or the pivot's, or the target's */

/* Takes the pose if it makes a valid camera; else ARG. */
int hand_take(struct hand *hand, const struct hand_pose *pose, struct psr_error *err);

void hand_move(struct hand *hand, const double by[3]);
/* About an axis of length 1, radians. */
void hand_turn_about(struct hand *hand, const double about[3], const double axis[3], double angle);
/* To the right about the model's way up, and up; it stops straight above and straight below. Radians. */
void hand_orbit(struct hand *hand, const double about[3], double right, double up);

#endif
