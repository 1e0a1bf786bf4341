#define _GNU_SOURCE
#include <dirent.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>
#include "octree/build/build.h"
#include "base/direction.h"
#include "leaves.h"

#define PI 3.14159265358979323846

static char folder[] = "/tmp/psr-octree-XXXXXX";

/* A number of points, made again on each reading. */
struct cloud {
	uint64_t n, next;
	void (*make)(struct octree_point *point, uint64_t i);
	int has_normal;
	unsigned scan;
};

static int go_back(void *userdata, struct psr_error *err)
{
	(void)err;
	((struct cloud *)userdata)->next = 0;
	return PSR_OK;
}

static int read_cloud(size_t *n, struct octree_point *points, size_t room, void *userdata, struct psr_error *err)
{
	struct cloud *cloud = userdata;

	(void)err;
	for (*n = 0; *n < room && cloud->next < cloud->n; ++*n)
		cloud->make(&points[*n], cloud->next++);
	return PSR_OK;
}

static const double middle[3] = { 500000.0, 4000000.0, 100.0 };
#define RADIUS 30.0

/* On a sphere at survey coordinates; red grows with z. */
static void on_sphere(struct octree_point *point, uint64_t i)
{
	uint64_t random = i;
	const double z = random_in(&random, -1.0, 1.0), r = sqrt(1.0 - z * z), a = random_in(&random, 0.0, 2.0 * PI);

	*point = (struct octree_point){ .at = { middle[0] + RADIUS * r * cos(a), middle[1] + RADIUS * r * sin(a),
		                                    middle[2] + RADIUS * z },
		                            .color = { (uint8_t)(127.0 + 127.0 * z), 10, 20 },
		                            .normal = { (float)(r * cos(a)), (float)(r * sin(a)), (float)z } };
}

static int build(struct octree **tree, struct cloud *cloud, int levels, uint64_t memory, struct psr_error *err)
{
	const struct octree_source source = { .name = "cloud", .has_color = 1, .has_normal = cloud->has_normal, .n_points = cloud->n,
		                               .scan = cloud->scan,
		                               .rewind = go_back, .read = read_cloud, .userdata = cloud };
	struct octree_build_options options;

	octree_build_options_default(&options);
	options.levels = levels;
	options.memory = memory;
	options.folder = folder;
	*tree = NULL;
	return octree_build(tree, &source, &options, err);
}

static struct octree *sphere(uint64_t n, int levels, uint64_t memory)
{
	struct cloud cloud = { .n = n, .make = on_sphere };
	struct octree *tree;

	assert_int_equal(build(&tree, &cloud, levels, memory, NULL), PSR_OK);
	assert_int_equal(octree_check(tree, NULL, NULL), PSR_OK);
	return tree;
}

static int n_files(void)
{
	DIR *dir = opendir(folder);
	int n = -2; /* . and .. */

	assert_non_null(dir);
	while (readdir(dir) != NULL)
		n++;
	closedir(dir);
	return n;
}

#define POINTS 200000
#define LEVELS 7

struct sphere_leaves {
	const struct octree *tree;
	uint8_t *is_there; /* by place */
	double worst_cosine, worst_place;
};

static int look(const struct octree_node *node, void *userdata)
{
	struct sphere_leaves *s = userdata;
	const float *normal = psr_direction_table()[s->tree->normal[node->leaf]];
	const double edge = ldexp(s->tree->edge, -LEVELS), offset = octree_offset(s->tree->offset[node->leaf]);
	double center[3], out[3], cosine = 0.0, length = 0.0, place = 0.0;
	uint32_t at[3];

	octree_place(node->path, at);
	s->is_there[at[0] + (at[1] << LEVELS) + (at[2] << 2 * LEVELS)] = 1;
	octree_center(s->tree, node->path, LEVELS, center);
	for (int c = 0; c < 3; c++) {
		out[c] = center[c] - middle[c];
		length += out[c] * out[c];
		cosine += out[c] * (double)normal[c];
		place += pow(out[c] + offset * edge * (double)normal[c], 2.0);
	}
	s->worst_cosine = fmin(s->worst_cosine, cosine / sqrt(length));
	s->worst_place = fmax(s->worst_place, fabs(sqrt(place) - RADIUS) / edge);
	return 0;
}

