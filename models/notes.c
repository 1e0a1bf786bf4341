#include "notes.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include "model/blocks.h"
#include "surface/normal.h"

#define PROGRAM "psr-model build"
#define NOTE PROGRAM ": note: "

void notes_of_import(const struct psr_mesh *mesh)
{
	if (mesh->warning[0] != '\0')
		fprintf(stderr, PROGRAM ": warning: %s\n", mesh->warning);
	if (mesh->n_dropped_primitives != 0)
		fprintf(stderr, PROGRAM ": warning: %" PRIu32 " points and lines were left out\n", mesh->n_dropped_primitives);
}

/* Of materials, not of the coverage of things narrower than a sample. */
void notes_of_blocks(const struct psr_model *model)
{
	const struct psr_blocks *blocks = psr_model_blocks(model);
	uint32_t n = 0;

	for (uint32_t b = 0; b < blocks->n_blocks; b++)
		n += psr_blocks_is_sheer(blocks, b) && (psr_blocks_traits(blocks, b) & PSR_BLOCK_THIN) == 0;
	if (n != 0)
		fprintf(stderr, NOTE "%" PRIu32 " of %" PRIu32 " blocks are of surfaces that let light through (BLEND materials); "
		        "each pixel shows the nearest eight, without refraction\n", n, blocks->n_blocks);
}

static int image_is_opaque(const struct psr_image *image)
{
	const size_t n = (size_t)image->width * image->height;
	uint8_t least = 255;

	for (size_t i = 0; i < n; i++)
		least = image->rgba[4 * i + 3] < least ? image->rgba[4 * i + 3] : least;
	return least == 255;
}

/* Many exporters write BLEND for what is opaque. */
static int is_sheer(const struct psr_mesh *mesh, const struct psr_material *material)
{
	const int image = material->base_texture.image;

	return material->alpha == PSR_ALPHA_BLEND
	       && (mesh->color != NULL || material->base_color[3] < 1 || (image >= 0 && !image_is_opaque(&mesh->image[image])));
}

static int is_mapped(const struct psr_mesh *mesh, const struct psr_material *material)
{
	(void)mesh;
	return normal_is_mapped(material);
}

/* Counts the triangles of such materials; 0 without memory: it is but a note. */
static uint32_t count_triangles(const struct psr_mesh *mesh,
                                int (*is_such)(const struct psr_mesh *mesh, const struct psr_material *material))
{
	uint32_t *of = calloc(mesh->n_materials, sizeof *of), n = 0;

	for (uint32_t t = 0; of != NULL && t < mesh->n_triangles; t++)
		of[mesh->triangle_material[t]]++;
	for (uint32_t m = 0; of != NULL && m < mesh->n_materials; m++)
		n += of[m] > 0 && is_such(mesh, &mesh->material[m]) ? of[m] : 0;
	free(of);
	return n;
}

static void note_sheer(const struct psr_mesh *mesh, const char *kind)
{
	const uint32_t n = count_triangles(mesh, is_sheer);

	if (n > 0)
		fprintf(stderr, NOTE "%" PRIu32 " of %" PRIu32 " triangles are of surfaces that let light through (BLEND materials);"
		        " %s are opaque, see through them with --representation blocks\n", n, mesh->n_triangles, kind);
}

void notes_of_octree(const struct psr_mesh *mesh)
{
	note_sheer(mesh, "octrees");
}

void notes_of_points(const struct psr_mesh *mesh)
{
	const uint32_t n = count_triangles(mesh, is_mapped);

	note_sheer(mesh, "differential points");
	if (n > 0)
		fprintf(stderr, NOTE "%" PRIu32 " of %" PRIu32 " triangles have normal maps, which differential points do not show;"
		        " blocks and octrees do\n", n, mesh->n_triangles);
}
