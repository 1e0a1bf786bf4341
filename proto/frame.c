#include <math.h>
#include "wire.h"

#define SPACING_ONE 65536.0 /* of a spacing in a report's count */

/* Kinds count from 1 on the wire; one field holds the angle or the height. */
void layout_camera(struct wire *w, struct psr_camera *m)
{
	uint8_t kind = (uint8_t)(m->kind + 1);
	double extent = m->kind == PSR_CAMERA_PERSPECTIVE ? m->fov_y : m->ortho_height;

	wire_u8(w, &kind);
	wire_reserved(w, 7);
	wire_f64(w, m->eye, 3);
	wire_f64(w, m->target, 3);
	wire_f64(w, m->up, 3);
	wire_f64(w, &extent, 1);
	wire_f64(w, &m->near_z, 1);
	if (w->writing)
		return;
	m->kind = (enum psr_camera_kind)(kind - 1);
	m->fov_y = m->kind == PSR_CAMERA_PERSPECTIVE ? extent : 0;
	m->ortho_height = m->kind == PSR_CAMERA_PERSPECTIVE ? 0 : extent;
}

static double length(const double v[3])
{
	return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

int check_camera(const struct psr_camera *m, struct psr_error *err)
{
	const double least = 1 / PSR_WIRE_MAX_LENGTH;
	double f[3], u[3], n_f, n_u;

	if (m->kind != PSR_CAMERA_PERSPECTIVE && m->kind != PSR_CAMERA_ORTHOGRAPHIC)
		return psr_fail(err, PSR_ERR_ARG, "the camera's kind is %d: it must be 1 (perspective) or 2 (orthographic)",
		                (int)m->kind + 1);
	if (check_lengths("the camera's eye", m->eye, 3, err) || check_lengths("the camera's target", m->target, 3, err) ||
	    check_lengths("the camera's up", m->up, 3, err))
		return PSR_ERR_ARG;
	for (int i = 0; i < 3; i++)
		f[i] = m->target[i] - m->eye[i];
	n_f = length(f);
	n_u = length(m->up);
	if (n_f < least)
		return psr_fail(err, PSR_ERR_ARG, "the camera's eye and target are the same point");
	if (n_u < least)
		return psr_fail(err, PSR_ERR_ARG, "the camera's up has no length");
	for (int i = 0; i < 3; i++) {
		f[i] /= n_f;
		u[i] = m->up[i] / n_u;
	}
	const double cross[3] = { f[1] * u[2] - f[2] * u[1], f[2] * u[0] - f[0] * u[2], f[0] * u[1] - f[1] * u[0] };

	if (length(cross) < 1e-6)
		return psr_fail(err, PSR_ERR_ARG, "the camera's up points along its view: turn it aside");
	if (check_range("the camera's near distance", m->near_z, 0, PSR_WIRE_MAX_LENGTH, err))
		return PSR_ERR_ARG;
	if (m->kind == PSR_CAMERA_PERSPECTIVE)
		return check_range("the camera's field of view (radians)", m->fov_y, 1e-6, 3.14159, err);
	return check_positive("the height of the camera's picture", m->ortho_height, err);
}

static void layout_settings(struct wire *w, struct psr_msg_settings *m)
{
	wire_u8(w, &m->scale);
	wire_u8(w, &m->smooth);
	wire_u8(w, &m->pass);
	wire_u8(w, &m->splats);
	wire_reserved(w, 4);
	wire_f64(w, &m->spacing_px, 1);
}

static int check_settings(const struct psr_msg_settings *m, struct psr_error *err)
{
	if (m->scale != 1 && m->scale != 2 && m->scale != 4)
		return psr_fail(err, PSR_ERR_ARG, "the scale of the settings is %u: it must be 1, 2 or 4", m->scale);
	if (check_integer("the smoothing of the settings", m->smooth, 0, 2, err) ||
	    check_integer("the pass of the settings", m->pass, 0, PSR_WIRE_MAX_PASS, err) ||
	    check_integer("the splats of the settings", m->splats, 0, 1, err))
		return PSR_ERR_ARG;
	return check_range("the sample spacing of the settings (pixels)", m->spacing_px, 1.0 / 64, 64, err);
}

uint64_t psr_settings_pack(const struct psr_msg_settings *settings)
{
	return settings->scale | (uint64_t)settings->smooth << 8 | (uint64_t)settings->pass << 16
	       | (uint64_t)llround(settings->spacing_px * SPACING_ONE) << 32;
}

void psr_settings_unpack(struct psr_msg_settings *settings, uint64_t packed)
{
	settings->scale = (uint8_t)packed;
	settings->smooth = (uint8_t)(packed >> 8);
	settings->pass = (uint8_t)(packed >> 16);
	settings->splats = 0; /* budgets choose none */
	settings->spacing_px = (double)(packed >> 32) / SPACING_ONE;
}

static int check_scale(const struct psr_msg_settings *m, uint32_t width, uint32_t height, struct psr_error *err)
{
	if (width % m->scale == 0 && height % m->scale == 0)
		return PSR_OK;
	return psr_fail(err, PSR_ERR_ARG, "the picture has %u x %u pixels: both sides must be multiples of its scale, %u",
	                width, height, m->scale);
}

static int check_depth_range(unsigned format, enum psr_camera_kind kind, double min, double max, struct psr_error *err)
{
	const double most = PSR_WIRE_MAX_LENGTH;
	if (format != PSR_WIRE_DEPTH_U16 && format != PSR_WIRE_DEPTH_U16_HALF)
		return check_zero("the range of depth, which only formats 2 and 3 have,", min == 0 && max == 0, err);
	if (check_range("the nearest depth", min, kind == PSR_CAMERA_PERSPECTIVE ? 1 / most : -most, most, err) ||
	    check_range("the farthest depth", max, -most, most, err))
		return PSR_ERR_ARG;
	if (min < max)
		return PSR_OK;
	return psr_fail(err, PSR_ERR_ARG, "the range of depth is %g to %g: the first must be less", min, max);
}

/* The fields that a request and its FRAME_BEGIN share. */
struct picture {
	uint32_t width, height, planes;
	uint8_t color_codec, color_quality, depth_format, depth_codec, data_codec;
};

static int check_picture(const struct picture *m, struct psr_error *err)
{
	const uint32_t data = ~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH);
	if (m->width == 0 || m->height == 0)
		return psr_fail(err, PSR_ERR_ARG, "the picture has %u x %u pixels: both sides need at least 1", m->width,
		                m->height);
	if (m->width > PSR_WIRE_MAX_SIDE || m->height > PSR_WIRE_MAX_SIDE ||
	    (uint64_t)m->width * m->height > PSR_WIRE_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "the picture has %u x %u pixels: a side holds at most %d, all of it %u",
		                m->width, m->height, PSR_WIRE_MAX_SIDE, PSR_WIRE_MAX_PIXELS);
	if (m->planes == 0 || m->planes >> PSR_N_PLANES)
		return psr_fail(err, PSR_ERR_ARG, "the planes are %#x: bits 0 to %d are known, and one is needed", m->planes,
		                PSR_N_PLANES - 1);
	if (m->planes & 1u << PSR_PLANE_COLOR) {
		int jpeg = m->color_codec == PSR_CODEC_JPEG;
		if (check_integer("the codec of colour", m->color_codec, PSR_CODEC_RAW, PSR_CODEC_PNG, err) ||
		    check_integer(jpeg ? "the JPEG quality" : "the quality of a lossless codec", m->color_quality, jpeg,
		                  jpeg ? 100 : 0, err))
			return PSR_ERR_ARG;
	} else if (check_zero("the codec of colour, which is not asked for,", !m->color_codec && !m->color_quality, err)) {
		return PSR_ERR_ARG;
	}
	if (m->planes & 1u << PSR_PLANE_DEPTH) {
		if (check_integer("the format of depth", m->depth_format, PSR_WIRE_DEPTH_F32, PSR_WIRE_DEPTH_U16_HALF, err))
			return PSR_ERR_ARG;
	} else if (check_zero("the format of depth, which is not asked for,", !m->depth_format && !m->depth_codec, err)) {
		return PSR_ERR_ARG;
	}
	if (m->depth_codec != PSR_CODEC_RAW && m->depth_codec != PSR_CODEC_ZSTD)
		return psr_fail(err, PSR_ERR_ARG, "the codec of depth is %u: it must be 0 or 2", m->depth_codec);
	if (!(m->planes & data) && check_zero("the codec of planes that are not asked for", !m->data_codec, err))
		return PSR_ERR_ARG;
	if (m->data_codec != PSR_CODEC_RAW && m->data_codec != PSR_CODEC_ZSTD)
		return psr_fail(err, PSR_ERR_ARG, "the codec of data planes is %u: it must be 0 or 2", m->data_codec);
	return PSR_OK;
}