/* Bounds. The planes whose normals a leaf blends are of 27 cells of some four leaves, each off by one at most, within 4
 * leaves of a plane: that tilts it by less than 12 degrees. Its middle is up to 0.87 leaves from its points, 0.8
 * degrees of a radius of 64 leaves; the code adds 1.27. Half a step of an offset is 0.22 leaves, and a mean of points
 * is up to 0.87 leaves beside the middle, where the sphere rises by the sine of these 15 degrees. */
static void every_point_is_within_its_leaf_and_normals_look_out(void **state)
{
	struct octree *tree = sphere(POINTS, LEVELS, OCTREE_LEAST_MEMORY);
	struct sphere_leaves s = { tree, calloc(1u << 3 * LEVELS, 1), 1.0, 0.0 };

	(void)state;
	assert_non_null(s.is_there);
	octree_walk(tree, LEVELS, look, &s);
	for (uint64_t i = 0; i < POINTS; i++) {
		struct octree_point point;
		uint32_t at = 0;

		on_sphere(&point, i);
		for (int c = 0; c < 3; c++) {
			const double place = floor(ldexp((point.at[c] - tree->low[c]) / tree->edge, LEVELS));

			at |= (uint32_t)fmin(place, (1 << LEVELS) - 1) << c * LEVELS;
		}
		assert_true(s.is_there[at]);
	}
	print_message("worst normal %.1f degrees, worst place %.2f leaves\n", acos(s.worst_cosine) * 180.0 / PI,
	              s.worst_place);
	assert_true(s.worst_cosine > cos(15.0 * PI / 180.0));
	assert_true(s.worst_place < 0.22 + 0.87 * sin(15.0 * PI / 180.0));
	free(s.is_there);
	octree_destroy(tree);
}

/* Cells of this sparse sphere are 16 leaves wide: a normal for all of a cell would be 12.4 degrees off at its corners.
 * Blended ones are off by what the planes are. */
static void normals_turn_from_cell_to_cell(void **state)
{
	struct octree *tree = sphere(2000, LEVELS, OCTREE_LEAST_MEMORY);
	struct sphere_leaves s = { tree, calloc(1u << 3 * LEVELS, 1), 1.0, 0.0 };

	(void)state;
	assert_non_null(s.is_there);
	octree_walk(tree, LEVELS, look, &s);
	print_message("worst normal %.1f degrees\n", acos(s.worst_cosine) * 180.0 / PI);
	assert_true(s.worst_cosine > cos(6.0 * PI / 180.0));
	free(s.is_there);
	octree_destroy(tree);
}

/* A leaf's middle is up to 0.87 leaves from its points, 0.8 degrees of a radius of 64 leaves; quantising twice adds 1.27
 * degrees each. */
static void normals_of_the_source_are_averaged(void **state)
{
	struct cloud cloud = { .n = POINTS, .make = on_sphere, .has_normal = 1 };
	struct octree *tree;
	struct sphere_leaves s = { NULL, calloc(1u << 3 * LEVELS, 1), 1.0, 0.0 };

	(void)state;
	assert_non_null(s.is_there);
	assert_int_equal(build(&tree, &cloud, LEVELS, OCTREE_LEAST_MEMORY, NULL), PSR_OK);
	s.tree = tree;
	octree_walk(tree, LEVELS, look, &s);
	print_message("worst normal %.1f degrees, worst place %.2f leaves\n", acos(s.worst_cosine) * 180.0 / PI,
	              s.worst_place);
	assert_true(s.worst_cosine > cos((sqrt(3.0) / 2.0 / 64.0) + 2.0 * 1.27 * PI / 180.0));
	assert_true(s.worst_place < 0.22 + 0.87 * sin(4.0 * PI / 180.0));
	free(s.is_there);
	octree_destroy(tree);
}

/* Only the upper half has normals, and they look in. */
static void half_with_normals(struct octree_point *point, uint64_t i)
{
	on_sphere(point, i);
	for (int c = 0; c < 3; c++)
		point->normal[c] = point->normal[2] > 0.1f ? -point->normal[c] : c == 0 ? NAN : point->normal[c];
}

