/* Which request of all flows comes next, and whether there is memory for it. */
#ifndef PSRD_SCHEDULE_CHOOSE_H
#define PSRD_SCHEDULE_CHOOSE_H

#include "schedule.h"

enum pool_class schedule_class(const struct schedule_request *request); /* of the frame that runs, or comes next */

/* The best one that may begin and was not looked at in this round, the one that starves first; NULL: none. */
struct schedule_request *schedule_choose(const struct schedule *schedule, uint64_t now_ns);

/* The request that has lacked memory for longest, if it could begin but for that, and smaller ones have gone by for
 * SCHEDULE_PATIENCE_NS since it first lacked memory and since a starving one began last; NULL: none. Frames that begin
 * from then on leave room for it: it begins when those before them have ended, and others have their time between two
 * that starve. *beside: bytes of the frames that run and began since it starves. */
struct schedule_request *schedule_starving(uint64_t *beside, const struct schedule *schedule, uint64_t now_ns);

enum schedule_fit {
	SCHEDULE_FITS,
	SCHEDULE_LACKS,           /* there is too little memory now */
	SCHEDULE_MUST_LEAVE_ROOM, /* for one that starves */
	SCHEDULE_NEVER_FITS,
};

/* Calls on_need() where that makes room. */
enum schedule_fit schedule_fit(struct schedule *schedule, const struct schedule_request *request, uint64_t now_ns);

#endif
