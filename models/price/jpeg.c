#include <stdlib.h>
#include <turbojpeg.h>
#include "price.h"

struct jpeg {
	tjhandle encoder, decoder;
	int quality, chroma;
	unsigned char *bytes; /* of what was encoded last */
	unsigned long n_bytes, capacity;
};

static int encode(uint64_t *n_bytes, const uint8_t *rgb, uint32_t width, uint32_t height, void *userdata)
{
	struct jpeg *jpeg = userdata;
	const unsigned long most = tjBufSize((int)width, (int)height, jpeg->chroma);

	if (most > jpeg->capacity) {
		free(jpeg->bytes);
		jpeg->bytes = malloc(most);
		jpeg->capacity = jpeg->bytes != NULL ? most : 0;
	}
	if (jpeg->bytes == NULL)
		return PSR_ERR_MEMORY;
	jpeg->n_bytes = jpeg->capacity;
	if (tjCompress2(jpeg->encoder, rgb, (int)width, 0, (int)height, TJPF_RGB, &jpeg->bytes, &jpeg->n_bytes, jpeg->chroma,
	                jpeg->quality, TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT) != 0)
		return PSR_ERR_INTERNAL;
	*n_bytes = jpeg->n_bytes;
	return PSR_OK;
}

static int decode(uint8_t *rgb, uint32_t width, uint32_t height, void *userdata)
{
	const struct jpeg *jpeg = userdata;

	return tjDecompress2(jpeg->decoder, jpeg->bytes, jpeg->n_bytes, rgb, (int)width, 0, (int)height, TJPF_RGB,
	                     TJFLAG_ACCURATEDCT) == 0 ? PSR_OK : PSR_ERR_INTERNAL;
}

int price_jpeg_open(struct ladder_coder *coder, int quality, int chroma, struct psr_error *err)
{
	struct jpeg *jpeg = calloc(1, sizeof *jpeg);

	*coder = (struct ladder_coder){ encode, decode, jpeg };
	if (jpeg != NULL) {
		jpeg->encoder = tjInitCompress();
		jpeg->decoder = tjInitDecompress();
		jpeg->quality = quality;
		jpeg->chroma = chroma == 1 ? TJSAMP_444 : TJSAMP_420;
	}
	if (jpeg != NULL && jpeg->encoder != NULL && jpeg->decoder != NULL)
		return PSR_OK;
	price_jpeg_close(coder);
	return psr_fail(err, PSR_ERR_MEMORY, "no memory for a JPEG coder");
}

void price_jpeg_close(struct ladder_coder *coder)
{
	struct jpeg *jpeg = coder->userdata;

	if (jpeg == NULL)
		return;
	if (jpeg->encoder != NULL)
		tjDestroy(jpeg->encoder);
	if (jpeg->decoder != NULL)
		tjDestroy(jpeg->decoder);
	free(jpeg->bytes);
	free(jpeg);
	*coder = (struct ladder_coder){ NULL, NULL, NULL };
}
