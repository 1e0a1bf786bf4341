#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "feed.h"
#include "gray.h"
#include "pcd_points.h"
#include "spread.h"
#include "import/cloud/pcd_point.h"

#define MOST_POINTS ((uint64_t)1 << 40)
#define MOST_WORDS ((size_t)1 << 26) /* bytes of a point of text */

struct pcd_points {
	struct feed feed;
	struct pcd pcd;
	struct pcd_roles roles;
	uint8_t *head;            /* the file's first bytes: names of fields point there */
	uint8_t *unpacked;        /* all points, of a compressed file */
	uint64_t next, step;      /* step: spread.h */
	size_t words;             /* bytes that the next point of text may take */
	struct gray gray;
	locale_t locale;
};

static int read_header(struct pcd_points *p, struct psr_error *err)
{
	int rc = feed_need(&p->feed, FEED_WINDOW, err);

	if (rc != PSR_OK)
		return rc;
	p->head = malloc(p->feed.n);
	if (p->head == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for the header", p->feed.path);
	memcpy(p->head, p->feed.bytes, p->feed.n);
	p->pcd = (struct pcd){ .path = p->feed.path, .bytes = p->head, .n_there = p->feed.n, .n_bytes = p->feed.n_bytes,
		                   .most = MOST_POINTS };
	rc = pcd_header_read(&p->pcd, err);
	return rc == PSR_OK ? pcd_roles_find(&p->roles, &p->pcd, err) : rc;
}

static int unpack(struct pcd_points *p, uint64_t most, struct psr_error *err)
{
	const struct pcd *pcd = &p->pcd;
	uint64_t packed;
	int rc;

	if (pcd->n_points > most / pcd->record)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: %llu compressed points take more than %llu MB; write them as \"DATA "
		                "binary\", which needs no memory, with \"pcl_convert_pcd_ascii_binary IN.pcd OUT.pcd 1\"", pcd->path,
		                (unsigned long long)pcd->n_points, (unsigned long long)(most >> 20));
	feed_seek(&p->feed, pcd->body);
	rc = feed_need(&p->feed, PCD_SIZES, err);
	if (rc == PSR_OK && p->feed.n < PCD_SIZES)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the compressed points are cut short", pcd->path);
	if (rc == PSR_OK)
		rc = pcd_check_sizes(&packed, pcd, p->feed.bytes, err);
	if (rc != PSR_OK)
		return rc;
	p->feed.next = PCD_SIZES;
	rc = feed_need(&p->feed, (size_t)packed, err);
	if (rc == PSR_OK)
		rc = pcd_unpack(&p->unpacked, pcd, p->feed.bytes + p->feed.next, packed, err);
	feed_close(&p->feed);
	return rc;
}

static void go_to_first(struct pcd_points *p)
{
	p->next = 0;
	p->words = FEED_LINE;
	feed_seek(&p->feed, p->pcd.body);
}

static int fail_words(const struct pcd_points *p, struct psr_error *err)
{
	return psr_fail(err, PSR_ERR_FORMAT,
	                "%s: point %llu of %llu, below line %u: expected %llu numbers; is the file cut short?", p->feed.path,
	                (unsigned long long)p->next + 1, (unsigned long long)p->pcd.n_points, p->pcd.data_line,
	                (unsigned long long)p->pcd.columns);
}

/* Words of a point may be in any number of lines: asks for more of the file until they are there. */
static int parse(struct pcd_points *p, struct pcd_point *point, struct psr_error *err)
{
	for (;;) {
		const uint8_t *at, *end;
		int rc = feed_need(&p->feed, p->words, err), is_whole, is_there;

		if (rc != PSR_OK)
			return rc;
		is_whole = p->feed.at + p->feed.n == p->feed.n_bytes;
		at = p->feed.bytes + p->feed.next;
		end = p->feed.bytes + p->feed.n;
		is_there = pcd_point_parse(point, &p->roles, &p->pcd, &at, end, p->locale);
		if (is_there && (at < end || is_whole)) {
			p->feed.next = (size_t)(at - p->feed.bytes);
			return PSR_OK;
		}
		if (at < end || is_whole || p->words > MOST_WORDS)
			return fail_words(p, err);
		p->words *= 2;
	}
}

