#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "cloud.h"

#define LEAF 8
#define CHUNK 4096 /* slots a task */

/* Points first .. end - 1; the children of an inner node are the next node and `right`. */
struct cloud_node {
	double split;
	uint32_t first, end, right;
	int axis; /* -1: a leaf */
};

static int is_before(const struct cloud_point *a, const struct cloud_point *b, int axis)
{
	return a->at[axis] != b->at[axis] ? a->at[axis] < b->at[axis] : a->id < b->id;
}

static void swap(struct cloud_point *a, struct cloud_point *b)
{
	struct cloud_point t = *a;
	*a = *b;
	*b = t;
}

/* Hoare's selection: moves the point of rank `middle` to its place, and smaller ones before it. The order is total, so
 * that equal coordinates cost nothing; pivots are pseudo-random, so that no ordered file is a bad case. */
static void select_rank(struct cloud_point *p, uint32_t first, uint32_t end, uint32_t middle, int axis)
{
	uint64_t random = UINT64_C(0x9e3779b97f4a7c15) * (end - first);
	while (end - first > 1) {
		uint32_t i = first, j = end - 1;
		struct cloud_point pivot;
		random = random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
		pivot = p[first + (uint32_t)((random >> 32) % (end - first))];
		while (i <= j) {
			while (is_before(&p[i], &pivot, axis))
				i++;
			while (is_before(&pivot, &p[j], axis))
				j--;
			if (i <= j) {
				swap(&p[i++], &p[j]);
				if (j == 0)
					break;
				j--;
			}
		}
		if (middle <= j && j < end)
			end = j + 1;
		else if (middle >= i)
			first = i;
		else
			return;
	}
}

static int widest_axis(const struct cloud_point *p, uint32_t first, uint32_t end)
{
	double low[3], high[3];
	int axis = 0;
	memcpy(low, p[first].at, sizeof low);
	memcpy(high, p[first].at, sizeof high);
	for (uint32_t i = first + 1; i < end; i++)
		for (int c = 0; c < 3; c++) {
			double x = p[i].at[c];
			low[c] = x < low[c] ? x : low[c];
			high[c] = x > high[c] ? x : high[c];
		}
	for (int c = 1; c < 3; c++)
		if (high[c] - low[c] > high[axis] - low[axis])
			axis = c;
	return axis;
}

/* Halving bounds the depth by the logarithm of the number of leaves. */
static void build(struct cloud *cloud, uint32_t first, uint32_t end)
{
	struct cloud_node *node = &cloud->node[cloud->n_nodes++];
	const uint32_t middle = first + (end - first) / 2;
	*node = (struct cloud_node){ 0.0, first, end, 0, -1 };
	if (end - first <= LEAF)
		return;
	node->axis = widest_axis(cloud->point, first, end);
	select_rank(cloud->point, first, end, middle, node->axis);
	node->split = cloud->point[middle].at[node->axis];
	build(cloud, first, middle);
	node->right = cloud->n_nodes;
	build(cloud, middle, end);
}

static void normalise(struct cloud *cloud, const double (*position)[3])
{
	double low[3], high[3];
	memcpy(low, position[0], sizeof low);
	memcpy(high, position[0], sizeof high);
	for (uint32_t i = 1; i < cloud->n; i++)
		for (int c = 0; c < 3; c++) {
			low[c] = fmin(low[c], position[i][c]);
			high[c] = fmax(high[c], position[i][c]);
		}
	cloud->unit = 0.0;
	for (int c = 0; c < 3; c++) {
		cloud->middle[c] = 0.5 * low[c] + 0.5 * high[c];
		cloud->unit = fmax(cloud->unit, 0.5 * high[c] - 0.5 * low[c]);
	}
	if (!(cloud->unit > 0.0))
		cloud->unit = 1.0;
	for (uint32_t i = 0; i < cloud->n; i++) {
		cloud->point[i].id = i;
		for (int c = 0; c < 3; c++)
			cloud->point[i].at[c] = (position[i][c] - cloud->middle[c]) / cloud->unit;
	}
}

