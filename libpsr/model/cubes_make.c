#include <math.h>
#include "base/direction.h"
#include "cubes_make.h"

#define LEAST_COSINE 0.05
/* Leaves for each cell of 2x2x2 that holds any: 4 of a surface in the mean. Where points have n in the mean for a place
 * of a leaf, there are 4 (1 - exp(-n)) / (1 - exp(-4 n)). */
#define CLOSED 3.8 /* n = 3: a twentieth of all places are empty */
#define ALONE 1.06 /* n = 0.04: the next level has as many leaves */

/* ---- counting ---- */

/* Returns how many levels the node that the skip index of a level has above subtree i is above its root. */
static int skip_up(const struct cubes_making *m, int level)
{
	const int above = m->tree->levels - m->height;

	return level < above ? level : above;
}

static int begins_skip(const struct cubes_making *m, int level, uint64_t i)
{
	const struct octree_skip *skip = &m->tree->skip[i];
	const int up = 3 * skip_up(m, level);

	return i == 0 || skip->path >> up != skip[-1].path >> up;
}

void cubes_count_task(int task, void *userdata)
{
	struct cubes_making *m = userdata;
	struct cubes_count *count = &m->task[task];
	const struct octree *tree = m->tree;
	const uint64_t end = octree_task_first(tree, task + 1);
	uint64_t n[OCTREE_SKIP_LEVELS + 1] = { 0 }, n_above = 0;

	for (uint64_t i = octree_task_first(tree, task); i < end; i++) {
		octree_subtree_count(n, tree->code + tree->skip[i].code, tree->code + tree->n_codes, m->height);
		n_above += octree_codes_above(tree, i);
		for (int l = 0; l < m->n_levels; l++)
			count->skip[l] += (uint64_t)begins_skip(m, l, i);
	}
	for (int l = 0; l < m->n_levels; l++) {
		count->cube[l] = n[l + 2];
		count->leaf[l] = n[l];
		count->code[l] = n_above;
		for (int h = l + 1; h <= m->height; h++)
			count->code[l] += n[h];
	}
}

/* ---- filling ---- */

#define MOST_BELOW(height) ((size_t)1 << 3 * (OCTREE_SKIP_LEVELS - (height))) /* nodes of a subtree */

struct subtree {
	const struct cubes_making *m;
	const uint8_t *code;        /* the next one */
	struct cubes_count next;
	/* Codes of the nodes that are leaves of the trees of levels 1 to 4, and how many. 8 are written at a time. */
	uint8_t *parent[CUBES_MOST_LEVELS];
	size_t n_parents[CUBES_MOST_LEVELS];
	uint8_t parents1[MOST_BELOW(1) + 8], parents2[MOST_BELOW(2)], parents3[MOST_BELOW(3)], parents4[MOST_BELOW(4)];
};

/* place: CUBES_PLACE_BITS a coordinate. */
static void put_cube(struct subtree *s, int level, uint64_t place)
{
	const struct cubes_making *m = s->m;
	const uint64_t in_level = s->next.cube[level]++, cube = m->cubes->level[level].first + in_level;
	const uint64_t code = level == 0 ? (uint64_t)(s->code - m->tree->code) : s->next.code[level];
	const uint64_t leaf = s->next.leaf[level], word = place | (uint64_t)level << 3 * CUBES_PLACE_BITS;

	if (in_level % CUBES_RUN == 0)
		m->run[level][in_level / CUBES_RUN] = (struct psr_cube_run){ (uint32_t)code, (uint32_t)leaf };
	m->cube[cube] = (struct psr_cube){ { (uint32_t)word, (uint32_t)(word >> 32) }, (uint16_t)code, (uint16_t)leaf };
	m->flags[cube] = (uint8_t)(level | (psr_octree_is_one_sided(m->tree) ? 0 : PSR_BLOCK_TWO_SIDED));
}

/* Puts a node and all below it, which is a cube of the level whose leaves are two below it. */
static void put_node(struct subtree *s, int height, uint64_t place)
{
	const struct cubes_making *m = s->m;
	unsigned code;

	put_cube(s, height - 2, place);
	code = *s->code++;
	for (int l = 1; l < height && l < m->n_levels; l++)
		m->coarse[l]->code[s->next.code[l]++] = (uint8_t)code;
	if (height < m->n_levels) {
		s->parent[height][s->n_parents[height]++] = (uint8_t)code;
		s->next.leaf[height]++;
	}
	if (height > 2) {
		for (unsigned left = code; left != 0; left &= left - 1) {
			const uint64_t j = (uint64_t)__builtin_ctz(left);

			put_node(s, height - 1, place << 1 | (j & 1) | (j >> 1 & 1) << CUBES_PLACE_BITS
			                            | j >> 2 << 2 * CUBES_PLACE_BITS);
		}
		return;
	}
	const unsigned n = octree_popcount(code);
	const uint64_t children = psr_cubes_children(m->tree, (uint32_t)(s->code - 1 - m->tree->code));

	memcpy(s->parent[1] + s->n_parents[1], &children, sizeof children);
	s->n_parents[1] += n;
	s->next.leaf[1] += n;
	s->next.leaf[0] += octree_popcount(children & UINT64_MAX >> 8 * (8 - n));
	s->code += n;
}

