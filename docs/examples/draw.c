/* draw MODEL.psr PICTURE.png: draws a model on this machine.
 * cc draw.c $(pkg-config --cflags --libs psr) -o draw */
#include <stdio.h>
#include <psr/shot.h>

int main(int argc, char **argv)
{
	struct psr_model *model = NULL;
	struct psr_frame frame = { 0 };
	struct psr_shot shot;
	struct psr_error err;
	int code;

	psr_shot_default(&shot, 640, 480);
	code = psr_model_map(&model, argc == 3 ? argv[1] : "", &err);
	if (code == PSR_OK)
		code = psr_shot_draw(&shot, model, &frame, &err);
	if (code == PSR_OK)
		code = psr_image_write(&frame, argv[2], &err);
	if (code != PSR_OK)
		fprintf(stderr, "draw: %s\n", err.text);
	psr_frame_free(&frame);
	psr_model_unref(model);
	return psr_exit_status(code);
}
