#include <string.h>
#include "base/image_module.h"
#include "import/import.h"

struct magic {
	const char *format; /* OpenImageIO's name */
	size_t offset, n;
	const char *bytes;
};

static const struct magic magics[] = {
	{ "png", 0, 8, "\x89PNG\r\n\x1a\n" }, { "jpeg", 0, 3, "\xff\xd8\xff" }, { "gif", 0, 4, "GIF8" },
	{ "webp", 8, 4, "WEBP" },             { "tiff", 0, 4, "II*\0" },        { "tiff", 0, 4, "MM\0*" },
	{ "hdr", 0, 2, "#?" },                { "openexr", 0, 4, "v/1\x01" },   { "psd", 0, 4, "8BPS" },
	{ "dds", 0, 4, "DDS " },              { "bmp", 0, 2, "BM" },            { "pnm", 0, 2, "P3" },
	{ "pnm", 0, 2, "P5" },                { "pnm", 0, 2, "P6" },
};

static const char *format_of(const uint8_t *bytes, size_t n_bytes, const char *name)
{
	for (size_t i = 0; i < sizeof magics / sizeof magics[0]; i++) {
		const struct magic *m = &magics[i];

		if (n_bytes >= m->offset + m->n && memcmp(bytes + m->offset, m->bytes, m->n) == 0)
			return m->format;
	}
	return import_path_ends_with(name, ".tga") ? "targa" : NULL;
}

int import_image_decode(struct psr_image *out, const uint8_t *bytes, size_t n_bytes, const char *name,
                        uint64_t max_pixels, struct psr_error *err)
{
	const char *format = format_of(bytes, n_bytes, name);
	const struct image_module *module;
	char message[PSR_ERROR_TEXT] = "";
	struct psr_error why;
	uint32_t size[2];
	uint8_t *rgba;
	int rc;

	if (format == NULL)
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "%s: not an image in a supported format (PNG, JPEG, WebP, TIFF, TGA, ...)", name);
	if (strcmp(format, "png") == 0 && import_image_plain_png(out, bytes, n_bytes, max_pixels))
		return PSR_OK;
	rc = image_module_open(&module, &why);
	if (rc != PSR_OK)
		return psr_fail(err, rc, "%s: cannot read images: %s", name, why.text);
	rc = module->read(&rgba, size, &(struct image_module_source){ bytes, n_bytes, format, max_pixels }, message,
	                  sizeof message);
	if (rc != PSR_OK)
		return psr_fail(err, rc, "%s: %s", name, message);
	out->width = size[0];
	out->height = size[1];
	out->rgba = rgba;
	return PSR_OK;
}
