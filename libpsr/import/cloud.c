#include "base/srgb.h"
#include "cloud.h"

float cloud_linear(double code)
{
	int below;

	if (!(code > 0.0))
		return psr_srgb_to_linear[0];
	if (!(code < 255.0))
		return psr_srgb_to_linear[255];
	below = (int)code;
	return (float)(psr_srgb_to_linear[below] +
	               (code - below) * ((double)psr_srgb_to_linear[below + 1] - psr_srgb_to_linear[below]));
}
