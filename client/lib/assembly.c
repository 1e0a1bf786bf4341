#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "internal.h"

void client_assembly_init(struct client_assembly *assembly, const struct psr_msg_frame *asked, uint16_t pass)
{
	memset(assembly, 0, sizeof *assembly);
	assembly->asked = *asked;
	assembly->pass = pass;
}

void client_assembly_fini(struct client_assembly *assembly)
{
	if (assembly->crew != NULL)
		client_crew_wait(assembly->crew, NULL);
	psr_frame_free(&assembly->picture);
	free(assembly->pieces);
	memset(assembly, 0, sizeof *assembly);
}

static void fill_background(const struct psr_frame *frame, const struct psr_msg_frame_begin *begin)
{
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
		size_t pixel = psr_plane_bytes(plane), n = (size_t)frame->width * frame->height * pixel;
		uint8_t *pixels = psr_frame_plane(frame, plane);

		if (pixels == NULL)
			continue;
		memcpy(pixels, plane == PSR_PLANE_COLOR ? begin->background : psr_plane_background(plane), pixel);
		for (size_t done = pixel; done < n; done *= 2)
			memcpy(pixels + done, pixels, done < n - done ? done : n - done);
	}
}

/* Whether a sharp frame follows frame 0. It does unless frame 0 is just as sharp. */
static unsigned has_sharp(const struct psr_msg_frame *asked)
{
	const struct psr_msg_settings *settings = &asked->settings;
	const int is_settled = asked->budget == PSR_WIRE_BUDGET_SETTINGS && settings->scale == 1 && settings->smooth == 1;

	return asked->flags & PSR_WIRE_FRAME_SHARP && !(is_settled && asked->color_codec != PSR_CODEC_JPEG);
}

/* The sharp frame is not refined; refined frames follow it. */
static unsigned refinement(const struct psr_msg_frame *asked, unsigned pass)
{
	return pass > 0 ? pass - has_sharp(asked) : 0;
}

/* The server must send the codec of the request, or a better one. */
static int is_asked(const struct psr_msg_frame_begin *begin, const struct psr_msg_frame *asked)
{
	const int is_better = begin->color_codec == PSR_CODEC_ZSTD && asked->color_codec == PSR_CODEC_JPEG;
	const int is_codec = begin->color_codec == asked->color_codec && begin->color_quality >= asked->color_quality;

	return begin->width == asked->width && begin->height == asked->height && begin->planes == asked->planes
	       && (is_better || is_codec) && begin->depth_format == asked->depth_format
	       && begin->depth_codec == asked->depth_codec && begin->data_codec == asked->data_codec
	       && begin->depth_min == asked->depth_min && begin->depth_max == asked->depth_max;
}

static int check_base(const struct psr_msg_frame_begin *begin, const struct client_held *base, struct psr_error *err)
{
	if (begin->base == 0)
		return PSR_OK;
	if (base == NULL)
		return psr_fail(err, PSR_ERR_PROTOCOL, "the server began a frame on frame %" PRIu32
		                ", pass %u, which was not offered as its base", begin->base, begin->base_pass);
	if (begin->width != base->begin.width || begin->height != base->begin.height || begin->planes != base->begin.planes
	    || begin->settings.scale != base->begin.settings.scale
	    || (begin->depth_format > PSR_WIRE_DEPTH_F32
	        && (begin->depth_min != base->begin.depth_min || begin->depth_max != base->begin.depth_max)))
		return psr_fail(err, PSR_ERR_PROTOCOL,
		                "the server began a frame on a base of another size (%" PRIu32 "x%" PRIu32
		                "), other planes, another scale or range of depth",
		                base->begin.width, base->begin.height);
	return PSR_OK;
}

static void copy_planes(const struct psr_frame *to, const struct psr_frame *from)
{
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (psr_frame_plane(to, plane) != NULL)
			memcpy(psr_frame_plane(to, plane), psr_frame_plane(from, plane),
			       (size_t)to->width * to->height * psr_plane_bytes(plane));
}

