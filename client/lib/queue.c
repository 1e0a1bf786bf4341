/* Events that came during a short exchange, and wait for psr_client_wait(). */
#include <stdlib.h>
#include <string.h>
#include "internal.h"

static void free_event(struct client_queued *queued)
{
	if (queued == NULL)
		return;
	client_assembly_fini(&queued->done);
	free(queued);
}

int client_queue_event(struct psr_client *client, const struct psr_event *event)
{
	struct client_queued *queued = calloc(1, sizeof *queued), **last = &client->queued;

	if (queued == NULL)
		return client_break(client, PSR_ERR_MEMORY, "no memory for what came during another request");
	queued->event = *event;
	if (event->end != NULL) {
		queued->end = *event->end;
		queued->event.end = &queued->end;
	}
	if (event->type == PSR_EVENT_BEGIN) {
		queued->begin = *event->begin;
		queued->event.begin = &queued->begin;
	}
	if (event->picture == &client->done.picture) { /* in view 0; others are held */
		queued->done = client->done;
		memset(&client->done, 0, sizeof client->done);
		queued->event.picture = &queued->done.picture;
		queued->event.begin = &queued->done.begin;
	}
	while (*last != NULL)
		last = &(*last)->next;
	*last = queued;
	return PSR_OK;
}

int client_take_queued(struct psr_client *client, struct psr_event *event)
{
	struct client_queued *queued = client->queued;

	client_free_given(client);
	if (queued == NULL)
		return 0;
	client->queued = queued->next;
	client->given = queued;
	*event = queued->event;
	return 1;
}

void client_free_given(struct psr_client *client)
{
	free_event(client->given);
	client->given = NULL;
}

void client_free_queued(struct psr_client *client)
{
	client_free_given(client);
	while (client->queued != NULL) {
		struct client_queued *queued = client->queued;

		client->queued = queued->next;
		free_event(queued);
	}
}
