#include "whole.h"

#include <string>
#include <Interface_Check.hxx>
#include "triangles.h"

void cad_expect_whole(const Handle(Interface_InterfaceModel) &model)
{
	const Handle(Interface_Check) check = model->GlobalCheck(Standard_True);
	if (check->NbFails() > 0)
		throw cad_failure(PSR_ERR_FORMAT, "it refers to an entity that it does not have (" +
		                                  std::string(check->CFail(1)) + "); export it again");
}
