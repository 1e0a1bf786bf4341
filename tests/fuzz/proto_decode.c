/* Everything that reads bytes of a peer. Properties, whatever the bytes are: a stream gives the same messages in any
 * splits; what a decoder takes encodes to the very bytes that it came from, but for values that fall back and bytes behind
 * the last field. */
#include <stdlib.h>
#include <string.h>
#include "tests/unit/proto/table.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

#define REQUIRE(x) ((x) ? (void)0 : abort())

static uint8_t bytes[PSR_WIRE_MAX_MESSAGE], storage[2 * PSR_WIRE_MAX_MESSAGE];
static union proto_any msg;

static void decode(const struct proto_case *kind, const uint8_t *payload, size_t n)
{
	struct psr_buf out = { bytes, 0, sizeof bytes };
	struct psr_error err = { 0, "" };
	int result;

	if (!kind->decode || n > PSR_WIRE_MAX_PAYLOAD)
		return;
	result = kind->decode(&msg, payload, n, &err);
	REQUIRE(result == err.code && (result == PSR_OK) == (err.text[0] == 0));
	REQUIRE(result == PSR_OK || result == PSR_ERR_PROTOCOL || result == PSR_ERR_ARG || result == PSR_ERR_LIMIT ||
	        result == PSR_ERR_VERSION);
	if (result != PSR_OK)
		return;
	REQUIRE(proto_is_kept(kind, &out, &msg, payload, n));
}

/* Takes the stream in pieces of `piece` bytes; gives a number that depends on all messages and the end. */
static uint64_t frame(const uint8_t *data, size_t n, enum psr_side peer, size_t piece)
{
	struct psr_framer framer;
	struct psr_message m;
	uint64_t sum = 0;
	int result = 0;

	psr_framer_init(&framer, peer, storage, sizeof storage);
	for (size_t at = 0; at < n && result >= 0;) {
		size_t room, take = n - at < piece ? n - at : piece;
		uint8_t *space = psr_framer_space(&framer, &room);

		REQUIRE(room > 0);
		take = take < room ? take : room;
		memcpy(space, data + at, take);
		psr_framer_filled(&framer, take);
		at += take;
		while ((result = psr_framer_next(&framer, &m, NULL)) > 0) {
			const struct proto_case *kind = proto_case_of(m.type);

			REQUIRE(kind && m.n <= PSR_WIRE_MAX_PAYLOAD);
			decode(kind, m.payload, m.n);
			for (size_t i = 0; i < m.n; i++)
				sum = (sum ^ m.payload[i]) * 0x100000001b3u;
			sum = (sum ^ m.type ^ (uint64_t)m.id << 16 ^ (uint64_t)m.view << 48) * 0x100000001b3u;
			if (m.type == PSR_MSG_HELLO)
				psr_framer_accept(&framer, storage, sizeof storage);
		}
	}
	return sum + (uint64_t)(uint32_t)result;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	for (int peer = PSR_CLIENT; peer <= PSR_SERVER; peer++)
		REQUIRE(frame(data, n, (enum psr_side)peer, n + 1) == frame(data, n, (enum psr_side)peer, n % 13 + 1));
	if (n >= PSR_HEADER_SIZE) { /* and each decoder, whatever the header says but the type */
		const struct proto_case *kind = &proto_cases[data[4] % N_PROTO_CASES];
		size_t payload = n - PSR_HEADER_SIZE;
		uint8_t *exact = malloc(payload + (payload == 0));

		REQUIRE(exact);
		memcpy(exact, data + PSR_HEADER_SIZE, payload);
		decode(proto_case_of(data[4]) ? proto_case_of(data[4]) : kind, exact, payload);
		free(exact);
	}
	return 0;
}
