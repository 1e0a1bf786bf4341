#include <string.h>
#include "mem.h"
#include "psr/error.h"
#include "table.h"

static int make_places(struct table *table, size_t size)
{
	table->entry = psr_alloc_array(size, table->bytes);
	if (table->entry == NULL)
		return PSR_ERR_MEMORY;
	table->size = size;
	memset(table->entry, 0xff, size * table->bytes);
	return PSR_OK;
}

int table_init(struct table *table, size_t bytes, size_t size)
{
	*table = (struct table){ .bytes = bytes };
	return make_places(table, size);
}

void table_fini(struct table *table)
{
	psr_free(table->entry);
	*table = (struct table){ 0 };
}

int table_grow(struct table *table)
{
	struct table old = *table;

	if (make_places(table, 2 * old.size) != PSR_OK) {
		*table = old;
		return PSR_ERR_MEMORY;
	}
	for (size_t i = 0; i < old.size; i++)
		if (*table_at(&old, i) != TABLE_FREE)
			memcpy(table_search(table, *table_at(&old, i)), table_at(&old, i), table->bytes);
	psr_free(old.entry);
	return PSR_OK;
}

void *table_put(struct table *table, uint64_t key)
{
	uint64_t *entry = table_search(table, key);

	if (*entry == key)
		return entry;
	if (4 * table->n >= 3 * table->size) {
		if (table_grow(table) != PSR_OK)
			return NULL;
		entry = table_search(table, key);
	}
	table->n++;
	memset(entry, 0, table->bytes);
	*entry = key;
	return entry;
}