int client_assembly_begin(struct client_assembly *assembly, const struct psr_msg_frame_begin *begin,
                          const struct client_held *base, struct psr_error *err)
{
	const struct psr_msg_frame *asked = &assembly->asked;
	int code;

	if (assembly->has_begun)
		return psr_fail(err, PSR_ERR_PROTOCOL, "the server began a frame twice");
	if (begin->pass != assembly->pass || begin->refine != refinement(asked, begin->pass) || !is_asked(begin, asked))
		return psr_fail(err, PSR_ERR_PROTOCOL,
		                "the server began another frame (%" PRIu32 "x%" PRIu32 ") than the one asked "
		                "for (%" PRIu32 "x%" PRIu32 ")",
		                begin->width, begin->height, asked->width, asked->height);
	code = check_base(begin, base, err);
	if (code != PSR_OK)
		return code;
	assembly->begin = *begin;
	assembly->has_begun = 1;
	code = psr_frame_alloc(&assembly->picture, asked->width, asked->height, asked->planes, err);
	if (code != PSR_OK)
		return code;
	if (begin->base == 0) {
		fill_background(&assembly->picture, begin);
	} else {
		copy_planes(&assembly->picture, &base->picture);
		assembly->base_lossy = base->lossy;
	}
	return PSR_OK;
}

/* Checks the rules that depend on the frame; psr_msg_rect_decode() has checked the rules within the message. */
static int check_rect(const struct client_assembly *assembly, const struct psr_msg_rect *rect, struct psr_error *err)
{
	const struct psr_msg_frame *asked = &assembly->asked;
	const struct psr_msg_frame_begin *begin = &assembly->begin;
	unsigned wanted, pixel;
	uint64_t n;

	if (!assembly->has_begun)
		return psr_fail(err, PSR_ERR_PROTOCOL, "the server sent a rectangle before the frame's beginning");
	if (rect->plane >= PSR_N_PLANES || !(asked->planes >> rect->plane & 1))
		return psr_fail(err, PSR_ERR_PROTOCOL, "the server sent a rectangle of plane %u, which was not asked for",
		                rect->plane);
	if (rect->scale != 1 && rect->scale != 2 && rect->scale != 4)
		return psr_fail(err, PSR_ERR_PROTOCOL, "the server sent a rectangle of scale %u", rect->scale);
	if (rect->w == 0 || rect->h == 0 || (uint32_t)rect->x + rect->w > asked->width
	    || (uint32_t)rect->y + rect->h > asked->height)
		return psr_fail(err, PSR_ERR_PROTOCOL,
		                "the server sent a rectangle %ux%u at %u,%u: outside of the picture of %" PRIu32 "x%" PRIu32,
		                rect->w, rect->h, rect->x, rect->y, asked->width, asked->height);
	wanted = rect->plane == PSR_PLANE_COLOR ? begin->color_codec
	         : rect->plane == PSR_PLANE_DEPTH ? begin->depth_codec : begin->data_codec;
	if (rect->codec != PSR_CODEC_RAW && rect->codec != wanted
	    && !(rect->codec == PSR_CODEC_ZSTD && wanted == PSR_CODEC_JPEG))
		return psr_fail(err, PSR_ERR_PROTOCOL, "the server sent a rectangle of codec %u in a frame of codec %u",
		                rect->codec, wanted);
	pixel = psr_plane_pixel_bytes(rect->plane, asked->depth_format);
	n = (uint64_t)((rect->w + rect->scale - 1u) / rect->scale) * ((rect->h + rect->scale - 1u) / rect->scale);
	if ((uint64_t)rect->w * rect->h > PSR_WIRE_MAX_RECT_PIXELS || rect->total == 0
	    || rect->total > psr_rect_total_max(n, pixel) || (rect->codec == PSR_CODEC_RAW && rect->total != n * pixel))
		return psr_fail(err, PSR_ERR_PROTOCOL, "the server claims %" PRIu32 " bytes for a rectangle of %ux%u pixels",
		                rect->total, rect->w, rect->h);
	return PSR_OK;
}