static void layout_frame(struct wire *w, void *p)
{
	struct psr_msg_frame *m = p;
	wire_u16(w, &m->slot);
	wire_u16(w, &m->pass_limit);
	wire_u32(w, &m->width);
	wire_u32(w, &m->height);
	wire_u32(w, &m->planes);
	wire_u8(w, &m->color_codec);
	wire_u8(w, &m->color_quality);
	wire_u8(w, &m->depth_format);
	wire_u8(w, &m->depth_codec);
	wire_u8(w, &m->data_codec);
	wire_u8(w, &m->budget);
	wire_u16(w, &m->flags);
	wire_u64(w, &m->time_budget_us);
	wire_f64(w, &m->error_bound, 1);
	layout_settings(w, &m->settings);
	wire_u32(w, &m->base);
	wire_reserved(w, 4);
	layout_camera(w, &m->camera);
	wire_f64(w, &m->depth_min, 1);
	wire_f64(w, &m->depth_max, 1);
}

static int check_budget(const struct psr_msg_frame *m, struct psr_error *err)
{
	const struct psr_msg_settings *settings = &m->settings;
	const int has_bound = m->budget == PSR_WIRE_BUDGET_ERROR || m->budget == PSR_WIRE_BUDGET_RMSE;
	const int no_settings = !settings->scale && !settings->smooth && !settings->pass && !settings->splats
	                        && settings->spacing_px == 0;

	if (check_integer("the kind of budget", m->budget, PSR_WIRE_BUDGET_NONE, PSR_WIRE_BUDGET_RMSE, err) ||
	    (m->budget != PSR_WIRE_BUDGET_TIME && check_zero("a time budget", m->time_budget_us == 0, err)) ||
	    (!has_bound && check_zero("an error bound", m->error_bound == 0, err)) ||
	    (m->budget != PSR_WIRE_BUDGET_SETTINGS && check_zero("settings", no_settings, err)))
		return PSR_ERR_ARG;
	if (m->budget == PSR_WIRE_BUDGET_TIME)
		return check_integer("the time budget", m->time_budget_us, 1, PSR_WIRE_MAX_INTEGER, err);
	if (has_bound)
		return check_positive("the error bound", m->error_bound, err);
	return m->budget == PSR_WIRE_BUDGET_SETTINGS ? check_settings(&m->settings, err) : PSR_OK;
}

