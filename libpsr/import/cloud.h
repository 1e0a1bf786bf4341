/* Clouds: what import_cloud_finish is made of, and what the readers of scans share. Shared by cloud*.c, ply*.c, las*.c. */
#ifndef PSR_IMPORT_CLOUD_H
#define PSR_IMPORT_CLOUD_H

#include "import.h"

/* Linear light of an sRGB code of 0..255 that may lie between two codes (16 bits a channel); clamped, NaN gives 0. */
float cloud_linear(double code);

#endif
