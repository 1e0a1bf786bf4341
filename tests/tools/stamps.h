/* A second clock for frames: reads the messages that pass both ways of a connection, and writes a line for each frame:
 * microseconds from the request's last byte to its FRAME_END's. The bytes are psr's and psrd's own, and are believed. */
#ifndef TESTS_TOOLS_STAMPS_H
#define TESTS_TOOLS_STAMPS_H

#include <stdint.h>
#include <stdio.h>
#include "proto/proto.h"

#define STAMPS_OPEN 256 /* ids that are remembered, by their remainder */

struct stamps_reader { /* of one way */
	uint8_t header[PSR_HEADER_SIZE];
	size_t n, left;    /* bytes of the header; bytes of the payload still to come */
};

struct stamps { /* of a connection; zeroed at first */
	struct stamps_reader reader[2];
	uint64_t asked_ns[STAMPS_OPEN];
};

static inline uint32_t stamps_number(const uint8_t *at, int n_bytes)
{
	uint32_t number = 0;

	for (int i = 0; i < n_bytes; i++)
		number |= (uint32_t)at[i] << 8 * i;
	return number;
}

/* n bytes have passed, upwards (0) or downwards (1). */
static inline void stamps_take(struct stamps *stamps, int way, const uint8_t *bytes, size_t n, uint64_t now_ns, FILE *to)
{
	struct stamps_reader *reader = &stamps->reader[way];

	for (size_t i = 0; i < n;) {
		uint32_t type, id;

		if (reader->n < PSR_HEADER_SIZE) {
			reader->header[reader->n++] = bytes[i++];
			if (reader->n < PSR_HEADER_SIZE)
				continue;
			reader->left = stamps_number(reader->header, 4) - PSR_HEADER_SIZE;
		} else {
			const size_t part = n - i < reader->left ? n - i : reader->left;

			reader->left -= part;
			i += part;
		}
		if (reader->left > 0)
			continue;
		type = stamps_number(reader->header + 4, 2);
		id = stamps_number(reader->header + 8, 4);
		if (way == 0 && type == PSR_MSG_FRAME)
			stamps->asked_ns[id % STAMPS_OPEN] = now_ns;
		else if (way == 1 && type == PSR_MSG_FRAME_END)
			fprintf(to, "%.3f\n", (double)(now_ns - stamps->asked_ns[id % STAMPS_OPEN]) / 1e3);
		reader->n = 0;
	}
}

#endif