int cloud_tree_build(struct cloud *cloud, const double (*position)[3])
{
	/* Splitting 9 points leaves at least 4 in a leaf. */
	const size_t n_nodes = 2 * ((size_t)cloud->n / (LEAF / 2)) + 1;
	cloud->k = cloud->n - 1 < CLOUD_NEIGHBOURS ? cloud->n - 1 : CLOUD_NEIGHBOURS;
	cloud->point = malloc(cloud->n * sizeof *cloud->point);
	cloud->node = malloc(n_nodes * sizeof *cloud->node);
	cloud->near = malloc(((size_t)cloud->n * cloud->k + 1) * sizeof *cloud->near);
	if (cloud->point == NULL || cloud->node == NULL || cloud->near == NULL)
		return PSR_ERR_MEMORY;
	normalise(cloud, position);
	build(cloud, 0, cloud->n);
	return PSR_OK;
}

/* The k nearest points so far, in order of distance, then of id. */
struct search {
	const struct cloud *cloud;
	const double *from;
	uint32_t self, n;
	uint32_t slot[CLOUD_NEIGHBOURS];
	double distance[CLOUD_NEIGHBOURS]; /* squared */
	double offset[3];                  /* to the current cell, along each axis */
};

static void try_point(struct search *s, uint32_t slot)
{
	const struct cloud_point *p = s->cloud->point, *q = &p[slot];
	const double dx = q->at[0] - s->from[0], dy = q->at[1] - s->from[1], dz = q->at[2] - s->from[2];
	const double d = dx * dx + dy * dy + dz * dz;
	const uint32_t k = s->cloud->k;
	uint32_t i;
	if (slot == s->self)
		return;
	if (s->n == k) {
		if (d > s->distance[k - 1] || (d == s->distance[k - 1] && q->id > p[s->slot[k - 1]].id))
			return;
	} else {
		s->n++;
	}
	for (i = s->n - 1; i > 0; i--) {
		if (s->distance[i - 1] < d || (s->distance[i - 1] == d && p[s->slot[i - 1]].id < q->id))
			break;
		s->distance[i] = s->distance[i - 1];
		s->slot[i] = s->slot[i - 1];
	}
	s->distance[i] = d;
	s->slot[i] = slot;
}

/* `distance`: squared, of the node's cell. Visits cells as far as the k-th neighbour, since ids break ties. */
static void search(struct search *s, uint32_t at, double distance)
{
	const struct cloud_node *node = &s->cloud->node[at];
	double to_split, before, farther;
	if (node->axis < 0) {
		for (uint32_t i = node->first; i < node->end; i++)
			try_point(s, i);
		return;
	}
	to_split = s->from[node->axis] - node->split;
	search(s, to_split < 0.0 ? at + 1 : node->right, distance);
	before = s->offset[node->axis];
	farther = distance - before * before + to_split * to_split;
	/* The factor allows for rounding. */
	if (s->n < s->cloud->k || farther * (1.0 - 1e-12) <= s->distance[s->cloud->k - 1]) {
		s->offset[node->axis] = to_split;
		search(s, to_split < 0.0 ? node->right : at + 1, farther);
		s->offset[node->axis] = before;
	}
}

static void nearest_of_chunk(int chunk, void *userdata)
{
	struct cloud *cloud = userdata;
	const uint64_t first = (uint64_t)chunk * CHUNK, end = first + CHUNK < cloud->n ? first + CHUNK : cloud->n;
	for (uint64_t i = first; i < end; i++) {
		struct search s = { .cloud = cloud, .from = cloud->point[i].at, .self = (uint32_t)i };
		search(&s, 0, 0.0);
		memcpy(&cloud->near[i * cloud->k], s.slot, cloud->k * sizeof s.slot[0]);
	}
}

void cloud_tree_nearest(struct cloud *cloud)
{
	if (cloud->k > 0)
		psr_pool_for(cloud->pool, (int)((cloud->n + CHUNK - 1) / CHUNK), nearest_of_chunk, cloud);
}
