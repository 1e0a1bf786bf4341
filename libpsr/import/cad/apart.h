/* The CAD module in a process of its own, which may crash. */
#ifndef PSR_IMPORT_CAD_APART_H
#define PSR_IMPORT_CAD_APART_H

#include "base/cad_module.h"

/* module->read() in a child of the process, which ends with it; *report is what the source has none of. FORMAT, if the
 * child crashes, too; then `message` says by what, and while it does what. Any other end by a signal, as by a limit, is
 * this process's, too. MEMORY, IO. */
int import_cad_apart(struct cad_module_mesh **out, struct cad_module_report *report, const struct cad_module *module,
                     const struct cad_module_source *source, char *message, unsigned message_size);

#endif
