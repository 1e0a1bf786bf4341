#include "peer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "model/blocks.h"
#include "surface/lobe.h"
#include "base/direction.h"
#include "report.h"

void peer_look_init(struct peer_look *out, uint64_t attr)
{
	struct look look;
	double diffuse[3], f0[3];

	material_decode(&look, attr);
	lobe_colors(diffuse, f0, &look);
	for (int c = 0; c < 3; c++) {
		out->diffuse[c] = (float)diffuse[c];
		out->f0[c] = (float)f0[c];
	}
	out->roughness = look.roughness;
}

static void fill_triangles(struct peer_mesh *out, const struct psr_mesh *mesh)
{
	memcpy(out->triangle, mesh->triangle, mesh->n_triangles * sizeof *out->triangle);
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		out->triangle_look[t] = (uint16_t)mesh->triangle_material[t];
	for (uint32_t m = 0; m < mesh->n_materials; m++) {
		struct material_values values;

		material_values_default(&values, &mesh->material[m]);
		peer_look_init(&out->look[m], material_word(&mesh->material[m], &values));
	}
}

/* Where the source has no normals, a vertex gets that of its last face. */
static void fill_normals(struct peer_mesh *out, const struct psr_mesh *mesh)
{
	memcpy(out->normal, mesh->normal, mesh->n_vertices * sizeof *out->normal);
	for (uint32_t t = 0; t < out->n_triangles; t++) {
		const uint32_t *v = out->triangle[t];
		float e[3], f[3], n[3];

		v3f_sub(e, out->position[v[1]], out->position[v[0]]);
		v3f_sub(f, out->position[v[2]], out->position[v[0]]);
		v3f_cross(n, e, f);
		v3f_normalize(n, n);
		for (int c = 0; c < 3; c++)
			if (v3f_dot(mesh->normal[v[c]], mesh->normal[v[c]]) == 0)
				memcpy(out->normal[v[c]], n, sizeof n);
	}
}

void peer_mesh_init(struct peer_mesh *out, const struct psr_mesh *mesh, const struct psr_model *model)
{
	const struct psr_model_info *info = psr_model_info(model);

	*out = (struct peer_mesh){ .n_vertices = mesh->n_vertices, .n_triangles = mesh->n_triangles,
		                       .n_looks = mesh->n_materials };
	out->position = report_alloc(out->n_vertices, sizeof *out->position);
	out->normal = report_alloc(out->n_vertices, sizeof *out->normal);
	out->triangle = report_alloc(out->n_triangles, sizeof *out->triangle);
	out->triangle_look = report_alloc(out->n_triangles, sizeof *out->triangle_look);
	out->look = report_alloc(out->n_looks, sizeof *out->look);
	for (uint32_t v = 0; v < out->n_vertices; v++)
		for (int k = 0; k < 3; k++)
			out->position[v][k] = (float)((mesh->position[v][k] - info->origin[k]) / info->scale);
	fill_triangles(out, mesh);
	fill_normals(out, mesh);
	peer_mesh_order(out);
}

void peer_mesh_fini(struct peer_mesh *mesh)
{
	free(mesh->position);
	free(mesh->normal);
	free(mesh->triangle);
	free(mesh->triangle_look);
	free(mesh->look);
}

void peer_view_init(struct peer_view *out, const struct scene_film *film, int frame)
{
	const struct psr_model_info *info = psr_model_info(film->model);
	struct psr_scene scene;
	double axis[3][3], v[3];

	scene_film_frame(&scene, film, frame);
	v3d_sub(v, scene.camera.target, scene.camera.eye);
	v3d_normalize(axis[2], v);
	v3d_cross(v, axis[2], scene.camera.up);
	v3d_normalize(axis[0], v);
	v3d_cross(axis[1], axis[2], axis[0]);
	for (int i = 0; i < 3; i++) {
		out->eye[i] = (float)((scene.camera.eye[i] - info->origin[i]) / info->scale);
		for (int k = 0; k < 3; k++)
			out->axis[i][k] = (float)axis[i][k];
	}
	v3d_scale(v, film->light.direction, -1);
	v3d_normalize(v, v);
	v3f_set(out->to_light, (float)v[0], (float)v[1], (float)v[2]);
	out->width = film->picture.width;
	out->height = film->picture.height;
	out->focal = (float)(out->height / 2.0 / tan(scene.camera.fov_y / 2));
	out->near_z = (float)(scene.camera.near_z / info->scale);
	out->far_z = v3f_length(out->eye) + 1.1f;
	out->ambient = (float)SCENE_AMBIENT;
}

