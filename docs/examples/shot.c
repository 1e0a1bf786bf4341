/* shot ADDRESS MODEL PICTURE.png: has psrd draw a whole model of its folder.
 * cc shot.c $(pkg-config --cflags --libs psr-client) -o shot */
#include <stdio.h>
#include <psr/client.h>

int main(int argc, char **argv)
{
	struct psr_client *client = NULL;
	struct psr_frame frame = { 0 };
	struct psr_shot shot;
	struct psr_error err = { 0 };

	psr_shot_default(&shot, 640, 480);
	if (argc != 4)
		psr_fail(&err, PSR_ERR_ARG, "usage: shot HOST:PORT MODEL PICTURE.png");
	else if (psr_client_connect(&client, argv[1], "shot 1.0", argv[2], 5000, &err) == PSR_OK &&
	         psr_client_draw(client, argv[2], &shot, &frame, 60000, &err) == PSR_OK)
		psr_image_write(&frame, argv[3], &err);
	if (err.code != PSR_OK)
		fprintf(stderr, "%s\n", err.text);
	psr_frame_free(&frame);
	psr_client_close(client);
	return psr_exit_status(err.code);
}
