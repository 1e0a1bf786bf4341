#include "wire.h"

static void layout_superseded(struct wire *w, void *p)
{
	struct psr_msg_superseded *m = p;
	wire_u32(w, &m->by);
}

static int check_superseded(const void *p, struct psr_error *err)
{
	const struct psr_msg_superseded *m = p;
	return check_integer("the id that supersedes", m->by, 2, UINT32_MAX, err);
}

int psr_msg_superseded_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_superseded *msg,
                              struct psr_error *err)
{
	return wire_encode(out, WIRE(SUPERSEDED, layout_superseded, check_superseded), id, view, msg, err);
}

int psr_msg_superseded_decode(struct psr_msg_superseded *msg, const uint8_t *payload, size_t n, struct psr_error *err)
{
	return wire_decode(msg, WIRE(SUPERSEDED, layout_superseded, check_superseded), payload, n, err);
}

static void layout_ack(struct wire *w, void *p)
{
	struct psr_msg_ack *m = p;
	wire_u16(w, &m->pass);
	wire_reserved(w, 2);
}

int psr_msg_ack_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_ack *msg,
                       struct psr_error *err)
{
	return wire_encode(out, WIRE(ACK, layout_ack, NULL), id, view, msg, err);
}

int psr_msg_ack_decode(struct psr_msg_ack *msg, const uint8_t *payload, size_t n, struct psr_error *err)
{
	return wire_decode(msg, WIRE(ACK, layout_ack, NULL), payload, n, err);
}

int psr_msg_cancelled_encode(struct psr_buf *out, uint32_t id, uint16_t view, struct psr_error *err)
{
	return wire_encode(out, WIRE(CANCELLED, NULL, NULL), id, view, NULL, err);
}

int psr_msg_cancel_encode(struct psr_buf *out, uint32_t id, uint16_t view, struct psr_error *err)
{
	return wire_encode(out, WIRE(CANCEL, NULL, NULL), id, view, NULL, err);
}

int psr_msg_pause_encode(struct psr_buf *out, uint16_t view, struct psr_error *err)
{
	return wire_encode(out, WIRE(PAUSE, NULL, NULL), 0, view, NULL, err);
}

int psr_msg_resume_encode(struct psr_buf *out, uint16_t view, struct psr_error *err)
{
	return wire_encode(out, WIRE(RESUME, NULL, NULL), 0, view, NULL, err);
}

int psr_msg_stats_encode(struct psr_buf *out, uint32_t id, struct psr_error *err)
{
	return wire_encode(out, WIRE(STATS, NULL, NULL), id, 0, NULL, err);
}

static void layout_stats_reply(struct wire *w, void *p)
{
	struct psr_msg_stats_reply *m = p;
	wire_u16(w, &m->n_stats);
	wire_reserved(w, 6);
	if (m->n_stats > PSR_WIRE_MAX_STATS) {
		wire_fail(w, PSR_ERR_LIMIT, "statistics have more than 64 entries");
		return;
	}
	for (unsigned i = 0; i < m->n_stats && w->code == PSR_OK; i++) {
		wire_u16(w, &m->stat[i].id);
		wire_u64(w, &m->stat[i].value);
	}
}

static int check_stats_reply(const void *p, struct psr_error *err)
{
	const struct psr_msg_stats_reply *m = p;
	uint16_t last = 0;
	if (m->n_stats > PSR_WIRE_MAX_STATS)
		return psr_fail(err, PSR_ERR_LIMIT, "statistics have %u entries, and hold at most %d", m->n_stats,
		                PSR_WIRE_MAX_STATS);
	for (unsigned i = 0; i < m->n_stats; last = m->stat[i].id, i++) {
		if (m->stat[i].id <= last)
			return psr_fail(err, PSR_ERR_ARG, "entry %u of statistics has id %u after %u: ids rise", i, m->stat[i].id,
			                last);
		if (check_integer("a statistic", m->stat[i].value, 0, PSR_WIRE_MAX_INTEGER, err))
			return PSR_ERR_ARG;
	}
	return PSR_OK;
}

int psr_msg_stats_reply_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_stats_reply *msg,
                               struct psr_error *err)
{
	return wire_encode(out, WIRE(STATS_REPLY, layout_stats_reply, check_stats_reply), id, 0, msg, err);
}

int psr_msg_stats_reply_decode(struct psr_msg_stats_reply *msg, const uint8_t *payload, size_t n,
                               struct psr_error *err)
{
	return wire_decode(msg, WIRE(STATS_REPLY, layout_stats_reply, check_stats_reply), payload, n, err);
}
