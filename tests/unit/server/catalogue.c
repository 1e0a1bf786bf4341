/* The catalogue: names, conflicts, changes of the folder, memory; and the keys of built models. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "server/models/cachekey.h"
#include "server/models/catalogue.h"
#include "fixture.h"

static char folder[PATH_MAX];
static struct catalogue catalogue;

static int set_up(void **state)
{
	(void)state;
	folder_make(folder);
	catalogue_init(&catalogue, 1 << 30);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	catalogue_fini(&catalogue);
	folder_remove(folder);
	return 0;
}

static void make(const char *name)
{
	file_write(folder, name, "x", 1);
}

static void make_folder(const char *name)
{
	char path[2 * PATH_MAX];

	snprintf(path, sizeof path, "%s/%s", folder, name);
	assert_int_equal(mkdir(path, 0700), 0);
}

static void scan(void)
{
	struct catalogue_listing *listing;
	struct psr_error error;

	assert_int_equal(catalogue_scan(&listing, folder, &error), PSR_OK);
	catalogue_adopt(&catalogue, listing);
}

static void expect_path(const char *name, const char *ending)
{
	struct catalogue_entry *entry = catalogue_find(&catalogue, name);

	assert_non_null(entry);
	assert_string_equal(entry->file.path + strlen(folder) + 1, ending);
}

static void expect_reason(const char *name, const char *part)
{
	struct catalogue_entry *entry = catalogue_find(&catalogue, name);

	assert_non_null(entry);
	assert_true(entry->has_failed);
	assert_non_null(entry->file.reason);
	if (strstr(entry->file.reason, part) == NULL)
		fail_msg("'%s' does not say '%s'", entry->file.reason, part);
}

/* Puts a model into the catalogue as if it had been read; the caller is its one user. */
static struct catalogue_model *load_at(const char *name, uint32_t resolution)
{
	struct catalogue_model *model;
	struct psr_model *plate = plate_create(0);
	uint64_t bytes = psr_model_bytes(plate);

	assert_int_equal(catalogue_reserve(&catalogue, bytes, name, NULL), PSR_OK);
	assert_int_equal(catalogue_add(&model, &catalogue,
	                               &(struct catalogue_loaded){ .entry = catalogue_find(&catalogue, name), .model = plate,
	                                                           .key = "", .resolution = resolution, .reserved = bytes }),
	                 PSR_OK);
	return model;
}

static struct catalogue_model *load(const char *name)
{
	return load_at(name, 0);
}

static void names_are_stems_and_the_psr_wins(void **state)
{
	(void)state;
	make("dragon.glb");
	make("dragon.psr");
	make("bunny.obj");
	make("bunny.GLB");
	make("readme.txt");
	make(".hidden.psr");
	make("no-ending");
	make("two.dots.stl");
	make("scan.LAS");
	scan();
	assert_int_equal(catalogue.n, 5);
	expect_path("dragon", "dragon.psr");
	expect_path("bunny", "bunny.GLB");
	expect_reason("bunny.obj", "bunny.obj: another file, bunny.GLB, is the model `bunny`");
	expect_path("two.dots", "two.dots.stl");
	assert_false(catalogue_find(&catalogue, "dragon")->file.is_source);
	assert_true(catalogue_find(&catalogue, "bunny")->file.is_source);
	assert_true(catalogue_find(&catalogue, "scan")->file.is_source);
	assert_null(catalogue_find(&catalogue, "readme"));
	assert_null(catalogue_find(&catalogue, "dragon.psr"));
	assert_null(catalogue_find(&catalogue, "../dragon"));
	assert_null(catalogue_find(&catalogue, ""));
}

static void the_list_is_sorted_by_bytes(void **state)
{
	static const char *const names[] = { "b.psr", "a.psr", "B.psr", "a-.psr", "\xc3\xa9.psr", "Z.psr" };
	static const char *const sorted[] = { "B", "Z", "a", "a-", "b", "\xc3\xa9" };

	(void)state;
	for (size_t i = 0; i < 6; i++)
		make(names[i]);
	scan();
	assert_int_equal(catalogue.n, 6);
	for (size_t i = 0; i < 6; i++)
		assert_string_equal(catalogue.entry[i].file.name, sorted[i]);
}

