#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "psr.h"

static const char *state_name(uint8_t state)
{
	static const char *const names[] = { "?", "ready", "loaded", "source", "failed" };

	return names[state < sizeof names / sizeof names[0] ? state : 0];
}

static int print_table(const struct psr_msg_list_entry *entries, uint32_t n, struct psr_error *err)
{
	int width = 4;

	for (uint32_t i = 0; i < n; i++)
		if ((int)strlen(entries[i].name) > width)
			width = (int)strlen(entries[i].name);
	printf("%-*s  %-6s  %10s\n", width, "name", "state", "MB");
	for (uint32_t i = 0; i < n; i++)
		printf("%-*s  %-6s  %10.2f\n", width, entries[i].name, state_name(entries[i].state),
		       (double)entries[i].file_bytes / 1e6);
	return psr_flush_output(err);
}

static int print_json(const struct psr_msg_list_entry *entries, uint32_t n, struct psr_error *err)
{
	cJSON *all = cJSON_CreateArray();

	for (uint32_t i = 0; i < n; i++) {
		cJSON *one = cJSON_CreateObject();
		char id[33];

		for (int k = 0; k < 16; k++)
			snprintf(id + 2 * k, 3, "%02x", entries[i].content_id[k]);
		cJSON_AddStringToObject(one, "name", entries[i].name);
		cJSON_AddStringToObject(one, "state", state_name(entries[i].state));
		cJSON_AddNumberToObject(one, "bytes", (double)entries[i].file_bytes);
		cJSON_AddStringToObject(one, "content_id", id);
		cJSON_AddItemToArray(all, one);
	}
	return psr_print_json(all, err);
}

int psr_list_main(int argc, char **argv)
{
	const char *server = psr_default_server();
	int64_t timeout = PSR_DEFAULT_TIMEOUT;
	int json = 0, code;
	const struct psr_opt opts[] = {
		PSR_OPT_SERVER(server),
		{ "json", 0, PSR_OPT_FLAG, &json, NULL, "Print an array of objects: name, state, bytes, content_id.", 0, 0,
		  NULL, NULL },
		PSR_OPT_TIMEOUT(timeout),
		{ NULL, 0, PSR_OPT_FLAG, NULL, NULL, NULL, 0, 0, NULL, NULL },
	};
	const struct psr_cli cli = {
		"psr list [--server ADDR] [--json]",
		"Lists the models of a server: ready (a model file), loaded (in the server's memory), source (built when it is "
		"first opened), failed (opening it says why).",
		opts,
		PSR_EXIT_CODES,
	};
	struct psr_msg_list_entry *entries = NULL;
	struct psr_client *client = NULL;
	struct psr_error err;
	uint32_t n = 0;

	code = psr_cli_parse(&cli, argc, argv, NULL, &err);
	if (code > 0)
		return 0;
	if (code == PSR_OK)
		code = psr_client_connect(&client, server, PSR_PROGRAM, NULL, (int)timeout * 1000, &err);
	if (code == PSR_OK)
		code = psr_client_list(client, &entries, &n, (int)timeout * 1000, &err);
	if (code == PSR_OK)
		code = json ? print_json(entries, n, &err) : print_table(entries, n, &err);
	free(entries);
	psr_client_close(client);
	return code == PSR_OK ? 0 : psr_cli_fail("psr list", &err);
}
