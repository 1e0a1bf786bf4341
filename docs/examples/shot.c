/* shot HOST:PORT MODEL PICTURE.png: has psrd draw a model of its folder.
 * cc shot.c $(pkg-config --cflags --libs psr-client) -o shot */
#include <stdio.h>
#include <psr/client.h>

int main(int argc, char **argv)
{
	struct psr_client *client = NULL;
	struct psr_frame frame = { 0 };
	struct psr_shot shot;
	struct psr_error err;
	int code;

	psr_shot_default(&shot, 640, 480);
	code = psr_client_connect(&client, argc == 4 ? argv[1] : "", "shot 1.0", NULL, 5000, &err);
	if (code == PSR_OK)
		code = psr_client_draw(client, argv[2], &shot, &frame, 60000, &err);
	if (code == PSR_OK)
		code = psr_image_write(&frame, argv[3], &err);
	if (code != PSR_OK)
		fprintf(stderr, "shot: %s\n", err.text);
	psr_frame_free(&frame);
	psr_client_close(client);
	return psr_exit_status(code);
}
