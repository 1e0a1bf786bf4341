/* Reading the models folder again, while psrd serves: models that came are served from then on. */
#ifndef PSR_SERVER_MODELS_RESCAN_H
#define PSR_SERVER_MODELS_RESCAN_H

#include "server/models/catalogue.h"
#include "server/net/loop.h"

struct rescan {
	struct loop *loop;
	struct psr_pool *io;
	struct catalogue *catalogue;
	const char *models; /* the folder */
	int is_running, must_run_again;
};

/* Reads the folder in a thread of io, and adopts it in the loop's. A call while it runs has it run once more. A failure
 * is logged, and the catalogue stays as it is. */
void rescan_start(struct rescan *rescan);

#endif
