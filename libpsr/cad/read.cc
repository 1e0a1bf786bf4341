// STEP and IGES by Open CASCADE's readers of documents, which know names, colours and assemblies.
#include <cstdio>
#include <cstdlib>
#include <new>
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>
#include <BRepBndLib.hxx>
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
#include <Quantity_Color.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <STEPControl_Controller.hxx>
#include <TDocStd_Document.hxx>
#include <TDF_LabelSequence.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include "result.h"
#include "whole.h"

namespace {

constexpr double ALIKE = 1e-6; // of the longest side: how far a NURBS may be from the surface that it stands for

// Open CASCADE may be built with threads of another library, which take all cores.
void use_threads(int n)
{
	OSD_Parallel::SetUseOcctThreads(Standard_True);
	OSD_ThreadPool::DefaultPool()->SetNbDefaultThreadsToLaunch(n);
}

void expect_whole(STEPCAFControl_Reader &reader, cad_module_report *report)
{
	cad_expect_whole(report, reader.ChangeReader().WS()->Model());
}

void expect_whole(IGESCAFControl_Reader &, cad_module_report *) {}

template <typename Reader> void transfer(Reader &reader, const Handle(TDocStd_Document) &document,
                                            const cad_module_source *source)
{
	reader.SetColorMode(Standard_True);
	reader.SetNameMode(Standard_True);
	if (reader.ReadFile(source->path) != IFSelect_RetDone)
		throw cad_failure(PSR_ERR_FORMAT, "its entities cannot be parsed");
	expect_whole(reader, source->report);
	Handle(TDocStd_Document) to = document;
	source->report->doing = CAD_MODULE_SHAPES;
	if (!reader.Transfer(to))
		throw cad_failure(PSR_ERR_FORMAT, "none of its shapes can be read");
}

// Colours of faces of IGES that the document lost: the reader looks for a face with the place that its entity has, and
// faces whose surface has a matrix of its own got another one since.
void take_entity_colors(cad_walk &w, const IGESCAFControl_Reader &reader)
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
	cad_walk w;
	source->report->doing = CAD_MODULE_PARSES;
	Message::DefaultMessenger()->ChangePrinters().Clear();
	IGESControl_Controller::Init();
	STEPControl_Controller::Init();
	Interface_Static::SetCVal("xstep.cascade.unit", "MM");
	use_threads(source->n_threads);
	w.number({ 0, 0, 0, -1 });
	if (source->is_iges) {
		IGESCAFControl_Reader reader;
		transfer(reader, opened.document, source);
		take_entity_colors(w, reader);
	} else {
		STEPCAFControl_Reader reader;
		transfer(reader, opened.document, source);
	}
	source->report->doing = CAD_MODULE_CUTS;
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
	cad_hand_over(out, w);
}

int fail(char *message, unsigned size, int code, const char *text)
{
	cad_print(message, size, text != nullptr && text[0] != '\0' ? text : "Open CASCADE gives no reason");
	return code;
}

} // namespace

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
