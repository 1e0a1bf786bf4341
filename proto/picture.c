#include "wire.h"

unsigned psr_plane_component_bytes(unsigned plane, unsigned depth_format)
{
	static const uint8_t bytes[PSR_N_PLANES] = { 1, 4, 2, 4, 1, 8, 1, 2 };
	return plane == PSR_PLANE_DEPTH && depth_format != PSR_WIRE_DEPTH_F32 ? 2 : bytes[plane];
}

unsigned psr_plane_pixel_bytes(unsigned plane, unsigned depth_format)
{
	static const uint8_t n_components[PSR_N_PLANES] = { 3, 1, 3, 1, 1, 1, 3, 1 };
	return n_components[plane] * psr_plane_component_bytes(plane, depth_format);
}

const uint8_t *psr_plane_background(unsigned plane)
{
	static const uint8_t bytes[PSR_N_PLANES][8] = {
		[PSR_PLANE_DEPTH] = { 0, 0, 0x80, 0x7f },
		[PSR_PLANE_ID] = { 0xff, 0xff, 0xff, 0xff },
		[PSR_PLANE_WEIGHT] = { 0xff },
		[PSR_PLANE_WORDS] = { 0xff, 0xff, 0xff, 0xff, 0, 0, 0x80, 0x7f },
		[PSR_PLANE_BLOCK] = { 0xff, 0xff, 0xff },
	};
	return bytes[plane];
}

uint64_t psr_plane_capability(unsigned plane)
{
	static const uint32_t capability[PSR_N_PLANES] = {
		[PSR_PLANE_NORMAL] = PSR_CAP_NORMAL, [PSR_PLANE_ID] = PSR_CAP_ID,
		[PSR_PLANE_WEIGHT] = PSR_CAP_WEIGHT, [PSR_PLANE_WORDS] = PSR_CAP_WORDS,
		[PSR_PLANE_BLOCK] = PSR_CAP_BLOCK, [PSR_PLANE_BOUND] = PSR_CAP_BOUND,
	};
	return capability[plane];
}

uint64_t psr_rect_total_max(uint64_t n_pixels, unsigned pixel_bytes)
{
	return 2 * n_pixels * pixel_bytes + 65536;
}

static void layout_rect(struct wire *w, void *p)
{
	struct psr_msg_rect *m = p;
	wire_u8(w, &m->plane);
	wire_u8(w, &m->codec);
	wire_u8(w, &m->scale);
	wire_reserved(w, 1);
	wire_u16(w, &m->x);
	wire_u16(w, &m->y);
	wire_u16(w, &m->w);
	wire_u16(w, &m->h);
	wire_u32(w, &m->total);
	wire_u32(w, &m->offset);
	wire_u32(w, &m->bytes);
	wire_data(w, &m->data, m->bytes);
}

static int check_rect(const void *p, struct psr_error *err)
{
	const struct psr_msg_rect *m = p;
	uint64_t n_pixels, raw;
	if (check_integer("the plane of a rectangle", m->plane, 0, PSR_N_PLANES - 1, err) ||
	    check_integer("the codec of a rectangle", m->codec, PSR_CODEC_RAW, PSR_CODEC_PNG, err))
		return PSR_ERR_ARG;
	if (m->plane != PSR_PLANE_COLOR && m->codec != PSR_CODEC_RAW && m->codec != PSR_CODEC_ZSTD)
		return psr_fail(err, PSR_ERR_ARG, "a rectangle of plane %u has codec %u, which is for colour", m->plane,
		                m->codec);
	if (m->scale != 1 && m->scale != 2 && m->scale != 4)
		return psr_fail(err, PSR_ERR_ARG, "the scale of a rectangle is %u: it must be 1, 2 or 4", m->scale);
	if (m->w == 0 || m->h == 0 || m->x + m->w > PSR_WIRE_MAX_SIDE || m->y + m->h > PSR_WIRE_MAX_SIDE)
		return psr_fail(err, PSR_ERR_ARG, "a rectangle of %u x %u pixels at %u, %u is outside of every picture", m->w,
		                m->h, m->x,
		                m->y);
	if ((uint32_t)m->w * m->h > PSR_WIRE_MAX_RECT_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "a rectangle has %u x %u pixels, and holds at most %u", m->w, m->h,
		                PSR_WIRE_MAX_RECT_PIXELS);
	n_pixels = (uint64_t)((m->w + m->scale - 1u) / m->scale) * ((m->h + m->scale - 1u) / m->scale);
	raw = n_pixels * psr_plane_pixel_bytes(m->plane, PSR_WIRE_DEPTH_F32);
	if (m->codec == PSR_CODEC_RAW && m->total != raw && !(m->plane == PSR_PLANE_DEPTH && m->total == raw / 2))
		return psr_fail(err, PSR_ERR_ARG, "a raw rectangle of %llu bytes claims %u", (unsigned long long)raw, m->total);
	if (m->total > psr_rect_total_max(n_pixels, psr_plane_pixel_bytes(m->plane, PSR_WIRE_DEPTH_F32)))
		return psr_fail(err, PSR_ERR_LIMIT, "a rectangle of %llu raw bytes claims %u coded ones",
		                (unsigned long long)raw, m->total);
	if (m->bytes == 0 || (uint64_t)m->offset + m->bytes > m->total)
		return psr_fail(err, PSR_ERR_ARG, "a rectangle of %u coded bytes has a piece of %u bytes at %u", m->total,
		                m->bytes, m->offset);
	return PSR_OK;
}

