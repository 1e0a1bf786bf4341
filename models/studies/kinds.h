/* The studies that there are: who runs them, their models, and what stands below and beside their tables. */
#ifndef MODELS_STUDIES_KINDS_H
#define MODELS_STUDIES_KINDS_H

#include "lib/study.h"

extern const struct study_kind study_tables[], study_figures[];
extern const size_t n_study_tables, n_study_figures;

#endif
