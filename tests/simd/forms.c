/* The forms of the warp's arithmetic that [G] 7.1 gives, beside the one that frames run: each is as far from doubles
 * as its roundings allow, and no further. With --bench: nanoseconds a sample by instruction set, and errors by how
 * obliquely a projection is seen. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "simd/isa.h"
#include "simd/block.h"

#define JOBS 256
#define SAMPLES PSR_BLOCK_SAMPLES
#define PICTURE 1024.0 /* pixels that the unit sphere spans at the distance DISTANCE */
#define DISTANCE 2.5

enum form { DIRECT, INCREMENTAL, OPTIMIZED, LOOKED_UP, LOOKED_UP_OPTIMIZED, N_FORMS };

static const char *const name_of[N_FORMS] = {
	"direct, (7.3)", "incremental, (7.6)", "optimized, (7.6')", "(7.6) looked up: frames", "(7.6') looked up",
};

/* A full block of a projection, and depths by column, which is how the incremental forms come upon them. */
struct job {
	struct warp_lattice lattice;
	struct warp_block block;
	double dx, dy, col, row, bias, step;
	uint16_t depth[SAMPLES], by_column[SAMPLES];
};

/* By row, or by column for the incremental forms. */
struct places {
	float u[SAMPLES], v[SAMPLES], z[SAMPLES];
};

typedef void form_fn(struct places *restrict out, const struct job *restrict job);

/* A loop that becomes vectors: the compiler would rather unroll so short a one, and then not find any. */
#define EIGHT(i) _Pragma("GCC unroll 1") for (uint32_t i = 0; i < 8; i++)
#define BODY static inline __attribute__((always_inline)) void

BODY widen(float to[SAMPLES], const uint16_t from[SAMPLES])
{
	for (int i = 0; i < SAMPLES; i++)
		to[i] = from[i];
}

/* The whole transformation of each sample. */
BODY direct(struct places *restrict out, const struct job *restrict job)
{
	float m[3][4];
	for (int a = 0; a < 3; a++) {
		m[a][0] = (float)(job->lattice.step[a] / job->dx);
		m[a][1] = (float)(job->lattice.down[a] / job->dy);
		m[a][2] = (float)job->lattice.along[a];
		m[a][3] = (float)job->lattice.origin[a];
	}
	const float dx = (float)job->dx, dy = (float)job->dy, col = (float)job->col, row = (float)job->row;
	const float bias = (float)job->bias, step = (float)job->step;
	float depth[SAMPLES];
	widen(depth, job->depth);
	for (int32_t i = 0; i < SAMPLES; i++) {
		const float x = (col + (float)(i & 7) + 0.5f * (float)(i >> 3 & 1)) * dx, y = (row + (float)(i >> 3)) * dy;
		const float z = bias + step * depth[i];
		const float x1 = ((m[0][0] * x + m[0][1] * y) + m[0][2] * z) + m[0][3];
		const float y1 = ((m[1][0] * x + m[1][1] * y) + m[1][2] * z) + m[1][3];
		const float z1 = ((m[2][0] * x + m[2][1] * y) + m[2][2] * z) + m[2][3], inverse = 1 / z1;
		out->u[i] = x1 * inverse;
		out->v[i] = y1 * inverse;
		out->z[i] = z1;
	}
}

/* p, q, r of the first sample of each row, each row from the one before, (7.4'). */
BODY begin_rows(float p[3][8], const double first[3], const double down[3], const double step[3])
{
	for (int a = 0; a < 3; a++) {
		const float to_odd = (float)(down[a] + 0.5 * step[a]), to_even = (float)(down[a] - 0.5 * step[a]);
		p[a][0] = (float)first[a];
		for (int r = 1; r < 8; r++)
			p[a][r] = p[a][r - 1] + (r & 1 ? to_odd : to_even);
	}
}