static int count_inward(const struct octree_node *node, void *userdata)
{
	struct sphere_leaves *s = userdata;
	const float *normal = psr_direction_table()[s->tree->normal[node->leaf]];
	double center[3], cosine = 0.0;

	octree_center(s->tree, node->path, LEVELS, center);
	for (int c = 0; c < 3; c++)
		cosine += (center[c] - middle[c]) / RADIUS * (double)normal[c];
	if (center[2] - middle[2] > 0.15 * RADIUS)
		assert_true(cosine < -0.9);
	else if (center[2] - middle[2] < 0.05 * RADIUS)
		assert_true(cosine > 0.9);
	return 0;
}

static void leaves_without_normals_get_theirs_from_their_neighbours(void **state)
{
	struct cloud cloud = { .n = POINTS, .make = half_with_normals, .has_normal = 1 };
	struct octree *tree;
	struct sphere_leaves s = { .worst_cosine = 1.0 };

	(void)state;
	assert_int_equal(build(&tree, &cloud, LEVELS, OCTREE_LEAST_MEMORY, NULL), PSR_OK);
	s.tree = tree;
	octree_walk(tree, LEVELS, count_inward, &s);
	octree_destroy(tree);
}

static void runs_on_disk_give_the_tree_of_memory(void **state)
{
	struct octree *small = sphere(POINTS, 9, OCTREE_LEAST_MEMORY), *large = sphere(POINTS, 9, (uint64_t)64 << 20);
	const uint64_t n = small->n_leaves;

	(void)state;
	assert_int_equal(small->n_codes, large->n_codes);
	assert_memory_equal(small->code, large->code, small->n_codes);
	assert_memory_equal(small->normal, large->normal, n * sizeof *small->normal);
	assert_memory_equal(small->color, large->color, n * sizeof *small->color);
	assert_memory_equal(small->offset, large->offset, n);
	assert_int_equal(n_files(), 0);
	octree_destroy(small);
	octree_destroy(large);
}

static void twice(struct octree_point *point, uint64_t i)
{
	*point = (struct octree_point){ .at = { i < 100 ? 0.1 : 1.0 }, .color = { i < 50 ? 0 : 100, 0, 7 } };
}

static void colors_of_a_leaf_are_averaged(void **state)
{
	struct cloud cloud = { .n = 101, .make = twice };
	struct octree *tree;

	(void)state;
	assert_int_equal(build(&tree, &cloud, 3, OCTREE_LEAST_MEMORY, NULL), PSR_OK);
	assert_int_equal(tree->n_leaves, 2);
	assert_true(tree->color[0][0] == 50 && tree->color[0][2] == 7 && tree->color[1][0] == 100);
	octree_destroy(tree);
}

/* The first leaf has the first 100 points, the other one the last. */
static void scanned(struct octree_point *point, uint64_t i)
{
	twice(point, i);
	point->intensity = (uint16_t)(i < 50 ? 10 : i < 100 ? 65535 : 7);
	point->class = (uint8_t)(i == 0 ? 2 : i < 100 ? 5 : 6);
	point->returns = (uint8_t)(i == 0 ? 0x31 : i < 100 ? 0x33 : 0x11);
	point->time = i == 7 ? NAN : 3e8 + 10.0 * (double)i;
}

static void streams_of_a_scan_are_means_and_first_points(void **state)
{
	struct cloud cloud = { .n = 101, .make = scanned, .scan = 15 };
	struct octree *tree;

	(void)state;
	assert_int_equal(build(&tree, &cloud, 3, OCTREE_LEAST_MEMORY, NULL), PSR_OK);
	const struct octree_scan *scan = &tree->scan;
	assert_int_equal(tree->n_leaves, 2);
	assert_true(scan->intensity[0] == 32773 && scan->intensity[1] == 7);
	assert_true(scan->class[0] == 2 && scan->class[1] == 6);
	assert_true(scan->returns[0] == 0x31 && scan->returns[1] == 0x11);
	assert_true(scan->time[0] == 0 && scan->time[1] == UINT32_MAX);
	assert_true((*scan->time_scale)[0] == 3e8 && fabs((*scan->time_scale)[1] * UINT32_MAX - 1000.0) < 1e-6);
	octree_destroy(tree);
	/* Only what the source has. */
	cloud.scan = 1u << OCTREE_CLASS;
	assert_int_equal(build(&tree, &cloud, 3, OCTREE_LEAST_MEMORY, NULL), PSR_OK);
	assert_non_null(tree->scan.class);
	assert_true(tree->scan.intensity == NULL && tree->scan.returns == NULL && tree->scan.time == NULL);
	octree_destroy(tree);
	/* twice() leaves zeros. */
	cloud = (struct cloud){ .n = 101, .make = twice, .scan = 15 };
	assert_int_equal(build(&tree, &cloud, 3, OCTREE_LEAST_MEMORY, NULL), PSR_OK);
	assert_true(tree->scan.intensity == NULL && tree->scan.class == NULL && tree->scan.returns == NULL
	            && tree->scan.time == NULL && tree->scan.time_scale == NULL);
	octree_destroy(tree);
}

