/* cad_plate HOLES OUT.step: a plate of HOLES x HOLES holes whose edges are all rounded, as 26 + 3 HOLES^2 trimmed NURBS
 * patches. */
#include <cstdio>
#include <cstdlib>

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepBuilderAPI_NurbsConvert.hxx>
#include <BRepFilletAPI_MakeFillet.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <STEPControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopoDS.hxx>

/* Millimetres. */
static constexpr double PITCH = 20, THICK = 15, RADIUS = 6, ROUND = 1.5;

static TopoDS_Shape drilled(int holes)
{
	TopTools_ListOfShape from, drills;
	BRepAlgoAPI_Cut cut;

	from.Append(BRepPrimAPI_MakeBox(holes * PITCH, holes * PITCH, THICK).Shape());
	for (int i = 0; i < holes * holes; i++) {
		const gp_Pnt at((i % holes + 0.5) * PITCH, (i / holes + 0.5) * PITCH, -1);

		drills.Append(BRepPrimAPI_MakeCylinder(gp_Ax2(at, gp::DZ()), RADIUS, THICK + 2).Shape());
	}
	cut.SetArguments(from);
	cut.SetTools(drills);
	cut.Build();
	return cut.Shape();
}

/* Edges between two faces: a hole's seam is twice in one. */
static TopoDS_Shape rounded(const TopoDS_Shape &sharp)
{
	BRepFilletAPI_MakeFillet round(sharp);
	TopTools_IndexedDataMapOfShapeListOfShape edges;

	TopExp::MapShapesAndAncestors(sharp, TopAbs_EDGE, TopAbs_FACE, edges);
	for (int e = 1; e <= edges.Extent(); e++)
		if (!edges(e).First().IsSame(edges(e).Last()))
			round.Add(ROUND, TopoDS::Edge(edges.FindKey(e)));
	return round.Shape();
}

static int write(int holes, const char *path)
{
	STEPControl_Writer writer;
	const TopoDS_Shape plate = BRepBuilderAPI_NurbsConvert(rounded(drilled(holes)), Standard_True).Shape();

	Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
	return writer.Transfer(plate, STEPControl_AsIs) == IFSelect_RetDone && writer.Write(path) == IFSelect_RetDone;
}

int main(int argc, char **argv)
{
	const int holes = argc == 3 ? std::atoi(argv[1]) : 0;

	if (holes < 1 || holes > 100) {
		std::fprintf(stderr, "usage: cad_plate HOLES OUT.step, 1 to 100 holes a side\n");
		return 2;
	}
	try {
		if (write(holes, argv[2]))
			return 0;
		std::fprintf(stderr, "cad_plate: %s: cannot be written\n", argv[2]);
	} catch (const Standard_Failure &failure) {
		std::fprintf(stderr, "cad_plate: %s\n", failure.GetMessageString());
	}
	return 3;
}
