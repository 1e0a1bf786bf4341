// What Open CASCADE does not ask about a STEP file.
#ifndef PSR_CAD_WHOLE_H
#define PSR_CAD_WHOLE_H

#include <Interface_InterfaceModel.hxx>

// Throws a cad_failure if an entity refers to one that is not there: Open CASCADE goes on with nothing in its place,
// and most of its translators fall over that. Or if a coordinate is beyond all numbers, as 1.E400: then some never end.
void cad_expect_whole(const Handle(Interface_InterfaceModel) &model);

#endif
