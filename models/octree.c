#include "octree.h"

#include <fcntl.h>
#include <math.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>
#include "base/srgb.h"
#include "import/cloud/las_source.h"

#define FEWEST_LEVELS 4

int octree_is_direct(const char *path)
{
	const size_t n = strlen(path);
	const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	char magic[4] = "";
	ssize_t got = 0;

	if (fd >= 0) {
		got = read(fd, magic, sizeof magic);
		close(fd);
	}
	return (got == 4 && memcmp(magic, "LASF", 4) == 0)
	       || (n > 4 && (strcasecmp(path + n - 4, ".las") == 0 || strcasecmp(path + n - 4, ".laz") == 0));
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

static int build(struct octree **out, const struct octree_source *source, const struct octree_wish *wish,
                 struct psr_error *err)
{
	struct octree_build_options options;

	octree_build_options_default(&options);
	if (wish->levels > 0)
		options.levels = wish->levels;
	else if (wish->spacing > 0)
		options.levels = 0;
	else if (source->n_points > 0)
		options.levels = levels_for(sqrt((double)source->n_points));
	options.spacing = wish->spacing;
	options.memory = wish->memory;
	options.on_progress = wish->on_progress;
	options.userdata = wish->userdata;
	return octree_build(out, source, &options, err);
}

int octree_make(struct octree **out, struct octree_input *input, const struct octree_wish *wish, struct psr_error *err)
{
	struct octree_source source = { .name = input->path };
	struct mesh_points points = { .mesh = input->mesh };
	int rc;

	if (input->is_direct) {
		rc = las_source_open(&source, input->path, err);
		if (rc != PSR_OK)
			return rc;
		rc = build(out, &source, wish, err);
		input->n_points = source.n_points;
		las_source_close(&source);
		return rc;
	}
	if (input->mesh->n_triangles > 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s: it is a mesh, and octrees are built from clouds of points alone; "
		                "build blocks of it (--representation blocks)", input->path);
	source.has_color = 1;
	source.n_points = input->n_points = input->mesh->n_points;
	source.rewind = go_back;
	source.read = read_points;
	source.userdata = &points;
	return build(out, &source, wish, err);
}
