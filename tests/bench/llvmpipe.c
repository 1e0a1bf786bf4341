#define GL_GLEXT_PROTOTYPES
#include "llvmpipe.h"

#include <GL/gl.h>
#include <GL/glext.h>
#include <GL/osmesa.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/stats.h"
#include "base/vec.h"
#include "model/blocks.h"
#include "base/direction.h"
#include "report.h"

#define N_WARM 2

/* The mesh has its material in uniforms, a draw a material; samples have theirs with them. */
struct mesh_vertex {
	float position[3];
	int16_t normal[4];
};
struct point_vertex {
	float position[3];
	int16_t normal[4];
	uint16_t diffuse[4], specular[4]; /* linear; specular: F0 and roughness */
};

/* Colours are coded by the shader, sRGB's curve as three square roots (3 codes of 255 off at most, where it is
 * nearly black): a frame buffer that does it takes a tenth longer. */
#define LIGHT                                                                                                          \
	"vec3 coded(vec3 c) {\n"                                                                                           \
	"	vec3 a = sqrt(min(c, 1.0)), b = sqrt(a);\n"                                                                    \
	"	return max(0.585122381 * a + 0.783140355 * b - 0.368262736 * sqrt(b), 0.0);\n"                                 \
	"}\n"                                                                                                              \
	"uniform vec3 eye, light; uniform float ambient;\n"                                                                \
	"vec3 lit(vec3 p, vec3 n, vec3 d, vec4 s) {\n"                                                                     \
	"	vec3 v = normalize(eye - p); float w = s.a * s.a, w2 = max(w * w, 4e-6), rest = 1.0 - w2;\n"                   \
	"	float l = max(dot(n, light), 0.0), e = max(dot(n, v), 1e-3), h = max(2.0 + 2.0 * dot(light, v), 1e-6);\n"      \
	"	float t = max(h - rest * (l + e) * (l + e), h * w2);\n"                                                        \
	"	float g = l * sqrt(e * e * rest + w2) + e * sqrt(l * l * rest + w2);\n"                                        \
	"	float k = 0.5 * w2 * h * h / (t * t * g), a = 1.0 - 0.5 * sqrt(h), q = a * a, f = q * q * a;\n"                \
	"	return coded((d + s.rgb) * ambient + l * (d * (1.0 - f) + k * (s.rgb * (1.0 - f) + f)));\n"                    \
	"}\n"

static const char mesh_vs[] =
	"#version 330\nlayout(location = 0) in vec3 p; layout(location = 1) in vec3 n; uniform mat4 m;\n"
	"out vec3 vp, vn; void main() { gl_Position = m * vec4(p, 1.0); vp = p; vn = n; }\n";
static const char mesh_fs[] =
	"#version 330\n" LIGHT "uniform vec3 diffuse; uniform vec4 specular; in vec3 vp, vn; out vec4 o;\n"
	"void main() { o = vec4(lit(vp, normalize(vn), diffuse, specular), 1.0); }\n";

/* Samples that face away go outside of the picture, before anything is set up for them. */
#define POINT_IN                                                                                                       \
	"layout(location = 0) in vec3 p; layout(location = 1) in vec3 n;\n"                                                \
	"layout(location = 2) in vec3 d; layout(location = 3) in vec4 s; uniform mat4 m; uniform vec3 from;\n"             \
	"vec4 place() { return dot(n, from - p) > 0.0 ? m * vec4(p, 1.0) : vec4(2.0, 2.0, 2.0, 1.0); }\n"
static const char point_vs[] =
	"#version 330\n" POINT_IN "flat out vec3 vp, vn, vd; flat out vec4 vs;\n"
	"void main() { gl_Position = place(); vp = p; vn = n; vd = d; vs = s; }\n";
static const char point_fs[] =
	"#version 330\n" LIGHT "flat in vec3 vp, vn, vd; flat in vec4 vs; out vec4 o;\n"
	"void main() { o = vec4(lit(vp, normalize(vn), vd, vs), 1.0); }\n";