/* As leaves have them of their points: the mean of intensities, class and return of the first child. */
static void average_scan(const struct octree_scan *to, uint64_t leaf, const struct octree_scan *from, uint64_t first,
                         unsigned n)
{
	if (to->intensity != NULL) {
		unsigned sum = n / 2;

		for (unsigned i = 0; i < n; i++)
			sum += from->intensity[first + i];
		to->intensity[leaf] = (uint16_t)(sum / n);
	}
	if (to->class != NULL)
		to->class[leaf] = from->class[first];
	if (to->returns != NULL)
		to->returns[leaf] = from->returns[first];
}

/* Gives the leaves of a level's tree, from `leaf` on, the means of those of the finer one from `finer_leaf` on. */
static void average(const struct subtree *s, int level, uint64_t leaf, uint64_t finer_leaf)
{
	const struct octree *finer = s->m->cubes->level[level - 1].tree, *tree = s->m->coarse[level];

	for (size_t i = 0; i < s->n_parents[level]; i++, leaf++) {
		const unsigned code = s->parent[level][i], n = octree_popcount(code);

		if (tree->normal != NULL)
			tree->normal[leaf] = octree_mean_normal(finer->normal + finer_leaf, n);
		if (tree->color != NULL)
			octree_mean_color(tree->color[leaf], (const uint8_t(*)[3])finer->color + finer_leaf, n);
		if (tree->material != NULL)
			octree_put_material(tree->material[leaf], octree_mean_material(finer, finer_leaf, n));
		if (tree->offset != NULL)
			tree->offset[leaf] = (uint8_t)octree_mean_offset(code, tree->normal[leaf], finer->normal + finer_leaf,
			                                                 finer->offset + finer_leaf);
		average_scan(&tree->scan, leaf, &finer->scan, finer_leaf, n);
		finer_leaf += n;
	}
}

/* Finds the cone of a cube's normals, and of the faces that they may be of, from which they lean by this sine. */
static void make_cone(const struct cubes_making *m, uint64_t cube, const uint16_t *normal, unsigned n, double lean)
{
	const float(*direction)[3] = psr_direction_table();
	double sum[3] = { 0, 0, 0 }, axis[3], most = 0, length = 0, least = 1;

	for (unsigned i = 0; i < n; i++)
		for (int a = 0; a < 3; a++)
			sum[a] += (double)direction[normal[i]][a];
	for (int a = 0; a < 3; a++)
		most = fmax(most, fabs(sum[a]));
	for (int a = 0; a < 3; a++) {
		axis[a] = most > 1e-9 ? floor(sum[a] / most * 127 + 0.5) : 0;
		m->axis[a][cube] = (int8_t)axis[a];
		length += axis[a] * axis[a];
	}
	length = sqrt(length);
	for (unsigned i = 0; i < n; i++) {
		const float *v = direction[normal[i]];

		least = fmin(least, (axis[0] * (double)v[0] + axis[1] * (double)v[1] + axis[2] * (double)v[2]) / length);
	}
	if (lean > 0)
		least = least * sqrt(1 - lean * lean) - sqrt(fmax(1 - least * least, 0)) * lean;
	const double sine = ceil(sqrt(1 - least * least) * 255 + 1e-3);
	m->sine[cube] = (uint8_t)(least >= LEAST_COSINE && sine < PSR_CONE_ANY ? sine : PSR_CONE_ANY);
}

/* How far leaves of subtree i lean. */
static uint8_t lean_of(const struct octree *tree, uint64_t i)
{
	const int depth = tree->levels - octree_subtree_height(tree), below = OCTREE_LEAN_DEPTH - depth;
	const uint64_t first = octree_lean_first(tree->skip[i].path, depth), n = below > 0 ? UINT64_C(1) << 3 * below : 1;
	uint8_t most = 0;

	for (uint64_t k = first; tree->lean != NULL && k < first + n; k++)
		most = tree->lean[k] > most ? tree->lean[k] : most;
	return most;
}

/* The cubes of a level from `cube` to the next one, whose leaves begin with `leaf`. */
static void make_cones(const struct subtree *s, int level, uint64_t cube, uint64_t leaf, uint8_t lean)
{
	const struct cubes_making *m = s->m;
	const struct psr_cube_level *of = &m->cubes->level[level];
	const uint64_t end = of->first + s->next.cube[level];

	for (cube += of->first; cube < end; cube++) {
		const uint16_t next = cube + 1 < end ? m->cube[cube + 1].leaf : (uint16_t)s->next.leaf[level];
		const unsigned n = (uint16_t)(next - m->cube[cube].leaf);

		make_cone(m, cube, of->tree->normal + leaf, n, lean / 255.0);
		if (m->traits != NULL)
			m->traits[cube] = lean > 0 ? PSR_BLOCK_BENT : 0;
		leaf += n;
	}
}

