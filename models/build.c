#include "commands.h"

#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/maths.h"
#include "base/outfile.h"
#include "base/vec.h"
#include "psr/build.h"
#include "base/cli.h"
#include "psr/mesh.h"
#include "model/blocks.h"
#include "measure/calibrate.h"
#include "model/points.h"
#include "model/tree.h"
#include "notes.h"
#include "octree.h"
#include "points.h"
#include "progress.h"

#define PROGRAM "psr-model build"
#define MOST_FACETS 8192    /* the finest resolution that exact surfaces are cut into triangles for */
#define CALIBRATION_SEED 31 /* views that evaluations have are others */
#define FORMATS \
	"IN is told by its first bytes and its ending:\n" \
	"  glTF 2.0    .gltf, .glb; with KHR_draco_mesh_compression, KHR_lights_punctual,\n" \
	"              KHR_materials_emissive_strength, KHR_materials_pbrSpecularGlossiness,\n" \
	"              KHR_materials_unlit, KHR_mesh_quantization, KHR_texture_transform,\n" \
	"              EXT_texture_webp\n" \
	"  PLY         meshes and clouds; text and binary\n" \
	"  LAS         clouds of versions 1.0 to 1.4; not compressed ones (LAZ)\n" \
	"  PCD         clouds of the Point Cloud Library; text, binary and compressed\n" \
	"  STEP, IGES  exact surfaces of CAD, with colours and assemblies\n" \
	"  PTS, PTX, XYZ\n" \
	"              clouds as text\n" \
	"  the others  OBJ, STL, OFF, 3DS, Collada and other formats that Assimp reads"

/* IN's name with .psr for its suffix; the caller frees it. */
static char *default_output(const char *in)
{
	const char *slash = strrchr(in, '/'), *dot = strrchr(slash != NULL ? slash : in, '.');
	size_t stem = dot != NULL && dot != in && dot[-1] != '/' ? (size_t)(dot - in) : strlen(in);
	char *out = malloc(stem + sizeof ".psr");

	if (out != NULL) {
		memcpy(out, in, stem);
		memcpy(out + stem, ".psr", sizeof ".psr");
	}
	return out;
}

/* The wishes of the command line. */
struct wish {
	struct psr_import_options import;
	struct psr_build_options build;
	struct octree_wish octree;
	struct points_wish points;
	int is_blocks, is_octree, is_points, is_packed, is_calibrated, quiet;
};

/* What was made on the way to a model. */
struct made {
	struct psr_mesh *mesh; /* NULL where nothing needed one */
	struct octree *tree;   /* in units of the file */
	struct psr_model *blocks, *model; /* of blocks alone, and the result */
	struct octree_input input;
	struct psr_build_report report;
	struct dpoint_build_report points;
	double seconds_octree;
};

static void summarize(const char *out, const struct made *made)
{
	const struct psr_blocks *blocks = psr_model_blocks(made->model);
	const struct octree *tree = psr_model_octree(made->model);
	const struct psr_mesh *mesh = made->mesh;
	struct stat st;
	const uint64_t file_bytes = stat(out, &st) == 0 ? (uint64_t)st.st_size : 0;

	if (blocks != NULL)
		printf("%s: %" PRIu64 " samples in %" PRIu32 " blocks, %.1f MB, from %" PRIu32
		       " %s in %.1f s (rays %.1f, selection %.1f)\n",
		       out, blocks->n_samples, blocks->n_blocks, (double)file_bytes / 1e6,
		       mesh->n_triangles > 0 ? mesh->n_triangles : mesh->n_points, mesh->n_triangles > 0 ? "triangles" : "points",
		       made->report.seconds_total, made->report.seconds_rays, made->report.seconds_select);
	if (made->input.n_left_out > 0)
		fprintf(stderr, PROGRAM ": warning: %s: points without a finite place were left out: %" PRIu64 "\n",
		        made->input.path, made->input.n_left_out);
	if (psr_model_point_set(made->model) != NULL)
		points_summarize(&made->points, out, file_bytes, mesh);
	if (tree != NULL)
		printf("%s: %" PRIu64 " leaves of %.3g in an octree of %d levels, %.1f MB, from %" PRIu64 " %s in %.1f s\n", out,
		       tree->n_leaves, ldexp(made->tree->edge, -tree->levels), tree->levels, (double)file_bytes / 1e6,
		       made->input.n_points > 0 ? made->input.n_points : mesh->n_triangles,
		       made->input.n_points > 0 ? "points" : "triangles", made->seconds_octree);
}

