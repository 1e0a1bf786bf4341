#include "walk.h"

#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <Quantity_ColorRGBA.hxx>
#include <TDataStd_Name.hxx>
#include <TDF_LabelSequence.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>

namespace {

constexpr int MOST_DEPTH = 64; // of assemblies
constexpr size_t MOST_COLORS = 65000;

// How much there was before a part's faces.
struct cad_count {
	size_t n_vertices, n_triangles, n_patches, n_rims, n_patch_of;
	uint32_t n_unlike, n_faces, n_left_out;

	cad_count(const cad_triangles &t, const cad_patches &p, uint32_t faces, uint32_t left_out)
		: n_vertices(t.vertex.size()), n_triangles(t.triangle.size()), n_patches(p.patch.size()), n_rims(p.rim.size()),
		  n_patch_of(p.patch_of.size()), n_unlike(p.n_unlike), n_faces(faces), n_left_out(left_out)
	{
	}

	void go_back(cad_triangles &t, cad_patches &p, uint32_t &faces, uint32_t &left_out) const
	{
		t.vertex.resize(n_vertices);
		t.triangle.resize(n_triangles);
		t.color_of.resize(n_triangles);
		p.patch.resize(n_patches);
		p.rim.resize(n_rims);
		p.patch_of.resize(n_patch_of);
		p.n_unlike = n_unlike;
		faces = n_faces;
		left_out = n_left_out;
	}
};

std::string name_of(const TDF_Label &label)
{
	Handle(TDataStd_Name) name;
	std::string text;
	if (label.FindAttribute(TDataStd_Name::GetID(), name)) {
		const TCollection_AsciiString ascii(name->Get(), '?');
		text.assign(ascii.ToCString(), std::min(ascii.Length(), 60));
	}
	for (char &c : text)
		if (c < ' ' || c > '~')
			c = '?';
	return text;
}

// Sides along edges are finer than the faces between them, if patches are to end there.
void cut(const TopoDS_Shape &shape, const cad_module_source &source, double longest_side, bool are_patches)
{
	IMeshTools_Parameters how;
	how.Angle = source.angle;
	how.AngleInterior = are_patches ? source.patch_angle : source.angle;
	how.Deflection = source.deflection * longest_side;
	how.DeflectionInterior = are_patches ? source.patch_deflection * longest_side : how.Deflection;
	if (source.rim > 0)
		how.Deflection = std::min(source.rim, source.deflection) * longest_side;
	how.InParallel = source.n_threads > 1; // face by face: the same triangles
	BRepMesh_IncrementalMesh(shape, how);
}

} // namespace

uint32_t cad_walk::number(const std::array<float, 4> &c)
{
	const auto found = number_of.find(c);
	if (found != number_of.end())
		return found->second;
	if (color.size() >= MOST_COLORS)
		throw cad_failure(PSR_ERR_LIMIT, "more than " + std::to_string(MOST_COLORS) + " colours");
	color.push_back(c);
	return number_of[c] = static_cast<uint32_t>(color.size() - 1);
}

bool cad_walk::color_of(uint32_t &out, const TDF_Label &label)
{
	Quantity_ColorRGBA c;
	if (!colors->GetColor(label, XCAFDoc_ColorSurf, c) && !colors->GetColor(label, XCAFDoc_ColorGen, c))
		return false;
	out = number({ static_cast<float>(c.GetRGB().Red()), static_cast<float>(c.GetRGB().Green()),
	               static_cast<float>(c.GetRGB().Blue()), c.Alpha() });
	return true;
}

void cad_walk::part(const TDF_Label &label, const TopLoc_Location &location, uint32_t inherited)
{
	const TopoDS_Shape shape = XCAFDoc_ShapeTool::GetShape(label);
	TopTools_DataMapOfShapeInteger own; // colours of faces that have their own, or whose solid has
	TDF_LabelSequence parts;
	if (shape.IsNull())
		return;
	XCAFDoc_ShapeTool::GetSubShapes(label, parts);
	for (const bool is_face : { false, true })
		for (TDF_LabelSequence::Iterator it(parts); it.More(); it.Next()) {
			const TopoDS_Shape sub = XCAFDoc_ShapeTool::GetShape(it.Value());
			uint32_t c = 0;
			if (sub.IsNull() || (sub.ShapeType() == TopAbs_FACE) != is_face || !color_of(c, it.Value()))
				continue;
			for (TopExp_Explorer face(sub, TopAbs_FACE); face.More(); face.Next())
				own.Bind(face.Current(), static_cast<int>(c));
		}
	for (TopExp_Explorer shell(shape, TopAbs_SHELL); shell.More(); shell.Next())
		n_open += !BRep_Tool::IsClosed(shell.Current());
	if (source->rim > 0) {
		const cad_count before = { triangles, patches, n_faces, n_left_out };
		cut(shape, *source, longest_side, true);
		faces(label, shape, location, inherited, own);
		if (patches.n_unlike == before.n_unlike && n_left_out == before.n_left_out)
			return;
		// Triangles stand for some of the faces.
		before.go_back(triangles, patches, n_faces, n_left_out);
		BRepTools::Clean(shape);
	}
	cut(shape, *source, longest_side, false);
	faces(label, shape, location, inherited, own);
}

void cad_walk::faces(const TDF_Label &label, const TopoDS_Shape &shape, const TopLoc_Location &location,
                     uint32_t inherited, const TopTools_DataMapOfShapeInteger &own)
{
	for (TopExp_Explorer it(shape, TopAbs_FACE); it.More(); it.Next()) {
		const int *c = own.Seek(it.Current());
		if (c == nullptr)
			c = entity_color.Seek(it.Current().Located(TopLoc_Location()));
		const TopoDS_Face face = TopoDS::Face(it.Current().Moved(location));
		const size_t first_triangle = triangles.triangle.size(), first_vertex = triangles.vertex.size();
		const uint32_t number = c != nullptr ? static_cast<uint32_t>(*c) : inherited;
		n_faces++;
		if (triangles.add(face, number)) {
			if (source->rim > 0)
				patches.add(triangles, face, number, first_triangle, first_vertex);
			continue;
		}
		if (n_left_out++ == 0)
			first_left_out = std::to_string(n_faces) + " of part \"" + name_of(label) + "\"";
	}
}

void cad_walk::visit(const TDF_Label &label, const TopLoc_Location &location, uint32_t inherited, int depth)
{
	TDF_LabelSequence parts;
	TDF_Label referred;
	if (depth > MOST_DEPTH)
		throw cad_failure(PSR_ERR_LIMIT, "assemblies are nested more than " + std::to_string(MOST_DEPTH) + " deep");
	color_of(inherited, label);
	if (XCAFDoc_ShapeTool::GetReferredShape(label, referred)) {
		visit(referred, location * XCAFDoc_ShapeTool::GetLocation(label), inherited, depth + 1);
	} else if (XCAFDoc_ShapeTool::IsAssembly(label)) {
		XCAFDoc_ShapeTool::GetComponents(label, parts);
		for (TDF_LabelSequence::Iterator it(parts); it.More(); it.Next())
			visit(it.Value(), location, inherited, depth + 1);
	} else {
		part(label, location, inherited);
	}
}
