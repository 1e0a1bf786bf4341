#include "daemon.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "report.h"

void daemon_must(int code, const char *what, const struct psr_error *err)
{
	if (code != PSR_OK)
		report_die(what, err->text);
}

void daemon_film(struct scene_film *film, const struct daemon_bench *bench, uint32_t width, uint32_t height)
{
	static const double straight[3];
	const struct scene_picture picture = { "", width, height, 0 };

	scene_film_init(film, &picture, bench->model, straight);
}

static void open_model(struct link *link, const struct daemon_server *server)
{
	const struct psr_msg_hello hello = { .minor = (uint16_t)link->minor, .client = "bench-daemon",
		                                 .capabilities = PSR_CAP_VIEWS | PSR_CAP_REFINE | PSR_CAP_SHARP };
	struct psr_msg_open open = { .name = "" };
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	uint8_t data[1024];
	struct psr_buf buf = { data, 0, sizeof data };
	struct psr_error err;

	memcpy(address.sun_path, server->socket, sizeof address.sun_path);
	link->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
	if (link->fd < 0 || connect(link->fd, (struct sockaddr *)&address, sizeof address) != 0)
		report_die(server->socket, strerror(errno));
	snprintf(open.name, sizeof open.name, "%s-%d", DAEMON_MODEL, DAEMON_RESOLUTION);
	daemon_must(psr_msg_hello_encode(&buf, &hello, &err), "HELLO", &err);
	daemon_must(psr_msg_open_encode(&buf, link->next_id++, &open, &err), "OPEN", &err);
	link_send(link, data, buf.size);
	link_wait(link, "OPEN");
}

void link_connect(struct link *link, const struct daemon_server *server, const struct scene_film *film)
{
	struct psr_scene scene;

	*link = (struct link){ .minor = server->minor, .next_id = 1, .film = film,
		                   .storage = report_alloc(1, LINK_STORAGE_BYTES) };
	open_model(link, server);
	if (link->handle == 0)
		report_die("OPEN", link->error.text);
	scene_film_frame(&scene, film, 0);
	link_scene(link, &scene);
}

int link_minor(const struct daemon_server *server)
{
	struct link link = { .minor = PSR_PROTO_MINOR, .next_id = 1, .storage = report_alloc(1, LINK_STORAGE_BYTES) };
	int minor;

	open_model(&link, server);
	minor = link.error.code == PSR_ERR_VERSION ? 1 : link.minor;
	link_close(&link);
	return minor;
}

void link_scene(struct link *link, const struct psr_scene *scene)
{
	struct psr_msg_scene *msg = report_alloc(1, sizeof *msg);
	uint8_t *data = report_alloc(1, PSR_WIRE_MAX_MESSAGE);
	struct psr_buf buf = { data, 0, PSR_WIRE_MAX_MESSAGE };
	struct psr_error err;

	msg->ambient = scene->ambient[0];
	msg->n_instances = (uint16_t)scene->n_instances;
	msg->n_lights = (uint16_t)scene->n_lights;
	for (uint32_t i = 0; i < scene->n_instances; i++) {
		const struct psr_instance *from = &scene->instance[i];
		struct psr_msg_instance *to = &msg->instance[i];

		*to = (struct psr_msg_instance){ .handle = link->handle, .scale = from->scale };
		memcpy(to->rotation, from->rotation, sizeof to->rotation);
		memcpy(to->translation, from->translation, sizeof to->translation);
	}
	for (uint32_t i = 0; i < scene->n_lights; i++)
		psr_msg_light_set(&msg->light[i], &scene->light[i]);
	daemon_must(psr_msg_scene_encode(&buf, link->next_id++, msg, &err), "SCENE", &err);
	link_send(link, data, buf.size);
	free(data);
	free(msg);
}

void link_close(struct link *link)
{
	if (link->fd >= 0)
		close(link->fd);
	free(link->storage);
	free(link->latency_ms);
	*link = (struct link){ .fd = -1 };
}

void link_frame(struct link *link, uint32_t width, uint32_t height)
{
	link->frame = (struct psr_msg_frame){
		.width = width, .height = height, .planes = 1u << PSR_PLANE_COLOR, .color_codec = PSR_CODEC_JPEG,
		.color_quality = DAEMON_QUALITY,
	};
}
