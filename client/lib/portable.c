#include "base/netpbm.h"
#include "picture.h"

int picture_write_ppm(struct outfile *file, const struct psr_frame *picture, struct psr_error *err)
{
	(void)err;
	ppm_write(file, picture->rgb, picture->width, picture->height);
	return PSR_OK;
}

int picture_write_pfm(struct outfile *file, const struct psr_frame *picture, struct psr_error *err)
{
	(void)err;
	pfm_write(file, picture->depth, picture->width, picture->height);
	return PSR_OK;
}
