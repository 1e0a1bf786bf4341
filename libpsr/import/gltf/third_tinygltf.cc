#include <fstream>
#include <sstream>
#define TINYGLTF_IMPLEMENTATION
#include "tinygltf.h"
