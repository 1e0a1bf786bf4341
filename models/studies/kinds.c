#include "kinds.h"

#include "dpoint/study_dpoint.h"
#include "figures/figures.h"
#include "tables/tables.h"

/* Five as different as [G] 5.3 wants, "from the large smooth surfaces of 'top' to the intricate features of
 * 'kittyhawk'". */
#define FIVE "top,teapot,chair,plant,kittyhawk"

/* Size and time, relative, over the rows; x are the labels. Columns of $table: 3 + the table's. */
#define PLOT_SIZE_TIME(xlabel, every) \
	"set style data linespoints\nset grid ytics\nset key top center\nset xlabel '" xlabel "'\n" \
	"set ylabel 'relative'\nset pointsize 1\nset xrange [-0.4:*]\nset offsets 0,0.4,0.02,0.02\n" \
	"plot $table " every " using 1:7:xtic(2) title 'file size' lw 2 pt 7, " \
	"'' " every " using 1:9 title 'warping time' lw 2 pt 5"

/* The last row is the equilateral lattice, the reference. */
#define PLOT_SQUARE \
	PLOT_SIZE_TIME("tolerance angle, degrees", "every ::0::9") \
	", [-0.4:9.4] 1 title 'equilateral lattice, 25 degrees' lt 0 lw 2\n"

/* Rows 0-4 without cones, 5-9 with them. */
#define PLOT_MASKS \
	"set multiplot layout 1,2\nset style data linespoints\nset grid ytics\nset key bottom right\n" \
	"set xlabel 'bits of the mask'\nset xrange [-0.4:4.4]\nset yrange [*:*]\nset pointsize 1\n" \
	"set xtics ('none' 0, '8' 1, '32' 2, '128' 3, '512' 4)\n" \
	"set ylabel '% of blocks culled'\n" \
	"plot $table every ::0::4 using 1:3 title 'masks' lw 2 pt 7, " \
	"'' every ::5::9 using ($1-5):3 title 'masks and cones' lw 2 pt 5, " \
	"'' every ::0::4 using 1:5 title 'hidden' lt 0 lw 2 pt -1\n" \
	"set ylabel '% speedup'\n" \
	"plot $table every ::0::4 using 1:9 title 'masks' lw 2 pt 7, " \
	"'' every ::5::9 using ($1-5):9 title 'masks and cones' lw 2 pt 5\nunset multiplot\n"
#define PLOT_SUBDIVISION \
	"set style data linespoints\nset grid ytics\nset key top left\nset xlabel 'regions of the screen'\n" \
	"set ylabel '% over 1x1'\nset pointsize 1\nset xrange [-0.4:*]\nset offsets 0,0.4,0.02,0.02\n" \
	"plot $table using 1:10:xtic(2) title 'blocks culled' lw 2 pt 7, '' using 1:9 title 'speed' lw 2 pt 5\n"

/* A line a model, of four parts. */
#define PLOT_PREFIXES \
	"set style data linespoints\nset grid\nset key off\nset logscale x\nset xlabel 'MB that have come'\n" \
	"set ylabel 'dB to the truth'\nset pointsize 1\nset offsets graph 0.05, graph 0.2, graph 0.05, graph 0.05\n" \
	"stats $table using 1 nooutput\n" \
	"plot for [m=0:STATS_records/4-1] $table every ::(4*m)::(4*m+3) using 3:7 lw 2 pt 7, \\\n" \
	"     $table every 4::3 using 3:7:(word(strcol(2),1)) with labels left offset 1,0\n"

#define NOTE_HIDDEN "hidden: no ray from a sample gets to the eye; wrong: culled though one does"
#define NOTE_CULLING NOTE_HIDDEN "; speedup: over the first line."

/* Of [B], table 1: a processor of 1.5 GHz, 512x512 pixels. */
#define NOTE_OCTREE \
	"codes ... col.: bits a point, codes in core and then all packed; in core an offset has 8, a normal 16, a colour 24.\n" \
	"fps: frames a second of points, splats and blocks. wrong: holes and leaks, of a million pixels inside, of points\n" \
	"and of splats.\n\n" \
	"[B]                M pts  codes  packed  offs.  norm.   fps  splats\n" \
	"St. Matthew 9       0.40   2.70    1.70   1.60   9.80  19.2     4.1\n" \
	"St. Matthew 10      1.60   2.70    1.30   1.50   8.60   6.2     1.3\n" \
	"Max Planck 9        0.70   2.80    1.40   1.50   5.10  16.3     5.2\n" \
	"Max Planck 10       2.60   2.70    1.00   1.40   3.30   5.1     1.6\n" \
	"Max Planck 11      10.50   2.70    0.90   1.30   1.90   1.4     0.5\n" \
	"Terrain 10          4.10   2.60    1.30   1.30   7.10   2.5     0.7\n" \
	"David 10            4.40   2.60    1.30   1.50   7.40   3.0     1.2\n" \
	"Tree 10             5.70   3.60    2.90   1.50   5.40   1.7     1.0"

