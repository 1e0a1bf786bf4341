/* How long a peer has been silent, and what psrd does about it. A state machine without a socket; its user gives the
 * time. */
#ifndef PSRD_SILENCE_H
#define PSRD_SILENCE_H

#include <stdint.h>

enum silence_verdict {
	SILENCE_FINE,
	SILENCE_PING, /* half of the time is over: send a PING to ask for a sign of life */
	SILENCE_IDLE, /* the time is over, half of it since the PING, and the peer has no open requests */
	SILENCE_DEAD, /* the peer has open requests, and has not answered a PING for the whole time */
};

struct silence {
	uint64_t heard_us;  /* last bytes from the peer, or last time that it took bytes */
	uint64_t pinged_us; /* a PING since then; 0: none */
};

static inline void silence_heard(struct silence *silence, uint64_t now_us)
{
	*silence = (struct silence){ .heard_us = now_us };
}

/* limit_us: --idle-timeout; 0: never. is_busy: the peer has open requests. */
static inline enum silence_verdict silence_look(struct silence *silence, uint64_t now_us, uint64_t limit_us,
                                                int is_busy)
{
	uint64_t lasts_us = now_us > silence->heard_us ? now_us - silence->heard_us : 0;

	if (limit_us == 0 || lasts_us < limit_us / 2)
		return SILENCE_FINE;
	if (silence->pinged_us == 0) {
		silence->pinged_us = now_us;
		return SILENCE_PING;
	}
	if (is_busy)
		return now_us - silence->pinged_us >= limit_us ? SILENCE_DEAD : SILENCE_FINE;
	return lasts_us >= limit_us && now_us - silence->pinged_us >= limit_us / 2 ? SILENCE_IDLE : SILENCE_FINE;
}

#endif
