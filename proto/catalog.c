#include <math.h>
#include "wire.h"

static int check_name(const char *name, struct psr_error *err)
{
	return *name ? PSR_OK : psr_fail(err, PSR_ERR_ARG, "the name of a model is empty");
}

WIRE_EMPTY_ID(list, LIST)

static void layout_list_entry(struct wire *w, void *p)
{
	struct psr_msg_list_entry *m = p;

	wire_u8(w, &m->state);
	wire_reserved(w, 7);
	wire_u64(w, &m->file_bytes);
	wire_bytes(w, m->content_id, sizeof m->content_id);
	wire_string(w, m->name, sizeof m->name);
	if (!w->writing && m->state > PSR_ENTRY_FAILED)
		m->state = PSR_ENTRY_FAILED;
}

static int check_list_entry(const void *p, struct psr_error *err)
{
	const struct psr_msg_list_entry *m = p;

	if (check_integer("the state of a model", m->state, PSR_ENTRY_READY, PSR_ENTRY_FAILED, err) ||
	    check_integer("the size of a file", m->file_bytes, 0, PSR_WIRE_MAX_INTEGER, err))
		return PSR_ERR_ARG;
	return check_name(m->name, err);
}

WIRE_ID(list_entry, LIST_ENTRY, check_list_entry)

static void layout_list_end(struct wire *w, void *p)
{
	struct psr_msg_list_end *m = p;

	wire_u32(w, &m->n_entries);
}

WIRE_ID(list_end, LIST_END, NULL)

static void layout_open(struct wire *w, void *p)
{
	struct psr_msg_open *m = p;

	wire_u16(w, &m->resolution);
	wire_u8(w, &m->levels);
	wire_reserved(w, 1);
	wire_string(w, m->name, sizeof m->name);
}

static int check_open(const void *p, struct psr_error *err)
{
	const struct psr_msg_open *m = p;

	if (check_integer("the side of the pictures", m->resolution, 0, PSR_WIRE_MAX_SIDE, err) ||
	    check_integer("the number of levels", m->levels, 0, PSR_WIRE_MAX_LEVELS, err))
		return PSR_ERR_ARG;
	return check_name(m->name, err);
}

WIRE_ID(open, OPEN, check_open)

static void layout_progress(struct wire *w, void *p)
{
	struct psr_msg_progress *m = p;

	wire_u16(w, &m->stage);
	wire_reserved(w, 6);
	wire_u64(w, &m->done);
	wire_u64(w, &m->total);
	if (!w->writing && m->stage > PSR_PROGRESS_LOAD)
		m->stage = PSR_PROGRESS_LOAD;
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

WIRE_ID(progress, PROGRESS, check_progress)

static void layout_opened(struct wire *w, void *p)
{
	struct psr_msg_opened *m = p;

	wire_u32(w, &m->handle);
	wire_u8(w, &m->representations);
	wire_u8(w, &m->colors);
	wire_u8(w, &m->octree_levels);
	wire_u8(w, &m->of_levels);
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
	wire_f64(w, m->up, 3);
}

static int check_opened(const void *p, struct psr_error *err)
{
	const struct psr_msg_opened *m = p;
	const double *up = m->up;

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
	if (check_integer("the levels of an octree", m->of_levels, 0, PSR_WIRE_MAX_LEVELS, err))
		return PSR_ERR_ARG;
	if ((m->octree_levels == 0) != (m->of_levels == 0) || m->octree_levels > m->of_levels)
		return psr_fail(err, PSR_ERR_ARG, "a model has %u of the %u levels of its octree: a beginning has some of "
		                "them, and all else says 0 of 0", m->octree_levels, m->of_levels);
	if (m->representations == 0 || (m->representations & 1u << PSR_WIRE_REP_AUTO))
		return psr_fail(err, PSR_ERR_ARG, "a model's representations are %#x: one is needed, and bit 0 is none",
		                m->representations);
	if (m->colors & 1u << PSR_WIRE_COLOR_OWN)
		return psr_fail(err, PSR_ERR_ARG, "a model's colours are %#x: bit 0, its own, is left out", m->colors);
	if (!(fabs(up[0] * up[0] + up[1] * up[1] + up[2] * up[2] - 1) <= 1e-6))
		return psr_fail(err, PSR_ERR_ARG, "a model's way up (%g, %g, %g) is not a unit vector", up[0], up[1], up[2]);
	for (int i = 0; i < 3; i++)
		if (m->box_min[i] > m->box_max[i])
			return psr_fail(err, PSR_ERR_ARG, "a model's box is inside out along axis %d", i);
	return PSR_OK;
}

WIRE_ID(opened, OPENED, check_opened)

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

WIRE_ID(close, CLOSE, check_close)
