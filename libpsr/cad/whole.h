// What a STEP file refers to and does not have.
#ifndef PSR_CAD_WHOLE_H
#define PSR_CAD_WHOLE_H

#include <Interface_InterfaceModel.hxx>

// Throws a cad_failure if an entity refers to one that is not there: Open CASCADE goes on with nothing in its place, and
// most of its translators do not ask.
void cad_expect_whole(const Handle(Interface_InterfaceModel) &model);

#endif
