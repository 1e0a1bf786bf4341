/* A hash table by open addressing. Entries have one size, and are structs that begin with a 63-bit key. Any number of
 * threads may look entries up while none puts one. */
#ifndef PSR_BASE_TABLE_H
#define PSR_BASE_TABLE_H

#include <stddef.h>
#include <stdint.h>

#define TABLE_FREE UINT64_MAX             /* a place without an entry */
#define TABLE_MARK (UINT64_C(1) << 63)    /* a caller may set it in an entry's key, and table_find() then passes over
                                           * the entry */

struct table {
	size_t n, size; /* entries; places for them, a power of two */
	size_t bytes;   /* of an entry, a multiple of 8 */
	unsigned char *entry;
};

/* Makes a table with `size` places, a power of two. MEMORY; call table_fini() even then. */
int table_init(struct table *table, size_t bytes, size_t size);
void table_fini(struct table *table);

/* Doubles the number of places. MEMORY, and nothing has changed. */
int table_grow(struct table *table);

/* Returns the entry of a key; makes a zeroed one if there is none. Putting may move all entries. NULL: no memory. */
void *table_put(struct table *table, uint64_t key);

/* Returns where the search for a key begins: the last step of MurmurHash3 (Appleby 2011), so that cells in a row
 * spread. */
static inline size_t table_place(uint64_t key, size_t size)
{
	key &= ~TABLE_MARK;
	key ^= key >> 33;
	key *= UINT64_C(0xff51afd7ed558ccd);
	key ^= key >> 33;
	key *= UINT64_C(0xc4ceb9fe1a85ec53);
	key ^= key >> 33;
	return (size_t)key & (size - 1);
}

static inline uint64_t *table_at(const struct table *table, size_t place)
{
	return (uint64_t *)(void *)(table->entry + place * table->bytes);
}

/* Returns the entry of a key, or the free place for it. */
static inline uint64_t *table_search(const struct table *table, uint64_t key)
{
	size_t i = table_place(key, table->size);

	while (*table_at(table, i) != key && *table_at(table, i) != TABLE_FREE)
		i = (i + 1) & (table->size - 1);
	return table_at(table, i);
}

/* Returns the entry of a key, or NULL. */
static inline void *table_find(const struct table *table, uint64_t key)
{
	uint64_t *entry = table_search(table, key);

	return *entry == key ? entry : NULL;
}

#endif