static void subfolders_with_one_model_count(void **state)
{
	(void)state;
	make_folder("clearcoat");
	make("clearcoat/ClearCoatTest.gltf");
	make("clearcoat/ClearCoatTest.bin");
	make("clearcoat/wood.png");
	make_folder("many");
	make("many/one.obj");
	make("many/two.obj");
	make_folder("empty");
	make_folder("deep");
	make_folder("deep/deeper");
	make("deep/deeper/hidden.glb");
	make("top.obj");
	make_folder("copy");
	make("copy/top.glb");
	scan();
	assert_int_equal(catalogue.n, 4);
	expect_path("ClearCoatTest", "clearcoat/ClearCoatTest.gltf");
	expect_path("top", "top.obj");
	expect_reason("copy/top.glb", "another file, top.obj, is the model `top`");
	expect_reason("many", "many: the folder holds several models");
}

static void what_cannot_be_read_is_named_with_what_to_do(void **state)
{
	(void)state;
	make("scan.laz");
	make("Tower.copc.laz");
	make("part.BREP");
	make("statue.e57");
	make("all.tar.gz");
	make_folder("cad");
	make("cad/lever.sldprt");
	make("cad/drawing.png");
	scan();
	assert_int_equal(catalogue.n, 6);
	expect_reason("scan", "scan.laz: psr reads no compressed LAS (LAZ); unpack it with \"laszip");
	expect_reason("Tower", "LAZ");
	expect_reason("part", "part.BREP: psr reads no surfaces in Open CASCADE's own format");
	expect_reason("statue", "pdal translate");
	expect_reason("all", "all.tar.gz: this is an archive");
	expect_reason("lever", "cad/lever.sldprt: psr reads no drawings of CAD programs");
}

static void what_belongs_to_models_is_no_entry(void **state)
{
	static const char *const files[] = {
		"README.md", "LICENSE", "notes.txt", "wood.png", "wood.jpg", "scan.mtl", "scene.bin", "dragon.psr~", ".laz", "x.json",
	};

	(void)state;
	for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
		make(files[i]);
	make_folder("textures");
	make("textures/stone.jpg");
	scan();
	assert_int_equal(catalogue.n, 0);
}

static void what_was_converted_is_the_model(void **state)
{
	(void)state;
	make("scan.laz");
	make("scan.las");
	make("part.brep");
	make("part.psr");
	make_folder("engine");
	make("engine/engine.gltf");
	make("engine/source.blend");
	make("engine/all.zip");
	scan();
	assert_int_equal(catalogue.n, 3);
	expect_path("scan", "scan.las");
	expect_path("part", "part.psr");
	expect_path("engine", "engine/engine.gltf");
}

static void a_psr_file_with_a_bad_header_has_failed_at_once(void **state)
{
	(void)state;
	make("old.psr");
	plate_write(folder, "plate.psr", 0);
	scan();
	assert_true(catalogue_find(&catalogue, "old")->has_failed);
	assert_false(catalogue_find(&catalogue, "plate")->has_failed);
	plate_write(folder, "old.psr", 0);
	scan();
	assert_false(catalogue_find(&catalogue, "old")->has_failed);
}

static void names_that_are_no_text_are_shown_as_what_to_rename(void **state)
{
	(void)state;
	make("bad\xff.psr");
	make("line\nbreak.psr");
	make("good.psr");
	scan();
	assert_int_equal(catalogue.n, 3);
	expect_path("good", "good.psr");
	expect_reason("bad?.psr", "is not UTF-8");
	expect_reason("line?break.psr", "is not UTF-8");
}

static void a_missing_folder_is_an_error(void **state)
{
	struct catalogue_listing *listing;
	struct psr_error error;

	(void)state;
	assert_int_equal(catalogue_scan(&listing, "/nonexistent-folder", &error), PSR_ERR_NOT_FOUND);
	assert_non_null(strstr(error.text, "/nonexistent-folder"));
}

