#include "embree.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __SSE__
#include <pmmintrin.h>
#endif
#include "base/srgb.h"
#include "base/pool.h"
#include "base/stats.h"
#include "report.h"

#define N 16    /* a packet: 4 x 4 pixels */
#define SIDE 4
#define TILE 32 /* pixels on a side of what a thread takes at a time */
#define CODES 4096
#define N_WARM 2

struct tracer {
	RTCDevice device;
	RTCScene scene;
	const struct peer_mesh *mesh;
	struct peer_view view;
	int has_shadow;
	uint32_t tiles_x;
	uint8_t code[CODES + 1]; /* sRGB of linear light */
	uint8_t *rgb;
};

/* What shading reads and writes, a column a lane. */
struct lanes {
	float direction[3][N], position[3][N], normal[3][N], diffuse[3][N], f0[3][N], width2[N], lit[N],
		color[3][N];
} __attribute__((aligned(64)));

static void build(struct tracer *t, const struct peer_mesh *mesh, int n_threads)
{
	char config[64];
	RTCGeometry geometry;
	float (*position)[3];
	uint32_t (*triangle)[3];

	snprintf(config, sizeof config, "threads=%d,set_affinity=0", n_threads);
	t->device = rtcNewDevice(config);
	geometry = rtcNewGeometry(t->device, RTC_GEOMETRY_TYPE_TRIANGLE);
	position = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof *position,
	                                   mesh->n_vertices);
	triangle = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof *triangle,
	                                   mesh->n_triangles);
	if (position == NULL || triangle == NULL)
		report_die("Embree", "has no memory");
	memcpy(position, mesh->position, mesh->n_vertices * sizeof *position);
	memcpy(triangle, mesh->triangle, mesh->n_triangles * sizeof *triangle);
	rtcCommitGeometry(geometry);
	t->scene = rtcNewScene(t->device);
	rtcSetSceneBuildQuality(t->scene, RTC_BUILD_QUALITY_HIGH);
	rtcAttachGeometry(t->scene, geometry);
	rtcReleaseGeometry(geometry);
	rtcCommitScene(t->scene);
	if (rtcGetDeviceError(t->device) != RTC_ERROR_NONE)
		report_die("Embree", "builds no tree");
	t->mesh = mesh;
}

static void aim(struct RTCRayHit16 *rays, struct lanes *l, int valid[N], const struct peer_view *view, uint32_t x0,
                uint32_t y0)
{
	for (uint32_t i = 0; i < N; i++) {
		const uint32_t px = x0 + i % SIDE, py = y0 + i / SIDE;
		const float x = ((float)px + 0.5f - 0.5f * (float)view->width) / view->focal,
			y = ((float)py + 0.5f - 0.5f * (float)view->height) / view->focal, k = 1 / sqrtf(x * x + y * y + 1);

		valid[i] = px < view->width && py < view->height ? -1 : 0;
		for (int c = 0; c < 3; c++)
			l->direction[c][i] = k * (x * view->axis[0][c] + y * view->axis[1][c] + view->axis[2][c]);
		rays->ray.org_x[i] = view->eye[0];
		rays->ray.org_y[i] = view->eye[1];
		rays->ray.org_z[i] = view->eye[2];
		rays->ray.dir_x[i] = l->direction[0][i];
		rays->ray.dir_y[i] = l->direction[1][i];
		rays->ray.dir_z[i] = l->direction[2][i];
		rays->ray.tnear[i] = view->near_z;
		rays->ray.tfar[i] = INFINITY;
		rays->ray.time[i] = 0;
		rays->ray.mask[i] = ~0u;
		rays->ray.id[i] = i;
		rays->ray.flags[i] = 0;
		rays->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
		rays->hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
	}
}

