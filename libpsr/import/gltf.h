/* The glTF reader inside of its wall: C++, exceptions, no names outside of namespace gltf.
 *
 * gltf_door.cc takes the file apart, reads what it names, and hands tinygltf a JSON text without files, images, extras,
 * animations or unknown extensions, in which every index is a non-negative int. tinygltf makes its structures of that.
 * gltf_accessor.cc and gltf_draco.cc make vertices of them, gltf_material.cc materials, gltf_nodes.cc places them,
 * gltf.cc flattens all of it. */
#ifndef PSR_IMPORT_GLTF_H
#define PSR_IMPORT_GLTF_H

#include <cstdint>
#include <string>
#include <vector>
#include "import.h"
#include "tinygltf.h"

namespace gltf {

/* What a file does wrong: a code of psr/error.h and a place with a reason, to which the path is added at the wall. */
struct failure {
	int code;
	std::string text;
};

[[noreturn]] void refuse(int code, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* An image as the file gives it: bytes of a buffer view (uri empty), or a uri. */
struct image_source {
	std::string uri;
	int buffer_view = -1;
};

struct source {
	std::string folder; /* resolved */
	std::string json;   /* for tinygltf */
	std::vector<std::vector<uint8_t>> buffers;
	std::vector<image_source> images;
};

void door_open(source &s, const char *path, const uint8_t *bytes, size_t n_bytes);

/* The bytes of a data uri, or of a file in the folder of the source. gltf_uri.cc */
std::vector<uint8_t> door_read_uri(const source &s, const std::string &uri, const std::string &place);

struct span {
	const uint8_t *bytes;
	uint64_t n;
};

struct reader {
	import_mesh &im;
	source src;
	tinygltf::Model model;
	std::vector<int> material_of;   /* glTF material -> psr material; -1: not made yet; the last is the default one */
	std::vector<int> image_of;      /* the same for images */
};

/* Column-major as in glTF; the last row is 0 0 0 1. */
struct transform {
	double m[16] = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
};

struct placement {
	int mesh;
	transform world;
};

/* Where the meshes of the scene stand, in the order of the walk: the default scene, the first, or all root nodes. */
std::vector<placement> place_meshes(reader &r);

/* A primitive in its own coordinates. normal, uv and color are empty where the file has none. */
struct primitive {
	std::vector<float> position, normal, uv, color; /* 3, 3, 2, 4 a vertex */
	std::vector<uint32_t> triangle;                 /* 3 a triangle, in range */
	size_t n_vertices() const { return position.size() / 3; }
};

/* A buffer view, checked against its buffer. */
span view_bytes(const reader &r, int view, const std::string &place);

/* All elements of an accessor as floats, n_wanted a row: normalized integers are scaled, missing alpha is 1. The
 * accessor has n_wanted components, or 3 where 4 are wanted. */
std::vector<float> accessor_floats(const reader &r, int accessor, size_t n_wanted, const std::string &place);
std::vector<uint32_t> accessor_indices(const reader &r, int accessor, const std::string &place);

/* Reads what KHR_draco_mesh_compression holds: positions, what else the primitive names, and triangles. */
void draco_read(const reader &r, const tinygltf::Primitive &p, const std::string &uv_name, primitive &out,
                const std::string &place);

/* How a primitive is to be textured: the set of coordinates, and KHR_texture_transform as u' = m0 u + m1 v + m2, ... */
struct texture_use {
	std::string uv_name; /* "TEXCOORD_n", or empty */
	double m[6] = { 1, 0, 0, 0, 1, 0 };
};

int material_index(reader &r, int material, texture_use &use); /* index in the psr mesh */

/* A member of an extension's object, or the fallback where it is absent. */
double value_number(const tinygltf::Value &v, const char *key, double fallback);
int value_int(const tinygltf::Value &v, const char *key, int fallback);

} // namespace gltf
#endif
