// The functions of the image module, for its table. base/image_module.h has their contracts.
#ifndef PSR_IMAGE_MODULE_H
#define PSR_IMAGE_MODULE_H

extern "C" {
#include "base/image_module.h"

image_module_read image_read;
image_module_write image_write;
image_module_check image_check;
image_module_animation_check image_animation_check;
image_module_animation_open image_animation_open;
image_module_animation_add image_animation_add;
image_module_animation_close image_animation_close;
}

#endif