/* Along all rows at once. */
BODY incremental(struct places *restrict out, const struct job *restrict job)
{
	const struct warp_block *b = &job->block;
	const float *unit = b->unit;
	float p[3][8], step[3], depth[SAMPLES];
	widen(depth, job->by_column);
	begin_rows(p, b->origin, job->lattice.down, job->lattice.step);
	for (int a = 0; a < 3; a++)
		step[a] = (float)job->lattice.step[a];
	for (int c = 0; c < 8; c++) {
		const float *d = depth + 8 * c;
		float *u = out->u + 8 * c, *v = out->v + 8 * c, *z = out->z + 8 * c;
		EIGHT(r) {
			const float z1 = p[2][r] + d[r] * unit[2], inverse = 1 / z1;
			u[r] = (p[0][r] + d[r] * unit[0]) * inverse;
			v[r] = (p[1][r] + d[r] * unit[1]) * inverse;
			z[r] = z1;
			p[0][r] += step[0];
			p[1][r] += step[1];
			p[2][r] += step[2];
		}
	}
}

/* (7.8): x and y of a vector less A_xz / A_zz and A_yz / A_zz times its z. */
BODY reduce(double out[3], const double in[3], const double along[3])
{
	for (int a = 0; a < 3; a++)
		out[a] = a < 2 ? in[a] - along[a] / along[2] * in[2] : in[2];
}

BODY optimized(struct places *restrict out, const struct job *restrict job)
{
	const struct warp_block *b = &job->block;
	const double *along = job->lattice.along;
	const float across = (float)(along[0] / along[2]), upright = (float)(along[1] / along[2]), unit = b->unit[2];
	double first[3], down[3], right[3];
	float p[3][8], step[3], depth[SAMPLES];
	widen(depth, job->by_column);
	reduce(first, b->origin, along);
	reduce(down, job->lattice.down, along);
	reduce(right, job->lattice.step, along);
	begin_rows(p, first, down, right);
	for (int a = 0; a < 3; a++)
		step[a] = (float)right[a];
	for (int c = 0; c < 8; c++) {
		const float *d = depth + 8 * c;
		float *u = out->u + 8 * c, *v = out->v + 8 * c, *z = out->z + 8 * c;
		EIGHT(r) {
			const float z1 = p[2][r] + d[r] * unit, inverse = 1 / z1;
			u[r] = p[0][r] * inverse + across;
			v[r] = p[1][r] * inverse + upright;
			z[r] = z1;
			p[0][r] += step[0];
			p[1][r] += step[1];
			p[2][r] += step[2];
		}
	}
}

/* As the kernels have it. */
BODY looked_up(struct places *restrict out, const struct job *restrict job)
{
	const struct warp_block *b = &job->block;
	struct warp_terms terms;
	float depth[SAMPLES];
	widen(depth, job->depth);
	warp_terms_make(&terms, b);
	for (uint32_t r = 0; r < 8; r++) {
		const float *d = depth + 8 * r;
		float *u = out->u + 8 * r, *v = out->v + 8 * r, *z = out->z + 8 * r;
		EIGHT(c) {
			const float z1 = warp_axis(&terms, b, 2, r, c, d[c]), inverse = 1 / z1;
			u[c] = warp_axis(&terms, b, 0, r, c, d[c]) * inverse;
			v[c] = warp_axis(&terms, b, 1, r, c, d[c]) * inverse;
			z[c] = z1;
		}
	}
}