static int next_point(struct pcd_points *p, struct pcd_point *point, struct psr_error *err)
{
	const uint64_t record = p->pcd.record;
	int rc = PSR_OK;

	if (p->pcd.data == PCD_ASCII) {
		rc = parse(p, point, err);
	} else if (p->pcd.data == PCD_COMPRESSED) {
		pcd_point_get(point, &p->roles, &p->pcd, p->unpacked, p->next);
	} else {
		if (p->feed.n - p->feed.next < record)
			rc = feed_need(&p->feed, (size_t)record, err);
		if (rc == PSR_OK)
			pcd_point_get(point, &p->roles, &p->pcd, p->feed.bytes + p->feed.next, 0);
		p->feed.next += (size_t)record;
	}
	p->next = spread_next(p->step, p->next + 1);
	if (p->step > 1 && p->next % SPREAD_RUN == 0 && p->next < p->pcd.n_points && p->pcd.data == PCD_BINARY)
		feed_seek(&p->feed, p->pcd.body + p->next * record);
	return rc;
}

static void put_point(struct octree_point *to, const struct pcd_points *p, const struct pcd_point *point)
{
	for (int c = 0; c < 3; c++) {
		to->at[c] = point->value[PCD_X + c];
		to->normal[c] = (float)point->value[PCD_NORMAL_X + c];
		to->color[c] = (uint8_t)(point->rgb >> (16 - 8 * c));
		if (p->roles.field[PCD_INTENSITY] != NULL)
			to->color[c] = gray_code(&p->gray, point->value[PCD_INTENSITY]);
	}
}

static int go_back(void *userdata, struct psr_error *err)
{
	(void)err;
	go_to_first(userdata);
	return PSR_OK;
}

static int read_points(size_t *n, struct octree_point *points, size_t room, void *userdata, struct psr_error *err)
{
	struct pcd_points *p = userdata;
	struct pcd_point point;
	int rc = PSR_OK;

	for (*n = 0; *n < room && p->next < p->pcd.n_points && rc == PSR_OK;) {
		rc = next_point(p, &point, err);
		if (rc == PSR_OK)
			put_point(&points[(*n)++], p, &point);
	}
	return rc;
}

static int find_gray(struct pcd_points *p, struct psr_error *err)
{
	struct pcd_point point;
	int rc = PSR_OK;

	go_to_first(p);
	if (p->roles.field[PCD_INTENSITY] == NULL)
		return PSR_OK;
	if (!gray_begin(&p->gray))
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for intensities", p->feed.path);
	while (p->next < p->pcd.n_points && rc == PSR_OK) {
		rc = next_point(p, &point, err);
		if (rc == PSR_OK)
			gray_note(&p->gray, point.value[PCD_INTENSITY]);
	}
	gray_end(&p->gray);
	if (p->gray.scale == 0.0)
		p->roles.field[PCD_INTENSITY] = NULL;
	go_to_first(p);
	return rc;
}

/* A run has a window of its own. */
static void set_part(struct pcd_points *p, uint64_t part)
{
	p->step = p->pcd.data == PCD_ASCII ? 1 : spread_step(p->pcd.n_points, part);
	if (p->step > 1 && SPREAD_RUN * p->pcd.record < FEED_WINDOW)
		p->feed.room = (size_t)(SPREAD_RUN * p->pcd.record);
}

int pcd_points_open(struct octree_source *out, const char *path, uint64_t most, uint64_t part, struct psr_error *err)
{
	struct pcd_points *p = calloc(1, sizeof *p);
	int rc;

	if (p == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to read it", path);
	*out = (struct octree_source){ .name = path, .rewind = go_back, .read = read_points, .userdata = p };
	rc = feed_open(&p->feed, path, err);
	if (rc == PSR_OK)
		rc = read_header(p, err);
	if (rc == PSR_OK && p->pcd.data == PCD_COMPRESSED)
		rc = unpack(p, most, err);
	if (rc == PSR_OK) {
		p->locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
		if (p->locale == (locale_t)0)
			rc = psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a locale", path);
	}
	if (rc == PSR_OK) {
		set_part(p, part);
		rc = find_gray(p, err);
	}
	if (rc != PSR_OK) {
		pcd_points_close(out);
		return rc;
	}
	out->has_color = p->roles.field[PCD_RGB] != NULL || p->roles.field[PCD_INTENSITY] != NULL;
	out->has_normal = p->roles.field[PCD_NORMAL_X] != NULL;
	out->n_points = (p->pcd.n_points + p->step - 1) / p->step;
	return PSR_OK;
}

void pcd_points_close(struct octree_source *source)
{
	struct pcd_points *p = source->userdata;

	if (p == NULL)
		return;
	feed_close(&p->feed);
	gray_fini(&p->gray);
	if (p->locale != (locale_t)0)
		freelocale(p->locale);
	free(p->head);
	free(p->unpacked);
	free(p);
	source->userdata = NULL;
}
