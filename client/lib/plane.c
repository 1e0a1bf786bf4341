#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "picture.h"
#include "proto/proto.h"

/* ---- .npy, version 1.0: a magic, a Python dictionary padded so that the data is aligned, the data ---- */

static int is_npy(const char *path)
{
	return strcasecmp(outfile_ending(path), "npy") == 0;
}

static size_t npy_header(char header[128], const struct psr_frame *picture, unsigned plane)
{
	static const char *const types[PSR_N_PLANES] = { "|u1", "<f4", "<i2", "<u4", "|u1", "<u8", "|u1", "<u2" };
	static const size_t start = 10; /* magic, version, length of the dictionary */
	unsigned pixel = psr_plane_pixel_bytes(plane, PSR_WIRE_DEPTH_F32);
	int has_three = pixel != psr_plane_component_bytes(plane, PSR_WIRE_DEPTH_F32);
	size_t n = start, padded;

	memcpy(header, "\x93NUMPY\x01\x00", 8);
	n += (size_t)snprintf(header + start, 128 - start, "{'descr': '%s', 'fortran_order': False, 'shape': (%u, %u%s), }",
	                      types[plane], picture->height, picture->width, has_three ? ", 3" : "");
	padded = (n + 1 + 63) / 64 * 64;
	memset(header + n, ' ', padded - n - 1);
	header[padded - 1] = '\n';
	header[8] = (char)((padded - start) & 0xff);
	header[9] = (char)((padded - start) >> 8);
	return padded;
}

static int write_npy(const struct psr_frame *picture, unsigned plane, const char *path, struct psr_error *err)
{
	struct outfile file;
	char header[128];
	size_t n = npy_header(header, picture, plane);
	int code = outfile_open(&file, path, OUTFILE_PLAIN, err);

	if (code != PSR_OK)
		return code;
	outfile_write(&file, header, n);
	outfile_write(&file, psr_frame_plane(picture, plane),
	              (size_t)picture->width * picture->height * psr_plane_pixel_bytes(plane, PSR_WIRE_DEPTH_F32));
	return outfile_close(&file, PSR_OK, err);
}

/* ---- pictures to look at ---- */

void psr_picture_color_normals(uint8_t *rgb, const int16_t *normal, size_t n)
{
	for (size_t i = 0; i < 3 * n; i += 3)
		for (size_t c = i; c < i + 3; c++)
			rgb[c] = normal[i] == 0 && normal[i + 1] == 0 && normal[i + 2] == 0
			             ? 0 : (uint8_t)(((normal[c] + 32767) * 255 + 32767) / 65534);
}

static int write_colored(const struct psr_frame *picture, unsigned plane, const char *path, struct psr_error *err)
{
	size_t n = (size_t)picture->width * picture->height;
	struct psr_frame colored = { .width = picture->width, .height = picture->height, .rgb = malloc(3 * n) };
	int code;

	if (colored.rgb == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a picture of %ux%u pixels", picture->width,
		                picture->height);
	if (plane == PSR_PLANE_NORMAL)
		psr_picture_color_normals(colored.rgb, picture->normal, n);
	else
		for (size_t i = 0; i < n; i++)
			memset(colored.rgb + 3 * i, picture->weight[i], 3);
	code = psr_picture_write_color(&colored, path, err);
	free(colored.rgb);
	return code;
}

static int is_colored(unsigned plane)
{
	return plane == PSR_PLANE_NORMAL || plane == PSR_PLANE_WEIGHT;
}

int psr_picture_check_plane(unsigned plane, const char *path, struct psr_error *err)
{
	if (is_npy(path))
		return PSR_OK;
	if (plane == PSR_PLANE_DEPTH)
		return psr_picture_check_depth(path, err);
	if (plane == PSR_PLANE_COLOR || is_colored(plane))
		return psr_picture_check_color(path, err);
	return psr_fail(err, PSR_ERR_ARG, "'%.300s': the %s plane is written as .npy only", path, psr_plane_name(plane));
}

int psr_picture_write_plane(const struct psr_frame *picture, unsigned plane, const char *path, struct psr_error *err)
{
	int code = psr_picture_check_plane(plane, path, err);

	if (code != PSR_OK)
		return code;
	if (is_npy(path))
		return write_npy(picture, plane, path, err);
	if (plane == PSR_PLANE_DEPTH)
		return psr_picture_write_depth(picture, path, err);
	return is_colored(plane) ? write_colored(picture, plane, path, err) : psr_picture_write_color(picture, path, err);
}
