/* Octrees from clouds and meshes: octree [-n MILLIONS] [-m MB] [-l LEVELS] [-w FILE.las] [FILE]
 *
 * Without a file it makes one: a terrain of hills and trees at survey coordinates, in the random order of no scanner.
 * -w keeps that file. Prints its entropy, time and peak of memory of building, bits a leaf beside those of Draco, and
 * rates of packing. Times are of the processor. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/random.h"
#include "import/points/points.h"
#include "octree/attributes.h"
#include "octree/pack.h"
#include "sample/octree/of_mesh.h"
#include "octree_draco.h"
#include "psr/mesh.h"

#define HEADER 227
#define RECORD 26 /* point format 2 */

static void put(uint8_t *p, uint64_t x, int n)
{
	for (int i = 0; i < n; i++)
		p[i] = (uint8_t)(x >> 8 * i);
}

static void put_double(uint8_t *p, double x)
{
	uint64_t bits;

	memcpy(&bits, &x, sizeof bits);
	put(p, bits, 8);
}

static double ground_at(double x, double y)
{
	return 40.0 * sin(x / 170.0) * cos(y / 130.0) + 6.0 * sin(x / 19.0 + y / 23.0);
}

static int has_trees(double x, double y)
{
	return sin(x / 7.0) * sin(y / 9.0) > 0.3;
}

/* A place of a square kilometre in millimetres, with 3 cm of noise; one of four is in a tree. */
static void make_point(uint8_t p[RECORD], uint64_t *random)
{
	const double x = random_in(random, 0.0, 1000.0), y = random_in(random, 0.0, 1000.0);
	const int is_tree = random_below(random, 4) == 0 && has_trees(x, y);
	const double z = ground_at(x, y) + (is_tree ? random_in(random, 2.0, 15.0) : random_in(random, -0.03, 0.03));

	memset(p, 0, RECORD);
	put(p, (uint64_t)(int64_t)(x * 1000.0), 4);
	put(p + 4, (uint64_t)(int64_t)(y * 1000.0), 4);
	put(p + 8, (uint64_t)(int64_t)floor(z * 1000.0), 4);
	p[15] = is_tree ? 5 : 2;
	put(p + 20, is_tree ? 9000 : 30000, 2);
	put(p + 22, is_tree ? 30000 : 26000, 2);
	put(p + 24, 8000 + (uint64_t)random_below(random, 2000), 2);
}

static int make_file(const char *path, uint64_t n)
{
	uint8_t header[HEADER] = "LASF", point[RECORD];
	uint64_t random = 1;
	FILE *file = fopen(path, "wb");

	if (file == NULL)
		return 0;
	header[24] = 1;
	header[25] = 2;
	put(header + 94, HEADER, 2);
	put(header + 96, HEADER, 4);
	header[104] = 2;
	put(header + 105, RECORD, 2);
	put(header + 107, n, 4);
	for (int c = 0; c < 3; c++) {
		put_double(header + 131 + 8 * c, 0.001);
		put_double(header + 155 + 8 * c, c == 0 ? 412000.0 : c == 1 ? 5312000.0 : 120.0);
	}
	fwrite(header, 1, sizeof header, file);
	for (uint64_t i = 0; i < n; i++) {
		make_point(point, &random);
		fwrite(point, 1, sizeof point, file);
	}
	return fclose(file) == 0;
}

/* ---- what no coder can do without ---- */

#define COLUMNS 512 /* of cells, either way, that stand for all */
#define PLACES 8    /* of a column, either way */
#define DEEPEST 15

/* Adds so many points, spread evenly from one height to another, to the cells of a column. */
static void spread_points(double *cells, double n, double from, double to, double edge)
{
	for (int z = (int)(from / edge); z * edge < to; z++)
		cells[z] += n * (fmin(to, (z + 1) * edge) - fmax(from, z * edge)) / (to - from);
}

/* Prints the entropy of which cells have one of n points, to who knows all that make_point() does but its draws. */
static void print_bound(double n, int levels)
{
	static double cells[1 << DEEPEST];
	const double edge = 1000.0 / (1 << levels), each = n * 1e-6 * edge * edge / (PLACES * PLACES);
	double bits = 0.0, leaves = 0.0;

	if (levels > DEEPEST)
		return;
	for (int c = 0; c < COLUMNS * COLUMNS; c++) {
		const double at[2] = { (c % COLUMNS) * (1000.0 / COLUMNS), (int)(c / COLUMNS) * (1000.0 / COLUMNS) };
		double low = 1e9, high = 0.0;

		for (int i = 0; i < PLACES * PLACES; i++) {
			const double x = at[0] + (i % PLACES + 0.5) / PLACES * edge;
			const double y = at[1] + ((int)(i / PLACES) + 0.5) / PLACES * edge;
			const double ground = 64.0 + ground_at(x, y), trees = has_trees(x, y) ? 0.25 : 0.0;

			spread_points(cells, each * (1.0 - trees), ground - 0.03, ground + 0.03, edge);
			spread_points(cells, each * trees, ground + 2.0, ground + 15.0, edge);
			low = fmin(low, ground - 0.03);
			high = fmax(high, ground + 15.0);
		}
		for (int z = (int)(low / edge); z * edge < high; z++) {
			const double none = exp(-cells[z]), some = 1.0 - none;

			bits -= cells[z] > 0.0 && some > 0.0 ? some * log2(some) + none * log2(none) : 0.0;
			leaves += some;
			cells[z] = 0.0;
		}
	}
	printf("%-8s %6.2f bits a leaf to who knows how the cloud is made\n", "entropy", bits / leaves);
}

