#include <string.h>
#include <strings.h>
#include "formats.h"

static const struct {
	const char *endings; /* each followed by a blank */
	const char *advice;
} formats[] = {
	{ ".copc.laz .laz ",
	  "psr reads no compressed LAS (LAZ); unpack it with \"laszip -i IN.laz -o OUT.las\", with las2las, or with "
	  "\"pdal translate IN.laz OUT.las\"" },
	{ ".e57 ",
	  "psr reads no E57 scans; convert it with \"pdal translate IN.e57 OUT.las\", or save it as LAS or PLY in CloudCompare" },
	{ ".pts .ptx .xyz .asc ",
	  "psr reads no points in this format; save it as LAS or PLY in CloudCompare, or with \"pdal translate\"" },
	{ ".rcp .rcs .fls .fws .lsproj .zfs ",
	  "psr reads no project of a scanner's own program; export it from there as LAS, or as PLY" },
	{ ".brep ", "psr reads no surfaces in Open CASCADE's own format; export it as STEP from FreeCAD" },
	{ ".fcstd .sldprt .sldasm .ipt .iam .prt .catpart .catproduct .jt .x_t .x_b .sat .f3d .3dm .skp .dwg .dxf ",
	  "psr reads no drawings of CAD programs; export it as glTF, OBJ or STL from the program that made it" },
	{ ".ifc ", "psr reads no buildings in IFC; convert it with \"IfcConvert IN.ifc OUT.glb\"" },
	{ ".blend ", "psr reads no files of Blender; export it from there as glTF 2.0" },
	{ ".usd .usda .usdc .usdz .abc ", "psr reads no USD or Alembic; import it into Blender, and export it as glTF 2.0" },
	{ ".max .ma .mb .c4d .ztl .hip ",
	  "psr reads no scenes of modelling programs; export it as glTF, OBJ or FBX from the program that made it" },
	{ ".wrl .vrml .x3d .x3db .ctm .u3d ", "psr reads no meshes in this format; save it as PLY or OBJ in MeshLab" },
	{ ".vtk .vtp .vtu ", "psr reads no files of VTK; save its surface as PLY or STL in ParaView" },
	{ ".nxs .nxz ", "psr reads no meshes in Nexus' format; give it the PLY or OBJ that this one was made of" },
	{ ".b3dm .i3dm .pnts ",
	  "psr reads no 3D tiles; give it the glTF, OBJ or LAS that they were made of (\"3d-tiles-tools b3dmToGlb\" unpacks one)" },
	{ ".splat .ksplat .spz ", "psr draws surfaces and points, not Gaussian splats; give it the mesh of the same object" },
	{ ".zip .7z .rar .tar .tar.gz .tgz .tar.xz .tar.bz2 .gz .bz2 .xz .zst ",
	  "this is an archive; unpack it into the models folder, or into a folder of its own there" },
};

const char *formats_advice(const char *file_name, size_t *stem)
{
	/* Looks from the first dot on: .tar.gz comes before .gz. */
	for (const char *dot = strchr(file_name, '.'); dot != NULL; dot = strchr(dot + 1, '.')) {
		*stem = (size_t)(dot - file_name);
		for (size_t i = 0; *stem > 0 && i < sizeof formats / sizeof formats[0]; i++)
			for (const char *at = formats[i].endings; *at != '\0'; at += strcspn(at, " ") + 1)
				if (strcspn(at, " ") == strlen(dot) && strncasecmp(at, dot, strlen(dot)) == 0)
					return formats[i].advice;
	}
	return NULL;
}
