// The parts of a document, with their names and colours, to triangles and patches.
#ifndef PSR_CAD_WALK_H
#define PSR_CAD_WALK_H

#include <map>
#include <TDF_Label.hxx>
#include <TopLoc_Location.hxx>
#include <TopTools_DataMapOfShapeInteger.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include "patches.h"

struct cad_walk {
	Handle(XCAFDoc_ShapeTool) shapes;
	Handle(XCAFDoc_ColorTool) colors;
	cad_triangles triangles;
	cad_patches patches;
	std::vector<std::array<float, 4>> color;
	std::map<std::array<float, 4>, uint32_t> number_of;
	const cad_module_source *source;
	double longest_side;
	uint32_t n_faces = 0, n_left_out = 0, n_open = 0;
	std::string first_left_out;
	TopTools_DataMapOfShapeInteger entity_color; // of faces without places; see take_entity_colors()

	uint32_t number(const std::array<float, 4> &c);
	bool color_of(uint32_t &out, const TDF_Label &label);
	void visit(const TDF_Label &label, const TopLoc_Location &location, uint32_t inherited, int depth);
	void part(const TDF_Label &label, const TopLoc_Location &location, uint32_t inherited);
	void faces(const TDF_Label &label, const TopoDS_Shape &shape, const TopLoc_Location &location, uint32_t inherited,
	           const TopTools_DataMapOfShapeInteger &own);
};

#endif