/* Makes room for n more bytes: doubles the memory, up to the size that the rectangle claims. */
static int reserve_pieces(struct client_assembly *assembly, size_t n, struct psr_error *err)
{
	size_t need = assembly->n_pieces + n, capacity = 2 * need;
	uint8_t *grown;

	if (need <= assembly->pieces_capacity)
		return PSR_OK;
	if (capacity > assembly->open.total)
		capacity = assembly->open.total;
	grown = realloc(assembly->pieces, capacity);
	if (grown == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a rectangle of %zu bytes", capacity);
	assembly->pieces = grown;
	assembly->pieces_capacity = capacity;
	return PSR_OK;
}

static int is_same_rect(const struct psr_msg_rect *a, const struct psr_msg_rect *b)
{
	return a->plane == b->plane && a->codec == b->codec && a->scale == b->scale && a->x == b->x && a->y == b->y
	       && a->w == b->w && a->h == b->h && a->total == b->total;
}

static int decode(struct client_assembly *assembly, struct client_decoder *decoder, const struct psr_msg_rect *rect,
                  const uint8_t *data, struct psr_error *err)
{
	if (assembly->crew != NULL)
		return client_crew_decode(assembly->crew, assembly, rect, data, err);
	return client_decode(decoder, &assembly->picture, &assembly->asked, rect, data, err);
}

int client_assembly_rect(struct client_assembly *assembly, struct client_decoder *decoder,
                         const struct psr_msg_rect *rect, struct psr_error *err)
{
	int code = check_rect(assembly, rect, err);

	if (code != PSR_OK)
		return code;
	if (assembly->open.total == 0 ? rect->offset != 0
	                              : !is_same_rect(rect, &assembly->open) || rect->offset != assembly->n_pieces)
		return psr_fail(err, PSR_ERR_PROTOCOL,
		                "the server sent the piece at byte %" PRIu32 " of a rectangle out of turn", rect->offset);
	if (rect->bytes == 0 || (uint64_t)rect->offset + rect->bytes > rect->total)
		return psr_fail(err, PSR_ERR_PROTOCOL,
		                "the server sent more bytes of a rectangle than the %" PRIu32 " it claimed", rect->total);
	/* The hashes of a frame drawn at a scale are those of the enlarged picture. */
	if (rect->codec == PSR_CODEC_JPEG || rect->scale > assembly->begin.settings.scale
	    || (rect->plane == PSR_PLANE_DEPTH && assembly->asked.depth_format != PSR_WIRE_DEPTH_F32))
		assembly->lossy |= 1u << rect->plane;
	if (rect->bytes == rect->total)
		return decode(assembly, decoder, rect, rect->data, err);
	assembly->open = *rect;
	code = reserve_pieces(assembly, rect->bytes, err);
	if (code != PSR_OK)
		return code;
	memcpy(assembly->pieces + assembly->n_pieces, rect->data, rect->bytes);
	assembly->n_pieces += rect->bytes;
	if (assembly->n_pieces < rect->total)
		return PSR_OK;
	assembly->open.total = 0;
	assembly->n_pieces = 0;
	return decode(assembly, decoder, rect, assembly->pieces, err);
}

int client_assembly_end(struct client_assembly *assembly, const struct psr_msg_frame_end *end, unsigned *checked,
                        struct psr_error *err)
{
	const struct psr_frame *picture = &assembly->picture;
	const struct psr_msg_frame *asked = &assembly->asked;

	if (!assembly->has_begun || assembly->open.total != 0)
		return psr_fail(err, PSR_ERR_PROTOCOL, "the server ended a frame %s",
		                assembly->has_begun ? "within a rectangle" : "that it had not begun");
	if (end->pass != assembly->pass || end->planes != asked->planes
	    || (end->pass == asked->pass_limit + has_sharp(asked) && !end->is_final)
	    || end->has_hashes == ((asked->flags & PSR_WIRE_FRAME_NO_HASHES) != 0))
		return psr_fail(err, PSR_ERR_PROTOCOL, "the server ended another frame than it began");
	if (assembly->crew != NULL && client_crew_wait(assembly->crew, err) != PSR_OK)
		return err != NULL ? err->code : PSR_ERR_PROTOCOL;
	*checked = 0;
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
		const unsigned bit = 1u << plane;
		uint64_t hash;

		if (!end->has_hashes || !(end->planes & bit) || assembly->lossy & bit)
			continue;
		hash = psr_frame_hash(picture, plane);
		if (hash == end->hash[plane]) {
			*checked |= bit;
			assembly->base_lossy &= ~bit;
		} else if (!(assembly->base_lossy & bit)) {
			return psr_fail(err, PSR_ERR_FORMAT,
			                "the %s plane of a frame is damaged: its hash is %016" PRIx64
			                ", the server drew %016" PRIx64,
			                plane == PSR_PLANE_COLOR ? "colour" : psr_plane_name(plane), hash, end->hash[plane]);
		}
	}
	assembly->lossy |= assembly->base_lossy;
	return PSR_OK;
}
