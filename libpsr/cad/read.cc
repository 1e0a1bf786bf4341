// STEP and IGES by Open CASCADE's readers of documents, which know names, colours and assemblies.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <new>
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>
#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <IGESCAFControl.hxx>
#include <IGESCAFControl_Reader.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESData_IGESEntity.hxx>
#include <IGESGraph_Color.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <OSD_Parallel.hxx>
#include <OSD_ThreadPool.hxx>
#include <Quantity_ColorRGBA.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <STEPControl_Controller.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TDF_LabelSequence.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_DataMapOfShapeInteger.hxx>
#include <TopoDS.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include "patches.h"
#include "whole.h"

namespace {

constexpr int MOST_DEPTH = 64;          // of assemblies
constexpr size_t MOST_COLORS = 65000;
constexpr double ALIKE = 1e-6;          // of the longest side: how far a NURBS may be from the surface that it stands for

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

struct walk {
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

	uint32_t number(const std::array<float, 4> &c)
	{
		const auto found = number_of.find(c);
		if (found != number_of.end())
			return found->second;
		if (color.size() >= MOST_COLORS)
			throw cad_failure(PSR_ERR_LIMIT, "more than " + std::to_string(MOST_COLORS) + " colours");
		color.push_back(c);
		return number_of[c] = static_cast<uint32_t>(color.size() - 1);
	}

	bool color_of(uint32_t &out, const TDF_Label &label)
	{
		Quantity_ColorRGBA c;
		if (!colors->GetColor(label, XCAFDoc_ColorSurf, c) && !colors->GetColor(label, XCAFDoc_ColorGen, c))
			return false;
		out = number({ static_cast<float>(c.GetRGB().Red()), static_cast<float>(c.GetRGB().Green()),
		               static_cast<float>(c.GetRGB().Blue()), c.Alpha() });
		return true;
	}

