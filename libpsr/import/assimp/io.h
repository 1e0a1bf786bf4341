/* Files for Assimp: the source from memory, and files in its folder; nothing else can be opened. */
#ifndef PSR_IMPORT_ASSIMP_IO_H
#define PSR_IMPORT_ASSIMP_IO_H

#include <assimp/cfileio.h>
#include <assimp/scene.h>
#include "import/import.h"

struct assimp_io {
	struct aiFileIO io; /* first: callbacks get a pointer to it */
	struct import_mesh *im;
	char *folder;
	char *path; /* the source's name for Assimp: folder, slash, name */
	const uint8_t *bytes;
	size_t n_bytes;
	char **image_path; /* of each image of the mesh, or NULL */
	const struct aiScene *scene; /* set by the reader, which releases it */
};

int assimp_io_init(struct assimp_io *io, struct import_mesh *im, const uint8_t *bytes, size_t n_bytes,
                   struct psr_error *err);
void assimp_io_fini(struct assimp_io *io);

#endif
