/* A GLB whose BIN chunk holds a unit square in the plane z = 0, counter-clockwise seen from +z, in several encodings:
 * accessors 0 POSITION, 1 indices of a list, 2 NORMAL (+z), 3 TEXCOORD, 4 COLOR (normalized bytes), 5 indices of a
 * strip, 6 indices of a fan, 7 POSITION in normalized shorts, 8 sparse POSITION over 0, 9 TEXCOORD of another set;
 * image 0 of the JSON may be buffer view 9, a BMP of 4 x 2. */
#ifndef TESTS_IMPORT_GLTF_H
#define TESTS_IMPORT_GLTF_H

#include "files.h"

#define BIN_BYTES 344

static const uint8_t bmp_pixels[24] = {
	/* bottom row: red, red, red, red; top row: blue, green, white, black */
	0, 0, 255, 0, 0, 255, 0, 0, 255, 0, 0, 255, 255, 0, 0, 0, 255, 0, 255, 255, 255, 0, 0, 0,
};

#define HEAD \
	"'asset':{'version':'2.0'},'buffers':[{'byteLength':344}],'bufferViews':[" \
	"{'buffer':0,'byteOffset':0,'byteLength':48},{'buffer':0,'byteOffset':48,'byteLength':12}," \
	"{'buffer':0,'byteOffset':60,'byteLength':48},{'buffer':0,'byteOffset':108,'byteLength':32}," \
	"{'buffer':0,'byteOffset':140,'byteLength':16},{'buffer':0,'byteOffset':156,'byteLength':8}," \
	"{'buffer':0,'byteOffset':164,'byteLength':8},{'buffer':0,'byteOffset':172,'byteLength':32,'byteStride':8}," \
	"{'buffer':0,'byteOffset':204,'byteLength':16},{'buffer':0,'byteOffset':220,'byteLength':78}," \
	"{'buffer':0,'byteOffset':300,'byteLength':32}]," \
	"'accessors':[{'bufferView':0,'componentType':5126,'type':'VEC3','count':4}," \
	"{'bufferView':1,'componentType':5123,'type':'SCALAR','count':6}," \
	"{'bufferView':2,'componentType':5126,'type':'VEC3','count':4}," \
	"{'bufferView':3,'componentType':5126,'type':'VEC2','count':4}," \
	"{'bufferView':4,'componentType':5121,'normalized':true,'type':'VEC4','count':4}," \
	"{'bufferView':5,'componentType':5123,'type':'SCALAR','count':4}," \
	"{'bufferView':6,'componentType':5123,'type':'SCALAR','count':4}," \
	"{'bufferView':7,'componentType':5122,'normalized':true,'type':'VEC3','count':4}," \
	"{'bufferView':0,'componentType':5126,'type':'VEC3','count':4,'sparse':{'count':1," \
	"'indices':{'bufferView':8,'byteOffset':0,'componentType':5125},'values':{'bufferView':8,'byteOffset':4}}}," \
	"{'bufferView':10,'componentType':5126,'type':'VEC2','count':4}]"

#define LIST "'attributes':{'POSITION':0},'indices':1"
#define SCENE "'nodes':[{'mesh':0}],'scenes':[{'nodes':[0]}],'scene':0"
#define PRIMITIVE(...) "{" HEAD ",'meshes':[{'primitives':[{" __VA_ARGS__ "}]}]," SCENE "}"
#define SQUARE PRIMITIVE(LIST)

static inline void make_bin(uint8_t bin[BIN_BYTES])
{
	static const float position[12] = { 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0 };
	static const float normal[12] = { 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1 };
	static const float uv[8] = { 0, 1, 1, 1, 1, 0, 0, 0 }, other_uv[8] = { 0.25f, 0.5f, 0, 0, 0, 0, 0, 0 };
	static const float sparse_value[3] = { 1, 3, 0 };
	static const uint16_t list[6] = { 0, 1, 2, 0, 2, 3 }, strip[4] = { 0, 1, 3, 2 }, fan[4] = { 0, 1, 2, 3 };
	static const uint8_t color[16] = { 255, 128, 0, 255, 255, 128, 0, 255, 255, 128, 0, 255, 255, 128, 0, 255 };
	static const int16_t shorts[16] = { 0, 0, 0, 0, 32767, 0, 0, 0, 32767, 32767, 0, 0, 0, 32767, 0, 0 };

	memset(bin, 0, BIN_BYTES);
	memcpy(bin, position, sizeof position);
	memcpy(bin + 48, list, sizeof list);
	memcpy(bin + 60, normal, sizeof normal);
	memcpy(bin + 108, uv, sizeof uv);
	memcpy(bin + 140, color, sizeof color);
	memcpy(bin + 156, strip, sizeof strip);
	memcpy(bin + 164, fan, sizeof fan);
	memcpy(bin + 172, shorts, sizeof shorts);
	put_u32(bin + 204, 2);
	memcpy(bin + 208, sparse_value, sizeof sparse_value);
	make_bmp(bin + 220, 4, 2, bmp_pixels, sizeof bmp_pixels);
	memcpy(bin + 300, other_uv, sizeof other_uv);
}

/* The GLB of a JSON text in which ' stands for ". The caller frees. */
static inline uint8_t *make_glb(const char *json, size_t *n)
{
	size_t n_json = (strlen(json) + 3) / 4 * 4;
	uint8_t *glb = malloc(28 + n_json + BIN_BYTES);

	assert_non_null(glb);
	*n = 28 + n_json + BIN_BYTES;
	memcpy(glb, "glTF", 4);
	put_u32(glb + 4, 2);
	put_u32(glb + 8, (uint32_t)*n);
	put_u32(glb + 12, (uint32_t)n_json);
	memcpy(glb + 16, "JSON", 4);
	memset(glb + 20, ' ', n_json);
	for (size_t i = 0; json[i] != '\0'; i++)
		glb[20 + i] = json[i] == '\'' ? '"' : (uint8_t)json[i];
	put_u32(glb + 20 + n_json, BIN_BYTES);
	memcpy(glb + 24 + n_json, "BIN", 4);
	make_bin(glb + 28 + n_json);
	return glb;
}

static inline void write_glb(const char *name, const char *json)
{
	size_t n;
	uint8_t *glb = make_glb(json, &n);

	write_bytes(path_of(name), glb, n);
	free(glb);
}

static inline struct psr_mesh *import_glb(const char *json)
{
	write_glb("square.glb", json);
	return import("square.glb");
}

#endif
