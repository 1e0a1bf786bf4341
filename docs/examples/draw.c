/* draw MODEL.psr PICTURE.png: draws a whole model on this machine.
 * cc draw.c $(pkg-config --cflags --libs psr) -o draw */
#include <stdio.h>
#include <psr/shot.h>

int main(int argc, char **argv)
{
	struct psr_model *model = NULL;
	struct psr_frame frame = { 0 };
	struct psr_shot shot;
	struct psr_error err = { 0 };

	psr_shot_default(&shot, 640, 480);
	if (argc != 3)
		psr_fail(&err, PSR_ERR_ARG, "usage: draw MODEL.psr PICTURE.png");
	else if (psr_model_map(&model, argv[1], &err) == PSR_OK && psr_shot_draw(&shot, model, &frame, &err) == PSR_OK)
		psr_image_write(&frame, argv[2], &err);
	if (err.code != PSR_OK)
		fprintf(stderr, "%s\n", err.text);
	psr_frame_free(&frame);
	psr_model_unref(model);
	return psr_exit_status(err.code);
}