static int make_octree(struct made *made, const struct wish *wish, struct psr_error *err)
{
	const double begin = clock_seconds();
	const int code = octree_make(&made->tree, &made->input, &wish->octree, err);

	made->seconds_octree = clock_seconds() - begin;
	return code;
}

/* Makes the model of a tree, and of blocks if there are any. */
static int join(struct made *made, const struct wish *wish, struct psr_error *err)
{
	const double *up = wish->build.up;
	struct psr_model_info info;
	struct octree inner;

	if (made->blocks != NULL) {
		info = *psr_model_info(made->blocks);
	} else {
		psr_octree_info(&info, made->tree);
		if (up[0] == 0 && up[1] == 0 && up[2] == 0)
			up = made->input.up;
		v3d_normalize(info.up, up);
		snprintf(info.builder, sizeof info.builder, "psr %s", PSR_VERSION);
	}
	psr_octree_to_inner(&inner, made->tree, &info);
	return psr_model_create_both(&made->model, &info, made->blocks != NULL ? psr_model_blocks(made->blocks) : NULL, &inner,
	                             made->blocks != NULL ? psr_model_presets(made->blocks) : NULL, err);
}

/* Measures the ladder of settings on the model, and puts the result into it. */
static int measure_ladder(struct made *made, const struct wish *wish, struct psr_error *err)
{
	static struct psr_calibrated view[CALIBRATE_VIEWS];
	static struct psr_calibrated_fine fine[CALIBRATE_VIEWS];
	const struct calibrate_options options = {
		.n_views = CALIBRATE_VIEWS, .seed = CALIBRATION_SEED, .n_threads = wish->build.n_threads,
		.on_progress = progress_show, .userdata = wish->build.userdata,
	};
	const struct psr_calibration calibration = { CALIBRATE_VIEWS, view, fine };
	struct psr_model *calibrated;
	int code = calibrate(view, fine, made->model, made->mesh, &options, err);

	if (code == PSR_OK)
		code = psr_model_calibrate(&calibrated, made->model, &calibration, err);
	if (code != PSR_OK)
		return code;
	psr_model_unref(made->model);
	made->model = calibrated;
	return PSR_OK;
}

static int make(struct made *made, const struct wish *wish, struct psr_error *err)
{
	int code = PSR_OK;

	made->input.is_direct = wish->is_octree && octree_is_direct(made->input.path);
	if (wish->is_blocks || !made->input.is_direct) {
		progress_show("import", 0, 1, wish->build.userdata);
		code = psr_mesh_import(&made->mesh, made->input.path, &wish->import, err);
		made->input.mesh = made->mesh;
	}
	if (code == PSR_OK && wish->is_blocks)
		code = psr_model_build(&made->blocks, made->mesh, &wish->build, &made->report, err);
	if (code == PSR_OK && wish->is_octree)
		code = make_octree(made, wish, err);
	if (code == PSR_OK && wish->is_octree)
		code = join(made, wish, err);
	else if (code == PSR_OK && wish->is_points)
		code = points_make(&made->model, &made->points, made->mesh, &wish->points, err);
	else if (code == PSR_OK)
		made->model = psr_model_ref(made->blocks);
	if (code == PSR_OK && wish->is_calibrated)
		code = measure_ladder(made, wish, err);
	return code;
}

