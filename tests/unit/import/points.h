/* Files of points that tests write and read. Include behind cmocka.h. */
#ifndef TESTS_IMPORT_POINTS_H
#define TESTS_IMPORT_POINTS_H

#include "files.h"
#include "import/points/points.h"

#define MOST_READ 64

struct read {
	struct octree_point point[MOST_READ];
	size_t n;
	int has_color, has_normal;
	uint64_t left_out, promised;
};

/* Reads all points, twice. Returns what fails, or PSR_OK. */
static inline int try_points(struct read *r, const char *name, struct psr_error *err)
{
	struct octree_source source;
	struct octree_point again[7];
	int rc = octree_source_open(&source, path_of(name), err);

	r->n = 0;
	if (rc != PSR_OK)
		return rc;
	r->has_color = source.has_color;
	r->has_normal = source.has_normal;
	r->promised = source.n_points;
	rc = source.rewind(source.userdata, err);
	for (size_t n = 1; rc == PSR_OK && n > 0; r->n += n) {
		assert_true(r->n < MOST_READ);
		rc = source.read(&n, r->point + r->n, MOST_READ - r->n, source.userdata, err);
		n = rc == PSR_OK ? n : 0;
	}
	r->left_out = octree_source_count(&source).n_left_out;
	assert_true(rc != PSR_OK || octree_source_count(&source).n_read == r->n);
	if (rc == PSR_OK) {
		size_t at = 0;

		rc = source.rewind(source.userdata, err);
		for (size_t n = 1; rc == PSR_OK && n > 0; at += n) {
			rc = source.read(&n, again, 7, source.userdata, err);
			assert_int_equal(rc, PSR_OK);
			for (size_t i = 0; i < n; i++) {
				assert_memory_equal(again[i].at, r->point[at + i].at, sizeof again[i].at);
				assert_memory_equal(again[i].color, r->point[at + i].color, 3);
			}
		}
		assert_int_equal(at, r->n);
	}
	octree_source_close(&source);
	return rc;
}

static inline void read_all(struct read *r, const char *name)
{
	struct psr_error err;

	if (try_points(r, name, &err) != PSR_OK)
		fail_msg("%s", err.text);
}

static inline void refuse_points(const char *name, int code, const char *words)
{
	struct read r;
	struct psr_error err = { 0, "" };
	const int rc = try_points(&r, name, &err);

	if (rc != code || err.code != code || strstr(err.text, words) == NULL || strstr(err.text, name) == NULL)
		fail_msg("expected %d with \"%s\", got %d: %s", code, words, rc, err.text);
}

#endif
