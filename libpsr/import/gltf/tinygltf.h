/* tiny_gltf.h as every file of this folder has to see it: it reads no files and no images; validate.cc does. */
#ifndef PSR_IMPORT_GLTF_TINYGLTF_H
#define PSR_IMPORT_GLTF_TINYGLTF_H

#define TINYGLTF_NO_FS
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#endif
