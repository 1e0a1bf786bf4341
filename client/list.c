#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "preset.h"

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

static void print_presets(const struct psr_msg_preset *presets, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++)
		printf("%-6s  %-12s  %s\n", presets[i].kind == PSR_WIRE_PRESET_CAMERA ? "camera" : "light",
		       preset_type(&presets[i]), presets[i].name);
}

static cJSON *presets_json(const struct psr_msg_preset *presets, uint32_t n)
{
	cJSON *all = cJSON_CreateArray();

	for (uint32_t i = 0; i < n; i++) {
		cJSON *one = cJSON_CreateObject();

		cJSON_AddStringToObject(one, "kind", presets[i].kind == PSR_WIRE_PRESET_CAMERA ? "camera" : "light");
		cJSON_AddStringToObject(one, "type", preset_type(&presets[i]));
		cJSON_AddStringToObject(one, "name", presets[i].name);
		cJSON_AddItemToArray(all, one);
	}
	return all;
}

static int list_presets(struct psr_client *client, const char *model, int json, int timeout_ms, struct psr_error *err)
{
	struct psr_progress_line line = { 0 };
	struct psr_msg_preset *presets = NULL;
	struct psr_msg_opened opened;
	uint32_t n = 0;
	int code = psr_client_open(client, model, psr_progress_draw, &line, timeout_ms, &opened, err);

	psr_progress_end(&line);
	if (code == PSR_OK)
		code = psr_client_presets(client, opened.handle, &presets, &n, timeout_ms, err);
	if (code == PSR_OK && json) {
		code = psr_print_json(presets_json(presets, n), err);
	} else if (code == PSR_OK) {
		print_presets(presets, n);
		code = psr_flush_output(err);
	}
	free(presets);
	return code;
}

static int list_models(struct psr_client *client, int json, int timeout_ms, struct psr_error *err)
{
	struct psr_msg_list_entry *entries = NULL;
	uint32_t n = 0;
	int code = psr_client_list(client, &entries, &n, timeout_ms, err);

	if (code == PSR_OK)
		code = json ? print_json(entries, n, err) : print_table(entries, n, err);
	free(entries);
	return code;
}

int psr_list_main(int argc, char **argv)
{
	const char *server = psr_default_server(), *model = NULL;
	int64_t timeout = PSR_DEFAULT_TIMEOUT;
	int json = 0, code;
	const struct psr_opt opts[] = {
		PSR_OPT_SERVER(server),
		{ "json", 0, PSR_OPT_FLAG, &json, NULL,
		  "Print an array of objects: name, state, bytes, content_id; of presets: kind, type, name.", 0, 0, NULL,
		  NULL },
		{ "presets", 'p', PSR_OPT_STRING, &model, "NAME",
		  "Instead, the cameras and lights that came with this model, which is opened for it.", 0, 0, NULL, NULL },
		PSR_OPT_TIMEOUT(timeout),
		{ NULL, 0, PSR_OPT_FLAG, NULL, NULL, NULL, 0, 0, NULL, NULL },
	};
	const struct psr_cli cli = {
		"psr list [--server ADDR] [--presets NAME] [--json]",
		"Lists the models of a server: ready (a model file), loaded (in the server's memory), source (built when it is "
		"first opened), failed (opening it says why).",
		opts,
		PSR_EXIT_CODES,
	};
	struct psr_client *client = NULL;
	struct psr_error err;

	code = psr_cli_parse(&cli, argc, argv, NULL, &err);
	if (code > 0)
		return 0;
	if (code == PSR_OK)
		code = psr_client_connect(&client, server, PSR_PROGRAM, model, (int)timeout * 1000, &err);
	if (code == PSR_OK)
		code = model != NULL ? list_presets(client, model, json, (int)timeout * 1000, &err)
		                     : list_models(client, json, (int)timeout * 1000, &err);
	psr_client_close(client);
	return code == PSR_OK ? 0 : psr_cli_fail("psr list", &err);
}
