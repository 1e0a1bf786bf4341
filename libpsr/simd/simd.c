#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include "simd.h"

static const char *const names[PSR_N_ISAS] = { "c", "avx2", "avx512" };
static atomic_int cap = -1; /* -1: not set */

const char *psr_isa_name(enum psr_isa isa)
{
	return (unsigned)isa < PSR_N_ISAS ? names[isa] : "?";
}

int psr_isa_parse(enum psr_isa *out, const char *name)
{
	for (int i = 0; i < PSR_N_ISAS; i++)
		if (strcmp(name, names[i]) == 0) {
			*out = (enum psr_isa)i;
			return PSR_OK;
		}
	return PSR_ERR_ARG;
}

int psr_isa_check_environment(struct psr_error *err)
{
	enum psr_isa isa;
	const char *wanted = getenv("PSR_ISA");

	if (wanted && psr_isa_parse(&isa, wanted))
		return psr_fail(err, PSR_ERR_ARG, "PSR_ISA is '%.40s'; it takes c, avx2 or avx512, or is left out", wanted);
	return PSR_OK;
}

void psr_isa_cap(enum psr_isa most)
{
	atomic_store(&cap, (int)most);
}

static int has(enum psr_isa isa)
{
#ifdef __x86_64__
	const int avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
	                 __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("popcnt");
	switch (isa) {
	case PSR_ISA_AVX2:
		return avx2;
	case PSR_ISA_AVX512:
		return avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
		       __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
		       __builtin_cpu_supports("avx512vbmi") && __builtin_cpu_supports("avx512vbmi2");
	default:
		break;
	}
#endif
	return isa == PSR_ISA_C;
}

enum psr_isa psr_isa_get(void)
{
	enum psr_isa most = PSR_ISA_AVX512;

	if (atomic_load(&cap) < 0) {
		const char *wanted = getenv("PSR_ISA");

		if (wanted)
			(void)psr_isa_parse(&most, wanted);
		psr_isa_cap(most);
	}
	most = (enum psr_isa)atomic_load(&cap);
	while (!has(most))
		most--;
	return most;
}

const struct simd *simd_of(enum psr_isa isa)
{
	if (!has(isa))
		return NULL;
#ifdef __x86_64__
	if (isa == PSR_ISA_AVX512)
		return &simd_avx512;
	if (isa == PSR_ISA_AVX2)
		return &simd_avx2;
#endif
	return &simd_c;
}

const struct simd *simd_get(void)
{
	return simd_of(psr_isa_get());
}
