#include "first_mesh.h"

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#define ROWS 500 /* of quads, from pole to pole */
#define COLUMNS 1000
#define N_VERTICES ((ROWS + 1) * COLUMNS)
#define N_TRIANGLES (2 * ROWS * COLUMNS)
#define PI 3.14159265358979323846

static void vertex(float p[3], int i)
{
	const double theta = PI * (i / COLUMNS) / ROWS, phi = 2 * PI * (i % COLUMNS) / COLUMNS;
	const double bumps = 0.05 * sin(13 * phi) * sin(11 * theta);
	const double radius = 1 + bumps + 0.002 * sin(97 * phi + 5 * theta) * sin(89 * theta);

	p[0] = (float)(radius * sin(theta) * cos(phi));
	p[1] = (float)(radius * cos(theta));
	p[2] = (float)(-radius * sin(theta) * sin(phi));
}

static void triangle(uint32_t v[3], int i)
{
	const uint32_t row = (uint32_t)(i / 2 / COLUMNS) * COLUMNS, col = (uint32_t)(i / 2 % COLUMNS);
	const uint32_t next = (col + 1) % COLUMNS, a = row + col, b = row + next, c = a + COLUMNS, d = b + COLUMNS;

	v[0] = a;
	v[1] = i % 2 == 0 ? c : d;
	v[2] = i % 2 == 0 ? d : b;
}

/* This machine's order of bytes is the formats'. */
static void write_arrays(FILE *out)
{
	float p[3];
	uint32_t v[3];

	for (int i = 0; i < N_VERTICES; i++) {
		vertex(p, i);
		fwrite(p, sizeof p, 1, out);
	}
	for (int i = 0; i < N_TRIANGLES; i++) {
		triangle(v, i);
		fwrite(v, sizeof v, 1, out);
	}
}

static void write_ply(FILE *out, int is_text)
{
	float p[3];
	uint32_t v[3];

	fprintf(out, "ply\nformat %s 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
	        "element face %d\nproperty list uchar int vertex_indices\nend_header\n",
	        is_text ? "ascii" : "binary_little_endian", N_VERTICES, N_TRIANGLES);
	for (int i = 0; i < N_VERTICES; i++) {
		vertex(p, i);
		if (is_text)
			fprintf(out, "%.9g %.9g %.9g\n", (double)p[0], (double)p[1], (double)p[2]);
		else
			fwrite(p, sizeof p, 1, out);
	}
	for (int i = 0; i < N_TRIANGLES; i++) {
		triangle(v, i);
		if (is_text)
			fprintf(out, "3 %u %u %u\n", v[0], v[1], v[2]);
		else if (fputc(3, out) != EOF)
			fwrite(v, sizeof v, 1, out);
	}
}

static void write_obj(FILE *out)
{
	float p[3];
	uint32_t v[3];

	for (int i = 0; i < N_VERTICES; i++) {
		vertex(p, i);
		fprintf(out, "v %.9g %.9g %.9g\n", (double)p[0], (double)p[1], (double)p[2]);
	}
	for (int i = 0; i < N_TRIANGLES; i++) {
		triangle(v, i);
		fprintf(out, "f %u %u %u\n", v[0] + 1, v[1] + 1, v[2] + 1);
	}
}

static void write_stl(FILE *out)
{
	const uint8_t header[80] = { 0 }, none[2] = { 0 };
	const uint32_t n = N_TRIANGLES;
	float p[4][3] = { { 0 } };
	uint32_t v[3];

	fwrite(header, sizeof header, 1, out);
	fwrite(&n, sizeof n, 1, out);
	for (int i = 0; i < N_TRIANGLES; i++) {
		triangle(v, i);
		for (int c = 0; c < 3; c++)
			vertex(p[c + 1], (int)v[c]);
		fwrite(p, sizeof p, 1, out);
		fwrite(none, sizeof none, 1, out);
	}
}

static void write_glb(FILE *out)
{
	const uint32_t n_vertex_bytes = 12 * N_VERTICES, n_bytes = n_vertex_bytes + 12 * N_TRIANGLES;
	char json[1024];
	uint32_t n, head[5];

	n = (uint32_t)snprintf(
		json, sizeof json,
		"{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],"
		"\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
		"\"buffers\":[{\"byteLength\":%u}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":%u},"
		"{\"buffer\":0,\"byteOffset\":%u,\"byteLength\":%u}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,"
		"\"count\":%d,\"type\":\"VEC3\",\"min\":[-2,-2,-2],\"max\":[2,2,2]},{\"bufferView\":1,\"componentType\":5125,"
		"\"count\":%d,\"type\":\"SCALAR\"}]}",
		n_bytes, n_vertex_bytes, n_vertex_bytes, n_bytes - n_vertex_bytes, N_VERTICES, 3 * N_TRIANGLES);
	while (n % 4 != 0)
		json[n++] = ' ';
	memcpy(head, "glTF\2\0\0\0", 8);
	head[2] = 12 + 8 + n + 8 + n_bytes;
	head[3] = n;
	memcpy(&head[4], "JSON", 4);
	fwrite(head, sizeof head, 1, out);
	fwrite(json, n, 1, out);
	head[0] = n_bytes;
	memcpy(&head[1], "BIN", 4);
	fwrite(head, 8, 1, out);
	write_arrays(out);
}

int first_mesh_write(char *path, size_t n, const char *folder, int format, struct psr_error *err)
{
	static const char *const names[FIRST_MESH_FORMATS] = { "text.ply", "binary.ply", "lines.obj", "corners.stl",
		                                                   "arrays.glb" };
	FILE *out;
	int failed;

	snprintf(path, n, "%s/%s", folder, names[format]);
	out = fopen(path, "wb");
	if (out == NULL)
		return psr_fail(err, PSR_ERR_IO, "%s: %s", path, strerror(errno));
	if (format < 2)
		write_ply(out, format == 0);
	else if (format == 2)
		write_obj(out);
	else if (format == 3)
		write_stl(out);
	else
		write_glb(out);
	failed = ferror(out);
	if (fclose(out) != 0 || failed)
		return psr_fail(err, PSR_ERR_IO, "%s: %s", path, strerror(errno));
	return PSR_OK;
}
