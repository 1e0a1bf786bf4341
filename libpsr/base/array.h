/* Arrays that grow at their ends. */
#ifndef PSR_BASE_ARRAY_H
#define PSR_BASE_ARRAY_H

#include <stdlib.h>

/* Makes sure that `array` has element n: grows it by half until it does. The array has `capacity` elements, and its
 * owner frees it with free(). Returns 0 without memory, and changes nothing. */
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
