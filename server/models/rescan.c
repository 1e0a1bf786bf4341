#include "rescan.h"

#include <stdlib.h>
#include "server/log.h"

struct scan {
	struct rescan *rescan;
	struct loop_note note;
	struct catalogue_listing *listing;
	struct psr_error error;
	int code;
};

static void on_scanned(void *userdata)
{
	struct scan *scan = userdata;
	struct rescan *rescan = scan->rescan;

	rescan->is_running = 0;
	if (scan->code != PSR_OK) {
		log_warn("the models folder was not read again: %s", scan->error.text);
	} else {
		catalogue_adopt(rescan->catalogue, scan->listing);
		log_info("models folder read again: %zu models", rescan->catalogue->n);
	}
	free(scan);
	if (rescan->must_run_again) {
		rescan->must_run_again = 0;
		rescan_start(rescan);
	}
}

static void scan_job(void *userdata)
{
	struct scan *scan = userdata;

	scan->code = catalogue_scan(&scan->listing, scan->rescan->models, &scan->error);
	scan->note = (struct loop_note){ .fn = on_scanned, .userdata = scan };
	loop_post(scan->rescan->loop, &scan->note);
}

void rescan_start(struct rescan *rescan)
{
	struct scan *scan;

	if (rescan->is_running) {
		rescan->must_run_again = 1;
		return;
	}
	scan = calloc(1, sizeof *scan);
	if (scan != NULL)
		scan->rescan = rescan;
	if (scan == NULL || psr_pool_submit(rescan->io, &(struct pool_job){ .fn = scan_job, .userdata = scan }) != PSR_OK) {
		free(scan);
		log_warn("no memory to read the models folder again");
		return;
	}
	rescan->is_running = 1;
}