/* Of [K], table 1: a processor of 866 MHz and a GeForce 2. */
#define NOTE_DPOINT_MODELS \
	"The teapot is its 32 patches, others are meshes. s: until points are chosen. Frames a second of 800x600; dB: to the\n" \
	"ray-traced source, inside the object, specular. Holes and leaks are pixels.\n\n" \
	"[K]                      points     kB      s  diffuse  specular\n" \
	"teapot, all              156800   9190   22.5      2.1       2.0\n" \
	"teapot, simplified        25713   1510  146.5     12.5      11.8\n" \
	"human head, all          376400  22060   22.2      0.9       0.9\n" \
	"human head, simplified    64042   3750  485.5      5.3       5.1\n" \
	"camera, all              216712  12690   15.3      1.6       1.5\n" \
	"camera, simplified        46077   2700  178.2      6.9       6.7"

const struct study_kind study_tables[] = {
	{ "tolerance", "figure 5.5", "tolerance angle, equilateral lattice", table_tolerance, FIVE, NULL,
	  PLOT_SIZE_TIME("tolerance angle, degrees", "") },
	{ "block-size", "figure 5.6", "side of the blocks", table_block_size, FIVE, NULL, PLOT_SIZE_TIME("block", "") },
	{ "square-lattice", "figure 5.7", "tolerance angle, square lattice", table_square, FIVE, NULL, PLOT_SQUARE },
	{ "selection", "sections 5.2, 9.2", "what was tried to select blocks", table_selection, FIVE, NULL, NULL },
	{ "masks", "figure 6.7", "visibility tests and bits of the masks", table_masks, FIVE, NOTE_CULLING, PLOT_MASKS },
	{ "subdivision", "figure 6.8", "subdivision of the screen, cones and 128 bits", table_subdivision, FIVE,
	  NOTE_CULLING, PLOT_SUBDIVISION },
	{ "models", "table 8.1", "the standard set", table_models, NULL, NULL, NULL },
	{ "culling", "table 8.3", "% of blocks culled by cones and masks", table_culling, NULL,
	  NOTE_HIDDEN ". frustum and after it: the same\nviews zoomed in, a quarter of the picture wide.", NULL },
	{ "dpoint", "[K] table 1", "differential points: simplification", table_dpoint, "teapot",
	  "kB: [K]'s points have 62 bytes, ours 16, and fitted ones are in groups. Errors, in degrees and radii\n"
	  "of the model, are those of each kept point at each place that it covers; holes: what no point covers.", NULL },
	{ "dpoint-bytes", "[K] 6", "bytes of points, and of blocks that are as good at magnification 4", table_dpoint_bytes,
	  "teapot,gavel",
	  "Pictures of 800x600, as those of dpoint-frames, of the brightest place; blocks of as many pixels as points and more.\n"
	  "kB: in memory; times: those of points. dB: inside the object, plain and in pass 1, of 2x2 sub-pixels; less: what\n"
	  "blocks have less than points.", NULL },
	{ "dpoint-equal", "[K] 6", "a highlight at magnification 8: points, and blocks of as much time", table_dpoint_equal,
	  "teapot,toybird",
	  "Pictures of 800x600, as those of dpoint-frames; points, and blocks of as many pixels or more. edges: smoothed;\n"
	  "pass 1: of 2x2 sub-pixels. kB: in memory. dB: inside the object; bright: of its bright pixels; points': what points\n"
	  "have more. best as fine, best of all: of the ways of blocks that take no longer than points.", NULL },
	{ "dpoint-error", "[K] 7", "differential points within an error", table_dpoint_error, "teapot,top",
	  "An error is what psr-model build --error asks for, in pixels of the resolution. off by: no drawn place is further\n"
	  "from the mesh, as is proven; over: points that are further off than asked.", NULL },
	{ "dpoint-frames", "[K] 6", "differential points beside blocks, at magnifications", table_dpoint_frames,
	  "teapot,toybird",
	  "Pictures of 800x600 with one light, roughness 0.25. A size is how many pixels of the picture are one that the\n"
	  "models are for. kB: in memory. dB: to the ray-traced source, inside the object; bright: of its bright pixels.\n"
	  "Holes are pixels; leaks, and blocks' holes and leaks, are a million pixels'.", NULL },
	{ "dpoint-holes", "[K] 4.2", "holes between differential points, at magnifications", table_dpoint_holes,
	  "teapot,gavel,toybird,chair",
	  "Each magnification has eight views around the model, from all heights. M pixels: whose neighbourhood meets the\n"
	  "object. Holes are pixels of these that are empty, though no ray of it misses the object, or show what is more\n"
	  "than three samples behind all of its surfaces; blocks: theirs, in the same views.", NULL },
	{ "dpoint-models", "[K] table 1", "differential points: three models", table_dpoint_models, "teapot,gavel",
	  NOTE_DPOINT_MODELS, NULL },
	{ "dpoint-meshes", "[K] 4.1", "differential points of meshes", table_dpoint_meshes, "top,teapot,toybird,gavel",
	  "Rectangles are fitted to 4 degrees and 0.002 radii; pieces: of triangles, no longer than 0.02 radii;\n"
	  "bad: corners without a curvature, and pieces without a normal. No place is left uncovered.", NULL },
	{ "octree", "[B] table 1", "octrees, beside blocks of the same models", table_octree, "teapot,kittyhawk,pinetree",
	  NOTE_OCTREE, NULL },
	{ "octree-points", "[B] table 1", "points and splats a second, 512x512", table_octree_points, "teapot,kittyhawk,pinetree",
	  "M pts: leaves of the tree. whole: these times frames a second, where the whole tree is drawn, as [B] tells it;\n"
	  "splats likewise, each beside what is asked ([B], 2002: 7 to 15 M points, 1.6 to 5.3 M splats). drawn: millions of\n"
	  "points that a frame at the levels it needs leaves after culling; warped: those of them that are placed in the\n"
	  "picture and do not face away, and how much of the tree they are. frames: warped points times frames a second;\n"
	  "Mpt/s: warped points by the time of culling and warp alone, Mspl/s splats likewise.", NULL },
	{ "octree-prefixes", "[B] figure 13", "parts of packed octrees of 11 levels", table_octree_prefixes, "teapot,kittyhawk",
	  "MB: of the file, that have come; levels, M pts: of the model that they are; below: decibels that it lacks of the\n"
	  "whole; wrong: holes and leaks, of a million pixels inside.", PLOT_PREFIXES },
	{ "octree-splats", "[B] 5.2", "leaves of octrees as points and as splats", table_octree_splats, "teapot,kittyhawk",
	  "leaf: its edge in pixels, in the model's middle. dB to the ray-traced source of points and of splats, plain, smooth\n"
	  "and fine, and of discs in pass 2; inside: of pixels inside, plain; wrong: holes and leaks, of a million of these;\n"
	  "time: of plain splats over that of points.", NULL },
};
const struct study_kind study_figures[] = {
	{ .name = "gaps", "figure 4.9", "methods of finding gaps", figure_gaps },
	{ .name = "fill", "figure 4.11", "gaps before and after they are filled", figure_fill },
	{ .name = "threshold", "figure 7.2", "the depth threshold", figure_threshold },
	{ .name = "highlights", "figure 7.3", "specular highlights", figure_highlights },
	{ .name = "shadows", "figure 7.4", "two directional lights and a spot", figure_shadows },
	{ .name = "backs", "figure 7.6", "samples that face away", figure_backs },
	{ .name = "set", "figure 8.1", "the fourteen models", figure_set },
	{ .name = "edges", "figure 9.1", "rough edges and passes over sub-pixels", figure_edges },
	{ .name = "interfaces", "figure 9.3", "interfaces between levels of the depth buffer", figure_interfaces },
	{ .name = "thin", "figure 9.4", "thin structures", figure_thin },
	{ .name = "stills", "section 9.1.1", "stills: resolution of the model, and passes", figure_stills },
	{ .name = "octree-offsets", .figure = "[B] figures 8, 9", .what = "octrees without and with offsets",
	  .run = figure_octree_offsets, .models = "dragon" },
	{ .name = "octree-alias", .figure = "[B] figure 10", .what = "octrees of textures finer than pixels",
	  .run = figure_octree_alias, .models = "terrain" },
	{ .name = "octree-levels", .figure = "[B] figure 12", .what = "octrees as points and as splats, by levels",
	  .run = figure_octree_levels, .models = "dragon" },
	{ .name = "octree-parts", .figure = "[B] figure 13", .what = "parts of packed octrees, as pictures",
	  .run = figure_octree_parts, .models = "dragon" },
	{ .name = "dpoint-splats", .figure = "[K] table 2, figure 6", .what = "differential points beside splats",
	  .run = figure_dpoint_splats },
	{ .name = "zoom", "section 9.1", "a zoom: error and popping, frame by frame", figure_zoom, .plot = figure_zoom_plot },
};
const size_t n_study_tables = sizeof study_tables / sizeof *study_tables;
const size_t n_study_figures = sizeof study_figures / sizeof *study_figures;