static const char shaded_vs[] =
	"#version 330\n" LIGHT POINT_IN "flat out vec3 vc;\n"
	"void main() { gl_Position = place(); vc = lit(p, normalize(n), d, s); }\n";
static const char shaded_fs[] =
	"#version 330\nflat in vec3 vc; out vec4 o; void main() { o = vec4(vc, 1.0); }\n";

struct gl {
	OSMesaContext context;
	uint8_t *screen, *rgba;
	GLuint program;
	GLsizei n;
	GLint matrix, eye, from, diffuse, specular;
	const struct peer_mesh *mesh; /* drawn look by look; NULL: points */
};

static GLuint compile(GLenum kind, const char *text)
{
	GLuint shader = glCreateShader(kind);
	GLint ok;
	char log[1024];

	glShaderSource(shader, 1, &text, NULL);
	glCompileShader(shader);
	glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
	if (!ok) {
		glGetShaderInfoLog(shader, sizeof log, NULL, log);
		report_die("a shader", log);
	}
	return shader;
}

static void start(struct gl *gl, uint32_t width, uint32_t height, struct peer_result *out)
{
	static const int wanted[] = { OSMESA_FORMAT, OSMESA_RGBA, OSMESA_PROFILE, OSMESA_CORE_PROFILE,
		                          OSMESA_CONTEXT_MAJOR_VERSION, 3, OSMESA_CONTEXT_MINOR_VERSION, 3, 0 };
	GLuint buffer, store[2], array;

	setenv("GALLIUM_DRIVER", "llvmpipe", 1);
	gl->context = OSMesaCreateContextAttribs(wanted, NULL);
	gl->screen = report_alloc((size_t)width * height, 4);
	gl->rgba = report_alloc((size_t)width * height, 4);
	if (gl->context == NULL
	    || !OSMesaMakeCurrent(gl->context, gl->screen, GL_UNSIGNED_BYTE, (GLsizei)width, (GLsizei)height))
		report_die("OSMesa", "gives no context of OpenGL 3.3");
	snprintf(out->what, sizeof out->what, "%s, Mesa %s", (const char *)glGetString(GL_RENDERER),
	         (const char *)glGetString(GL_VERSION));
	if (strstr(out->what, "llvmpipe") == NULL)
		report_die(out->what, "is not llvmpipe");
	glGenFramebuffers(1, &buffer);
	glBindFramebuffer(GL_FRAMEBUFFER, buffer);
	glGenRenderbuffers(2, store);
	glBindRenderbuffer(GL_RENDERBUFFER, store[0]);
	glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, (GLsizei)width, (GLsizei)height);
	glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, store[0]);
	glBindRenderbuffer(GL_RENDERBUFFER, store[1]);
	glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, (GLsizei)width, (GLsizei)height);
	glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, store[1]);
	if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
		report_die("OSMesa", "gives no frame buffer");
	glGenVertexArrays(1, &array);
	glBindVertexArray(array);
	glViewport(0, 0, (GLsizei)width, (GLsizei)height);
	glEnable(GL_DEPTH_TEST);
}

static void use(struct gl *gl, const char *vs, const char *fs, const struct peer_view *view)
{
	GLint ok;

	gl->program = glCreateProgram();
	glAttachShader(gl->program, compile(GL_VERTEX_SHADER, vs));
	glAttachShader(gl->program, compile(GL_FRAGMENT_SHADER, fs));
	glLinkProgram(gl->program);
	glGetProgramiv(gl->program, GL_LINK_STATUS, &ok);
	if (!ok)
		report_die("shaders", "do not link");
	glUseProgram(gl->program);
	gl->matrix = glGetUniformLocation(gl->program, "m");
	gl->eye = glGetUniformLocation(gl->program, "eye");
	gl->from = glGetUniformLocation(gl->program, "from");
	gl->diffuse = glGetUniformLocation(gl->program, "diffuse");
	gl->specular = glGetUniformLocation(gl->program, "specular");
	glUniform3fv(glGetUniformLocation(gl->program, "light"), 1, view->to_light);
	glUniform1f(glGetUniformLocation(gl->program, "ambient"), view->ambient);
}

