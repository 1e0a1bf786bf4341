#include "wire.h"

static void layout_fetch(struct wire *w, void *p)
{
	struct psr_msg_fetch *m = p;

	wire_u32(w, &m->handle);
	wire_reserved(w, 4);
	wire_u64(w, &m->offset);
	wire_u64(w, &m->length);
	wire_u64(w, &m->file_hash);
	wire_string(w, m->name, sizeof m->name);
}

static int check_fetch(const void *p, struct psr_error *err)
{
	const struct psr_msg_fetch *m = p;

	if (check_integer("the place of a part", m->offset, 0, PSR_WIRE_MAX_INTEGER, err) ||
	    check_integer("the length of a part", m->length, 0, PSR_WIRE_MAX_INTEGER, err))
		return PSR_ERR_ARG;
	if ((m->handle == 0) != (m->name[0] != '\0'))
		return psr_fail(err, PSR_ERR_ARG, "a file is asked for by a handle or by a name, and not by %s of them",
		                m->handle == 0 ? "none" : "both");
	return PSR_OK;
}

WIRE_ID(fetch, FETCH, check_fetch)

static void layout_fetch_part(struct wire *w, void *p)
{
	struct psr_msg_fetch_part *m = p;

	wire_u64(w, &m->offset);
	wire_u32(w, &m->bytes);
	wire_reserved(w, 4);
	wire_data(w, &m->data, m->bytes);
}

static int check_fetch_part(const void *p, struct psr_error *err)
{
	const struct psr_msg_fetch_part *m = p;

	if (check_integer("the bytes of a part", m->bytes, 1, PSR_WIRE_MAX_PART, err) ||
	    check_integer("the place of a part", m->offset, 0, PSR_WIRE_MAX_INTEGER - m->bytes, err))
		return PSR_ERR_ARG;
	return PSR_OK;
}

WIRE_ID(fetch_part, FETCH_PART, check_fetch_part)

static void layout_fetch_end(struct wire *w, void *p)
{
	struct psr_msg_fetch_end *m = p;

	wire_u64(w, &m->file_bytes);
	wire_u64(w, &m->file_hash);
}

static int check_fetch_end(const void *p, struct psr_error *err)
{
	return check_integer("the size of a file", ((const struct psr_msg_fetch_end *)p)->file_bytes, 0, PSR_WIRE_MAX_INTEGER,
	                     err);
}

WIRE_ID(fetch_end, FETCH_END, check_fetch_end)
