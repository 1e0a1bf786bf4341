#include "wire.h"

static int check_name(const char *name, struct psr_error *err)
{
	return *name ? PSR_OK : psr_fail(err, PSR_ERR_ARG, "the name of a model is empty");
}

int psr_msg_list_encode(struct psr_buf *out, uint32_t id, struct psr_error *err)
{
	return wire_encode(out, WIRE(LIST, NULL, NULL), id, 0, NULL, err);
}

static void layout_list_entry(struct wire *w, void *p)
{
	struct psr_msg_list_entry *m = p;
	wire_u8(w, &m->state);
	wire_reserved(w, 7);
	wire_u64(w, &m->file_bytes);
	wire_bytes(w, m->content_id, sizeof m->content_id);
	wire_string(w, m->name, sizeof m->name);
}

static int check_list_entry(const void *p, struct psr_error *err)
{
	const struct psr_msg_list_entry *m = p;
	if (check_integer("the state of a model", m->state, PSR_ENTRY_READY, PSR_ENTRY_FAILED, err) ||
	    check_integer("the size of a file", m->file_bytes, 0, PSR_WIRE_MAX_INTEGER, err))
		return PSR_ERR_ARG;
	return check_name(m->name, err);
}

int psr_msg_list_entry_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_list_entry *msg,
                              struct psr_error *err)
{
	return wire_encode(out, WIRE(LIST_ENTRY, layout_list_entry, check_list_entry), id, 0, msg, err);
}

int psr_msg_list_entry_decode(struct psr_msg_list_entry *msg, const uint8_t *payload, size_t n, struct psr_error *err)
{
	return wire_decode(msg, WIRE(LIST_ENTRY, layout_list_entry, check_list_entry), payload, n, err);
}

static void layout_list_end(struct wire *w, void *p)
{
	struct psr_msg_list_end *m = p;
	wire_u32(w, &m->n_entries);
}

int psr_msg_list_end_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_list_end *msg,
                            struct psr_error *err)
{
	return wire_encode(out, WIRE(LIST_END, layout_list_end, NULL), id, 0, msg, err);
}

int psr_msg_list_end_decode(struct psr_msg_list_end *msg, const uint8_t *payload, size_t n, struct psr_error *err)
{
	return wire_decode(msg, WIRE(LIST_END, layout_list_end, NULL), payload, n, err);
}

static void layout_open(struct wire *w, void *p)
{
	struct psr_msg_open *m = p;
	wire_u32(w, &m->resolution);
	wire_string(w, m->name, sizeof m->name);
}

static int check_open(const void *p, struct psr_error *err)
{
	const struct psr_msg_open *m = p;
	if (check_integer("the side of the pictures", m->resolution, 0, PSR_WIRE_MAX_SIDE, err))
		return PSR_ERR_ARG;
	return check_name(m->name, err);
}

int psr_msg_open_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_open *msg, struct psr_error *err)
{
	return wire_encode(out, WIRE(OPEN, layout_open, check_open), id, 0, msg, err);
}

int psr_msg_open_decode(struct psr_msg_open *msg, const uint8_t *payload, size_t n, struct psr_error *err)
{
	return wire_decode(msg, WIRE(OPEN, layout_open, check_open), payload, n, err);
}

static void layout_progress(struct wire *w, void *p)
{
	struct psr_msg_progress *m = p;
	wire_u16(w, &m->stage);
	wire_reserved(w, 6);
	wire_u64(w, &m->done);
	wire_u64(w, &m->total);
}

static int check_progress(const void *p, struct psr_error *err)
{
	const struct psr_msg_progress *m = p;
	if (check_integer("the stage of a build", m->stage, PSR_PROGRESS_WAITING, PSR_PROGRESS_LOAD, err) ||
	    check_integer("the work of a stage", m->total, 0, PSR_WIRE_MAX_INTEGER, err) ||
	    check_integer("the work done", m->done, 0, m->total ? m->total : PSR_WIRE_MAX_INTEGER, err))
		return PSR_ERR_ARG;
	return PSR_OK;
}