	void visit(const TDF_Label &label, const TopLoc_Location &location, uint32_t inherited, int depth);
	void part(const TDF_Label &label, const TopLoc_Location &location, uint32_t inherited);
	void faces(const TDF_Label &label, const TopoDS_Shape &shape, const TopLoc_Location &location, uint32_t inherited,
	           const TopTools_DataMapOfShapeInteger &own);
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

// Open CASCADE may be built with threads of another library, which take all cores.
void use_threads(int n)
{
	OSD_Parallel::SetUseOcctThreads(Standard_True);
	OSD_ThreadPool::DefaultPool()->SetNbDefaultThreadsToLaunch(n);
}

void walk::part(const TDF_Label &label, const TopLoc_Location &location, uint32_t inherited)
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

void walk::faces(const TDF_Label &label, const TopoDS_Shape &shape, const TopLoc_Location &location, uint32_t inherited,
                 const TopTools_DataMapOfShapeInteger &own)
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

void walk::visit(const TDF_Label &label, const TopLoc_Location &location, uint32_t inherited, int depth)
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

void expect_whole(STEPCAFControl_Reader &reader)
{
	cad_expect_whole(reader.ChangeReader().WS()->Model());
}

void expect_whole(IGESCAFControl_Reader &) {}

template <typename Reader> void transfer(Reader &reader, const Handle(TDocStd_Document) &document, const char *path)
{
	reader.SetColorMode(Standard_True);
	reader.SetNameMode(Standard_True);
	if (reader.ReadFile(path) != IFSelect_RetDone)
		throw cad_failure(PSR_ERR_FORMAT, "its entities cannot be parsed");
	expect_whole(reader);
	Handle(TDocStd_Document) to = document;
	if (!reader.Transfer(to))
		throw cad_failure(PSR_ERR_FORMAT, "none of its shapes can be read");
}

// Colours of faces of IGES that the document lost: the reader looks for a face with the place that its entity has, and
// faces whose surface has a matrix of its own got another one since.
void take_entity_colors(walk &w, const IGESCAFControl_Reader &reader)
{
	const Handle(Transfer_TransientProcess) results = reader.WS()->TransferReader()->TransientProcess();
	const Handle(Interface_InterfaceModel) model = reader.WS()->Model();
	for (int i = 1; i <= model->NbEntities(); i++) {
		const Handle(IGESData_IGESEntity) entity = Handle(IGESData_IGESEntity)::DownCast(model->Value(i));
		if (entity.IsNull() || entity->DefColor() == IGESData_DefVoid)
			continue;
		const TopoDS_Shape shape = TransferBRep::ShapeResult(results, entity);
		if (shape.IsNull() || shape.ShapeType() != TopAbs_FACE)
			continue;
		const Handle(IGESGraph_Color) given = Handle(IGESGraph_Color)::DownCast(entity->Color());
		Quantity_Color c = given.IsNull() ? IGESCAFControl::DecodeColor(entity->RankColor()) : Quantity_Color();
		if (!given.IsNull()) {
			double percent[3];
			given->RGBIntensity(percent[0], percent[1], percent[2]);
			for (double &p : percent)
				p = std::min(std::max(p / 100, 0.0), 1.0);
			c.SetValues(percent[0], percent[1], percent[2], Quantity_TOC_sRGB);
		}
		w.entity_color.Bind(shape.Located(TopLoc_Location()),
		                    static_cast<int>(w.number({ static_cast<float>(c.Red()), static_cast<float>(c.Green()),
		                                                static_cast<float>(c.Blue()), 1 })));
	}
}

double longest_side(const TDF_LabelSequence &roots)
{
	Bnd_Box box;
	double low[3], high[3], side = 0;
	for (TDF_LabelSequence::Iterator it(roots); it.More(); it.Next())
		BRepBndLib::Add(XCAFDoc_ShapeTool::GetShape(it.Value()), box, Standard_False);
	if (box.IsVoid() || box.IsOpen())
		throw cad_failure(PSR_ERR_FORMAT, "it has no surface");
	box.Get(low[0], low[1], low[2], high[0], high[1], high[2]);
	for (int k = 0; k < 3; k++)
		side = std::max(side, high[k] - low[k]);
	return side;
}

// Copies to memory that cad_destroy() frees.
template <typename To, typename From> To *copy(const std::vector<From> &from)
{
	static_assert(sizeof(To) == sizeof(From));
	void *block = std::malloc((from.size() + 1) * sizeof(From));
	if (block == nullptr)
		throw std::bad_alloc();
	std::memcpy(block, from.data(), from.size() * sizeof(From));
	return static_cast<To *>(block);
}

void hand_over(psr_patch *out, const cad_patch &p)
{
	for (int k = 0; k < 2; k++) {
		out->degree[k] = p.degree[k];
		out->n[k] = p.n[k];
		out->knot[k] = copy<double>(p.knot[k]);
	}
	out->control = copy<double[4]>(p.control);
	out->corner = copy<double[2]>(p.corner);
	out->triangle = copy<uint32_t[3]>(p.triangle);
	out->rim = copy<uint8_t>(p.rim);
	out->n_corners = static_cast<uint32_t>(p.corner.size());
	out->n_triangles = static_cast<uint32_t>(p.triangle.size());
	out->material = p.color;
}

void hand_over(cad_module_mesh *out, const walk &w)
{
	const cad_triangles &t = w.triangles;
	std::vector<std::array<double, 3>> position;
	std::vector<std::array<float, 3>> normal;
	for (const cad_vertex &v : t.vertex) {
		position.push_back(v.at);
		normal.push_back(v.normal);
	}
	out->position = copy<double[3]>(position);
	out->normal = copy<float[3]>(normal);
	out->triangle = copy<uint32_t[3]>(t.triangle);
	out->color_of = copy<uint32_t>(t.color_of);
	out->color = copy<float[4]>(w.color);
	out->n_vertices = static_cast<uint32_t>(t.vertex.size());
	out->n_triangles = static_cast<uint32_t>(t.triangle.size());
	out->n_colors = static_cast<uint32_t>(w.color.size());
	if (w.patches.patch.size() > 0) {
		out->patch = static_cast<psr_patch *>(std::calloc(w.patches.patch.size(), sizeof *out->patch));
		if (out->patch == nullptr)
			throw std::bad_alloc();
		out->n_patches = static_cast<uint32_t>(w.patches.patch.size());
		for (uint32_t i = 0; i < out->n_patches; i++)
			hand_over(&out->patch[i], w.patches.patch[i]);
		out->patch_of = copy<uint32_t>(w.patches.patch_of);
	}
	out->n_unlike = w.patches.n_unlike;
	out->n_faces = w.n_faces;
	out->n_left_out = w.n_left_out;
	out->n_open = w.n_open;
	std::snprintf(out->first_left_out, sizeof out->first_left_out, "%s", w.first_left_out.c_str());
}

// An application of the process keeps its documents; this one is closed in any case.
struct open_document {
	Handle(TDocStd_Document) document;
	open_document() { XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document); }
	~open_document() { XCAFApp_Application::GetApplication()->Close(document); }
};

void read(cad_module_mesh *out, const cad_module_source *source)
{
	open_document opened;
	TDF_LabelSequence roots;
	walk w;
	Message::DefaultMessenger()->ChangePrinters().Clear();
	IGESControl_Controller::Init();
	STEPControl_Controller::Init();
	Interface_Static::SetCVal("xstep.cascade.unit", "MM");
	use_threads(source->n_threads);
	w.number({ 0, 0, 0, -1 });
	if (source->is_iges) {
		IGESCAFControl_Reader reader;
		transfer(reader, opened.document, source->path);
		take_entity_colors(w, reader);
	} else {
		STEPCAFControl_Reader reader;
		transfer(reader, opened.document, source->path);
	}
	w.shapes = XCAFDoc_DocumentTool::ShapeTool(opened.document->Main());
	w.colors = XCAFDoc_DocumentTool::ColorTool(opened.document->Main());
	w.shapes->GetFreeShapes(roots);
	w.source = source;
	w.longest_side = longest_side(roots);
	if (!(w.longest_side > 0))
		throw cad_failure(PSR_ERR_FORMAT, "all of it is one point");
	w.triangles.max_triangles = source->max_triangles;
	w.patches.most_degree = source->most_degree;
	w.patches.tolerance = ALIKE * w.longest_side;
	for (TDF_LabelSequence::Iterator it(roots); it.More(); it.Next())
		w.visit(it.Value(), TopLoc_Location(), 0, 0);
	w.triangles.join();
	w.patches.find_ends(w.triangles);
	hand_over(out, w);
}

int fail(char *message, unsigned size, int code, const char *text)
{
	std::snprintf(message, size, "%s", text != nullptr && text[0] != '\0' ? text : "Open CASCADE gives no reason");
	for (char *c = message; *c != '\0'; c++)
		if (static_cast<unsigned char>(*c) < ' ')
			*c = ' ';
	return code;
}

} // namespace