static double used_seconds(void)
{
	return (double)clock_read(CLOCK_PROCESS_CPUTIME_ID) * 1e-9;
}

static double peak_mb(void)
{
	struct rusage usage;

	getrusage(RUSAGE_SELF, &usage);
	return (double)usage.ru_maxrss / 1024.0;
}

static int collect_place(const struct octree_node *node, void *userdata)
{
	octree_place(node->path, ((uint32_t (*)[3])userdata)[node->leaf]);
	return 0;
}

/* The same leaves, by Draco. */
static void print_draco(const struct octree *tree, double code_bits)
{
	const double begin = used_seconds(), n = (double)tree->n_leaves;
	uint32_t (*at)[3] = tree->n_leaves <= UINT32_MAX ? malloc(tree->n_leaves * sizeof *at) : NULL;
	double bits;

	if (at == NULL)
		return;
	octree_walk(tree, tree->levels, collect_place, at);
	bits = 8.0 * (double)draco_bytes((const uint32_t (*)[3])at, (uint32_t)tree->n_leaves) / n;
	if (bits > 0)
		printf("%-8s %6.2f bits a leaf, coded %5.1f M leaves/s on one thread; packed codes are %.2f of that\n", "draco",
		       bits, n / (used_seconds() - begin) * 1e-6, code_bits / bits);
	free(at);
}

static int print_packing(const char *name, const struct octree *tree, enum octree_packing packing, double *bits,
                         struct psr_error *err)
{
	const double begin = used_seconds(), n = (double)tree->n_leaves;
	double middle;
	struct octree_shares shares;
	struct octree *again;
	uint8_t *bytes;
	size_t n_bytes;
	int rc = octree_pack(&bytes, &n_bytes, tree, packing, NULL, err);

	if (rc != PSR_OK)
		return rc;
	middle = used_seconds();
	rc = octree_unpack(&again, bytes, n_bytes, tree->n_leaves, NULL, err);
	octree_packed_shares(&shares, bytes, n_bytes);
	*bits = 8.0 * (double)shares.codes / n;
	if (rc == PSR_OK)
		printf("%-8s %6.2f bits a leaf, codes %.2f, coded %5.1f and decoded %5.1f M leaves/s on one thread\n", name,
		       8.0 * (double)n_bytes / n, *bits, n / (middle - begin) * 1e-6, n / (used_seconds() - middle) * 1e-6);
	free(bytes);
	if (rc == PSR_OK)
		octree_destroy(again);
	return rc;
}

/* The codes alone, then all that the leaves have, too; each packed small and fast. */
static int print_packings(const struct octree *tree, struct psr_error *err)
{
	struct octree codes = *tree;
	double bits, fast_bits;
	int rc;

	codes.normal = NULL;
	codes.offset = NULL;
	codes.color = NULL;
	codes.material = NULL;

	printf("%-8s %6.2f bits a leaf\n", "in core", 8.0 * (double)tree->n_codes / (double)tree->n_leaves);
	rc = print_packing("codes", &codes, OCTREE_SMALL, &bits, err);
	if (rc == PSR_OK)
		rc = print_packing("- fast", &codes, OCTREE_FAST, &fast_bits, err);
	if (rc == PSR_OK)
		rc = print_packing("all", tree, OCTREE_SMALL, &bits, err);
	if (rc == PSR_OK)
		rc = print_packing("- fast", tree, OCTREE_FAST, &fast_bits, err);
	if (rc == PSR_OK)
		print_draco(tree, bits);
	return rc;
}

struct collecting {
	const struct octree *tree;
	struct octree_level *level;
	int has_failed;
};

static int collect_code(const struct octree_node *node, void *userdata)
{
	struct collecting *c = userdata;

	c->has_failed = !octree_level_put(c->level, c->tree->code[node->code]);
	return c->has_failed;
}