WIRE_VIEW(rect, RECT, check_rect)

static void layout_frame_end(struct wire *w, void *p)
{
	struct psr_msg_frame_end *m = p;
	wire_u16(w, &m->pass);
	wire_u8(w, &m->is_final);
	wire_u8(w, &m->status);
	wire_u32(w, &m->planes);
	wire_f64(w, &m->error_px, 1);
	wire_u16(w, &m->n_entries);
	wire_u8(w, &m->has_hashes);
	wire_reserved(w, 5);
	wire_f64(w, &m->depth_min, 1);
	wire_f64(w, &m->depth_max, 1);
	if (!w->writing && m->status > PSR_WIRE_FRAME_COARSE)
		m->status = PSR_WIRE_FRAME_OK;
	for (unsigned i = 0; i < PSR_N_PLANES; i++) {
		if (m->has_hashes && m->planes & 1u << i)
			wire_u64(w, &m->hash[i]);
		else if (!w->writing)
			m->hash[i] = 0;
	}
	if (m->n_entries > PSR_WIRE_MAX_REPORT) {
		wire_fail(w, PSR_ERR_LIMIT, "a report has more than 64 entries");
		return;
	}
	for (unsigned i = 0; i < m->n_entries && w->code == PSR_OK; i++) {
		wire_u16(w, &m->entry[i].id);
		wire_u64(w, &m->entry[i].ns);
		wire_u64(w, &m->entry[i].count);
	}
}

static int check_frame_end(const void *p, struct psr_error *err)
{
	const struct psr_msg_frame_end *m = p;
	const int has_depth = (m->planes & 1u << PSR_PLANE_DEPTH) != 0;
	uint16_t last = 0;
	if (check_integer("the final mark of a frame", m->is_final, 0, 1, err) ||
	    check_integer("the status of a frame", m->status, PSR_WIRE_FRAME_OK, PSR_WIRE_FRAME_COARSE, err) ||
	    check_range("the error of a frame (pixels)", m->error_px, 0, PSR_WIRE_MAX_LENGTH, err) ||
	    check_integer("whether a frame has hashes", m->has_hashes, 0, 1, err) ||
	    check_range("the nearest depth", m->depth_min, 0, has_depth ? PSR_WIRE_MAX_LENGTH : 0, err) ||
	    check_range("the farthest depth", m->depth_max, m->depth_min, has_depth ? PSR_WIRE_MAX_LENGTH : 0, err))
		return PSR_ERR_ARG;
	if (m->planes == 0 || m->planes >> PSR_N_PLANES)
		return psr_fail(err, PSR_ERR_ARG, "the planes of a frame are %#x: bits 0 to %d are known, and one is needed",
		                m->planes, PSR_N_PLANES - 1);
	if (m->n_entries > PSR_WIRE_MAX_REPORT)
		return psr_fail(err, PSR_ERR_LIMIT, "a report has %u entries, and holds at most %d", m->n_entries,
		                PSR_WIRE_MAX_REPORT);
	for (unsigned i = 0; i < m->n_entries; last = m->entry[i].id, i++) {
		if (m->entry[i].id <= last)
			return psr_fail(err, PSR_ERR_ARG, "entry %u of a report has id %u after %u: ids rise", i, m->entry[i].id,
			                last);
		if (check_integer("the count of a report entry", m->entry[i].count, 0, PSR_WIRE_MAX_INTEGER, err) ||
		    check_integer("the time of a report entry", m->entry[i].ns, 0,
		                  m->entry[i].id >= 32 && m->entry[i].id < 64 ? 0 : PSR_WIRE_MAX_INTEGER, err))
			return PSR_ERR_ARG;
	}
	return PSR_OK;
}

WIRE_VIEW(frame_end, FRAME_END, check_frame_end)
