/* A GLB put together by a test, list by list. */
#ifndef TESTS_IMPORT_GLTF_BUILD_H
#define TESTS_IMPORT_GLTF_BUILD_H

#include "files.h"

enum { I8 = 5120, U8, I16, U16, U32 = 5125, F32 };

struct built {
	uint8_t bin[1 << 15];
	size_t n_bin;
	char views[4096], accessors[4096];
	int n_views, n_accessors;
};

/* A buffer view of n bytes; stride 0: tight. Returns its index. */
static inline int put_view(struct built *b, const void *bytes, size_t n, int stride)
{
	size_t at = strlen(b->views);
	char text[32] = "";

	assert_true(b->n_bin + n + 4 <= sizeof b->bin);
	if (stride > 0)
		snprintf(text, sizeof text, ",'byteStride':%d", stride);
	snprintf(b->views + at, sizeof b->views - at, "%s{'buffer':0,'byteOffset':%zu,'byteLength':%zu%s}",
	         b->n_views > 0 ? "," : "", b->n_bin, n, text);
	memcpy(b->bin + b->n_bin, bytes, n);
	b->n_bin = (b->n_bin + n + 3) / 4 * 4;
	return b->n_views++;
}

/* An accessor over a view of its own; `more` goes into its JSON. Returns its index. */
static inline int put_list(struct built *b, const void *bytes, size_t n, int stride, int component, const char *type,
                           int count, const char *more)
{
	int view = put_view(b, bytes, n, stride);
	size_t at = strlen(b->accessors);

	snprintf(b->accessors + at, sizeof b->accessors - at,
	         "%s{'bufferView':%d,'componentType':%d,'type':'%s','count':%d%s}", b->n_accessors > 0 ? "," : "", view,
	         component, type, count, more);
	return b->n_accessors++;
}

#define PUT(b, array, component, type, count) put_list(b, array, sizeof array, 0, component, type, count, "")
#define PUT_NORMALIZED(b, array, stride, component, type, count) \
	put_list(b, array, sizeof array, stride, component, type, count, ",'normalized':true")

/* Accessor 0: the triangle (0,0,0) (1,0,0) (0,1,0), so that a file may start with it. */
static inline void put_triangle(struct built *b)
{
	static const float position[9] = { 0, 0, 0, 1, 0, 0, 0, 1, 0 };

	memset(b, 0, sizeof *b);
	assert_int_equal(PUT(b, position, F32, "VEC3", 3), 0);
}

/* Writes the GLB; `rest` is the JSON beside asset, buffers, views and accessors, in which ' stands for ". */
static inline void write_built(const char *name, const struct built *b, const char *rest)
{
	size_t room = strlen(rest) + sizeof b->views + sizeof b->accessors + 256, n_json, n;
	uint8_t *glb = malloc(28 + room + sizeof b->bin);

	assert_non_null(glb);
	n_json = (size_t)snprintf((char *)glb + 20, room,
	                          "{'asset':{'version':'2.0'},'buffers':[{'byteLength':%zu}],'bufferViews':[%s],"
	                          "'accessors':[%s],%s}",
	                          b->n_bin, b->views, b->accessors, rest);
	for (; n_json % 4 != 0; n_json++)
		glb[20 + n_json] = ' ';
	for (size_t i = 0; i < n_json; i++)
		if (glb[20 + i] == '\'')
			glb[20 + i] = '"';
	n = 28 + n_json + b->n_bin;
	memcpy(glb, "glTF", 4);
	put_u32(glb + 4, 2);
	put_u32(glb + 8, (uint32_t)n);
	put_u32(glb + 12, (uint32_t)n_json);
	memcpy(glb + 16, "JSON", 4);
	put_u32(glb + 20 + n_json, (uint32_t)b->n_bin);
	memcpy(glb + 24 + n_json, "BIN", 4);
	memcpy(glb + 28 + n_json, b->bin, b->n_bin);
	write_bytes(path_of(name), glb, n);
	free(glb);
}

static inline struct psr_mesh *import_built(const struct built *b, const char *rest)
{
	write_built("built.glb", b, rest);
	return import("built.glb");
}

static inline void refuse_built(const struct built *b, const char *rest, int code, const char *words)
{
	write_built("built.glb", b, rest);
	refuse("built.glb", code, words);
}

/* Each number is at most `tolerance` off. */
static inline void assert_near(const double *x, const double *expected, int n, double tolerance)
{
	for (int i = 0; i < n; i++)
		if (!(x[i] - expected[i] <= tolerance && expected[i] - x[i] <= tolerance))
			fail_msg("number %d is %.17g, not %.17g", i, x[i], expected[i]);
}

static inline void assert_near_f(const float *x, const double *expected, int n, double tolerance)
{
	double wide[16];

	for (int i = 0; i < n; i++)
		wide[i] = x[i];
	assert_near(wide, expected, n, tolerance);
}

#define NEAR(x, tolerance, ...) \
	assert_near(x, (const double[]){ __VA_ARGS__ }, (int)(sizeof((const double[]){ __VA_ARGS__ }) / sizeof(double)), \
	            tolerance)
#define NEAR_F(x, tolerance, ...) \
	assert_near_f(x, (const double[]){ __VA_ARGS__ }, (int)(sizeof((const double[]){ __VA_ARGS__ }) / sizeof(double)), \
	              tolerance)

/* The vertex at this place; one of them. */
static inline uint32_t vertex_at(const struct psr_mesh *m, double x, double y, double z)
{
	for (uint32_t v = 0; v < m->n_vertices; v++)
		if (m->position[v][0] == x && m->position[v][1] == y && m->position[v][2] == z)
			return v;
	fail_msg("no vertex at %g %g %g", x, y, z);
	return 0;
}

#endif