int psr_msg_progress_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_progress *msg,
                            struct psr_error *err)
{
	return wire_encode(out, WIRE(PROGRESS, layout_progress, check_progress), id, 0, msg, err);
}

int psr_msg_progress_decode(struct psr_msg_progress *msg, const uint8_t *payload, size_t n, struct psr_error *err)
{
	return wire_decode(msg, WIRE(PROGRESS, layout_progress, check_progress), payload, n, err);
}

static void layout_opened(struct wire *w, void *p)
{
	struct psr_msg_opened *m = p;
	wire_u32(w, &m->handle);
	wire_u32(w, &m->representations);
	wire_bytes(w, m->content_id, sizeof m->content_id);
	wire_f64(w, m->box_min, 3);
	wire_f64(w, m->box_max, 3);
	wire_f64(w, m->origin, 3);
	wire_f64(w, &m->scale, 1);
	wire_f64(w, &m->spacing, 1);
	wire_u32(w, &m->resolution);
	wire_u32(w, &m->n_levels);
	wire_u64(w, &m->n_samples);
	wire_u64(w, &m->n_blocks);
	wire_u64(w, &m->bytes);
}

static int check_opened(const void *p, struct psr_error *err)
{
	const struct psr_msg_opened *m = p;
	const uint32_t known = 1u << PSR_WIRE_REP_BLOCKS | 1u << PSR_WIRE_REP_OCTREE | 1u << PSR_WIRE_REP_DPOINT;
	if (check_integer("a model's handle", m->handle, 1, UINT32_MAX, err) ||
	    check_lengths("a model's box", m->box_min, 3, err) || check_lengths("a model's box", m->box_max, 3, err) ||
	    check_lengths("a model's origin", m->origin, 3, err) || check_positive("a model's scale", m->scale, err) ||
	    check_positive("a model's sample spacing", m->spacing, err) ||
	    check_integer("a model's resolution", m->resolution, 1, UINT32_MAX, err) ||
	    check_integer("a model's number of levels", m->n_levels, 1, UINT32_MAX, err) ||
	    check_integer("a model's number of samples", m->n_samples, 0, PSR_WIRE_MAX_INTEGER, err) ||
	    check_integer("a model's number of blocks", m->n_blocks, 0, PSR_WIRE_MAX_INTEGER, err) ||
	    check_integer("a model's memory", m->bytes, 0, PSR_WIRE_MAX_INTEGER, err))
		return PSR_ERR_ARG;
	if (m->representations == 0 || (m->representations & ~known))
		return psr_fail(err, PSR_ERR_ARG, "a model's representations are %#x: bits 1 to 3 are known, and one is needed",
		                m->representations);
	for (int i = 0; i < 3; i++)
		if (m->box_min[i] > m->box_max[i])
			return psr_fail(err, PSR_ERR_ARG, "a model's box is inside out along axis %d", i);
	return PSR_OK;
}

int psr_msg_opened_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_opened *msg, struct psr_error *err)
{
	return wire_encode(out, WIRE(OPENED, layout_opened, check_opened), id, 0, msg, err);
}

int psr_msg_opened_decode(struct psr_msg_opened *msg, const uint8_t *payload, size_t n, struct psr_error *err)
{
	return wire_decode(msg, WIRE(OPENED, layout_opened, check_opened), payload, n, err);
}

static void layout_close(struct wire *w, void *p)
{
	struct psr_msg_close *m = p;
	wire_u32(w, &m->handle);
}

static int check_close(const void *p, struct psr_error *err)
{
	const struct psr_msg_close *m = p;
	return check_integer("a model's handle", m->handle, 1, UINT32_MAX, err);
}

int psr_msg_close_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_close *msg, struct psr_error *err)
{
	return wire_encode(out, WIRE(CLOSE, layout_close, check_close), id, 0, msg, err);
}

int psr_msg_close_decode(struct psr_msg_close *msg, const uint8_t *payload, size_t n, struct psr_error *err)
{
	return wire_decode(msg, WIRE(CLOSE, layout_close, check_close), payload, n, err);
}
