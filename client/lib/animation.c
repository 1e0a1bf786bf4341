#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "base/image_module.h"
#include "picture.h"

struct psr_animation {
	struct outfile file;
	struct apng *apng;                 /* NULL: the module writes the file */
	const struct image_module *module;
	void *module_animation;
};

/* Opens the image module if the file needs it; else leaves *module NULL. */
static int choose(const struct image_module **module, const char *path, struct psr_error *err)
{
	const char *ending = outfile_ending(path);
	struct psr_error why;
	char message[256] = "";
	int code;

	*module = NULL;
	if (strcmp(path, OUTFILE_STDOUT) == 0 || strcasecmp(ending, "png") == 0 || strcasecmp(ending, "apng") == 0)
		return PSR_OK;
	if (ending[0] == '\0')
		return psr_fail(err, PSR_ERR_ARG,
		                "'%.300s' needs an ending that says the format of the animation: .png or .gif", path);
	code = image_module_open(module, &why);
	if (code != PSR_OK)
		return psr_fail(err, code, "only .png is written as an animation: %s", why.text);
	if ((*module)->animation_check(ending, message, sizeof message) != 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "'%.200s': %s", path, message);
	return PSR_OK;
}

int psr_animation_check(const char *path, struct psr_error *err)
{
	const struct image_module *module;

	return choose(&module, path, err);
}

int psr_animation_open(struct psr_animation **out, const char *path, const struct psr_frame *first, uint32_t n_frames,
                       double seconds, struct psr_error *err)
{
	const struct image_module_film film = { first->width, first->height, n_frames, seconds };
	struct psr_animation *animation = calloc(1, sizeof *animation);
	char message[256] = "";
	int code;

	if (animation == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for an animation");
	code = choose(&animation->module, path, err);
	if (code == PSR_OK)
		code = outfile_open(&animation->file, path, OUTFILE_PLAIN, err);
	if (code != PSR_OK) {
		free(animation);
		return code;
	}
	if (animation->module == NULL)
		code = apng_open(&animation->apng, &animation->file, first, n_frames, seconds, err);
	else if (animation->module->animation_open(&animation->module_animation, outfile_name(&animation->file),
	                                           &film, message, sizeof message)
	         != 0)
		code = psr_fail(err, PSR_ERR_IO, "cannot write %.200s: %s", path, message);
	if (code != PSR_OK) {
		outfile_close(&animation->file, code, NULL);
		free(animation);
		return code;
	}
	*out = animation;
	return PSR_OK;
}

int psr_animation_add(struct psr_animation *animation, const struct psr_frame *picture, struct psr_error *err)
{
	char message[256] = "";

	if (animation->module == NULL)
		return apng_add(animation->apng, picture, err);
	if (animation->module->animation_add(animation->module_animation, picture->rgb, message, sizeof message) != 0)
		return psr_fail(err, PSR_ERR_IO, "cannot write %.200s: %s", animation->file.path, message);
	return PSR_OK;
}

int psr_animation_close(struct psr_animation *animation, int code, struct psr_error *err)
{
	char message[256] = "";
	struct psr_error why;
	int ended = PSR_OK;

	if (animation == NULL)
		return code;
	if (animation->module == NULL)
		ended = apng_close(animation->apng, code == PSR_OK, &why);
	else if (animation->module->animation_close(animation->module_animation, message, sizeof message) != 0)
		ended = psr_fail(&why, PSR_ERR_IO, "cannot write %.200s: %s", animation->file.path, message);
	if (code == PSR_OK && ended != PSR_OK)
		code = psr_fail(err, ended, "%s", why.text);
	code = outfile_close(&animation->file, code, err);
	free(animation);
	return code;
}