static int build(const char *in, const char *out, const struct wish *wish, struct psr_error *err)
{
	struct progress *progress = wish->build.userdata;
	struct made made = { .input.path = in };
	int code = make(&made, wish, err);

	if (code == PSR_OK) {
		progress_show("write", 0, 1, progress);
		code = wish->is_packed ? psr_model_write_packed(made.model, out, err) : psr_model_write(made.model, out, err);
	}
	if (progress->has_bar)
		progress_clear();
	if (code == PSR_OK && !wish->quiet) {
		if (made.mesh != NULL)
			notes_of_import(made.mesh);
		if (made.blocks != NULL)
			notes_of_blocks(made.blocks);
		if (made.mesh != NULL && wish->is_octree)
			notes_of_octree(made.mesh);
		if (made.mesh != NULL && wish->is_points)
			notes_of_points(made.mesh);
		points_warn(&made.points, wish->points.error);
		summarize(out, &made);
	}
	psr_model_unref(made.model);
	psr_model_unref(made.blocks);
	octree_destroy(made.tree);
	psr_mesh_destroy(made.mesh);
	return code;
}

static int take_representation(const char *text, void *userdata, struct psr_error *err)
{
	struct wish *wish = userdata;

	wish->is_points = strcmp(text, "dpoints") == 0;
	if (!wish->is_points && strcmp(text, "blocks") != 0 && strcmp(text, "octree") != 0 && strcmp(text, "both") != 0)
		return psr_fail(err, PSR_ERR_ARG, "%s is not known; it is blocks, octree, both or dpoints", text);
	wish->is_blocks = text[0] == 'b';
	wish->is_octree = text[0] == 'o' || strcmp(text, "both") == 0;
	return PSR_OK;
}

/* Whoever names no representation gets what suits the file, and of its scan what there is. One that cannot be read has its error when it is built. */
static void choose_representation(struct wish *wish, const char *in)
{
	if (wish->is_blocks || wish->is_octree || wish->is_points)
		return;
	wish->is_octree = octree_is_direct(in);
	wish->is_blocks = !wish->is_octree;
	wish->octree.with_scan &= wish->is_octree;
}

static int check_calibration(const struct wish *wish, struct psr_error *err)
{
	if (wish->is_calibrated && !wish->is_blocks)
		return psr_fail(err, PSR_ERR_ARG, "--calibrate measures pictures of blocks; add --representation blocks or both");
	return PSR_OK;
}

static int check_octree(const struct wish *wish, struct psr_error *err)
{
	if (wish->octree.levels == 1)
		return psr_fail(err, PSR_ERR_ARG, "--levels 1: an octree has 2 levels at least");
	if (wish->octree.levels > 0 && wish->octree.spacing > 0)
		return psr_fail(err, PSR_ERR_ARG, "--levels and --spacing both say how fine the octree is; give one of them");
	if (!wish->is_octree && (wish->octree.levels > 0 || wish->octree.spacing > 0 || wish->octree.with_scan))
		return psr_fail(err, PSR_ERR_ARG, "--levels, --spacing and --scan are for octrees; add --representation octree");
	return PSR_OK;
}