static void scanning_again_keeps_what_did_not_change(void **state)
{
	struct catalogue_model *kept, *changed, *gone;

	(void)state;
	make("kept.psr");
	make("changed.psr");
	make("gone.psr");
	scan();
	kept = load("kept");
	changed = load("changed");
	gone = load("gone");
	catalogue_unref(&catalogue, gone);
	file_write(folder, "changed.psr", "longer", 6);
	file_write(folder, "new.psr", "x", 1);
	assert_int_equal(catalogue.n_models, 3);
	{
		char path[2 * PATH_MAX];

		snprintf(path, sizeof path, "%s/gone.psr", folder);
		assert_int_equal(unlink(path), 0);
	}
	scan();
	assert_int_equal(catalogue.n, 3);
	assert_ptr_equal(catalogue_find(&catalogue, "kept")->model, kept);
	assert_ptr_equal(kept->entry, catalogue_find(&catalogue, "kept"));
	assert_null(catalogue_find(&catalogue, "changed")->model);
	assert_null(changed->entry); /* in use: it stays until its user goes */
	assert_int_equal(catalogue.n_models, 2);
	catalogue_unref(&catalogue, changed);
	assert_int_equal(catalogue.n_models, 1);
	catalogue_unref(&catalogue, kept);
	assert_int_equal(catalogue.n_models, 1); /* stays for the next one who asks */
}

static void the_longest_unused_makes_room_and_the_used_stay(void **state)
{
	struct catalogue_model *a, *b, *c;
	struct psr_error error;
	uint64_t bytes;

	(void)state;
	make("a.psr");
	make("b.psr");
	make("c.psr");
	scan();
	a = load("a");
	bytes = a->bytes;
	catalogue.max_bytes = 2 * bytes;
	b = load("b");
	catalogue_pin(&catalogue, a);
	catalogue_pin(&catalogue, b);
	assert_int_equal(catalogue_reserve(&catalogue, bytes, "c", &error), PSR_ERR_BUSY); /* both are being drawn */
	assert_non_null(strstr(error.text, "--max-memory"));
	assert_int_equal(catalogue.bytes, 2 * bytes);
	catalogue_unpin(&catalogue, b);
	catalogue_unpin(&catalogue, a);
	catalogue_unref(&catalogue, b);
	catalogue_unref(&catalogue, a);
	c = load("c"); /* b has been unused for longer than a */
	assert_null(catalogue_find(&catalogue, "b")->model);
	assert_ptr_equal(catalogue_find(&catalogue, "a")->model, a);
	assert_true(catalogue.bytes <= catalogue.max_bytes);
	assert_int_equal(catalogue_reserve(&catalogue, 2 * bytes + 1, "c", &error), PSR_ERR_LIMIT); /* never fits */
	assert_ptr_equal(catalogue_find(&catalogue, "a")->model, a);
	catalogue_unref(&catalogue, c);
}

static void a_source_has_a_model_a_resolution(void **state)
{
	struct catalogue_model *coarse, *fine, *again;
	struct catalogue_entry *entry;

	(void)state;
	make("a.obj");
	scan();
	coarse = load_at("a", 512);
	fine = load_at("a", 1024);
	entry = catalogue_find(&catalogue, "a");
	assert_ptr_equal(catalogue_model(entry, 512, 0), coarse);
	assert_ptr_equal(catalogue_model(entry, 1024, 0), fine);
	assert_null(catalogue_model(entry, 768, 0));
	scan(); /* nothing changed but, maybe, what lies beside it */
	entry = catalogue_find(&catalogue, "a");
	assert_ptr_equal(catalogue_model(entry, 512, 0), coarse);
	assert_true(coarse->is_stale);
	assert_true(fine->is_stale);
	again = load_at("a", 512); /* it had changed */
	assert_ptr_equal(catalogue_model(entry, 512, 0), again);
	assert_null(coarse->entry);
	assert_ptr_equal(catalogue_model(entry, 1024, 0), fine);
	assert_int_equal(catalogue.n_models, 3);
	catalogue_unref(&catalogue, coarse); /* gone with its last user */
	assert_int_equal(catalogue.n_models, 2);
	catalogue_unref(&catalogue, fine);
	catalogue.max_bytes = 2 * fine->bytes;
	catalogue_pin(&catalogue, again);
	catalogue_unpin(&catalogue, again);
	catalogue_unref(&catalogue, load("a")); /* the longest unused of an entry's models makes room */
	assert_null(catalogue_model(entry, 1024, 0));
	assert_ptr_equal(catalogue_model(entry, 512, 0), again);
	catalogue_unref(&catalogue, again);
}