static void scanned_sphere(struct octree_point *point, uint64_t i)
{
	on_sphere(point, i);
	point->intensity = (uint16_t)(i * 40503);
	point->class = (uint8_t)(i * 131);
	point->returns = (uint8_t)(i * 17);
	point->time = 1e5 + 1e-4 * (double)i;
}

/* Who is first in a leaf does not depend on where runs end. */
static void runs_on_disk_keep_the_order_of_a_scan(void **state)
{
	struct octree *tree[2];

	(void)state;
	for (int i = 0; i < 2; i++) {
		struct cloud cloud = { .n = POINTS, .make = scanned_sphere, .scan = 15 };

		assert_int_equal(build(&tree[i], &cloud, 6, i == 0 ? OCTREE_LEAST_MEMORY : (uint64_t)64 << 20, NULL), PSR_OK);
	}
	const uint64_t n = tree[0]->n_leaves;
	assert_true(n == tree[1]->n_leaves && n < POINTS / 10);
	assert_memory_equal(tree[0]->scan.intensity, tree[1]->scan.intensity, 2 * n);
	assert_memory_equal(tree[0]->scan.class, tree[1]->scan.class, n);
	assert_memory_equal(tree[0]->scan.returns, tree[1]->scan.returns, n);
	assert_memory_equal(tree[0]->scan.time, tree[1]->scan.time, 4 * n);
	octree_destroy(tree[0]);
	octree_destroy(tree[1]);
}

static void at_one_place(struct octree_point *point, uint64_t i)
{
	(void)i;
	*point = (struct octree_point){ .at = { 1.0, 2.0, 3.0 } };
}

static void no_number(struct octree_point *point, uint64_t i)
{
	*point = (struct octree_point){ .at = { (double)i, i == 9 ? NAN : 1.0, 3.0 } };
}

static void very_far(struct octree_point *point, uint64_t i)
{
	*point = (struct octree_point){ .at = { i == 0 ? -1.7e308 : 1.7e308 } };
}

static void far(struct octree_point *point, uint64_t i)
{
	*point = (struct octree_point){ .at = { (double)i * 1e300 } };
}

static void tiny(struct octree_point *point, uint64_t i)
{
	*point = (struct octree_point){ .at = { (double)i * 1e-300 } };
}

