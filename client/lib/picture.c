#include <string.h>
#include <strings.h>
#include "base/image_module.h"
#include "base/netpbm.h"
#include "base/png.h"
#include "picture.h"

typedef int native_writer(struct outfile *file, const struct psr_frame *picture, struct psr_error *err);

struct plan {
	native_writer *write; /* NULL: the module writes it */
	image_module_write *module_write;
};

static int choose(struct plan *plan, const char *path, int is_depth, struct psr_error *err)
{
	const char *ending = outfile_ending(path);
	const struct image_module *module;
	struct psr_error why;
	char message[256] = "";
	int code;

	memset(plan, 0, sizeof *plan);
	if (strcmp(path, OUTFILE_STDOUT) == 0)
		ending = is_depth ? "pfm" : "png";
	if (ending[0] == '\0')
		return psr_fail(err, PSR_ERR_ARG, "'%.300s' needs an ending that says the format, such as %s", path,
		                is_depth ? ".pfm or .exr" : ".png");
	if (strcasecmp(ending, "png") == 0 || strcasecmp(ending, "ppm") == 0) {
		if (is_depth)
			return psr_fail(err, PSR_ERR_ARG, "'%.300s': .%.10s cannot hold depth, which is float; use .pfm or .exr",
			                path, ending);
		plan->write = strcasecmp(ending, "png") == 0 ? png_write_frame : ppm_write_frame;
		return PSR_OK;
	}
	if (strcasecmp(ending, "pfm") == 0) {
		if (!is_depth)
			return psr_fail(err, PSR_ERR_ARG,
			                "'%.300s': .pfm is written for depth only; use .png, .ppm or .exr for colour", path);
		plan->write = pfm_write_frame;
		return PSR_OK;
	}
	code = image_module_open(&module, &why);
	if (code != PSR_OK)
		return psr_fail(err, code, "only .png, .ppm and .pfm can be written: %s", why.text);
	plan->module_write = module->write;
	if (module->check(ending, is_depth, message, sizeof message) != 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "'%.200s': %s", path, message);
	return PSR_OK;
}

static int write_picture(const struct psr_frame *picture, const char *path, int is_depth, struct psr_error *err)
{
	const struct image_module_picture pixels = { picture->width, picture->height, is_depth,
		                                         is_depth ? (const void *)picture->depth : picture->rgb };
	struct outfile file;
	struct plan plan;
	char message[256] = "";
	int code = choose(&plan, path, is_depth, err);

	if (code == PSR_OK)
		code = outfile_open(&file, path, OUTFILE_PLAIN, err);
	if (code != PSR_OK)
		return code;
	if (plan.write != NULL)
		code = plan.write(&file, picture, err);
	else if (plan.module_write(outfile_name(&file), &pixels, message, sizeof message) != 0)
		code = psr_fail(err, PSR_ERR_IO, "cannot write %.200s: %s", path, message);
	return outfile_close(&file, code, err);
}

int psr_picture_write_color(const struct psr_frame *picture, const char *path, struct psr_error *err)
{
	return write_picture(picture, path, 0, err);
}

int psr_picture_write_depth(const struct psr_frame *picture, const char *path, struct psr_error *err)
{
	return write_picture(picture, path, 1, err);
}

int psr_picture_check_color(const char *path, struct psr_error *err)
{
	struct plan plan;

	return choose(&plan, path, 0, err);
}

int psr_picture_check_depth(const char *path, struct psr_error *err)
{
	struct plan plan;

	return choose(&plan, path, 1, err);
}
