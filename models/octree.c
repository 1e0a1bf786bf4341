#include "octree.h"

#include <math.h>
#include <string.h>
#include "base/srgb.h"
#include "import/points/points.h"
#include "sample/octree/of_mesh.h"

#define FEWEST_LEVELS 4
#define ACROSS_UNKNOWN 4096 /* of a file that does not tell how many points it has */
#define PREVIEW_POINTS 500000

int octree_is_direct(const char *path)
{
	return octree_source_suits(path);
}

/* ---- points of a mesh ---- */

struct mesh_points {
	const struct psr_mesh *mesh;
	uint32_t next;
};

static int go_back(void *userdata, struct psr_error *err)
{
	struct mesh_points *points = userdata;

	(void)err;
	points->next = 0;
	return PSR_OK;
}

static int read_points(size_t *n, struct octree_point *points, size_t room, void *userdata, struct psr_error *err)
{
	struct mesh_points *from = userdata;
	const struct psr_mesh *mesh = from->mesh;

	(void)err;
	for (*n = 0; *n < room && from->next < mesh->n_points; ++*n, from->next++) {
		struct octree_point *point = &points[*n];
		const float *base = mesh->material[mesh->point_material[from->next]].base_color;

		memcpy(point->at, mesh->point[from->next], sizeof point->at);
		memcpy(point->normal, mesh->point_normal[from->next], sizeof point->normal);
		for (int c = 0; c < 3; c++)
			point->color[c] =
				psr_linear_to_srgb(base[c] * (mesh->point_color != NULL ? mesh->point_color[from->next][c] : 1.0f));
	}
	return PSR_OK;
}

/* ---- building ---- */

/* A surface's points stand as densely as their cube's edge / sqrt(n). */
static int levels_for(double across)
{
	const int levels = (int)ceil(log2(fmax(across, 1.0)));

	return levels < FEWEST_LEVELS ? FEWEST_LEVELS : levels > OCTREE_MOST_LEVELS ? OCTREE_MOST_LEVELS : levels;
}

static void set_options(struct octree_build_options *options, const struct octree_wish *wish, double across)
{
	octree_build_options_default(options);
	if (wish->levels > 0)
		options->levels = wish->levels;
	else if (wish->spacing > 0)
		options->levels = 0;
	else
		options->levels = levels_for(across);
	options->spacing = wish->spacing;
	options->memory = wish->memory;
	options->on_progress = wish->on_progress;
	options->userdata = wish->userdata;
}

static int build(struct octree **out, const struct octree_source *source, const struct octree_wish *wish,
                 struct psr_error *err)
{
	struct octree_build_options options;

	set_options(&options, wish, source->n_points > 0 ? sqrt((double)source->n_points) : ACROSS_UNKNOWN);
	return octree_build(out, source, &options, err);
}

static int of_file(struct octree **out, struct octree_input *input, const struct octree_wish *wish, struct psr_error *err)
{
	struct octree_source source;
	struct octree_source_count count;
	const int is_preview = wish->levels == 0 && !(wish->spacing > 0) && wish->resolution <= PSR_PREVIEW_RESOLUTION;
	int rc = octree_source_open_part(&source, input->path, is_preview ? PREVIEW_POINTS : 0, err);

	if (rc != PSR_OK)
		return rc;
	source.scan = wish->with_scan ? source.scan : 0;
	rc = build(out, &source, wish, err);
	count = octree_source_count(&source);
	input->n_points = count.n_read;
	input->n_left_out = count.n_left_out;
	if (rc == PSR_OK)
		input->up[octree_source_up(&source, (*out)->low, (*out)->edge)] = 1.0;
	octree_source_close(&source);
	return rc;
}

int octree_make(struct octree **out, struct octree_input *input, const struct octree_wish *wish, struct psr_error *err)
{
	struct octree_source source = { .name = input->path, .has_color = 1, .has_normal = 1, .rewind = go_back,
		                            .read = read_points };
	struct mesh_points points = { .mesh = input->mesh };
	struct octree_build_options options;

	if (input->is_direct)
		return of_file(out, input, wish, err);
	memcpy(input->up, input->mesh->up, sizeof input->up);
	if (input->mesh->n_triangles > 0) {
		set_options(&options, wish, wish->resolution);
		return octree_of_mesh(out, NULL, input->mesh, &options, err);
	}
	source.n_points = input->n_points = input->mesh->n_points;
	source.userdata = &points;
	return build(out, &source, wish, err);
}
