/* Guests: connections that are not clients yet. When one too many comes, doors.c says which has to leave: the one that
 * has waited longest of the origin with the most guests. So neither many silent connections nor a flood of them keeps
 * out a client that introduces itself. No sockets, no clock. */
#ifndef PSRD_DOORS_H
#define PSRD_DOORS_H

#include <stdint.h>
#include <sys/socket.h>

struct doors_origin;

struct doors_guest { /* part of its owner; origin is NULL while the guest is not at the doors */
	struct doors_guest *next, *previous;
	struct doors_origin *origin;
};

struct doors {
	struct doors_origin *first; /* in the order of arrival */
	unsigned n, max, max_per_origin; /* guests; at least 1 */
};

void doors_init(struct doors *doors, unsigned max, unsigned max_per_origin);

/* Takes a guest in. Returns the guest that has to leave for it, or NULL; or the newcomer itself if there is no memory.
 * The caller closes that guest's connection, which calls doors_leave(). */
struct doors_guest *doors_enter(struct doors *doors, struct doors_guest *guest, uint64_t origin);
void doors_leave(struct doors *doors, struct doors_guest *guest); /* does nothing if the guest is not there */
void doors_hurry(struct doors_guest *guest); /* the guest has been refused: it leaves first */
struct doors_guest *doors_oldest(const struct doors *doors);      /* the guest that the next one replaces, or NULL */

/* Finds a connection's origin: its address; of IPv6 the network of 64 bits; of a Unix socket the process. All addresses
 * of this machine are one origin. */
uint64_t doors_origin_of(int fd, const struct sockaddr_storage *address);

#endif
