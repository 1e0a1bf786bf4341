/* Arrays that grow at their ends. */
#ifndef PSR_BASE_ARRAY_H
#define PSR_BASE_ARRAY_H

#include <stdlib.h>

/* Whether `array`, which has `capacity` elements and is free()d in the end, has element n: it grows by half until it
 * has. 0: no memory, and nothing is changed. */
#define ARRAY_ROOM(array, n, capacity)                                                                      \
	({                                                                                                       \
		if ((size_t)(n) >= (capacity)) {                                                                     \
			const size_t more_ = (size_t)(n) + (size_t)(n) / 2 + 64;                                         \
			void *grown_ = (typeof(capacity))more_ == more_ ? realloc(array, more_ * sizeof *(array)) : NULL; \
                                                                                                             \
			if (grown_ != NULL) {                                                                            \
				(array) = grown_;                                                                            \
				(capacity) = (typeof(capacity))more_;                                                        \
			}                                                                                                \
		}                                                                                                    \
		(size_t)(n) < (capacity);                                                                            \
	})

#endif