static int fetch(struct lanes *l, const struct tracer *t, const struct RTCRayHit16 *rays)
{
	int any = 0;

	for (int i = 0; i < N; i++) {
		if (rays->hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
			for (int c = 0; c < 3; c++) {
				l->normal[c][i] = c == 0;
				l->diffuse[c][i] = l->f0[c][i] = 0;
			}
			l->width2[i] = 1;
			continue;
		}
		const uint32_t prim = rays->hit.primID[i], *v = t->mesh->triangle[prim];
		const struct peer_look *look = &t->mesh->look[t->mesh->triangle_look[prim]];
		const float b1 = rays->hit.u[i], b2 = rays->hit.v[i], b0 = 1 - b1 - b2;

		for (int c = 0; c < 3; c++) {
			l->normal[c][i] = b0 * t->mesh->normal[v[0]][c] + b1 * t->mesh->normal[v[1]][c]
			                  + b2 * t->mesh->normal[v[2]][c];
			l->diffuse[c][i] = look->diffuse[c];
			l->f0[c][i] = look->f0[c];
		}
		l->width2[i] = fmaxf(powf(look->roughness, 4), 4e-6f);
		any = 1;
	}
	return any;
}

static void cast_shadows(struct lanes *l, const struct tracer *t, const struct RTCRayHit16 *rays)
{
	const float bias = 1e-3f, *light = t->view.to_light;
	struct RTCRay16 shadow;
	int valid[N] __attribute__((aligned(64)));

	for (int i = 0; i < N; i++) {
		const float facing = l->normal[0][i] * light[0] + l->normal[1][i] * light[1] + l->normal[2][i] * light[2];

		valid[i] = rays->hit.geomID[i] != RTC_INVALID_GEOMETRY_ID && facing > 0 ? -1 : 0;
		shadow.org_x[i] = l->position[0][i];
		shadow.org_y[i] = l->position[1][i];
		shadow.org_z[i] = l->position[2][i];
		shadow.dir_x[i] = light[0];
		shadow.dir_y[i] = light[1];
		shadow.dir_z[i] = light[2];
		shadow.tnear[i] = bias;
		shadow.tfar[i] = INFINITY;
		shadow.time[i] = 0;
		shadow.mask[i] = ~0u;
		shadow.id[i] = (unsigned)i;
		shadow.flags[i] = 0;
	}
	struct RTCIntersectContext context;
	rtcInitIntersectContext(&context);
	context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
	rtcOccluded16(valid, t->scene, &context, &shadow);
	for (int i = 0; i < N; i++)
		l->lit[i] = valid[i] && shadow.tfar[i] < 0 ? 0 : 1;
}

static void shade(struct lanes *l, const struct peer_view *view)
{
	const float lx = view->to_light[0], ly = view->to_light[1], lz = view->to_light[2], ambient = view->ambient;

	for (int i = 0; i < N; i++) {
		const float x = l->normal[0][i], y = l->normal[1][i], z = l->normal[2][i], k = 1 / sqrtf(x * x + y * y + z * z);
		const float facing = k * (x * lx + y * ly + z * lz);
		const float n_v = -k * (x * l->direction[0][i] + y * l->direction[1][i] + z * l->direction[2][i]);
		const float l_v = -(lx * l->direction[0][i] + ly * l->direction[1][i] + lz * l->direction[2][i]);
		const float nl = facing > 0 ? facing : 0, nv = n_v > 1e-3f ? n_v : 1e-3f, lit = l->lit[i] * nl;
		const float width2 = l->width2[i], rest = 1 - width2, h2 = 2 + 2 * l_v > 1e-6f ? 2 + 2 * l_v : 1e-6f;
		const float wide = h2 - rest * (nl + nv) * (nl + nv), t = wide > h2 * width2 ? wide : h2 * width2;
		const float shadowed = nl * sqrtf(nv * nv * rest + width2) + nv * sqrtf(nl * nl * rest + width2);
		const float lobe = 0.5f * width2 * h2 * h2 / (t * t * shadowed), grazing = 1 - 0.5f * sqrtf(h2);
		const float square = grazing * grazing, fresnel = square * square * grazing;

		for (int c = 0; c < 3; c++) {
			const float f0 = l->f0[c][i], mirrored = f0 * (1 - fresnel) + fresnel;
			const float color = (l->diffuse[c][i] + f0) * ambient
			                    + (l->diffuse[c][i] * (1 - fresnel) + lobe * mirrored) * lit;

			l->color[c][i] = color < 1 ? color : 1;
		}
	}
}

