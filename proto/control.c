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

WIRE_VIEW(superseded, SUPERSEDED, check_superseded)

static void layout_ack(struct wire *w, void *p)
{
	struct psr_msg_ack *m = p;

	wire_u16(w, &m->pass);
	wire_reserved(w, 2);
}

WIRE_VIEW(ack, ACK, NULL)

WIRE_EMPTY_VIEW(cancelled, CANCELLED)
WIRE_EMPTY_VIEW(cancel, CANCEL)
WIRE_EMPTY_VIEW(pause, PAUSE)
WIRE_EMPTY_VIEW(resume, RESUME)
WIRE_EMPTY_ID(stats, STATS)

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

WIRE_ID(stats_reply, STATS_REPLY, check_stats_reply)
