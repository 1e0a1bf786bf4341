// What Open CASCADE does not ask about a STEP file.
#ifndef PSR_CAD_WHOLE_H
#define PSR_CAD_WHOLE_H

#include <Interface_InterfaceModel.hxx>
#include "triangles.h"

// Throws a cad_failure if an entity refers to one that is not there; if an entity of a shape has not as many parameters
// as its type, or no number or list where one should be, which Open CASCADE leaves undefined; or if a coordinate is beyond
// all numbers, as 1.E400: then some translators never end. Entities of shapes that refer to nothing or to a wrong type are
// counted: Open CASCADE goes on with nothing in its place, leaves out what it was for, or falls over that.
void cad_expect_whole(cad_module_report *report, const Handle(Interface_InterfaceModel) &model);

void cad_print(char *out, size_t size, const char *text); // without control characters

#endif
