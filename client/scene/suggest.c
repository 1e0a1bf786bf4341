#include "suggest.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "base/cli.h"

/* Allows a third of the letters to differ; fewer in short names, which all resemble each other. */
static size_t most_edits(size_t length)
{
	return length < 3 ? 1 : length < 9 ? 2 : length / 3;
}

const char *suggest_name(const char *name, const char *names, size_t n, size_t stride)
{
	const char *dot = strrchr(name, '.'), *near = NULL;
	size_t length = strlen(name), least = most_edits(length) + 1;

	for (size_t i = 0; i < n; i++) {
		const char *other = names + i * stride;
		size_t distance = psr_edit_distance(name, length, other);

		if (strcasecmp(name, other) == 0
		    || (dot != NULL && strlen(other) == (size_t)(dot - name) && strncasecmp(name, other, strlen(other)) == 0))
			return other;
		if (distance < least && distance < strlen(other)) {
			least = distance;
			near = other;
		}
	}
	return near;
}

int suggest_model(struct psr_client *client, const char *model, int timeout_ms, struct psr_error *err)
{
	struct psr_msg_list_entry *entries = NULL;
	struct psr_error why;
	uint32_t n = 0;

	if (psr_client_list(client, &entries, &n, timeout_ms, &why) == PSR_OK) {
		const char *near = n == 0 ? NULL : suggest_name(model, entries[0].name, n, sizeof *entries);

		if (near != NULL && strcmp(near, model) != 0) /* else a part of the model is missing */
			psr_fail(err, PSR_ERR_NOT_FOUND, "there is no model %.200s; did you mean '%.200s'?", model, near);
	}
	free(entries);
	return PSR_ERR_NOT_FOUND;
}