static void put_buffer(GLenum target, const void *bytes, size_t n_bytes)
{
	GLuint name;

	glGenBuffers(1, &name);
	glBindBuffer(target, name);
	glBufferData(target, (GLsizeiptr)n_bytes, bytes, GL_STATIC_DRAW);
}

static void put_attribute(GLuint at, GLint n, GLenum type, size_t stride, size_t offset)
{
	glVertexAttribPointer(at, n, type, type != GL_FLOAT, (GLsizei)stride, (const char *)NULL + offset);
	glEnableVertexAttribArray(at);
}

static void put_normal(int16_t to[4], const float n[3])
{
	for (int k = 0; k < 3; k++)
		to[k] = (int16_t)lrintf(n[k] * 32767);
	to[3] = 0;
}

static void put_mesh(struct gl *gl, const struct peer_mesh *mesh)
{
	struct mesh_vertex *v = report_alloc(mesh->n_vertices, sizeof *v);

	for (uint32_t i = 0; i < mesh->n_vertices; i++) {
		memcpy(v[i].position, mesh->position[i], sizeof v[i].position);
		put_normal(v[i].normal, mesh->normal[i]);
	}
	put_buffer(GL_ARRAY_BUFFER, v, mesh->n_vertices * sizeof *v);
	put_buffer(GL_ELEMENT_ARRAY_BUFFER, mesh->triangle, mesh->n_triangles * sizeof *mesh->triangle);
	put_attribute(0, 3, GL_FLOAT, sizeof *v, offsetof(struct mesh_vertex, position));
	put_attribute(1, 3, GL_SHORT, sizeof *v, offsetof(struct mesh_vertex, normal));
	free(v);
	gl->mesh = mesh;
	glEnable(GL_CULL_FACE);
}

static void put_points(struct gl *gl, const struct peer_points *points)
{
	const float (*direction)[3] = psr_direction_table();
	struct point_vertex *v = report_alloc(points->n, sizeof *v);

	for (uint64_t i = 0; i < points->n; i++) {
		struct peer_look look;

		peer_look_init(&look, points->attr[i]);
		memcpy(v[i].position, points->position[i], sizeof v[i].position);
		put_normal(v[i].normal, direction[PSR_ATTR_NORMAL(points->attr[i])]);
		for (int k = 0; k < 3; k++) {
			v[i].diffuse[k] = (uint16_t)lrintf(look.diffuse[k] * 65535);
			v[i].specular[k] = (uint16_t)lrintf(look.f0[k] * 65535);
		}
		v[i].specular[3] = (uint16_t)lrintf(look.roughness * 65535);
	}
	put_buffer(GL_ARRAY_BUFFER, v, points->n * sizeof *v);
	put_attribute(0, 3, GL_FLOAT, sizeof *v, offsetof(struct point_vertex, position));
	put_attribute(1, 3, GL_SHORT, sizeof *v, offsetof(struct point_vertex, normal));
	put_attribute(2, 3, GL_UNSIGNED_SHORT, sizeof *v, offsetof(struct point_vertex, diffuse));
	put_attribute(3, 4, GL_UNSIGNED_SHORT, sizeof *v, offsetof(struct point_vertex, specular));
	free(v);
	gl->n = (GLsizei)points->n;
}

