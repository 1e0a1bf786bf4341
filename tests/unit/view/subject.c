/* What a viewer shows octrees as, and what it says of it. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "client/view/subject.h"

static struct subject subject;
static struct link_model model = { .name = "hill" };
static const struct link_scene scene = { .n_models = 1, .model = &model };

static int show(void **state)
{
	(void)state;
	memset(&subject, 0, sizeof subject);
	subject.spacing = 1;
	return subject_set_model(&subject, "hill", NULL);
}

static void have(unsigned representations, uint8_t as)
{
	model.opened.representations = (uint8_t)representations;
	subject.instance[0].link.representation = as;
}

static void an_octree_is_shown_where_it_is_asked_for_or_there_are_no_blocks(void **state)
{
	const unsigned blocks = 1u << PSR_WIRE_REP_BLOCKS, octree = 1u << PSR_WIRE_REP_OCTREE;

	(void)state;
	have(octree, PSR_WIRE_REP_AUTO);
	assert_true(subject_has_octree(&subject, &scene));
	assert_false(subject_has_octree(&subject, NULL));
	have(blocks | octree, PSR_WIRE_REP_AUTO);
	assert_false(subject_has_octree(&subject, &scene));
	have(blocks | octree, PSR_WIRE_REP_OCTREE);
	assert_true(subject_has_octree(&subject, &scene));
	have(blocks | octree, PSR_WIRE_REP_BLOCKS);
	assert_false(subject_has_octree(&subject, &scene));
	have(1u << PSR_WIRE_REP_DPOINT | octree, PSR_WIRE_REP_AUTO);
	assert_true(subject_has_octree(&subject, &scene));
	have(octree, PSR_WIRE_REP_AUTO);
	assert_int_equal(subject_set_model(&subject, "another", NULL), PSR_OK);
	assert_false(subject_has_octree(&subject, &scene));
}

static int command_has_splats(void)
{
	static const double low[3] = { -1, -1, -1 }, high[3] = { 1, 1, 1 }, up[3] = { 0, 1, 0 };
	struct hand hand;
	char *command;
	int has;

	assert_int_equal(hand_init(&hand, low, high, up, 35, NULL), PSR_OK);
	hand_set_size(&hand, 64, 48);
	hand_home(&hand);
	command = subject_command(&subject, &hand, "localhost:1", NULL);
	assert_non_null(command);
	has = strstr(command, " --splats") != NULL;
	free(command);
	return has;
}

static void splats_come_and_go_and_the_command_says_so(void **state)
{
	struct link_instance instance[SUBJECT_INSTANCES];
	struct link_wish wish;
	char note[64];

	(void)state;
	have(1u << PSR_WIRE_REP_OCTREE, PSR_WIRE_REP_AUTO);
	assert_false(command_has_splats());
	subject_toggle_splats(&subject, &scene, note, sizeof note);
	assert_string_equal(note, "octrees as splats");
	assert_true(command_has_splats());
	link_wish_default(&wish);
	assert_false(wish.with_splats);
	subject_wish(&subject, &wish, instance);
	assert_true(wish.with_splats);
	subject_toggle_splats(&subject, &scene, note, sizeof note);
	assert_string_equal(note, "octrees as points");
	assert_false(command_has_splats());
}

static void without_an_octree_nothing_changes_and_a_note_says_why(void **state)
{
	char note[64];

	(void)state;
	have(1u << PSR_WIRE_REP_BLOCKS, PSR_WIRE_REP_AUTO);
	subject_toggle_splats(&subject, &scene, note, sizeof note);
	assert_non_null(strstr(note, "no octree"));
	assert_false(subject.with_splats);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(an_octree_is_shown_where_it_is_asked_for_or_there_are_no_blocks, show),
		cmocka_unit_test_setup(splats_come_and_go_and_the_command_says_so, show),
		cmocka_unit_test_setup(without_an_octree_nothing_changes_and_a_note_says_why, show),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