/* The sphere of a cluster's box of cubes, grown by how far leaves reach beyond their cubes' middles. */
static void make_cluster(const struct subtree *s, int level, uint64_t i, uint64_t cube)
{
	const struct cubes_making *m = s->m;
	const struct psr_cube_level *of = &m->cubes->level[level];
	struct psr_cluster *k = &m->cluster[(uint64_t)level * m->tree->n_skips + i];
	double low[3] = { INFINITY, INFINITY, INFINITY }, high[3] = { -INFINITY, -INFINITY, -INFINITY }, square = 0;

	*k = (struct psr_cluster){ .first_block = (uint32_t)(of->first + cube), .group = (uint32_t)i, .level = (uint8_t)level,
		                       .n_blocks = (uint32_t)(s->next.cube[level] - cube) };
	for (uint32_t b = k->first_block; b < k->first_block + k->n_blocks; b++) {
		double center[3];

		psr_cubes_center(m->cubes, of, b, center);
		for (int a = 0; a < 3; a++) {
			low[a] = center[a] < low[a] ? center[a] : low[a];
			high[a] = center[a] > high[a] ? center[a] : high[a];
		}
	}
	for (int a = 0; a < 3; a++) {
		const double center = (double)(float)((low[a] + high[a]) / 2);
		const double reach = fmax(high[a] - center, center - low[a]);

		k->center[a] = (float)center;
		square += reach * reach;
	}
	k->radius = (float)((sqrt(square) + CUBES_RADIUS * of->edge) * (1 + 1e-6));
}

/* Leaves of a sparse cloud are drawn as wide as those of the next level, so that no background shows between them; and
 * leaves that stand alone, as wide as the next level's are. first: of the subtree; root: its code. */
static void widen(const struct subtree *s, const struct cubes_count *first, uint8_t root)
{
	const struct cubes_making *m = s->m;
	uint64_t n_cells = octree_popcount(root);
	unsigned wider = 0;

	for (int l = m->n_levels; l-- > 0;) {
		const uint64_t n_leaves = s->next.leaf[l] - first->leaf[l], begin = m->cubes->level[l].first;
		const double filled = (double)n_leaves / (double)n_cells;

		wider = filled >= CLOSED ? 0 : filled >= ALONE ? 1 : wider + 1;
		for (uint64_t cube = begin + first->cube[l]; cube < begin + s->next.cube[l]; cube++)
			m->flags[cube] = (uint8_t)(m->flags[cube] + wider);
		n_cells = n_leaves;
	}
}

/* Puts the codes of nodes above subtree i, and its entries of skip indices. */
static void put_above(struct subtree *s, uint64_t i)
{
	const struct cubes_making *m = s->m;
	const struct octree_skip *skip = &m->tree->skip[i];
	const unsigned n = octree_codes_above(m->tree, i);

	s->code = m->tree->code + skip->code;
	for (int l = 1; l < m->n_levels; l++) {
		struct octree *tree = m->coarse[l];
		const int up = skip_up(m, l);

		memcpy(tree->code + s->next.code[l], s->code - n, n);
		s->next.code[l] += n;
		if (begins_skip(m, l, i))
			tree->skip[s->next.skip[l]++] =
				(struct octree_skip){ skip->path >> 3 * up, s->next.code[l] - (uint64_t)up, s->next.leaf[l] };
	}
}

static void put_subtree(struct subtree *s, uint64_t i)
{
	const struct cubes_making *m = s->m;
	const uint8_t lean = lean_of(m->tree, i);
	struct cubes_count first;
	uint32_t at[3];
	uint8_t root;

	put_above(s, i);
	first = s->next;
	root = *s->code;
	memset(s->n_parents, 0, sizeof s->n_parents);
	octree_place(m->tree->skip[i].path, at);
	put_node(s, m->height, at[0] | (uint64_t)at[1] << CUBES_PLACE_BITS | (uint64_t)at[2] << 2 * CUBES_PLACE_BITS);
	for (int l = 0; l < m->n_levels; l++) {
		if (l > 0)
			average(s, l, first.leaf[l], first.leaf[l - 1]);
		if (m->sine != NULL)
			make_cones(s, l, first.cube[l], first.leaf[l], lean);
		make_cluster(s, l, i, first.cube[l]);
	}
	if (m->tree->is_cloud)
		widen(s, &first, root);
}

void cubes_fill_task(int task, void *userdata)
{
	const struct cubes_making *m = userdata;
	const uint64_t end = octree_task_first(m->tree, task + 1);
	struct subtree s;

	s.m = m;
	s.next = m->task[task];
	s.parent[1] = s.parents1;
	s.parent[2] = s.parents2;
	s.parent[3] = s.parents3;
	s.parent[4] = s.parents4;
	for (uint64_t i = octree_task_first(m->tree, task); i < end; i++)
		put_subtree(&s, i);
}