BODY looked_up_optimized(struct places *restrict out, const struct job *restrict job)
{
	const struct warp_block *b = &job->block;
	const double *along = job->lattice.along;
	const float across = (float)(along[0] / along[2]), upright = (float)(along[1] / along[2]);
	struct warp_terms terms;
	float depth[SAMPLES];
	widen(depth, job->depth);
	for (int i = 0; i < 8; i++) {
		double row[3], col[3], from[3];
		for (int a = 0; a < 3; a++)
			from[a] = b->origin[a] + job->lattice.row[a][i];
		reduce(row, from, along);
		for (int a = 0; a < 3; a++)
			from[a] = i * job->lattice.step[a];
		reduce(col, from, along);
		for (int a = 0; a < 3; a++) {
			terms.row[a][i] = (float)row[a];
			terms.col[a][i] = (float)col[a];
		}
	}
	for (uint32_t r = 0; r < 8; r++) {
		const float *d = depth + 8 * r;
		float *u = out->u + 8 * r, *v = out->v + 8 * r, *z = out->z + 8 * r;
		EIGHT(c) {
			const float z1 = warp_axis(&terms, b, 2, r, c, d[c]), inverse = 1 / z1;
			u[c] = (terms.row[0][r] + terms.col[0][c]) * inverse + across;
			v[c] = (terms.row[1][r] + terms.col[1][c]) * inverse + upright;
			z[c] = z1;
		}
	}
}

#define FORMS_OF(isa, attributes) \
	attributes static void direct_##isa(struct places *o, const struct job *j) { direct(o, j); } \
	attributes static void incremental_##isa(struct places *o, const struct job *j) { incremental(o, j); } \
	attributes static void optimized_##isa(struct places *o, const struct job *j) { optimized(o, j); } \
	attributes static void looked_up_##isa(struct places *o, const struct job *j) { looked_up(o, j); } \
	attributes static void both_##isa(struct places *o, const struct job *j) { looked_up_optimized(o, j); }
#define TABLE_OF(isa) { direct_##isa, incremental_##isa, optimized_##isa, looked_up_##isa, both_##isa }

FORMS_OF(c, )
#ifdef __x86_64__
FORMS_OF(avx2, __attribute__((target("avx2"))))
FORMS_OF(avx512, __attribute__((target("avx2,avx512f,avx512bw,avx512dq,avx512vl,prefer-vector-width=512"))))
#endif
static form_fn *const form_of[PSR_N_ISAS][N_FORMS] = {
	[PSR_ISA_C] = TABLE_OF(c),
#ifdef __x86_64__
	[PSR_ISA_AVX2] = TABLE_OF(avx2), [PSR_ISA_AVX512] = TABLE_OF(avx512),
#endif
};

static double random_between(double low, double high)
{
	static uint64_t state = 1;
	state ^= state >> 12;
	state ^= state << 25;
	state ^= state >> 27;
	return low + (high - low) * (double)(state * UINT64_C(0x2545f4914f6cdd1d) >> 11) * 0x1p-53;
}

/* Rows are a rotation: that of a unit quaternion. */
static void random_rotation(double m[3][3])
{
	double q[4], n = 0;
	for (int i = 0; i < 4; i++)
		q[i] = random_between(-1, 1);
	for (int i = 0; i < 4; i++)
		n += q[i] * q[i];
	for (int i = 0; i < 4; i++)
		q[i] /= sqrt(n);
	const double x = q[0], y = q[1], z = q[2], w = q[3];
	const double rows[3][3] = { { 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w) },
		                        { 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w) },
		                        { 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y) } };
	memcpy(m, rows, sizeof rows);
}

/* A block within the unit sphere, of a projection that is seen from anywhere, as render/plan.c has it. The eye is at
 * DISTANCE from the sphere's center or, if near, 1/16 before the block. */
