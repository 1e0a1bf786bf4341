// What the module gives.
#ifndef PSR_CAD_RESULT_H
#define PSR_CAD_RESULT_H

#include "walk.h"

void cad_hand_over(cad_module_mesh *out, const cad_walk &w); // throws std::bad_alloc; then *out holds a part
extern "C" cad_module_destroy cad_destroy;

#endif
