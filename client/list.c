#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/json.h"
#include "base/outfile.h"
#include "client/cli/cli.h"
#include "client/scene/preset.h"
#include "commands.h"

static const char *state_name(uint8_t state)
{
	static const char *const names[] = { "?", "ready", "loaded", "source", "failed" };

	return names[state < sizeof names / sizeof names[0] ? state : 0];
}

/* Fills in why[i] for each model that failed; the others keep "". */
static int find_reasons(char (*why)[PSR_ERROR_TEXT], struct psr_msg_list_entry *entries, uint32_t n,
                        struct psr_client *client, int timeout_ms, struct psr_error *err)
{
	for (uint32_t i = 0; i < n; i++) {
		struct psr_msg_opened opened;
		int code;

		if (entries[i].state != PSR_ENTRY_FAILED)
			continue;
		code = psr_client_open(client, entries[i].name, timeout_ms, &opened, err);
		if (code == PSR_OK)
			entries[i].state = PSR_ENTRY_LOADED; /* it works again */
		else if (code == PSR_ERR_CONNECTION || code == PSR_ERR_PROTOCOL)
			return code;
		else
			snprintf(why[i], sizeof why[i], "%s", err->text);
	}
	return PSR_OK;
}

static int print_table(const struct psr_msg_list_entry *entries, char (*why)[PSR_ERROR_TEXT], uint32_t n,
                       struct psr_error *err)
{
	int width = 4;

	for (uint32_t i = 0; i < n; i++)
		if ((int)strlen(entries[i].name) > width)
			width = (int)strlen(entries[i].name);
	printf("%-*s  %-6s  %10s\n", width, "name", "state", "MB");
	for (uint32_t i = 0; i < n; i++)
		printf("%-*s  %-6s  %10.2f%s%s\n", width, entries[i].name, state_name(entries[i].state),
		       (double)entries[i].file_bytes / 1e6, why[i][0] != '\0' ? "  " : "", why[i]);
	return outfile_flush_stdout(err);
}

static int print_json(const struct psr_msg_list_entry *entries, char (*why)[PSR_ERROR_TEXT], uint32_t n,
                      struct psr_error *err)
{
	cJSON *all = cJSON_CreateArray();

	for (uint32_t i = 0; i < n; i++) {
		cJSON *one = cJSON_CreateObject();
		char id[JSON_ID_TEXT];

		cJSON_AddStringToObject(one, "name", entries[i].name);
		cJSON_AddStringToObject(one, "state", state_name(entries[i].state));
		cJSON_AddNumberToObject(one, "bytes", (double)entries[i].file_bytes);
		cJSON_AddStringToObject(one, "content_id", json_id(id, entries[i].content_id));
		if (why[i][0] != '\0')
			cJSON_AddStringToObject(one, "error", why[i]);
		cJSON_AddItemToArray(all, one);
	}
	return json_print(all, err);
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
	int code;

	psr_client_on_progress(client, psr_progress_draw, &line);
	code = psr_client_open(client, model, timeout_ms, &opened, err);
	psr_client_on_progress(client, NULL, NULL);
	psr_progress_end(&line);
	if (code == PSR_OK)
		code = psr_client_presets(client, opened.handle, &presets, &n, timeout_ms, err);
	if (code == PSR_OK && json) {
		code = json_print(presets_json(presets, n), err);
	} else if (code == PSR_OK) {
		print_presets(presets, n);
		code = outfile_flush_stdout(err);
	}
	free(presets);
	return code;
}

static int list_models(struct psr_client *client, int json, int timeout_ms, struct psr_error *err)
{
	struct psr_msg_list_entry *entries = NULL;
	char (*why)[PSR_ERROR_TEXT] = NULL;
	uint32_t n = 0;
	int code = psr_client_list(client, &entries, &n, timeout_ms, err);

	if (code == PSR_OK && (why = calloc(n + 1, sizeof *why)) == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for a list of %u models", n);
	if (code == PSR_OK)
		code = find_reasons(why, entries, n, client, timeout_ms, err);
	if (code == PSR_OK)
		code = json ? print_json(entries, why, n, err) : print_table(entries, why, n, err);
	free(entries);
	free(why);
	return code;
}

int psr_list_main(int argc, char **argv)
{
	const char *server = psr_default_server(), *model = NULL;
	int64_t timeout = PSR_DEFAULT_TIMEOUT;
	int json = 0, code;
	const struct psr_opt opts[] = {
		PSR_OPT_SERVER(server),
		{ .name = "json", .type = PSR_OPT_FLAG, .value = &json,
		  .help = "For scripts: an array of objects with name, state, bytes, content_id and, of a failed model, error; of "
		          "presets with kind, type and name." },
		{ .name = "presets", .letter = 'p', .type = PSR_OPT_STRING, .value = &model, .arg = "NAME",
		  .words = "@models",
		  .help = "Instead of models, the cameras and lights in the file of this one, for --camera and --light "
		          "preset:NAME." },
		PSR_OPT_TIMEOUT(timeout),
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr list [--server ADDR] [--presets NAME] [--json]",
		.summary = "Lists the models of a server: ready (a model file), loaded (in the server's memory), source "
		           "(built when a picture first asks for it), failed (cannot be served; the reason stands beside it).",
		.opts = opts,
		.footer = PSR_EXIT_CODES,
	};
	struct psr_client *client = NULL;
	struct psr_error err;

	code = psr_command_parse("list", &cli, argc, argv, NULL, &err);
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
