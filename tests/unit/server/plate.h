/* For tests of a psrd that serves plate.psr from a folder of its own. */
#ifndef SERVER_PLATE_H
#define SERVER_PLATE_H

#include "fixture.h"

static char folder[PATH_MAX];

static int set_up(void **state)
{
	(void)state;
	folder_make(folder);
	plate_write(folder, "plate.psr", 0x2040c0);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	folder_remove(folder);
	return 0;
}

#endif