int cmd_build(int argc, char **argv)
{
	struct wish wish = { 0 };
	struct progress progress = { .fd = -1 };
	struct psr_error err;
	const char *out = NULL;
	char *made = NULL;
	int n_operands, code;
	int64_t resolution, n_threads, fd = -1, levels = 0, memory = (int64_t)2 << 30;
	double tolerance, crease;
	const struct psr_opt opts[] = {
		{ .name = "The model", .type = PSR_OPT_HEADING },
		{ .name = "output", .letter = 'o', .type = PSR_OPT_STRING, .value = &out, .arg = "OUT.psr",
		  .help = "The file to write. If not given: IN's name with .psr for its ending." },
		{ .name = "resolution", .letter = 'r', .type = PSR_OPT_INT, .value = &resolution, .arg = "PIXELS",
		  .help = "Use about twice the height of the pictures that you want. Larger pictures show rough edges; twice the figure"
		          " takes four times the memory. Up to 64, meshes of more than 131,072 triangles are merged to few: a model"
		          " for a first look, fast. An octree of points is as fine as these are.", .min = 8, .max = 8192 },
		{ .name = "up", .type = PSR_OPT_VEC3, .value = wish.build.up, .arg = "X,Y,Z",
		  .help = "What is up in the file. Give it when pictures without a camera show the object on its side. 0,0,0: as is"
		          " usual for the format, +z for LAS, PCD, STL, STEP, IGES and survey coordinates, +y for the others." },
		{ .name = "crease", .type = PSR_OPT_REAL, .value = &crease, .arg = "DEG",
		  .help = "Edges stay sharp where faces meet at a greater angle, in files that bring no directions of shading"
		          " (normals). Lower it where edges look rounded; raise it where a smooth surface shows facets.",
		  .min = 0, .max = 180 },
		{ .name = "pack", .type = PSR_OPT_FLAG, .value = &wish.is_packed,
		  .help = "A file of a third to a half of the size, for archives and slow networks. Opening it takes longer, and"
		          " memory for all of it. The beginning of a packed octree is a coarser model." },
		{ .name = "calibrate", .type = PSR_OPT_FLAG, .value = &wish.is_calibrated,
		  .help = "Measures in 32 views what settings cost and how far their pictures are from the source, and stores it in the"
		          " file. Then psrd keeps budgets by figures of this model. Takes some minutes." },
		{ .name = "Octrees, for clouds of points", .type = PSR_OPT_HEADING },
		{ .name = "representation", .type = PSR_OPT_CALL, .call = take_representation, .value = &wish, .arg = "KIND",
		  .help = "What the model holds: blocks, octree, both, or dpoints. Octrees hold the points of a cloud as they are, in"
		          " a tenth of the size and the time; blocks are of a resampled surface; dpoints are few points of a smooth"
		          " mesh that know its curvature. Default: an octree of a file of points alone, blocks of a mesh.",
		  .words = "blocks octree both dpoints" },
		{ .name = "levels", .type = PSR_OPT_INT, .value = &levels, .arg = "K",
		  .help = "Points within a leaf become one; a leaf is 1 / 2^K of the longest side, K 2 to 20. 0: by --spacing or by"
		          " the number of points.", .min = 0, .max = OCTREE_MOST_LEVELS },
		{ .name = "spacing", .type = PSR_OPT_REAL, .value = &wish.octree.spacing, .arg = "X",
		  .help = "In place of --levels, the widest that a leaf may be, in units of the file.", .min = 0, .max = 1e30 },
		{ .name = "memory", .type = PSR_OPT_INT, .value = &memory, .arg = "SIZE",
		  .help = "Memory to sort points in; more of them are sorted on disk, in TMPDIR. The octree comes on top.",
		  .min = OCTREE_LEAST_MEMORY, .max = 0x1p50 },
		{ .name = "scan", .type = PSR_OPT_FLAG, .value = &wish.octree.with_scan,
		  .help = "Keeps what LAS tells of points besides: intensity, class, return, GPS time; up to 8 bytes more a leaf." },
		{ .name = "Differential points, for smooth surfaces", .type = PSR_OPT_HEADING },
		{ .name = "eps", .type = PSR_OPT_REAL, .value = &wish.points.eps, .arg = "E",
		  .help = "A point reaches until its normal has turned by the angle whose cosine is 1 - E. 0: 0.01, which is 8"
		          " degrees.", .min = 0, .max = 0.5 },
		{ .name = "delta", .type = PSR_OPT_REAL, .value = &wish.points.delta, .arg = "D",
		  .help = "And no further than this part of the model's radius. 0: an eighth.", .min = 0, .max = 1 },
		{ .name = "error", .type = PSR_OPT_CALL, .call = points_take_error, .value = &wish.points, .arg = "PX",
		  .help = "In place of both: nothing that is drawn is further from the surface than this, in pixels of the resolution,"
		          " such as 0.5. Default: no bound, and E and D as above." },
		{ .name = "While it is built", .type = PSR_OPT_HEADING },
		{ .name = "threads", .type = PSR_OPT_INT, .value = &n_threads, .arg = "N",
		  .help = "Processor cores to use. Fewer take longer; the model is the same.", .min = 1, .max = 256 },
		{ .name = "quiet", .letter = 'q', .type = PSR_OPT_FLAG, .value = &wish.quiet,
		  .help = "Prints errors only: no progress, no warnings about parts left out, no summary." },
		{ .name = "For developers", .type = PSR_OPT_HEADING },
		{ .name = "tolerance", .type = PSR_OPT_REAL, .value = &tolerance, .arg = "DEG",
		  .help = "The greatest angle between a surface and the plane of the projection that samples it; docs/studies.md"
		          " shows what it changes.", .min = 0.01, .max = 60 },
		{ .name = "progress-fd", .type = PSR_OPT_INT, .value = &fd, .arg = "FD",
		  .help = "Writes lines \"STAGE DONE TOTAL\" to this open descriptor, for a program that waits; -1: nowhere.",
		  .min = -1, .max = 1 << 20 },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr-model build IN [-o OUT.psr] [-r RES] [--representation octree] [options]",
		.summary = "Turns a mesh or a scan into a .psr model, which psrd draws. psrd builds models itself when they are first"
		           " asked for; build one here to choose how fine it is.",
		.opts = opts,
		.footer = FORMATS,
	};

	psr_import_options_default(&wish.import);
	psr_build_options_default(&wish.build);
	resolution = wish.build.resolution;
	tolerance = wish.build.tolerance / PSR_DEGREE;
	crease = wish.import.crease / PSR_DEGREE;
	n_threads = wish.build.n_threads;
	code = psr_cli_parse(&cli, argc, argv, &n_operands, &err);
	if (code > 0)
		return 0;
	if (code == PSR_OK && n_operands != 1)
		code = psr_fail(&err, PSR_ERR_ARG, "one input file is needed");
	wish.octree.levels = (int)levels;
	if (code == PSR_OK)
		choose_representation(&wish, argv[1]);
	if (code == PSR_OK)
		code = check_octree(&wish, &err);
	if (code == PSR_OK)
		code = points_check(&wish.points, wish.is_points, &err);
	if (code == PSR_OK)
		code = check_calibration(&wish, &err);
	if (code == PSR_OK && fd >= 0 && fcntl((int)fd, F_GETFD) < 0)
		code = psr_fail(&err, PSR_ERR_ARG, "--progress-fd: descriptor %" PRId64 " is not open", fd);
	if (code != PSR_OK)
		return psr_cli_fail(PROGRAM, &err);
	wish.build.resolution = (uint32_t)resolution;
	wish.build.tolerance = tolerance * PSR_DEGREE;
	wish.build.n_threads = wish.import.n_threads = (int)n_threads;
	wish.import.crease = crease * PSR_DEGREE;
	wish.import.resolution = (uint32_t)resolution;
	wish.import.has_patches = wish.is_points;
	/* An error is told from triangles: those of exact surfaces are off by a quarter of it at most. */
	if (wish.points.error > 0 && wish.points.error < 0.5)
		wish.import.resolution = (uint32_t)fmin(ceil((double)resolution * 0.5 / wish.points.error), MOST_FACETS);
	wish.import.is_preview = resolution <= PSR_PREVIEW_RESOLUTION;
	wish.octree.resolution = (uint32_t)resolution;
	wish.octree.memory = (uint64_t)memory;
	wish.build.on_progress = wish.octree.on_progress = progress_show;
	wish.octree.userdata = wish.points.userdata = &progress;
	wish.points.on_progress = progress_show;
	wish.points.resolution = (uint32_t)resolution;
	wish.points.n_threads = (int)n_threads;
	memcpy(wish.points.up, wish.build.up, sizeof wish.points.up);
	wish.build.userdata = &progress;
	progress.fd = (int)fd;
	progress.has_bar = !wish.quiet && isatty(STDERR_FILENO);
	made = out == NULL ? default_output(argv[1]) : NULL;
	if (out == NULL && made == NULL)
		code = psr_fail(&err, PSR_ERR_MEMORY, "no memory for a file name");
	else
		code = build(argv[1], out != NULL ? out : made, &wish, &err);
	free(made);
	if (code == PSR_OK)
		code = outfile_flush_stdout(&err);
	return code == PSR_OK ? 0 : psr_cli_fail(PROGRAM, &err);
}
