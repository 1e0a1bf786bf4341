#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/direction.h"
#include "octree/attributes.h"
#include "leaves.h"

/* A tree as levels, and attributes of its leaves; `again` is to unpack into. */
struct fixture {
	struct octree_levels levels;
	struct octree *tree;
	struct octree_attributes leaf, again;
	size_t n;
	uint64_t random;
};

static const uint64_t root = 0;

static int put_node(const struct octree_node *node, void *userdata)
{
	struct fixture *f = userdata;
	struct octree_level *level = &f->levels.at[f->levels.height];

	assert_true(octree_level_put(level, f->tree->code[node->code]));
	return 0;
}

static struct octree_attributes allocate(size_t n)
{
	struct octree_attributes a = { calloc(n, 2), calloc(n, 1), calloc(n, 3), calloc(n, 3) };

	assert_true(a.normal != NULL && a.offset != NULL && a.color != NULL && a.material != NULL);
	return a;
}

static void release(struct octree_attributes *a)
{
	free(a->normal);
	free(a->offset);
	free(a->color);
	free(a->material);
}

static void set_up(struct fixture *f, struct leaves leaves, int levels)
{
	*f = (struct fixture){ .tree = leaves_to_tree(&leaves, levels), .levels = { .n_roots = 1, .root = &root },
		                   .random = 1 };
	assert_non_null(f->tree);
	for (; f->levels.height < levels; f->levels.height++)
		octree_walk(f->tree, f->levels.height, put_node, f);
	f->n = f->tree->n_leaves;
	f->leaf = allocate(f->n);
	f->again = allocate(f->n);
	free(leaves.path);
}

static void tear_down(struct fixture *f)
{
	octree_levels_fini(&f->levels);
	octree_destroy(f->tree);
	release(&f->leaf);
	release(&f->again);
}

static void set_anything(struct fixture *f)
{
	for (size_t i = 0; i < f->n; i++) {
		f->leaf.normal[i] = (uint16_t)random_below(&f->random, PSR_DIRECTIONS);
		f->leaf.offset[i] = (uint8_t)random_below(&f->random, OCTREE_OFFSETS);
		for (int c = 0; c < 3; c++) {
			f->leaf.color[i][c] = (uint8_t)random_below(&f->random, 256);
			f->leaf.material[i][c] = (uint8_t)random_below(&f->random, 256);
		}
	}
}

