#include "html.h"
#include <stdlib.h>
#include "png.h"

void html_escape(FILE *to, const char *text)
{
	for (; *text != '\0'; text++) {
		if (*text == '<')
			fputs("&lt;", to);
		else if (*text == '>')
			fputs("&gt;", to);
		else if (*text == '&')
			fputs("&amp;", to);
		else if (*text == '"')
			fputs("&quot;", to);
		else
			putc((unsigned char)*text < ' ' || *text == '\x7f' ? '?' : *text, to);
	}
}

static void write_memory(png_structp png, png_bytep data, size_t n)
{
	if (fwrite(data, 1, n, png_get_io_ptr(png)) != n)
		png_error(png, "no memory");
}

void html_base64(FILE *to, const uint8_t *bytes, size_t n)
{
	static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

	for (size_t i = 0; i < n; i += 3) {
		const uint32_t three =
			(uint32_t)bytes[i] << 16 | (i + 1 < n ? (uint32_t)bytes[i + 1] << 8 : 0) | (i + 2 < n ? bytes[i + 2] : 0);

		for (size_t k = 0; k < 4; k++)
			putc(i + k <= n ? digits[three >> (18 - 6 * k) & 63] : '=', to);
	}
}

int html_image(FILE *to, const struct psr_frame *picture, uint32_t factor, struct psr_error *err)
{
	char *png = NULL;
	size_t n = 0;
	FILE *memory = open_memstream(&png, &n);
	int code = memory != NULL ? png_encode(memory, write_memory, picture, err) : PSR_ERR_MEMORY;

	if (memory != NULL && fclose(memory) != 0)
		code = PSR_ERR_MEMORY;
	if (code == PSR_OK) {
		fprintf(to, "<img width=\"%u\" height=\"%u\" alt=\"\" src=\"data:image/png;base64,", picture->width * factor,
		        picture->height * factor);
		html_base64(to, (const uint8_t *)png, n);
		fputs("\">", to);
	}
	free(png);
	return code == PSR_OK ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory for a picture of the page");
}
