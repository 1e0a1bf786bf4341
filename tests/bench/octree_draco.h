/* Draco's point coder, as a peer. */
#ifndef TESTS_BENCH_OCTREE_DRACO_H
#define TESTS_BENCH_OCTREE_DRACO_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Returns how many bytes Draco takes for these places, by its kd-tree, at its slowest; 0 if it fails. */
size_t draco_bytes(const uint32_t (*at)[3], uint32_t n);

#ifdef __cplusplus
}
#endif

#endif