/* ---- keys ---- */

static void find_key(char key[CATALOGUE_KEY], const char *source)
{
	char path[2 * PATH_MAX], builder[2 * PATH_MAX];
	struct psr_error error = { 0 };

	snprintf(path, sizeof path, "%s/%s", folder, source);
	snprintf(builder, sizeof builder, "%s/builder", folder);
	if (cachekey_find(key, path, builder, &error) != PSR_OK)
		fail_msg("%s", error.text);
	assert_int_equal(strlen(key), 32);
}

static void keys_change_with_what_a_model_is_made_of(void **state)
{
	char first[CATALOGUE_KEY], next[CATALOGUE_KEY];

	(void)state;
	file_write(folder, "builder", "1", 1);
	make_folder("m");
	make_folder("m/textures");
	file_write(folder, "m/m.gltf", "{}", 2);
	file_write(folder, "m/textures/a.png", "a", 1);
	find_key(first, "m/m.gltf");
	find_key(next, "m/m.gltf");
	assert_string_equal(first, next);
	file_write(folder, "m/m.gltf", "{ }", 3);
	find_key(next, "m/m.gltf");
	assert_string_not_equal(first, next);
	file_write(folder, "m/m.gltf", "{}", 2);
	find_key(next, "m/m.gltf");
	assert_string_equal(first, next);
	file_write(folder, "m/textures/a.png", "aa", 2); /* a neighbour that it may name */
	find_key(next, "m/m.gltf");
	assert_string_not_equal(first, next);
	find_key(first, "m/m.gltf");
	file_write(folder, "builder", "2", 1);
	find_key(next, "m/m.gltf");
	assert_string_not_equal(first, next);
}

static void other_models_and_neighbours_of_glb_and_las_do_not_change_keys(void **state)
{
	char first[CATALOGUE_KEY], next[CATALOGUE_KEY], glb[CATALOGUE_KEY], las[CATALOGUE_KEY];

	(void)state;
	file_write(folder, "builder", "1", 1);
	make_folder("m");
	file_write(folder, "m/a.obj", "v", 1);
	file_write(folder, "m/b.glb", "v", 1);
	find_key(first, "m/a.obj");
	find_key(glb, "m/b.glb");
	file_write(folder, "m/e.las", "v", 1);
	find_key(las, "m/e.las");
	assert_string_not_equal(first, glb);
	file_write(folder, "m/c.psr", "v", 1);
	file_write(folder, "m/d.stl", "v", 1);
	find_key(next, "m/a.obj");
	assert_string_equal(first, next);
	file_write(folder, "m/a.mtl", "v", 1);
	find_key(next, "m/a.obj");
	assert_string_not_equal(first, next);
	find_key(next, "m/b.glb");
	assert_string_equal(glb, next);
	find_key(next, "m/e.las");
	assert_string_equal(las, next);
}

/* ---- parts ---- */

/* A GLB of this JSON and no buffer. */
static void make_glb(const char *name, const char *json)
{
	uint8_t bytes[256] = "glTF\x02";
	const size_t n = strlen(json);

	assert_true(n < sizeof bytes - 20);
	bytes[8] = (uint8_t)(20 + n);
	bytes[12] = (uint8_t)n;
	memcpy(bytes + 16, "JSON", 4);
	memcpy(bytes + 20, json, n);
	file_write(folder, name, bytes, 20 + n);
}

static void textures_that_a_glb_or_a_ply_names_change_its_key(void **state)
{
	static const char ply[] = "ply\nformat ascii 1.0\ncomment TextureFile t.png\nend_header\n";
	static const char plain[] = "ply\nformat ascii 1.0\ncomment t.png\nend_header\ncomment TextureFile t.png\n";
	static const struct {
		const char *name;
		int names_it;
	} file[] = { { "m/out.glb", 1 }, { "m/in.glb", 0 }, { "m/out.ply", 1 }, { "m/in.ply", 0 } };
	char before[4][CATALOGUE_KEY], after[CATALOGUE_KEY];

	(void)state;
	file_write(folder, "builder", "1", 1);
	make_folder("m");
	file_write(folder, "m/t.png", "t", 1);
	make_glb("m/out.glb", "{\"images\":[{\"uri\" : \"t.png\"}]}");
	make_glb("m/in.glb", "{\"images\":[{\"uri\":\"data:image/png;base64,AA\"}]}");
	file_write(folder, "m/out.ply", ply, sizeof ply - 1);
	file_write(folder, "m/in.ply", plain, sizeof plain - 1);
	for (size_t i = 0; i < 4; i++)
		find_key(before[i], file[i].name);
	file_write(folder, "m/t.png", "tt", 2);
	for (size_t i = 0; i < 4; i++) {
		find_key(after, file[i].name);
		if ((strcmp(before[i], after) != 0) != file[i].names_it)
			fail_msg("%s: the key %s", file[i].name, file[i].names_it ? "stays" : "changes");
	}
}

