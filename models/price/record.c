#include <math.h>
#include <stdlib.h>
#include "base/json.h"
#include "base/outfile.h"
#include "price.h"

int price_open(struct outfile *file, char path[PRICE_PATH], const struct price *price, const char *name,
               struct psr_error *err)
{
	if (snprintf(path, PRICE_PATH, "%s/%s", price->options->out, name) >= PRICE_PATH)
		return psr_fail(err, PSR_ERR_ARG, "--out: the path of the folder is too long");
	return outfile_open(file, path, OUTFILE_PLAIN, err);
}

int price_write_csv(const struct price *price, struct psr_error *err)
{
	char path[PRICE_PATH];
	struct outfile file;
	int code = price_open(&file, path, price, "prices.csv", err);

	if (code != PSR_OK)
		return code;
	fputs("view,kind,knob,setting,choice,ms,ms_low,ms_high,ratio,ratio_low,ratio_high,shadow_ms,rmse,psnr_db,bytes,rounds,"
	      "same\n", file.stream);
	for (uint32_t v = 0; v < price->options->n_views; v++)
		for (uint32_t i = 0; i < price->set.n; i++) {
			const struct ladder_row *row = &price->row[(size_t)v * price->set.n + i];
			const struct price_setting *setting = &price->set.setting[i];

			fprintf(file.stream, "%u,%s,%s,\"%s\",%d,%.6f,%.6f,%.6f,%.4f,%.4f,%.4f,%.6f,%.6f,", v,
			        ladder_kind_name(price->view[v].kind), setting->knob, setting->name, setting->is_choice, row->ms,
			        row->ms_low, row->ms_high, row->ratio, row->ratio_low, row->ratio_high, row->shadow_ms, row->rmse);
			if (row->rmse > 0)
				fprintf(file.stream, "%.4f", ladder_psnr(row->rmse));
			fprintf(file.stream, ",%llu,%u,%d\n", (unsigned long long)row->n_bytes, row->n_rounds, row->is_same);
		}
	return outfile_close(&file, code, err);
}

static cJSON *json_of(const struct price *price, uint32_t i)
{
	const struct price_setting *setting = &price->set.setting[i];
	cJSON *item = cJSON_CreateObject();

	cJSON_AddStringToObject(item, "setting", setting->name);
	cJSON_AddStringToObject(item, "knob", setting->knob);
	cJSON_AddBoolToObject(item, "is_choice", setting->is_choice);
	cJSON_AddBoolToObject(item, "is_unbeaten", price->is_unbeaten[i]);
	cJSON_AddBoolToObject(item, "is_same", price->is_same[i]);
	json_add_number(item, "ms", price->point[i].ms);
	json_add_numbers(item, "ratio", price->ratio[i], 3);
	json_add_number(item, "rmse", price->point[i].rmse);
	for (int k = 0; k < LADDER_N_KINDS; k++) {
		const struct ladder_point *point = &price->of_kind[k][i];
		cJSON *kind;

		if (isnan(point->ms))
			continue;
		kind = cJSON_AddObjectToObject(item, ladder_kind_name((enum ladder_kind)k));
		json_add_number(kind, "ms", point->ms);
		json_add_number(kind, "rmse", point->rmse);
	}
	if (price->bytes[i] > 0)
		json_add_number(item, "bytes", price->bytes[i]);
	return item;
}

int price_write_json(const struct price *price, struct psr_error *err)
{
	const struct price_options *options = price->options;
	cJSON *root = cJSON_CreateObject(), *settings = cJSON_AddArrayToObject(root, "settings");
	char path[PRICE_PATH], *text;
	struct outfile file;
	int code = price_open(&file, path, price, "prices.json", err);

	cJSON_AddNumberToObject(root, "views", options->n_views);
	cJSON_AddNumberToObject(root, "width", options->size[0]);
	cJSON_AddNumberToObject(root, "height", options->size[1]);
	cJSON_AddNumberToObject(root, "resolution", options->resolution);
	cJSON_AddNumberToObject(root, "rounds", options->n_rounds);
	cJSON_AddNumberToObject(root, "seed", (double)options->seed);
	for (uint32_t i = 0; i < price->set.n; i++)
		cJSON_AddItemToArray(settings, json_of(price, i));
	text = json_text(root);
	if (code == PSR_OK && text == NULL)
		code = outfile_close(&file, psr_fail(err, PSR_ERR_MEMORY, "no memory for prices.json"), err);
	else if (code == PSR_OK) {
		fputs(text, file.stream);
		code = outfile_close(&file, PSR_OK, err);
	}
	free(text);
	return code;
}