static void bad_clouds_get_an_error_that_names_what_is_wrong(void **state)
{
	static const struct {
		struct cloud cloud;
		int levels, code;
		const char *text;
	} bad[] = {
		{ { .n = 0, .make = at_one_place }, 5, PSR_ERR_FORMAT, "no points" },
		{ { .n = 10000, .make = at_one_place }, 5, PSR_ERR_FORMAT, "all 10000 points are at 1 2 3" },
		{ { .n = 20, .make = no_number }, 5, PSR_ERR_FORMAT, "point 9 (counted from 0) has no finite y" },
		{ { .n = 2, .make = very_far }, 5, PSR_ERR_FORMAT, "cannot be told apart" },
		{ { .n = 2, .make = far }, 5, PSR_ERR_FORMAT, "points at coordinates of 1e+300: a model's are at most 1e+30" },
		{ { .n = 2, .make = tiny }, 5, PSR_ERR_FORMAT, "it extends over 1e-300: models are from 1e-24 to 1e+30 wide" },
		{ { .n = 9, .make = on_sphere }, 1, PSR_ERR_ARG, "1 levels" },
		{ { .n = 9, .make = on_sphere }, 21, PSR_ERR_ARG, "21 levels" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		struct cloud cloud = bad[i].cloud;
		struct psr_error err;
		struct octree *tree;

		assert_int_equal(build(&tree, &cloud, bad[i].levels, OCTREE_LEAST_MEMORY, &err), bad[i].code);
		assert_null(tree);
		assert_non_null(strstr(err.text, bad[i].text));
		assert_int_equal(n_files(), 0);
	}
}

static void a_full_disk_leaves_no_file(void **state)
{
	struct rlimit was, full;
	struct cloud cloud = { .n = POINTS, .make = on_sphere };
	struct psr_error err;
	struct octree *tree;

	(void)state;
	assert_int_equal(getrlimit(RLIMIT_FSIZE, &was), 0);
	full = was;
	full.rlim_cur = 1000000; /* within the second run */
	signal(SIGXFSZ, SIG_IGN);
	assert_int_equal(setrlimit(RLIMIT_FSIZE, &full), 0);
	assert_int_equal(build(&tree, &cloud, 9, OCTREE_LEAST_MEMORY, &err), PSR_ERR_IO);
	assert_int_equal(setrlimit(RLIMIT_FSIZE, &was), 0);
	assert_null(tree);
	assert_non_null(strstr(err.text, "TMPDIR"));
	assert_int_equal(n_files(), 0);
}

static int is_called_often(void *userdata)
{
	return --*(int *)userdata < 0;
}

static void a_build_can_be_cancelled_at_any_time(void **state)
{
	(void)state;
	for (int after = 0, rc = PSR_ERR_CANCELLED; rc != PSR_OK; after = 2 * after + 1) {
		struct cloud cloud = { .n = POINTS, .make = on_sphere };
		const struct octree_source source = { .name = "cloud", .n_points = POINTS, .rewind = go_back, .read = read_cloud,
			                               .userdata = &cloud };
		int left = after;
		const struct psr_cancel cancel = { is_called_often, &left };
		struct octree_build_options options;
		struct octree *tree = NULL;

		octree_build_options_default(&options);
		options.memory = OCTREE_LEAST_MEMORY;
		options.folder = folder;
		options.cancel = &cancel;
		rc = octree_build(&tree, &source, &options, NULL);
		assert_true((rc == PSR_OK && left >= 0) || (rc == PSR_ERR_CANCELLED && tree == NULL));
		octree_destroy(tree);
		assert_int_equal(n_files(), 0);
	}
}

static void spacing_chooses_the_levels(void **state)
{
	struct cloud cloud = { .n = 1000, .make = on_sphere };
	const struct octree_source source = { .name = "cloud", .n_points = 1000, .rewind = go_back, .read = read_cloud,
		                               .userdata = &cloud };
	struct octree_build_options options;
	struct octree *tree = NULL;

	(void)state;
	octree_build_options_default(&options);
	options.folder = folder;
	options.levels = 0;
	options.spacing = 1.0;
	assert_int_equal(octree_build(&tree, &source, &options, NULL), PSR_OK);
	assert_int_equal(tree->levels, 6); /* 60 in 64 */
	assert_null(tree->color);
	octree_destroy(tree);
	options.spacing = 1e-9;
	assert_int_equal(octree_build(&tree, &source, &options, NULL), PSR_ERR_ARG);
	options.spacing = 0.0;
	assert_int_equal(octree_build(&tree, &source, &options, NULL), PSR_ERR_ARG);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_point_is_within_its_leaf_and_normals_look_out),
		cmocka_unit_test(normals_turn_from_cell_to_cell),
		cmocka_unit_test(normals_of_the_source_are_averaged),
		cmocka_unit_test(leaves_without_normals_get_theirs_from_their_neighbours),
		cmocka_unit_test(runs_on_disk_give_the_tree_of_memory),
		cmocka_unit_test(colors_of_a_leaf_are_averaged),
		cmocka_unit_test(streams_of_a_scan_are_means_and_first_points),
		cmocka_unit_test(runs_on_disk_keep_the_order_of_a_scan),
		cmocka_unit_test(bad_clouds_get_an_error_that_names_what_is_wrong),
		cmocka_unit_test(a_full_disk_leaves_no_file),
		cmocka_unit_test(a_build_can_be_cancelled_at_any_time),
		cmocka_unit_test(spacing_chooses_the_levels),
	};
	int failed;

	if (mkdtemp(folder) == NULL)
		return 1;
	failed = cmocka_run_group_tests(tests, NULL, NULL);
	rmdir(folder);
	return failed;
}
