#define _GNU_SOURCE
#include <netinet/in.h>
#include <stdlib.h>
#include "doors.h"

#define TAG_HERE (UINT64_C(1) << 56) /* in the byte that begins an IPv6 network; no network begins with any of these */
#define TAG_IPV4 (UINT64_C(2) << 56)
#define TAG_PROCESS (UINT64_C(3) << 56)

struct doors_origin {
	struct doors_origin *next;
	uint64_t key;
	unsigned n;
	struct doors_guest *first, *last;
};

void doors_init(struct doors *doors, unsigned max, unsigned max_per_origin)
{
	*doors = (struct doors){ .max = max, .max_per_origin = max_per_origin };
}

static struct doors_origin *find(struct doors *doors, uint64_t key)
{
	struct doors_origin **at = &doors->first;

	while (*at != NULL && (*at)->key != key)
		at = &(*at)->next;
	if (*at == NULL) {
		*at = calloc(1, sizeof **at);
		if (*at != NULL)
			(*at)->key = key;
	}
	return *at;
}

struct doors_guest *doors_oldest(const struct doors *doors)
{
	const struct doors_origin *most = doors->first;

	if (most == NULL)
		return NULL;
	for (const struct doors_origin *origin = most->next; origin != NULL; origin = origin->next)
		if (origin->n > most->n)
			most = origin;
	return most->first;
}

struct doors_guest *doors_enter(struct doors *doors, struct doors_guest *guest, uint64_t key)
{
	struct doors_origin *origin = find(doors, key);
	struct doors_guest *leaves = NULL;

	if (origin == NULL)
		return guest;
	if (origin->n >= doors->max_per_origin)
		leaves = origin->first;
	else if (doors->n >= doors->max)
		leaves = doors_oldest(doors);
	*guest = (struct doors_guest){ .previous = origin->last, .origin = origin };
	if (origin->last != NULL)
		origin->last->next = guest;
	else
		origin->first = guest;
	origin->last = guest;
	origin->n++;
	doors->n++;
	return leaves;
}

static void unlink_guest(struct doors_guest *guest)
{
	struct doors_origin *origin = guest->origin;

	*(guest->previous != NULL ? &guest->previous->next : &origin->first) = guest->next;
	*(guest->next != NULL ? &guest->next->previous : &origin->last) = guest->previous;
}

void doors_leave(struct doors *doors, struct doors_guest *guest)
{
	struct doors_origin *origin = guest->origin, **at = &doors->first;

	if (origin == NULL)
		return;
	unlink_guest(guest);
	guest->origin = NULL;
	doors->n--;
	if (--origin->n > 0)
		return;
	while (*at != origin)
		at = &(*at)->next;
	*at = origin->next;
	free(origin);
}

void doors_hurry(struct doors_guest *guest)
{
	struct doors_origin *origin = guest->origin;

	if (origin == NULL || origin->first == guest)
		return;
	unlink_guest(guest);
	guest->previous = NULL;
	guest->next = origin->first;
	origin->first->previous = guest;
	origin->first = guest;
}

static uint64_t big_endian(const uint8_t *bytes, int n)
{
	uint64_t value = 0;

	for (int i = 0; i < n; i++)
		value = value << 8 | bytes[i];
	return value;
}

static uint64_t origin_of_v4(uint64_t address)
{
	return address >> 24 == 127 ? TAG_HERE : TAG_IPV4 | address;
}

uint64_t doors_origin_of(int fd, const struct sockaddr_storage *address)
{
	struct ucred peer = { .pid = 0 };
	socklen_t n = sizeof peer;

	if (address->ss_family == AF_INET)
		return origin_of_v4(ntohl(((const struct sockaddr_in *)(const void *)address)->sin_addr.s_addr));
	if (address->ss_family == AF_INET6) {
		const struct in6_addr *a = &((const struct sockaddr_in6 *)(const void *)address)->sin6_addr;

		if (IN6_IS_ADDR_LOOPBACK(a))
			return TAG_HERE;
		return IN6_IS_ADDR_V4MAPPED(a) ? origin_of_v4(big_endian(a->s6_addr + 12, 4)) : big_endian(a->s6_addr, 8);
	}
	getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &n);
	return TAG_PROCESS | (uint32_t)peer.pid;
}
