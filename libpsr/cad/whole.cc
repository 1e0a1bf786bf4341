#include "whole.h"

#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <string>
#include <Interface_Check.hxx>
#include <StepData_StepModel.hxx>
#include <StepGeom_CartesianPoint.hxx>
#include <StepRepr_ItemDefinedTransformation.hxx>
#include <StepRepr_PropertyDefinitionRepresentation.hxx>
#include <StepRepr_Representation.hxx>
#include <StepRepr_RepresentationContext.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <StepRepr_RepresentationMap.hxx>
#include <StepRepr_RepresentationRelationship.hxx>
#include <StepShape_ContextDependentShapeRepresentation.hxx>
#include <StepVisual_Colour.hxx>
#include <StepVisual_FillAreaStyle.hxx>
#include <StepVisual_FillAreaStyleColour.hxx>
#include <StepVisual_PresentationStyleAssignment.hxx>
#include <StepVisual_SurfaceSideStyle.hxx>
#include <StepVisual_SurfaceStyleFillArea.hxx>
#include <StepVisual_SurfaceStyleUsage.hxx>

namespace {

// Entities that shapes, their places and their colours are made of. Others are read as far as they can be.
bool is_of_shape(const Handle(Standard_Transient) &entity)
{
	for (const Handle(Standard_Type) &type :
	     { STANDARD_TYPE(StepRepr_RepresentationItem), STANDARD_TYPE(StepRepr_Representation),
	       STANDARD_TYPE(StepRepr_RepresentationContext), STANDARD_TYPE(StepRepr_RepresentationMap),
	       STANDARD_TYPE(StepRepr_RepresentationRelationship), STANDARD_TYPE(StepRepr_ItemDefinedTransformation),
	       STANDARD_TYPE(StepRepr_PropertyDefinitionRepresentation),
	       STANDARD_TYPE(StepShape_ContextDependentShapeRepresentation), STANDARD_TYPE(StepVisual_Colour),
	       STANDARD_TYPE(StepVisual_FillAreaStyle), STANDARD_TYPE(StepVisual_FillAreaStyleColour),
	       STANDARD_TYPE(StepVisual_PresentationStyleAssignment), STANDARD_TYPE(StepVisual_SurfaceSideStyle),
	       STANDARD_TYPE(StepVisual_SurfaceStyleFillArea), STANDARD_TYPE(StepVisual_SurfaceStyleUsage) })
		if (entity->IsKind(type))
			return true;
	return false;
}

bool has(const std::string &text, std::initializer_list<const char *> any)
{
	for (const char *part : any)
		if (text.find(part) != std::string::npos)
			return true;
	return false;
}

// Of other fails Open CASCADE says itself what it took instead. A coordinate that is no number is 0: its part is
// elsewhere.
bool is_undefined(const std::string &fail, bool is_point)
{
	return has(fail, { "Count of Parameters", " not a LIST" }) ||
	       (!is_point && has(fail, { " not a Real", " not an Integer" }));
}

bool is_lacking(const std::string &fail)
{
	return has(fail, { " not an Entity", " absent", "illegal type", "illegal parameter type", "Unresolved reference",
	                   "could not be read", "does not match SELECT" });
}

void check_parameters(cad_module_report *report, const Handle(StepData_StepModel) &step, int i)
{
	const Handle(Standard_Transient) entity = step->Value(i);
	const Handle(Interface_Check) check = step->Check(i, Standard_True);
	const std::string type = entity->DynamicType()->Name();
	bool is_counted = false;
	for (int k = 1; k <= check->NbFails() && is_of_shape(entity); k++) {
		std::string fail = check->CFail(k);
		if (const size_t at = fail.find(" n0."); at != std::string::npos)
			fail.erase(at + 1, 3);
		const std::string text = "#" + std::to_string(step->IdentLabel(entity)) + ", read as " +
		                         type.substr(type.find('_') + 1) + ": " + fail;
		if (is_undefined(fail, entity->IsKind(STANDARD_TYPE(StepGeom_CartesianPoint))))
			throw cad_failure(PSR_ERR_FORMAT, "entity " + text + "; export it again");
		if (is_counted || !is_lacking(fail))
			continue;
		is_counted = true;
		if (report->n_lacking++ == 0)
			cad_print(report->first_lacking, sizeof report->first_lacking, text.c_str());
	}
}

void expect_finite(const Handle(StepData_StepModel) &step, int i)
{
	const Handle(StepGeom_CartesianPoint) point = Handle(StepGeom_CartesianPoint)::DownCast(step->Value(i));
	for (int k = 1; !point.IsNull() && k <= point->NbCoordinates(); k++)
		if (std::isinf(point->CoordinatesValue(k))) /* NaN leaves out what is there, and no more */
			throw cad_failure(PSR_ERR_FORMAT, "entity #" + std::to_string(step->IdentLabel(point)) +
			                                  " has a coordinate that is not finite");
}

} // namespace

void cad_expect_whole(cad_module_report *report, const Handle(Interface_InterfaceModel) &model)
{
	const Handle(Interface_Check) check = model->GlobalCheck(Standard_True);
	const Handle(StepData_StepModel) step = Handle(StepData_StepModel)::DownCast(model);
	/* What cannot be parsed fails, too, and is left out alone. */
	for (int i = 1; i <= check->NbFails(); i++) {
		const std::string fail = check->CFail(i);
		if (fail.rfind("Unresolved Reference", 0) == 0)
			throw cad_failure(PSR_ERR_FORMAT,
			                  "it refers to an entity that it does not have (" + fail + "); export it again");
	}
	for (int i = 1; !step.IsNull() && i <= step->NbEntities(); i++) {
		expect_finite(step, i);
		check_parameters(report, step, i);
	}
}

void cad_print(char *out, size_t size, const char *text)
{
	std::snprintf(out, size, "%s", text);
	for (char *c = out; *c != '\0'; c++)
		if (static_cast<unsigned char>(*c) < ' ')
			*c = ' ';
}
