#include <stdlib.h>
#include "handles.h"

int handles_init(struct handles *handles, struct catalogue *catalogue, uint32_t max)
{
	*handles = (struct handles){ .catalogue = catalogue, .max = max };
	handles->handle = calloc(max, sizeof *handles->handle);
	return handles->handle != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

void handles_fini(struct handles *handles)
{
	for (uint32_t i = 0; i < handles->n; i++)
		catalogue_unref(handles->catalogue, handles->handle[i].model);
	free(handles->handle);
}

static struct handle *find(const struct handles *handles, uint32_t number)
{
	for (uint32_t i = 0; i < handles->n; i++)
		if (handles->handle[i].number == number)
			return &handles->handle[i];
	return NULL;
}

struct catalogue_model *handles_find(const struct handles *handles, uint32_t number)
{
	const struct handle *handle = find(handles, number);

	return handle != NULL ? handle->model : NULL;
}

uint32_t handles_next(const struct handles *handles)
{
	return handles->n < handles->max && handles->last < UINT32_MAX ? handles->last + 1 : 0;
}

void handles_add(struct handles *handles, struct catalogue_model *model)
{
	handles->handle[handles->n++] = (struct handle){ .number = ++handles->last,
		                                             .model = catalogue_ref(handles->catalogue, model) };
}

int handles_close(struct handles *handles, uint32_t number)
{
	struct handle *handle = find(handles, number);

	if (handle == NULL)
		return 0;
	catalogue_unref(handles->catalogue, handle->model);
	*handle = handles->handle[--handles->n];
	return 1;
}
