/* Files for Assimp: the source from memory, and what it names from its own folder; nothing else can be opened. */
#ifndef PSR_IMPORT_ASSIMP_IO_H
#define PSR_IMPORT_ASSIMP_IO_H

#include <assimp/cfileio.h>
#include "import/import.h"

struct assimp_io {
	struct aiFileIO io; /* first: Assimp hands a pointer to it back */
	struct import_mesh *im;
	char *folder;
	char *path; /* by which Assimp knows the source: folder, slash, name */
	const uint8_t *bytes;
	size_t n_bytes;
	char **image_path; /* of each image of the mesh; NULL where it has none */
};

int assimp_io_init(struct assimp_io *io, struct import_mesh *im, const uint8_t *bytes, size_t n_bytes,
                   struct psr_error *err);
void assimp_io_fini(struct assimp_io *io);

#endif