extern "C" void cad_destroy(cad_module_mesh *mesh)
{
	if (mesh == nullptr)
		return;
	std::free(mesh->position);
	std::free(mesh->normal);
	std::free(mesh->triangle);
	std::free(mesh->color_of);
	std::free(mesh->color);
	for (uint32_t i = 0; i < mesh->n_patches; i++)
		cad_patch_free(&mesh->patch[i]);
	std::free(mesh->patch);
	std::free(mesh->patch_of);
	std::free(mesh);
}

extern "C" int cad_read(cad_module_mesh **out, const cad_module_source *source, char *message, unsigned size)
{
	cad_module_mesh *mesh = static_cast<cad_module_mesh *>(std::calloc(1, sizeof *mesh));
	int code = PSR_OK;
	*out = nullptr;
	try {
		if (mesh == nullptr)
			throw std::bad_alloc();
		read(mesh, source);
	} catch (const cad_failure &e) {
		code = fail(message, size, e.code, e.what());
	} catch (const Standard_OutOfMemory &) {
		code = fail(message, size, PSR_ERR_MEMORY, "no memory");
	} catch (const Standard_Failure &e) {
		code = fail(message, size, PSR_ERR_FORMAT, e.GetMessageString());
	} catch (const std::bad_alloc &) {
		code = fail(message, size, PSR_ERR_MEMORY, "no memory");
	} catch (const std::exception &e) {
		code = fail(message, size, PSR_ERR_FORMAT, e.what());
	} catch (...) {
		code = fail(message, size, PSR_ERR_FORMAT, nullptr);
	}
	if (code != PSR_OK)
		cad_destroy(mesh);
	else
		*out = mesh;
	return code;
}

// The symbol that programs look for in the CAD module.
extern "C" __attribute__((visibility("default"))) const cad_module psr_cad_module = { CAD_MODULE_VERSION, cad_read,
	                                                                                  cad_destroy };
