#include "whole.h"

#include <cmath>
#include <string>
#include <Interface_Check.hxx>
#include <StepData_StepModel.hxx>
#include <StepGeom_CartesianPoint.hxx>
#include "triangles.h"

void cad_expect_whole(const Handle(Interface_InterfaceModel) &model)
{
	const Handle(Interface_Check) check = model->GlobalCheck(Standard_True);
	const Handle(StepData_StepModel) step = Handle(StepData_StepModel)::DownCast(model);
	/* What cannot be parsed fails, too, and is left out alone. */
	for (int i = 1; i <= check->NbFails(); i++) {
		const std::string fail = check->CFail(i);
		if (fail.rfind("Unresolved Reference", 0) == 0)
			throw cad_failure(PSR_ERR_FORMAT, "it refers to an entity that it does not have (" + fail + "); export it again");
	}
	for (int i = 1; !step.IsNull() && i <= step->NbEntities(); i++) {
		const Handle(StepGeom_CartesianPoint) point = Handle(StepGeom_CartesianPoint)::DownCast(step->Value(i));
		for (int k = 1; !point.IsNull() && k <= point->NbCoordinates(); k++)
			if (std::isinf(point->CoordinatesValue(k))) /* NaN leaves out what is there, and no more */
				throw cad_failure(PSR_ERR_FORMAT, "entity #" + std::to_string(step->IdentLabel(point)) +
				                                  " has a coordinate that is not finite");
	}
}
