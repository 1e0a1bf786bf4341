#include "optlist.h"
#include <assert.h>
#include <string.h>

void optlist_add(struct optlist *list, const struct psr_opt *opts, int n)
{
	assert(list->n + n <= OPTLIST_MAX);
	memcpy(list->opt + list->n, opts, (size_t)n * sizeof *opts);
	list->n += n;
}

void optlist_heading(struct optlist *list, const char *heading, const char *text)
{
	const struct psr_opt opt = { .name = heading, .type = PSR_OPT_HEADING, .help = text };

	optlist_add(list, &opt, 1);
}
