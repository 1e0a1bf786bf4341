/* Which instructions the renderer's kernels may use. Frames are the same bytes with all of them; only time differs.
 *
 * The best that the machine has is used, unless PSR_ISA in the environment (c, avx2 or avx512; other words are passed
 * over) or a call caps it. */
#ifndef PSR_SIMD_ISA_H
#define PSR_SIMD_ISA_H

#include "psr/error.h"

enum psr_isa {
	PSR_ISA_C,      /* what the compiler makes of C for any machine of the kind */
	PSR_ISA_AVX2,   /* with BMI1, BMI2 and POPCNT */
	PSR_ISA_AVX512, /* F, BW, DQ, VL, VBMI and VBMI2: Ice Lake, Zen 4 and later */
	PSR_N_ISAS
};

/* What renderers that are made from now on use. */
enum psr_isa psr_isa_get(void);

/* Caps it; asking for more than the machine has is no error. */
void psr_isa_cap(enum psr_isa most);

const char *psr_isa_name(enum psr_isa isa); /* "avx2" */

/* 0, or PSR_ERR_ARG if there is none of this name; `out` is then as it was. */
int psr_isa_parse(enum psr_isa *out, const char *name);

/* ARG with a sentence if PSR_ISA holds a word that is no name: what programs look at when they start. */
int psr_isa_check_environment(struct psr_error *err);

#endif