static float stretched(const struct peer_view *view, const struct psr_cluster *cluster)
{
	float d[3], z, distance;

	v3f_sub(d, cluster->center, view->eye);
	z = fmaxf(v3f_dot(d, view->axis[2]) - cluster->radius, view->near_z);
	distance = v3f_length(d) + cluster->radius;
	return view->focal * distance / (z * z);
}

/* The level of each group: the coarsest whose samples are within a pixel of each other, else the finest. */
static uint8_t *choose(const struct psr_blocks *b, const struct peer_view *view, float spacing)
{
	float *most = report_alloc(b->n_clusters, sizeof *most);
	uint8_t *level = report_alloc(b->n_clusters, 1);

	memset(level, 0xff, b->n_clusters);
	for (uint32_t k = 0; k < b->n_clusters; k++)
		most[b->cluster[k].group] = fmaxf(most[b->cluster[k].group], stretched(view, &b->cluster[k]));
	for (uint32_t k = 0; k < b->n_clusters; k++) {
		const struct psr_cluster *c = &b->cluster[k];
		const int fits = most[c->group] * spacing * (float)(1u << c->level) <= 1;
		uint8_t *best = &level[c->group];
		const int best_fits = *best != 0xff && most[c->group] * spacing * (float)(1u << *best) <= 1;

		if (*best == 0xff || (fits ? !best_fits || c->level > *best : !best_fits && c->level < *best))
			*best = c->level;
	}
	free(most);
	return level;
}

static void put_block(struct peer_points *out, const struct psr_blocks *b, uint32_t i)
{
	const struct psr_projection *p = &b->projection[b->block_projection[i]];
	const float dx = p->spacing * (float)(1u << psr_blocks_level(b, i)), dy = dx * 0.866025404f;
	uint32_t k = psr_blocks_attr_first(b, i);
	struct psr_place place;

	psr_blocks_place(b, i, &place);
	for (int s = 0; s < PSR_BLOCK_SAMPLES; s++) {
		const int row = s / PSR_BLOCK_SIDE, col = s % PSR_BLOCK_SIDE;
		float x, y, z;

		if (!(b->mask[i] >> s & 1))
			continue;
		x = (float)place.col * p->spacing + ((float)col + (float)(row & 1) / 2) * dx;
		y = (float)place.row * p->spacing * 0.866025404f + (float)row * dy;
		z = psr_place_depth(&place, b->depth[k]);
		for (int c = 0; c < 3; c++)
			out->position[out->n][c] = x * p->axis[0][c] + y * p->axis[1][c] + z * p->axis[2][c];
		out->attr[out->n++] = b->attr[k++];
	}
}

void peer_points_init(struct peer_points *out, const struct scene_film *film)
{
	const struct psr_blocks *b = psr_model_blocks(film->model);
	const struct psr_model_info *info = psr_model_info(film->model);
	struct peer_view view;
	uint8_t *level;

	peer_view_init(&view, film, 0);
	level = choose(b, &view, (float)(info->spacing / info->scale));
	out->n = 0;
	out->position = report_alloc(b->n_samples, sizeof *out->position);
	out->attr = report_alloc(b->n_samples, sizeof *out->attr);
	for (uint32_t k = 0; k < b->n_clusters; k++) {
		const struct psr_cluster *c = &b->cluster[k];

		if (c->level != level[c->group])
			continue;
		for (uint32_t i = c->first_block; i < c->first_block + c->n_blocks; i++)
			put_block(out, b, i);
	}
	free(level);
}

void peer_points_fini(struct peer_points *points)
{
	free(points->position);
	free(points->attr);
}