static void random_job(struct job *job, int is_near)
{
	const double focal = PICTURE / 2 * DISTANCE;
	double to_camera[3][3], center[3] = { 0, 0, DISTANCE };
	struct warp_lattice *l = &job->lattice;
	random_rotation(to_camera);
	job->dx = 2 / PICTURE;
	job->dy = job->dx * 0.86602540378443864676;
	job->col = 8 * floor(random_between(-0.55, 0.55) / job->dx / 8);
	job->row = 8 * floor(random_between(-0.55, 0.55) / job->dy / 8);
	job->bias = floor(random_between(-0.55, 0.55) * 16384) / 16384;
	job->step = 0x1p-24;
	for (int a = 0; is_near && a < 3; a++)
		center[a] = (a == 2 ? 1.0 / 16 : 0) - to_camera[a][0] * job->col * job->dx -
		            to_camera[a][1] * job->row * job->dy - to_camera[a][2] * job->bias;
	for (int a = 0; a < 3; a++) {
		const double scale = a < 2 ? focal : 1, half = a < 2 ? PICTURE / 2 : 0;
		l->step[a] = job->dx * (scale * to_camera[a][0] + half * to_camera[2][0]);
		l->down[a] = job->dy * (scale * to_camera[a][1] + half * to_camera[2][1]);
		l->along[a] = scale * to_camera[a][2] + half * to_camera[2][2];
		l->origin[a] = scale * center[a] + half * center[2];
		for (int i = 0; i < 8; i++) {
			l->row[a][i] = i * l->down[a] + (i & 1) * 0.5 * l->step[a];
			l->col[a][i] = (float)(i * l->step[a]);
		}
	}
	job->block = (struct warp_block){ .scale = 1, .lattice = l };
	for (int a = 0; a < 3; a++) {
		job->block.origin[a] = l->origin[a] + job->col * l->step[a] + job->row * l->down[a] + job->bias * l->along[a];
		job->block.unit[a] = (float)l->along[a] * (float)job->step;
	}
	for (int i = 0; i < SAMPLES; i++)
		job->by_column[8 * (i & 7) + (i >> 3)] = job->depth[i] = (uint16_t)random_between(0, 65536);
}

/* What a sum of terms and its errors are made of, in doubles: roundings, of 2^-24 of the terms' sum of magnitudes
 * each. */
struct sum {
	double value, size;
};

static void add(struct sum *sum, double term)
{
	sum->value += term;
	sum->size += fabs(term);
}

/* x', y' or z' as a form adds it up; `reduced`: of (7.8), without the depth. */
static struct sum axis_of(const struct job *job, enum form form, int a, int r, int c)
{
	const struct warp_lattice *l = &job->lattice;
	const int is_reduced = a < 2 && (form == OPTIMIZED || form == LOOKED_UP_OPTIMIZED);
	const double k = is_reduced ? l->along[a] / l->along[2] : 0, depth = job->step * job->depth[8 * r + c];
	const double step = l->step[a] - k * l->step[2], down = l->down[a] - k * l->down[2], x = c + 0.5 * (r & 1);
	const double origin = l->origin[a] - k * l->origin[2], along = is_reduced ? 0 : l->along[a];
	struct sum sum = { 0, 0 };
	if (form == DIRECT) {
		add(&sum, (job->col + x) * step);
		add(&sum, (job->row + r) * down);
		add(&sum, (job->bias + depth) * along);
		add(&sum, origin);
		return sum;
	}
	add(&sum, origin + job->col * step + job->row * down + job->bias * along);
	add(&sum, r * down);
	add(&sum, x * step);
	add(&sum, depth * along);
	if (form == INCREMENTAL || form == OPTIMIZED)
		sum.size += 0.5 * (r + 1) * fabs(step); /* to odd rows and back */
	return sum;
}

/* Roundings that a term meets on its way into x', y' or z', at most. Direct: y twice, a coefficient, a product and
 * three sums. Incremental: a coefficient, seven sums down the rows, seven along one, and that of depth. Looked up: a
 * row or column and two sums; of depth a coefficient, a product and a sum. */
static const double roundings[N_FORMS] = { 7, 16, 16, 3, 3 };

struct error {
	double most, beyond; /* pixels; how many times what the roundings allow */
};

/* Of u and v. Roundings of x' and z', of 1 / z', of the product and, where a constant is added, of it and the sum;
 * second-order terms are within a thousandth. */