static void trace_packet(const struct tracer *t, uint32_t x0, uint32_t y0)
{
	struct RTCRayHit16 rays;
	struct RTCIntersectContext context;
	struct lanes l;
	int valid[N] __attribute__((aligned(64)));
	int any;

	aim(&rays, &l, valid, &t->view, x0, y0);
	rtcInitIntersectContext(&context);
	context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
	rtcIntersect16(valid, t->scene, &context, &rays);
	any = fetch(&l, t, &rays);
	if (any) {
		for (int i = 0; i < N; i++) {
			for (int c = 0; c < 3; c++)
				l.position[c][i] = t->view.eye[c] + rays.ray.tfar[i] * l.direction[c][i];
			l.lit[i] = 1;
		}
		if (t->has_shadow)
			cast_shadows(&l, t, &rays);
		shade(&l, &t->view);
	} else {
		memset(l.color, 0, sizeof l.color);
	}
	for (uint32_t i = 0; i < N; i++) {
		const uint32_t x = x0 + i % SIDE, y = y0 + i / SIDE;

		if (!valid[i])
			continue;
		for (int c = 0; c < 3; c++)
			t->rgb[3 * ((size_t)y * t->view.width + x) + (size_t)c] = t->code[(int)(l.color[c][i] * CODES + 0.5f)];
	}
}

static void trace_tile(int tile, void *userdata)
{
	const struct tracer *t = userdata;
	const uint32_t x0 = (uint32_t)tile % t->tiles_x * TILE, y0 = (uint32_t)tile / t->tiles_x * TILE;

#ifdef __SSE__
	_MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
	_MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
#endif
	for (uint32_t y = y0; y < y0 + TILE && y < t->view.height; y += SIDE)
		for (uint32_t x = x0; x < x0 + TILE && x < t->view.width; x += SIDE)
			trace_packet(t, x, y);
}

static void draw(struct tracer *t, struct psr_pool *pool, const struct scene_film *film, int frame)
{
	peer_view_init(&t->view, film, frame);
	t->tiles_x = (t->view.width + TILE - 1) / TILE;
	psr_pool_for(pool, (int)(t->tiles_x * ((t->view.height + TILE - 1) / TILE)), trace_tile, t);
}

void embree_measure(struct peer_result *out, const struct scene_film *film, const struct peer_mesh *mesh,
                    int has_shadow, int n_threads, int n_frames, uint8_t *rgb)
{
	const size_t n_bytes = (size_t)3 * film->picture.width * film->picture.height;
	struct tracer *t = report_alloc(1, sizeof *t);
	struct psr_pool *pool;
	double begin = report_ms(), ms[SCENE_FRAMES];

	if (psr_pool_create(&pool, n_threads, NULL) != PSR_OK)
		report_die("threads", "cannot be started");
	build(t, mesh, n_threads);
	t->has_shadow = has_shadow;
	t->rgb = report_alloc(n_bytes, 1);
	for (int i = 0; i <= CODES; i++)
		t->code[i] = psr_linear_to_srgb((float)i / CODES);
	out->setup_s = (report_ms() - begin) / 1e3;
	for (int i = N_WARM; i-- > 0;)
		draw(t, pool, film, i);
	if (rgb != NULL)
		memcpy(rgb, t->rgb, n_bytes);
	for (int i = 0; i < n_frames; i++) {
		begin = report_ms();
		draw(t, pool, film, i * SCENE_FRAMES / n_frames);
		ms[i] = report_ms() - begin;
	}
	out->ms = stats_median(ms, (size_t)n_frames);
	out->n_frames = n_frames;
	snprintf(out->what, sizeof out->what, "Embree %d.%d.%d, packets of %d",
	         (int)rtcGetDeviceProperty(t->device, RTC_DEVICE_PROPERTY_VERSION_MAJOR),
	         (int)rtcGetDeviceProperty(t->device, RTC_DEVICE_PROPERTY_VERSION_MINOR),
	         (int)rtcGetDeviceProperty(t->device, RTC_DEVICE_PROPERTY_VERSION_PATCH), N);
	rtcReleaseScene(t->scene);
	rtcReleaseDevice(t->device);
	psr_pool_destroy(pool);
	free(t->rgb);
	free(t);
}
