#include <draco/compression/expert_encode.h>
#include <draco/point_cloud/point_cloud_builder.h>
#include "octree_draco.h"

namespace {

size_t encode(const uint32_t (*at)[3], uint32_t n)
{
	draco::PointCloudBuilder builder;
	builder.Start(n);
	const int place = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_UINT32);
	builder.SetAttributeValuesForAllPoints(place, at, 0);
	const std::unique_ptr<draco::PointCloud> cloud = builder.Finalize(false);
	if (cloud == nullptr)
		return 0;
	draco::ExpertEncoder encoder(*cloud);
	encoder.SetEncodingMethod(draco::POINT_CLOUD_KD_TREE_ENCODING);
	encoder.SetSpeedOptions(0, 0);
	draco::EncoderBuffer buffer;
	return encoder.EncodeToBuffer(&buffer).ok() ? buffer.size() : 0;
}

} // namespace

extern "C" size_t draco_bytes(const uint32_t (*at)[3], uint32_t n)
{
	try {
		return encode(at, n);
	} catch (...) {
		return 0;
	}
}
