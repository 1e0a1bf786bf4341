/* glTF from memory: whatever is accepted keeps the promises of psr/mesh.h. Run from the root of the repository, whose
 * tests/data/import is the folder from which files may be read. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "import/import.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

static void require(int truth)
{
	if (!truth)
		abort();
}

static void check_texture(const struct psr_mesh *mesh, const struct psr_texture *t)
{
	require(t->image >= -1 && t->image < (int)mesh->n_images);
	require(t->uv_set >= 0 && t->uv_set < PSR_UV_SETS);
	for (int i = 0; i < 6; i++)
		require(isfinite(t->transform[i]));
}

static void check_material(const struct psr_mesh *mesh, const struct psr_material *m)
{
	check_texture(mesh, &m->base_texture);
	check_texture(mesh, &m->metallic_roughness_texture);
	check_texture(mesh, &m->emissive_texture);
	check_texture(mesh, &m->occlusion_texture);
	check_texture(mesh, &m->normal_texture);
	check_texture(mesh, &m->specular_texture);
	require(m->roughness >= 0 && m->roughness <= 1 && m->metallic >= 0 && m->metallic <= 1 && m->alpha_cutoff >= 0);
	for (int c = 0; c < 3; c++)
		require(m->base_color[c] >= 0 && m->base_color[c] <= 1 && m->emissive[c] >= 0 && isfinite(m->emissive[c]));
}

static void check_presets(const struct psr_mesh *mesh)
{
	require(mesh->n_cameras <= PSR_MAX_PRESETS && mesh->n_lights <= PSR_MAX_PRESETS);
	for (uint32_t i = 0; i < mesh->n_cameras; i++) {
		const struct psr_camera *c = &mesh->camera[i].camera;
		double way = 0.0;

		require(mesh->camera[i].name[0] != '\0' && memchr(mesh->camera[i].name, '\0', PSR_NAME_BYTES) != NULL);
		for (int k = 0; k < 3; k++) {
			require(isfinite(c->eye[k]) && isfinite(c->target[k]) && isfinite(c->up[k]));
			way += fabs(c->target[k] - c->eye[k]);
		}
		require(way > 0.0 && c->near_z >= 0.0 && (c->fov_y > 0.0 || c->ortho_height > 0.0));
	}
	for (uint32_t i = 0; i < mesh->n_lights; i++) {
		const struct psr_light *l = &mesh->light[i].light;

		require(mesh->light[i].name[0] != '\0' && memchr(mesh->light[i].name, '\0', PSR_NAME_BYTES) != NULL);
		for (int k = 0; k < 3; k++)
			require(isfinite(l->position[k]) && isfinite(l->direction[k]) && l->color[k] >= 0.0);
		require(l->kind != PSR_LIGHT_SPOT || (l->inner <= l->outer && l->outer > 0.0));
	}
}

static void check_unit(const float *n)
{
	float length = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];

	require(length == 0.0f || fabsf(length - 1.0f) < 1e-5f);
}

static void check(const struct psr_mesh *mesh)
{
	require(mesh->n_triangles + mesh->n_points > 0 && mesh->n_materials > 0);
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		require(mesh->triangle_material[t] < mesh->n_materials);
		for (int c = 0; c < 3; c++)
			require(mesh->triangle[t][c] < mesh->n_vertices);
	}
	for (uint32_t v = 0; v < mesh->n_vertices; v++) {
		check_unit(mesh->normal[v]);
		if (mesh->tangent != NULL)
			check_unit(mesh->tangent[v]);
		for (int c = 0; c < 3; c++)
			require(isfinite(mesh->position[v][c]));
		for (int set = 0; set < PSR_UV_SETS; set++)
			require(mesh->uv[set] == NULL || (isfinite(mesh->uv[set][v][0]) && isfinite(mesh->uv[set][v][1])));
	}
	for (uint32_t p = 0; p < mesh->n_points; p++) {
		check_unit(mesh->point_normal[p]);
		require(mesh->point_material[p] < mesh->n_materials);
		for (int c = 0; c < 3; c++)
			require(isfinite(mesh->point[p][c]));
	}
	for (uint32_t m = 0; m < mesh->n_materials; m++)
		check_material(mesh, &mesh->material[m]);
	check_presets(mesh);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	struct psr_mesh *mesh = NULL;
	struct import_mesh im;
	struct psr_error err = { 0, "" };
	int rc;

	require(import_mesh_init(&im, "tests/data/import/fuzz.glb", &err) == PSR_OK);
	rc = import_gltf(&im, data, n, &err);
	if (rc == PSR_OK)
		rc = import_mesh_finish(&mesh, &im, &err);
	import_mesh_fini(&im);
	require((rc == PSR_OK) == (mesh != NULL) && rc == err.code);
	if (mesh != NULL)
		check(mesh);
	psr_mesh_destroy(mesh);
	return 0;
}
