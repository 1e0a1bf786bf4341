#include <cstring>
#include "gltf.h"

namespace gltf {

namespace {

const uint64_t max_sparse_only = 1u << 24; /* elements of an accessor with sparse values alone */

unsigned component_bytes(int type, const std::string &place)
{
	switch (type) {
	case TINYGLTF_COMPONENT_TYPE_BYTE:
	case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
		return 1;
	case TINYGLTF_COMPONENT_TYPE_SHORT:
	case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
		return 2;
	case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
	case TINYGLTF_COMPONENT_TYPE_FLOAT:
		return 4;
	default:
		refuse(PSR_ERR_FORMAT, "%s: unknown component type %d", place.c_str(), type);
	}
}

float load_float(const uint8_t *p, int type, bool normalized)
{
	uint32_t bits;
	float x;
	switch (type) {
	case TINYGLTF_COMPONENT_TYPE_BYTE:
		x = (float)(int8_t)p[0];
		return !normalized ? x : x < -127.0f ? -1.0f : x / 127.0f;
	case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
		return normalized ? (float)p[0] / 255.0f : (float)p[0];
	case TINYGLTF_COMPONENT_TYPE_SHORT:
		x = (float)(int16_t)(uint16_t)(p[0] | p[1] << 8);
		return !normalized ? x : x < -32767.0f ? -1.0f : x / 32767.0f;
	case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
		x = (float)(p[0] | p[1] << 8);
		return normalized ? x / 65535.0f : x;
	case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
		return (float)load_u32(p);
	default:
		bits = load_u32(p);
		std::memcpy(&x, &bits, sizeof x);
		return x;
	}
}

uint32_t load_index(const uint8_t *p, int type)
{
	return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? p[0]
	       : type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? (uint32_t)(p[0] | p[1] << 8)
	                                                        : load_u32(p);
}

void check_index_type(int type, const std::string &place)
{
	if (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
	    type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
		refuse(PSR_ERR_FORMAT, "%s: indices of type %d; they must be unsigned integers", place.c_str(), type);
}

const tinygltf::Accessor &accessor_at(const reader &r, int index, const std::string &place)
{
	check_index(index, r.model.accessors.size(), "accessor", place);
	return r.model.accessors[(size_t)index];
}

/* n elements of `size` bytes, `stride` apart, from byte `offset` of a buffer view. */
struct layout {
	uint64_t offset, n, stride, size;
};

/* Returns the first element; all are within the view. */
const uint8_t *elements(const reader &r, int view, const layout &l, const std::string &place)
{
	const span s = view_bytes(r, view, place);
	const uint64_t max = UINT64_C(1) << 40, offset = l.offset, n = l.n, stride = l.stride, size = l.size;
	if (offset > max || n > max || stride > 65536 || (n > 0 && offset + (n - 1) * stride + size > s.n))
		refuse(PSR_ERR_FORMAT,
		       "%s: %llu elements of %llu bytes from byte %llu reach behind the end of bufferViews[%d] of %llu bytes",
		       place.c_str(), (unsigned long long)n, (unsigned long long)size, (unsigned long long)offset, view,
		       (unsigned long long)s.n);
	return s.bytes + (n > 0 ? offset : 0);
}

uint64_t view_stride(const reader &r, int view, uint64_t tight)
{
	uint64_t stride = (size_t)view < r.model.bufferViews.size() ? r.model.bufferViews[(size_t)view].byteStride : 0;
	return stride != 0 ? stride : tight;
}

void add_sparse(const reader &r, const tinygltf::Accessor &a, size_t n_wanted, bool is_normalized,
                std::vector<float> &out, const std::string &place)
{
	const auto &s = a.sparse;
	const size_t n_components = (size_t)tinygltf::GetNumComponentsInType((uint32_t)a.type);
	unsigned size = component_bytes(a.componentType, place), index_size;
	if (s.count < 0 || (size_t)s.count > a.count || s.indices.byteOffset < 0 || s.values.byteOffset < 0)
		refuse(PSR_ERR_FORMAT, "%s: %d sparse values of %zu", place.c_str(), s.count, a.count);
	check_index_type(s.indices.componentType, place);
	index_size = component_bytes(s.indices.componentType, place);

	uint64_t n = (uint64_t)s.count, value_size = (uint64_t)size * n_components;
	const layout at_index = { (uint64_t)s.indices.byteOffset, n, index_size, index_size };
	const layout at_value = { (uint64_t)s.values.byteOffset, n, value_size, value_size };
	const uint8_t *index = elements(r, s.indices.bufferView, at_index, place + ".sparse.indices");
	const uint8_t *value = elements(r, s.values.bufferView, at_value, place + ".sparse.values");

	for (uint64_t i = 0; i < n; i++) {
		uint32_t at = load_index(index + i * index_size, s.indices.componentType);
		if (at >= a.count)
			refuse(PSR_ERR_FORMAT, "%s: sparse index %u of %zu elements", place.c_str(), at, a.count);
		for (size_t c = 0; c < n_components; c++)
			out[at * n_wanted + c] = load_float(value + i * value_size + c * size, a.componentType, is_normalized);
	}
}

} // namespace

span view_bytes(const reader &r, int view, const std::string &place)
{
	check_index(view, r.model.bufferViews.size(), "buffer view", place);
	const tinygltf::BufferView &v = r.model.bufferViews[(size_t)view];
	check_index(v.buffer, r.src.buffers.size(), "buffer", "bufferViews[" + std::to_string(view) + "]");
	const std::vector<uint8_t> &b = r.src.buffers[(size_t)v.buffer];

	if (v.byteOffset > b.size() || v.byteLength > b.size() - v.byteOffset)
		refuse(PSR_ERR_FORMAT,
		       "bufferViews[%d]: %zu bytes from byte %zu reach behind the end of buffers[%d] of %zu bytes",
		       view, v.byteLength, v.byteOffset, v.buffer, b.size());
	return { b.data() + v.byteOffset, v.byteLength };
}

std::vector<float> accessor_floats(const reader &r, int accessor, size_t n_wanted, const std::string &place,
                                   bool is_normalized)
{
	const tinygltf::Accessor &a = accessor_at(r, accessor, place);
	const std::string where = place + " (accessors[" + std::to_string(accessor) + "])";
	size_t n_components = (size_t)tinygltf::GetNumComponentsInType((uint32_t)a.type);
	unsigned size = component_bytes(a.componentType, where);
	std::vector<float> out;
	is_normalized |= a.normalized;
	if (n_components != n_wanted && !(n_wanted == 4 && n_components == 3))
		refuse(PSR_ERR_FORMAT, "%s has %zu components, expected %zu", where.c_str(), n_components, n_wanted);
	if (a.count > IMPORT_MAX_VERTICES)
		refuse(PSR_ERR_LIMIT, "%s has %zu elements, the limit is %llu", where.c_str(), a.count,
		       (unsigned long long)IMPORT_MAX_VERTICES);
	if (a.bufferView < 0) {
		if (!a.sparse.isSparse || a.count > max_sparse_only)
			refuse(PSR_ERR_FORMAT, "%s has no data", where.c_str());
		out.assign(a.count * n_wanted, 0.0f);
	} else {
		uint64_t element = (uint64_t)size * n_components, stride = view_stride(r, a.bufferView, element);
		const uint8_t *p = elements(r, a.bufferView, { a.byteOffset, a.count, stride, element }, where);
		out.resize(a.count * n_wanted);
		for (size_t i = 0; i < a.count; i++)
			for (size_t c = 0; c < n_components; c++)
				out[i * n_wanted + c] = load_float(p + i * stride + c * size, a.componentType, is_normalized);
	}
	if (a.sparse.isSparse)
		add_sparse(r, a, n_wanted, is_normalized, out, where);
	for (size_t i = 0; n_components < n_wanted && i < a.count; i++)
		out[i * n_wanted + 3] = 1.0f;
	return out;
}

size_t accessor_count(const reader &r, int accessor, const std::string &place)
{
	return accessor_at(r, accessor, place).count;
}

std::vector<uint32_t> accessor_indices(const reader &r, int accessor, const std::string &place)
{
	const tinygltf::Accessor &a = accessor_at(r, accessor, place);
	const std::string where = place + " (accessors[" + std::to_string(accessor) + "])";
	std::vector<uint32_t> out;
	if (a.type != TINYGLTF_TYPE_SCALAR || a.sparse.isSparse)
		refuse(PSR_ERR_FORMAT, "%s: indices must be scalars that are not sparse", where.c_str());
	check_index_type(a.componentType, where);
	if (a.count > 3 * IMPORT_MAX_TRIANGLES)
		refuse(PSR_ERR_LIMIT, "%s has %zu indices", where.c_str(), a.count);

	unsigned size = component_bytes(a.componentType, where);
	uint64_t stride = view_stride(r, a.bufferView, size);
	const uint8_t *p = elements(r, a.bufferView, { a.byteOffset, a.count, stride, size }, where);

	out.resize(a.count);
	for (size_t i = 0; i < a.count; i++)
		out[i] = load_index(p + i * stride, a.componentType);
	return out;
}

} // namespace gltf
