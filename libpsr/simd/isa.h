/* Which instructions the renderer's kernels may use. All give the same bytes of a frame; only time differs.
 *
 * The renderer uses the best that the machine has, unless a call or PSR_ISA in the environment (c, avx2 or avx512;
 * other words are ignored) caps it. */
#ifndef PSR_SIMD_ISA_H
#define PSR_SIMD_ISA_H

#include "psr/error.h"

enum psr_isa {
	PSR_ISA_C,      /* C, as compiled for any machine of this architecture */
	PSR_ISA_AVX2,   /* with BMI1, BMI2 and POPCNT */
	PSR_ISA_AVX512, /* F, BW, DQ, VL, VBMI and VBMI2: Ice Lake, Zen 4 and later */
	PSR_N_ISAS
};

/* Returns the instructions of renderers that are made from now on. */
enum psr_isa psr_isa_get(void);

/* Caps the instructions. A cap above the machine's own is no error. */
void psr_isa_cap(enum psr_isa most);

const char *psr_isa_name(enum psr_isa isa); /* "avx2" */

/* Reads a name. Returns 0, or PSR_ERR_ARG for an unknown one, and leaves `out` alone then. */
int psr_isa_parse(enum psr_isa *out, const char *name);

/* Checks PSR_ISA; programs call it at their start. ARG with a sentence if it holds an unknown word. */
int psr_isa_check_environment(struct psr_error *err);

#endif