static int check_frame(const void *p, struct psr_error *err)
{
	const struct psr_msg_frame *m = p;
	const struct picture picture = { m->width, m->height, m->planes, m->color_codec, m->color_quality,
		m->depth_format, m->depth_codec, m->data_codec };
	int result;
	if (check_integer("the slot of the scene", m->slot, 0, PSR_WIRE_MAX_SCENES - 1, err) ||
	    check_integer("the flag word of a frame", m->flags, 0, PSR_WIRE_FRAME_NO_HASHES | PSR_WIRE_FRAME_SHARP, err))
		return PSR_ERR_ARG;
	result = check_picture(&picture, err);
	if (result != PSR_OK)
		return result;
	if (check_budget(m, err) || check_camera(&m->camera, err))
		return PSR_ERR_ARG;
	if (m->budget == PSR_WIRE_BUDGET_SETTINGS && check_scale(&m->settings, m->width, m->height, err))
		return PSR_ERR_ARG;
	return check_depth_range(m->depth_format, m->camera.kind, m->depth_min, m->depth_max, err);
}

WIRE_VIEW(frame, FRAME, check_frame)

static void layout_frame_begin(struct wire *w, void *p)
{
	struct psr_msg_frame_begin *m = p;
	wire_u16(w, &m->pass);
	wire_u16(w, &m->base_pass);
	wire_u32(w, &m->width);
	wire_u32(w, &m->height);
	wire_u32(w, &m->planes);
	wire_u8(w, &m->color_codec);
	wire_u8(w, &m->color_quality);
	wire_u8(w, &m->depth_format);
	wire_u8(w, &m->depth_codec);
	wire_u8(w, &m->data_codec);
	wire_bytes(w, m->background, 3);
	wire_u32(w, &m->base);
	wire_u16(w, &m->refine);
	wire_reserved(w, 2);
	layout_settings(w, &m->settings);
	wire_f64(w, &m->depth_min, 1);
	wire_f64(w, &m->depth_max, 1);
	layout_camera(w, &m->camera);
}

static int check_frame_begin(const void *p, struct psr_error *err)
{
	const struct psr_msg_frame_begin *m = p;
	const struct picture picture = { m->width, m->height, m->planes, m->color_codec, m->color_quality,
		m->depth_format, m->depth_codec, m->data_codec };
	int result = check_picture(&picture, err);
	if (result != PSR_OK)
		return result;
	if ((m->base == 0 && check_zero("the pass of a base that is none", m->base_pass == 0, err)) ||
	    check_settings(&m->settings, err) || check_scale(&m->settings, m->width, m->height, err) ||
	    check_camera(&m->camera, err))
		return PSR_ERR_ARG;
	return check_depth_range(m->depth_format, m->camera.kind, m->depth_min, m->depth_max, err);
}

WIRE_VIEW(frame_begin, FRAME_BEGIN, check_frame_begin)
