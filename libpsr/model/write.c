#include "base/mem.h"
#include "base/outfile.h"
#include "file.h"
#include "pack.h"

int psr_model_write(const struct psr_model *model, const char *path, struct psr_error *err)
{
	size_t n_bytes;
	const uint8_t *bytes = model_image(model, &n_bytes);

	return outfile_save(path, OUTFILE_DURABLE, bytes, n_bytes, err);
}

/* The file is opened before the work that goes into it. */
int psr_model_write_packed(const struct psr_model *model, const char *path, struct psr_error *err)
{
	size_t n_image, n_bytes, capacity;
	const uint8_t *image = model_image(model, &n_image);
	struct outfile file;
	uint8_t *bytes;
	int code = outfile_open(&file, path, OUTFILE_DURABLE, err);

	if (code != PSR_OK)
		return code;
	code = pack_image(&bytes, &n_bytes, &capacity, image, n_image, err);
	if (code == PSR_OK) {
		outfile_write(&file, bytes, n_bytes);
		psr_free_huge(bytes, capacity);
	}
	return outfile_close(&file, code, err);
}
