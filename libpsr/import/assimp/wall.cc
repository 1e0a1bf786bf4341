#include <cstdio>
#include <exception>
#include <stdexcept>
#include <assimp/ai_assert.h>
#include <assimp/cimport.h>
#include "wall.h"

/* Debian builds Assimp with assertions that end the process. This function replaces the library's by name, and throws
 * instead; Assimp turns exceptions into failed imports. */
namespace Assimp {

__attribute__((visibility("default"))) void aiAssertViolation(const char *expression, const char *, int)
{
	char text[256];
	std::snprintf(text, sizeof text, "unexpected content (%s)", expression);
	throw std::runtime_error(text);
}

} // namespace Assimp

extern "C" const struct aiScene *assimp_read(const char *path, struct aiFileIO *io, char why[ASSIMP_WHY])
{
	try {
		const aiScene *scene = aiImportFileEx(path, 0, io);
		if (scene == nullptr)
			std::snprintf(why, ASSIMP_WHY, "%s", aiGetErrorString());
		return scene;
	} catch (const std::exception &e) {
		std::snprintf(why, ASSIMP_WHY, "%s", e.what());
	} catch (...) {
		std::snprintf(why, ASSIMP_WHY, "Assimp gives no reason");
	}
	return nullptr;
}