/* Columns; clip space has y up. */
static void put_camera(const struct gl *gl, const struct peer_view *view)
{
	const float a = (view->far_z + view->near_z) / (view->far_z - view->near_z),
		b = -2 * view->far_z * view->near_z / (view->far_z - view->near_z);
	float row[4][4], m[16];

	for (int k = 0; k < 3; k++) {
		row[0][k] = 2 * view->focal / (float)view->width * view->axis[0][k];
		row[1][k] = -2 * view->focal / (float)view->height * view->axis[1][k];
		row[2][k] = a * view->axis[2][k];
		row[3][k] = view->axis[2][k];
	}
	for (int i = 0; i < 4; i++)
		row[i][3] = -v3f_dot(row[i], view->eye) + (i == 2 ? b : 0);
	for (int i = 0; i < 16; i++)
		m[i] = row[i % 4][i / 4];
	glUniformMatrix4fv(gl->matrix, 1, GL_FALSE, m);
	glUniform3fv(gl->eye, 1, view->eye);
	glUniform3fv(gl->from, 1, view->eye);
}

static void draw_mesh(const struct gl *gl)
{
	const struct peer_mesh *mesh = gl->mesh;
	uint32_t end;

	for (uint32_t t = 0; t < mesh->n_triangles; t = end) {
		const struct peer_look *look = &mesh->look[mesh->triangle_look[t]];

		for (end = t + 1; end < mesh->n_triangles && mesh->triangle_look[end] == mesh->triangle_look[t];)
			end++;
		glUniform3fv(gl->diffuse, 1, look->diffuse);
		glUniform4f(gl->specular, look->f0[0], look->f0[1], look->f0[2], look->roughness);
		glDrawElements(GL_TRIANGLES, (GLsizei)(3 * (end - t)), GL_UNSIGNED_INT,
		               (const char *)NULL + t * sizeof *mesh->triangle);
	}
}

static void draw(const struct gl *gl, const struct scene_film *film, int frame)
{
	struct peer_view view;

	peer_view_init(&view, film, frame);
	put_camera(gl, &view);
	glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
	if (gl->mesh != NULL)
		draw_mesh(gl);
	else
		glDrawArrays(GL_POINTS, 0, gl->n);
	glFinish();
	glReadPixels(0, 0, (GLsizei)view.width, (GLsizei)view.height, GL_RGBA, GL_UNSIGNED_BYTE, gl->rgba);
}

static void save(uint8_t *rgb, const struct gl *gl, uint32_t width, uint32_t height)
{
	for (uint32_t y = 0; y < height; y++)
		for (uint32_t x = 0; x < width; x++)
			memcpy(rgb + 3 * ((size_t)y * width + x), gl->rgba + 4 * ((size_t)(height - 1 - y) * width + x), 3);
}

void llvmpipe_measure(struct peer_result *out, enum llvmpipe_way way, const struct scene_film *film,
                      const struct peer_mesh *mesh, const struct peer_points *points, int n_frames, uint8_t *rgb)
{
	const uint32_t width = film->picture.width, height = film->picture.height;
	struct gl gl = { .mesh = NULL };
	struct peer_view view;
	double begin = report_ms(), ms[SCENE_FRAMES];

	start(&gl, width, height, out);
	peer_view_init(&view, film, 0);
	if (way == LLVMPIPE_MESH) {
		use(&gl, mesh_vs, mesh_fs, &view);
		put_mesh(&gl, mesh);
	} else {
		use(&gl, way == LLVMPIPE_POINTS ? point_vs : shaded_vs, way == LLVMPIPE_POINTS ? point_fs : shaded_fs, &view);
		put_points(&gl, points);
	}
	for (int i = N_WARM; i-- > 0;)
		draw(&gl, film, i);
	if (glGetError() != GL_NO_ERROR)
		report_die("OpenGL", "refuses a frame");
	out->setup_s = (report_ms() - begin) / 1e3;
	if (rgb != NULL)
		save(rgb, &gl, width, height);
	for (int i = 0; i < n_frames; i++) {
		begin = report_ms();
		draw(&gl, film, i * SCENE_FRAMES / n_frames);
		ms[i] = report_ms() - begin;
	}
	out->ms = stats_median(ms, (size_t)n_frames);
	out->n_frames = n_frames;
	OSMesaDestroyContext(gl.context);
	free(gl.screen);
	free(gl.rgba);
}
