/* A bumpy ball of a million triangles, in the formats that scans come in. */
#ifndef TESTS_BENCH_FIRST_MESH_H
#define TESTS_BENCH_FIRST_MESH_H

#include <stddef.h>
#include "psr/error.h"

#define FIRST_MESH_FORMATS 5 /* PLY as text and binary, OBJ, STL, GLB */

/* Writes it to the folder; path, of n bytes, gets the file's. IO. */
int first_mesh_write(char *path, size_t n, const char *folder, int format, struct psr_error *err);

#endif
