/* The glTF reader behind import_gltf: C++ with exceptions, in namespace gltf. gltf.cc knows the order:
 *
 * validate.cc takes the file apart and gives tinygltf a JSON text without files, images, extras, animations or unknown
 * extensions, in which every index is a non-negative int. nodes.cc walks the scene; material.cc makes materials,
 * primitive.cc vertices, from the lists of numbers of accessor.cc and draco.cc; deform.cc applies skins and morph
 * targets; instance.cc adds to the mesh; presets.cc keeps cameras and lights. */
#ifndef PSR_IMPORT_GLTF_GLTF_H
#define PSR_IMPORT_GLTF_GLTF_H

#include <cstdint>
#include <memory>
#include <string>
#include <vector>
#include <nlohmann/json_fwd.hpp>
#include "import/import.h"
#include "tinygltf.h"

namespace draco {
class Mesh;
}

namespace gltf {

/* An error in the file: a code of psr/error.h, and a place with a reason; import_gltf adds the path. */
struct failure {
	int code;
	std::string text;
};

[[noreturn]] void refuse(int code, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Refuses an index that is not within 0..n-1. `place` may be empty. */
void check_index(int index, size_t n, const char *kind, const std::string &place);

inline uint32_t load_u32(const uint8_t *p)
{
	return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

/* An image of the file: a uri, or if that is empty a buffer view. */
struct image_source {
	std::string uri;
	int buffer_view = -1;
};

/* A camera or a light; position and direction come from its node. */
struct camera_source {
	std::string name;
	struct psr_camera camera;
	bool is_valid;
};

struct light_source {
	std::string name;
	struct psr_light light;
	bool is_valid;
};

struct source {
	std::string folder; /* resolved */
	std::string json;   /* for tinygltf */
	std::vector<std::vector<uint8_t>> buffers;
	std::vector<image_source> images;
	std::vector<camera_source> cameras;
	std::vector<light_source> lights;
	std::vector<std::string> ignored; /* unsupported extensions that may change the picture */
};

/* Reads and validates the document, and its buffers. */
void validate(source &s, const char *path, const uint8_t *bytes, size_t n_bytes);

/* uri.cc: reads a data uri, or a file in the folder of the source. */
std::vector<uint8_t> read_uri(const source &s, const std::string &uri, const std::string &place);

struct span {
	const uint8_t *bytes;
	uint64_t n;
};

/* Column-major as in glTF; the last row is 0 0 0 1. */
struct transform {
	double m[16] = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
};

transform multiply(const transform &a, const transform &b);

/* A material, with everything that its primitives need. */
struct material_use {
	int index = -1;                               /* in the mesh; -1: not made yet */
	int point_index = -1;                         /* of its variant without textures, for points */
	std::string uv_name[PSR_UV_SETS];             /* the attribute of each set, or empty */
	bool has_normal_map = false;
};

struct reader {
	import_mesh &im;
	source src;
	tinygltf::Model model;
	std::vector<material_use> materials; /* of the file; the last is the default */
	std::vector<int> image_of;           /* image -> image of the mesh; -1: not made yet */

	/* nodes.cc: the nodes of the default scene (or the first, or all) in the order of the walk, and the transforms of
	 * all nodes, other scenes' too; is_placed is false for nodes in cycles. */
	std::vector<int> scene;
	std::vector<transform> world;
	std::vector<char> is_placed;

	std::vector<std::vector<transform>> joints; /* by skin: world times inverse bind; computed on demand */
	uint64_t n_lines = 0;
	uint64_t n_morphed = 0;
};

/* extensions.cc: checks and erases the document's lists of extensions. */
void extensions_check(source &s, nlohmann::json &doc);
bool extension_is_known(const std::string &name);

/* presets.cc: reads and erases the cameras and lights of the document; makes presets of the ones in the scene. */
void presets_read(source &s, nlohmann::json &doc);
void presets_place(reader &r);

/* A member of the document as an array of objects, empty if missing; refuses anything else. */
nlohmann::json &array_of(nlohmann::json &doc, const char *key);

void place_nodes(reader &r);

/* A primitive in its own coordinates. Lists are empty if missing or not needed by the material. */
struct primitive {
	std::vector<float> position, normal, tangent, color, uv[PSR_UV_SETS]; /* 3, 3, 4, 4, 2 a vertex */
	std::vector<std::vector<float>> joint, weight;                        /* sets of 4 a vertex */
	std::vector<uint32_t> triangle;                                       /* 3 a triangle, in range */
	std::vector<uint32_t> point;                                          /* in range */
	size_t n_vertices() const { return position.size() / 3; }
};

/* Returns false if there is nothing to draw; counts lines without reading them. */
bool read_primitive(reader &r, const tinygltf::Primitive &g, const material_use &use, primitive &out,
                    const std::string &place);

/* deform.cc: the matrices of a skin's joints. */
const std::vector<transform> &skin_joints(reader &r, int skin);

/* Adds the morph targets of g, weighted. */
void morph(reader &r, const tinygltf::Primitive &g, const std::vector<double> &weights, primitive &p,
           const std::string &place);

/* Computes the transform of vertex v: the weighted mean of its joints. */
transform blend(const primitive &p, const std::vector<transform> &joints, size_t v, const std::string &place);

/* Adds the primitive to the mesh, transformed by `world`, or by `joints` unless NULL. */
void add_instance(reader &r, const primitive &p, const material_use &use, const transform &world,
                  const std::vector<transform> *joints, const std::string &place);

/* Returns the bytes of a buffer view, within its buffer. */
span view_bytes(const reader &r, int view, const std::string &place);

/* Reads all elements of an accessor as floats, n_wanted a row: scales normalized integers (with is_normalized all
 * integers), sets missing alpha to 1. The accessor must have n_wanted components, or 3 where 4 are wanted. */
std::vector<float> accessor_floats(const reader &r, int accessor, size_t n_wanted, const std::string &place,
                                   bool is_normalized = false);
std::vector<uint32_t> accessor_indices(const reader &r, int accessor, const std::string &place);
size_t accessor_count(const reader &r, int accessor, const std::string &place);

/* draco.cc: KHR_draco_mesh_compression. Attributes that it does not hold come from their accessors. */
std::shared_ptr<draco::Mesh> draco_open(const reader &r, const tinygltf::Primitive &p, const std::string &place);
std::vector<float> draco_floats(const reader &r, const draco::Mesh &mesh, const tinygltf::Primitive &p,
                                const std::string &where, size_t n_wanted, bool is_normalized);
std::vector<uint32_t> draco_triangles(const draco::Mesh &mesh);

/* Returns the material of a primitive (-1: none). Makes it on demand, with its variant for points if the caller wants
 * that. */
const material_use &use_material(reader &r, int material, bool for_points);

/* A member of an extension's object, or the fallback if it is missing. */
double value_number(const tinygltf::Value &v, const char *key, double fallback);
int value_int(const tinygltf::Value &v, const char *key, int fallback);

/* An error whose text has the path already. */
struct reported {
	struct psr_error error;
};

} // namespace gltf
#endif
