/* The glTF reader inside of its wall: C++, exceptions, no names outside of namespace gltf.
 *
 * validate.cc takes the file apart, reads what it names, and hands tinygltf a JSON text without files, images, extras,
 * animations or unknown extensions, in which every index is a non-negative int. tinygltf makes its structures of that.
 * accessor.cc and draco.cc make lists of numbers of them, primitive.cc vertices, material.cc
 * materials; nodes.cc walks the scene, deform.cc bends what is skinned or has morph targets, instance.cc
 * places it, presets.cc keeps cameras and lights, gltf.cc does one after the other. */
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

/* A camera or a light in its own coordinates; position and direction come from its node. */
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
	std::vector<std::string> ignored; /* extensions that the file uses, and that may change its picture */
};

void door_open(source &s, const char *path, const uint8_t *bytes, size_t n_bytes);

/* The bytes of a data uri, or of a file in the folder of the source. uri.cc */
std::vector<uint8_t> door_read_uri(const source &s, const std::string &uri, const std::string &place);

struct span {
	const uint8_t *bytes;
	uint64_t n;
};

/* Column-major as in glTF; the last row is 0 0 0 1. */
struct transform {
	double m[16] = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
};

transform multiply(const transform &a, const transform &b);

/* A material and what it wants of its primitives. */
struct material_use {
	int index = -1;                               /* in the mesh; -1: not made yet */
	int point_index = -1;                         /* of the same without textures, for points */
	std::string uv_name[PSR_UV_SETS];             /* the attribute that each set comes from, or empty */
	bool has_normal_map = false;
};

struct reader {
	import_mesh &im;
	source src;
	tinygltf::Model model;
	std::vector<material_use> materials; /* as the file has them; the last is the default one */
	std::vector<int> image_of;           /* image -> image of the mesh; -1: not made yet */

	/* nodes.cc: the nodes of the default scene (or the first, or all) in the order of the walk, and where all
	 * nodes stand, those of other scenes too; is_placed is false for nodes of which each is the other's child. */
	std::vector<int> scene;
	std::vector<transform> world;
	std::vector<char> is_placed;

	std::vector<std::vector<transform>> joints; /* of each skin: world times inverse bind; made when asked for */
	uint64_t n_lines = 0;
	uint64_t n_morphed = 0;
};

/* Checks the head of the document, and erases its lists of extensions. extensions.cc */
void extensions_check(source &s, nlohmann::json &doc);
bool extension_is_known(const std::string &name);

/* Reads and erases the cameras and lights of the document; makes presets of those of the scene. presets.cc */
void presets_read(source &s, nlohmann::json &doc);
void presets_place(reader &r);

/* A member of the document as an array of objects; refuses anything else. */
nlohmann::json &array_of(nlohmann::json &doc, const char *key);

void place_nodes(reader &r);

/* A primitive in its own coordinates. What the file does not have, or the material does not want, is empty. */
struct primitive {
	std::vector<float> position, normal, tangent, color, uv[PSR_UV_SETS]; /* 3, 3, 4, 4, 2 a vertex */
	std::vector<std::vector<float>> joint, weight;                        /* sets of 4 a vertex */
	std::vector<uint32_t> triangle;                                       /* 3 a triangle, in range */
	std::vector<uint32_t> point;                                          /* in range */
	size_t n_vertices() const { return position.size() / 3; }
};

/* False if there is nothing to draw: lines are counted, not read. */
bool read_primitive(reader &r, const tinygltf::Primitive &g, const material_use &use, primitive &out,
                    const std::string &place);

/* The matrices of a skin's joints. deform.cc */
const std::vector<transform> &skin_joints(reader &r, int skin);

/* Adds the morph targets of g in proportion to weights. */
void morph(reader &r, const tinygltf::Primitive &g, const std::vector<double> &weights, primitive &p,
           const std::string &place);

/* What moves vertex v: of its joints, the mean by weight. */
transform blend(const primitive &p, const std::vector<transform> &joints, size_t v, const std::string &place);

/* Adds the primitive to the mesh, where `world` puts it, or `joints` if there are any. */
void add_instance(reader &r, const primitive &p, const material_use &use, const transform &world,
                  const std::vector<transform> *joints, const std::string &place);

/* A buffer view, checked against its buffer. */
span view_bytes(const reader &r, int view, const std::string &place);

/* All elements of an accessor as floats, n_wanted a row: normalized integers are scaled (all integers if asked for),
 * missing alpha is 1. The accessor has n_wanted components, or 3 where 4 are wanted. */
std::vector<float> accessor_floats(const reader &r, int accessor, size_t n_wanted, const std::string &place,
                                   bool is_normalized = false);
std::vector<uint32_t> accessor_indices(const reader &r, int accessor, const std::string &place);
size_t accessor_count(const reader &r, int accessor, const std::string &place);

/* What KHR_draco_mesh_compression holds; an attribute that is not compressed comes from its accessor. */
std::shared_ptr<draco::Mesh> draco_open(const reader &r, const tinygltf::Primitive &p, const std::string &place);
std::vector<float> draco_floats(const reader &r, const draco::Mesh &mesh, const tinygltf::Primitive &p,
                                const std::string &name, size_t n_wanted, const std::string &place,
                                bool is_normalized);
std::vector<uint32_t> draco_triangles(const draco::Mesh &mesh);

/* The material of a primitive (-1: none), made when first asked for, or its likeness for points. */
const material_use &use_material(reader &r, int material, bool for_points);

/* A member of an extension's object, or the fallback where it is absent. */
double value_number(const tinygltf::Value &v, const char *key, double fallback);
int value_int(const tinygltf::Value &v, const char *key, int fallback);

/* An error whose text names the path already. */
struct reported {
	struct psr_error error;
};

} // namespace gltf
#endif
