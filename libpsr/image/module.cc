// The symbol that programs look for in the image module.
#include "module.h"

extern "C" __attribute__((visibility("default"))) const image_module psr_image_module = {
	IMAGE_MODULE_VERSION, image_read, image_write, image_check,
	image_animation_check, image_animation_open, image_animation_add, image_animation_close,
};