/* Normals as they are, of 15 bits, and all else that the leaves have; as one chunk. */
static int print_attributes(const struct octree *tree, struct psr_error *err)
{
	static const char *const names[] = { "normals", "offsets", "colours", "material" };
	static const uint64_t root = 0;
	const struct octree_attributes leaf = { tree->normal, tree->offset, tree->color, tree->material };
	const void *const array[] = { tree->normal, tree->offset, tree->color, tree->material };
	struct octree_levels levels = { .height = tree->levels, .n_roots = 1, .root = &root };
	struct collecting c = { .tree = tree };
	int rc = PSR_OK;

	for (int depth = 0; depth < tree->levels && !c.has_failed; depth++) {
		c.level = &levels.at[depth];
		octree_walk(tree, depth, collect_code, &c);
	}
	for (int stream = 0; stream < OCTREE_STREAMS && rc == PSR_OK && !c.has_failed; stream++) {
		const double begin = used_seconds(), n = (double)tree->n_leaves;
		struct coder coder;

		if (array[stream] == NULL)
			continue;
		coder_begin(&coder);
		rc = octree_attributes_pack(&coder, &levels, &leaf, stream);
		coder_end(&coder);
		if (rc == PSR_OK && !coder.has_failed)
			printf("%-8s %6.2f bits a leaf, coded %5.1f M leaves/s on one thread\n", names[stream],
			       8.0 * (double)coder.n / n, n / (used_seconds() - begin) * 1e-6);
		free(coder.bytes);
	}
	octree_levels_fini(&levels);
	if (rc != PSR_OK || c.has_failed)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the levels of an octree");
	return PSR_OK;
}

static int measure_cloud(const char *path, const struct octree_build_options *options, struct psr_error *err)
{
	struct octree_source source;
	struct octree *tree;
	const double begin = used_seconds();
	int rc = octree_source_open(&source, path, err);

	if (rc != PSR_OK)
		return rc;
	rc = octree_build(&tree, &source, options, err);
	if (rc == PSR_OK)
		printf("%.1f M points, %d levels: built in %.1f s, peak %.0f MB; %.2f M leaves (%.0f %% of the points)\n",
		       (double)source.n_points * 1e-6, tree->levels, used_seconds() - begin, peak_mb(),
		       (double)tree->n_leaves * 1e-6, 100.0 * (double)tree->n_leaves / (double)source.n_points);
	octree_source_close(&source);
	if (rc != PSR_OK)
		return rc;
	rc = print_packings(tree, err);
	if (rc == PSR_OK)
		rc = print_attributes(tree, err);
	octree_destroy(tree);
	return rc;
}

static int measure_mesh(const char *path, const struct octree_build_options *options, struct psr_error *err)
{
	struct octree_mesh_report report;
	struct psr_mesh *mesh;
	struct octree *tree;
	double begin;
	int rc = psr_mesh_import(&mesh, path, NULL, err);

	if (rc != PSR_OK)
		return rc;
	begin = used_seconds();
	rc = octree_of_mesh(&tree, &report, mesh, options, err);
	if (rc == PSR_OK) {
		printf("%.2f M triangles, %d levels: built in %.1f s; %.2f M leaves, %.2f %% with both sides, %s\n",
		       (double)mesh->n_triangles * 1e-6, tree->levels, used_seconds() - begin, (double)tree->n_leaves * 1e-6,
		       100.0 * (double)report.n_both / (double)tree->n_leaves, report.is_closed ? "closed" : "open");
		rc = print_packings(tree, err);
		if (rc == PSR_OK)
			rc = print_attributes(tree, err);
		octree_destroy(tree);
	}
	psr_mesh_destroy(mesh);
	return rc;
}

int main(int argc, char **argv)
{
	char made[] = "/tmp/psr-bench-octree-XXXXXX";
	const char *path = NULL;
	uint64_t n = 20, memory = 1024;
	int levels = 12, option, rc, is_kept = 0;
	struct octree_build_options options;
	struct psr_error err;

	while ((option = getopt(argc, argv, "n:m:l:w:")) != -1) {
		if (option == '?')
			return 2;
		n = option == 'n' ? strtoull(optarg, NULL, 10) : n;
		memory = option == 'm' ? strtoull(optarg, NULL, 10) : memory;
		levels = option == 'l' ? atoi(optarg) : levels;
		path = option == 'w' ? optarg : path;
	}
	is_kept = path != NULL;
	if (optind < argc) {
		path = argv[optind];
		is_kept = 1;
	} else {
		const int fd = path == NULL ? mkstemp(made) : -1;

		if (fd >= 0)
			close(fd);
		path = path != NULL ? path : made;
		if (!make_file(path, n * 1000000)) {
			fprintf(stderr, "octree: %s cannot be written\n", path);
			return 3;
		}
	}
	octree_build_options_default(&options);
	options.levels = levels;
	options.memory = memory << 20;
	if (optind >= argc)
		print_bound((double)n * 1e6, levels);
	rc = octree_source_suits(path) ? measure_cloud(path, &options, &err) : measure_mesh(path, &options, &err);
	if (!is_kept)
		unlink(path);
	if (rc != PSR_OK)
		fprintf(stderr, "octree: %s\n", err.text);
	return psr_exit_status(rc);
}