static int set_sphere_leaf(const struct octree_node *node, void *userdata)
{
	struct fixture *f = userdata;
	const double side = (double)(1u << f->tree->levels);
	double center[3], length;
	float v[3];

	octree_center(f->tree, node->path, f->tree->levels, center);
	for (int c = 0; c < 3; c++)
		v[c] = (float)(center[c] - 0.5);
	length = sqrt((double)(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
	f->leaf.normal[node->leaf] = psr_direction_encode(v) & 0x7ffc; /* 13 bits */
	f->leaf.offset[node->leaf] = (uint8_t)octree_offset_step((0.4 - length) * side);
	for (int c = 0; c < 3; c++)
		f->leaf.color[node->leaf][c] =
			(uint8_t)(128 + (int)(100 * sin(9 * center[c])) + (int)random_below(&f->random, 5));
	/* Two halves: rough, and a metal whose roughness goes up along y. */
	octree_put_material(f->leaf.material[node->leaf],
	                    center[0] < 0.5 ? 0xff00c0 : 31 | (uint32_t)(40 + 100 * center[1]) << 16);
	return 0;
}

static void set_sphere(struct fixture *f)
{
	octree_walk(f->tree, f->tree->levels, set_sphere_leaf, f);
}

static struct coder pack(const struct fixture *f, enum octree_stream stream)
{
	struct coder coder;

	coder_begin(&coder);
	assert_int_equal(octree_attributes_pack(&coder, &f->levels, &f->leaf, stream), PSR_OK);
	coder_end(&coder);
	assert_int_equal(coder.has_failed, 0);
	return coder;
}

/* Unpacks from an allocation of exactly n bytes. Returns whether they ended where they should. */
static int unpack(struct fixture *f, const uint8_t *bytes, size_t n, enum octree_stream stream)
{
	uint8_t *exact = malloc(n > 0 ? n : 1);
	struct coder coder;

	assert_non_null(exact);
	memcpy(exact, bytes, n);
	coder_open(&coder, exact, n);
	assert_int_equal(octree_attributes_unpack(&f->again, &coder, &f->levels, stream, 0), PSR_OK);
	free(exact);
	return coder_is_at_end(&coder);
}

static void assert_all_come_back(struct fixture *f, double bits[OCTREE_STREAMS])
{
	for (enum octree_stream stream = 0; stream < OCTREE_STREAMS; stream++) {
		const struct coder coder = pack(f, stream);

		assert_true(unpack(f, coder.bytes, coder.n, stream));
		bits[stream] = 8.0 * (double)coder.n / (double)f->n;
		free(coder.bytes);
	}
	assert_memory_equal(f->leaf.normal, f->again.normal, 2 * f->n);
	assert_memory_equal(f->leaf.offset, f->again.offset, f->n);
	assert_memory_equal(f->leaf.color, f->again.color, 3 * f->n);
	assert_memory_equal(f->leaf.material, f->again.material, 3 * f->n);
}

static void anything_comes_back(void **state)
{
	static const struct {
		int levels;
		size_t n;
	} forms[] = { { 2, 5 }, { 6, 20000 }, { 12, 3000 }, { 20, 1 }, { 20, 1000 } };
	struct fixture f;

	(void)state;
	for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
		double bits[OCTREE_STREAMS];

		set_up(&f, leaves_at_random(forms[i].levels, forms[i].n), forms[i].levels);
		set_anything(&f);
		assert_all_come_back(&f, bits);
		tear_down(&f);
	}
}

/* [B] table 1 has 1.3 to 1.6 bits for offsets, 1.9 to 9.8 for normals. The colours have a noise of 5 values each. */
static void surfaces_pack_well(void **state)
{
	double bits[OCTREE_STREAMS];
	struct fixture f;

	(void)state;
	set_up(&f, leaves_of_sphere(8), 8);
	set_sphere(&f);
	assert_all_come_back(&f, bits);
	print_message("%zu leaves: normals %.2f bits, offsets %.2f, colours %.2f, materials %.2f\n", f.n,
	              bits[OCTREE_NORMAL_STREAM], bits[OCTREE_OFFSET_STREAM], bits[OCTREE_COLOR_STREAM],
	              bits[OCTREE_MATERIAL_STREAM]);
	assert_true(bits[OCTREE_NORMAL_STREAM] < 6 && bits[OCTREE_OFFSET_STREAM] < 1.3);
	assert_true(bits[OCTREE_COLOR_STREAM] < 12);
	/* A step of roughness is 2.56 leaves: of neighbours in a row, one of two differs from the leaf before at most. */
	assert_true(bits[OCTREE_MATERIAL_STREAM] < 2);
	tear_down(&f);
}

static void offsets_come_back_without_normals(void **state)
{
	struct fixture f;
	struct coder coder;
	uint16_t *normal[2];

	(void)state;
	set_up(&f, leaves_of_sphere(5), 5);
	set_sphere(&f);
	normal[0] = f.leaf.normal;
	normal[1] = f.again.normal;
	f.leaf.normal = f.again.normal = NULL;
	coder = pack(&f, OCTREE_OFFSET_STREAM);
	assert_true(unpack(&f, coder.bytes, coder.n, OCTREE_OFFSET_STREAM));
	assert_memory_equal(f.leaf.offset, f.again.offset, f.n);
	free(coder.bytes);
	f.leaf.normal = normal[0];
	f.again.normal = normal[1];
	tear_down(&f);
}

static void any_bytes_give_values_in_range(void **state)
{
	struct fixture f;

	(void)state;
	set_up(&f, leaves_at_random(5, 2000), 5);
	for (int i = 0; i < 200; i++) {
		uint8_t bytes[64];
		const size_t n = (size_t)random_below(&f.random, sizeof bytes + 1);

		for (size_t k = 0; k < n; k++)
			bytes[k] = (uint8_t)random_below(&f.random, 256);
		for (enum octree_stream stream = 0; stream < OCTREE_STREAMS; stream++)
			unpack(&f, bytes, n, stream);
		for (size_t k = 0; k < f.n; k++)
			assert_true(f.again.normal[k] < PSR_DIRECTIONS && f.again.offset[k] < OCTREE_OFFSETS);
	}
	tear_down(&f);
}

static void what_is_cut_short_or_longer_is_noticed(void **state)
{
	struct fixture f;

	(void)state;
	set_up(&f, leaves_at_random(4, 300), 4);
	set_anything(&f);
	for (enum octree_stream stream = 0; stream < OCTREE_STREAMS; stream++) {
		struct coder coder = pack(&f, stream);
		uint8_t *longer = calloc(1, coder.n + 1);

		assert_non_null(longer);
		memcpy(longer, coder.bytes, coder.n);
		for (size_t n = 0; n < coder.n; n += n < 8 || n + 8 > coder.n ? 1 : 7)
			assert_false(unpack(&f, longer, n, stream));
		assert_false(unpack(&f, longer, coder.n + 1, stream));
		assert_true(unpack(&f, longer, coder.n, stream));
		free(longer);
		free(coder.bytes);
	}
	tear_down(&f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(anything_comes_back),
		cmocka_unit_test(surfaces_pack_well),
		cmocka_unit_test(offsets_come_back_without_normals),
		cmocka_unit_test(any_bytes_give_values_in_range),
		cmocka_unit_test(what_is_cut_short_or_longer_is_noticed),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