static struct error error_of(const struct job *job, enum form form, const struct places *p)
{
	struct error error = { 0, 0 };
	const double e = 0x1p-24;
	for (int i = 0; i < SAMPLES; i++) {
		const int r = i >> 3, c = i & 7, at = form == INCREMENTAL || form == OPTIMIZED ? 8 * c + r : i;
		const struct sum z = axis_of(job, form, 2, r, c);
		for (int a = 0; a < 2; a++) {
			const struct sum x = axis_of(job, form, a, r, c);
			const int is_reduced = form == OPTIMIZED || form == LOOKED_UP_OPTIMIZED;
			const double k = is_reduced ? job->lattice.along[a] / job->lattice.along[2] : 0, ratio = x.value / z.value;
			const double is = a == 0 ? (double)p->u[at] : (double)p->v[at], off = fabs(is - (ratio + k));
			const double from_sums = roundings[form] * e * (x.size + fabs(ratio) * z.size) / z.value;
			const double allowed = from_sums + e * (2 * fabs(ratio) + (is_reduced ? fabs(k) + fabs(ratio + k) : 0));
			error.most = fmax(error.most, off);
			error.beyond = fmax(error.beyond, off / (allowed * 1.001));
		}
	}
	return error;
}

static int run_tests(void)
{
	struct job *job = malloc(sizeof *job);
	struct places places;
	int n = 0, failed = 0;
	for (int isa = 0; isa <= (int)psr_isa_get(); isa++)
		for (int form = 0; form < N_FORMS; form++) {
			double beyond = 0;
			for (int trial = 0; trial < 2000; trial++) {
				random_job(job, trial % 2);
				form_of[isa][form](&places, job);
				beyond = fmax(beyond, error_of(job, (enum form)form, &places).beyond);
			}
			printf("%sok %d - %s by %s: within what roundings allow (%.2f of it)\n", beyond <= 1 ? "" : "not ", ++n,
			       name_of[form], psr_isa_name((enum psr_isa)isa), beyond);
			failed |= !(beyond <= 1);
		}
	printf("1..%d\n", n);
	free(job);
	return failed;
}

static double ns_a_sample(form_fn *form, const struct job *job)
{
	struct places places;
	double best = INFINITY;
	for (int round = 0; round < 40; round++) {
		const double start = clock_seconds();
		for (int j = 0; j < JOBS; j++) {
			form(&places, &job[j]);
			__asm__ volatile("" : : "r"(&places) : "memory");
		}
		best = fmin(best, (clock_seconds() - start) * 1e9 / JOBS / SAMPLES);
	}
	return best;
}

static int run_bench(void)
{
	static const double least[] = { 0.5, 0.0625, 0 };
	struct job *job = malloc(JOBS * sizeof *job);
	struct places places;
	for (int j = 0; j < JOBS; j++)
		random_job(&job[j], 0);
	printf("\nforms of the warp ([G] 7.1), full blocks: ns a sample by instruction set; greatest error in\n"
	       "pixels of a picture of %g, by |A_zz| of the projection: from 1/2, from 1/16, less; and of the\n"
	       "first seen from %g times as near\n",
	       PICTURE, DISTANCE * 16);
	for (int form = 0; form < N_FORMS; form++) {
		double most[4] = { 0, 0, 0, 0 };
		printf("%-26s", name_of[form]);
		for (int isa = 0; isa <= (int)psr_isa_get(); isa++)
			printf(" %s %5.2f", psr_isa_name((enum psr_isa)isa), ns_a_sample(form_of[isa][form], job));
		for (int trial = 0; trial < 40000; trial++) {
			const int is_near = trial % 2;
			random_job(&job[0], is_near);
			int bin = 0;
			while (!(fabs(job[0].lattice.along[2]) >= least[bin]))
				bin++;
			if (is_near && bin > 0)
				continue;
			form_of[PSR_ISA_C][form](&places, &job[0]);
			double *to = &most[is_near ? 3 : bin];
			*to = fmax(*to, error_of(&job[0], (enum form)form, &places).most);
		}
		printf(" | %9.6f %9.6f %9.6f %9.6f\n", most[0], most[1], most[2], most[3]);
	}
	free(job);
	return 0;
}

int main(int argc, char **argv)
{
	return argc > 1 && strcmp(argv[1], "--bench") == 0 ? run_bench() : run_tests();
}