static void expect_bytes(const char *name, uint64_t bytes)
{
	struct catalogue_entry *entry = catalogue_find(&catalogue, name);

	assert_non_null(entry);
	if (entry->file.bytes != bytes)
		fail_msg("%s has %ju bytes, not %ju", name, (uintmax_t)entry->file.bytes, (uintmax_t)bytes);
}

static void the_size_of_a_source_is_that_of_all_its_parts(void **state)
{
	static const char gltf[] = "{\"buffers\":[{\"uri\":\"a%20b.bin\"},{\"uri\":\"data:;base64,AAAA\"}],\"images\":"
	                           "[{\"uri\":\"textures\\/t.png\"},{\"uri\":\"textures/t.png\"},{\"uri\":\"gone.png\"},"
	                           "{\"uri\":\"../builder\"}]}";
	static const char obj[] = "# scan\nmtllib o.mtl\r\nv 0 0 0\n", mtl[] = "newmtl a\n\tmap_Kd -s 1 1 1 textures\\t.png\nbump b c.png\n";
	static const char ply[] = "ply\ncomment TextureFile b c.png\nend_header\n";

	(void)state;
	file_write(folder, "builder", "12345", 5);
	make_folder("textures");
	file_write(folder, "a b.bin", "1234567", 7);
	file_write(folder, "b c.png", "123", 3);
	file_write(folder, "textures/t.png", "12345678901", 11);
	file_write(folder, "g.gltf", gltf, sizeof gltf - 1);
	file_write(folder, "o.obj", obj, sizeof obj - 1);
	file_write(folder, "o.mtl", mtl, sizeof mtl - 1);
	file_write(folder, "p.ply", ply, sizeof ply - 1);
	file_write(folder, "s.stl", "1234", 4);
	scan();
	expect_bytes("g", sizeof gltf - 1 + 7 + 11);
	expect_bytes("o", sizeof obj - 1 + sizeof mtl - 1 + 11 + 3);
	expect_bytes("p", sizeof ply - 1 + 3);
	expect_bytes("s", 4);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(names_are_stems_and_the_psr_wins, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_list_is_sorted_by_bytes, set_up, tear_down),
		cmocka_unit_test_setup_teardown(subfolders_with_one_model_count, set_up, tear_down),
		cmocka_unit_test_setup_teardown(names_that_are_no_text_are_shown_as_what_to_rename, set_up, tear_down),
		cmocka_unit_test_setup_teardown(what_cannot_be_read_is_named_with_what_to_do, set_up, tear_down),
		cmocka_unit_test_setup_teardown(what_belongs_to_models_is_no_entry, set_up, tear_down),
		cmocka_unit_test_setup_teardown(what_was_converted_is_the_model, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_psr_file_with_a_bad_header_has_failed_at_once, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_source_has_a_model_a_resolution, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_missing_folder_is_an_error, set_up, tear_down),
		cmocka_unit_test_setup_teardown(scanning_again_keeps_what_did_not_change, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_longest_unused_makes_room_and_the_used_stay, set_up, tear_down),
		cmocka_unit_test_setup_teardown(keys_change_with_what_a_model_is_made_of, set_up, tear_down),
		cmocka_unit_test_setup_teardown(other_models_and_neighbours_of_glb_and_las_do_not_change_keys, set_up,
		                                tear_down),
		cmocka_unit_test_setup_teardown(textures_that_a_glb_or_a_ply_names_change_its_key, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_size_of_a_source_is_that_of_all_its_parts, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
