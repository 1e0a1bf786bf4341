/* What is asked about an IGES file before Open CASCADE reads it. */
#ifndef PSR_IMPORT_CAD_IGES_H
#define PSR_IMPORT_CAD_IGES_H

#include "import/import.h"

int import_iges_is(const uint8_t *bytes, size_t n_bytes);

/* FORMAT, if lines are missing, or if an entity tells more parts than it has parameters: Open CASCADE makes room for
 * them, and looks for each. */
int import_iges_check(const struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);

#endif
