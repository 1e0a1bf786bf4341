/* Vectors of three and 3x3 matrices (rows), in double (v3d, m3d) and float (v3f, m3f). Results may overlap inputs. */
#ifndef PSR_BASE_VEC_H
#define PSR_BASE_VEC_H

#include <math.h>

#define PSR_VEC_DEFINE(s, type, root)                                                                                  \
	static inline void v3##s##_set(type r[3], type x, type y, type z)                                                  \
	{                                                                                                                  \
		r[0] = x;                                                                                                      \
		r[1] = y;                                                                                                      \
		r[2] = z;                                                                                                      \
	}                                                                                                                  \
	static inline void v3##s##_add(type r[3], const type a[3], const type b[3])                                        \
	{                                                                                                                  \
		v3##s##_set(r, a[0] + b[0], a[1] + b[1], a[2] + b[2]);                                                         \
	}                                                                                                                  \
	static inline void v3##s##_sub(type r[3], const type a[3], const type b[3])                                        \
	{                                                                                                                  \
		v3##s##_set(r, a[0] - b[0], a[1] - b[1], a[2] - b[2]);                                                         \
	}                                                                                                                  \
	static inline void v3##s##_scale(type r[3], const type a[3], type k)                                               \
	{                                                                                                                  \
		v3##s##_set(r, a[0] * k, a[1] * k, a[2] * k);                                                                  \
	}                                                                                                                  \
	/* r = a + k b */                                                                                                  \
	static inline void v3##s##_add_scaled(type r[3], const type a[3], type k, const type b[3])                         \
	{                                                                                                                  \
		v3##s##_set(r, a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]);                                             \
	}                                                                                                                  \
	static inline type v3##s##_dot(const type a[3], const type b[3])                                                   \
	{                                                                                                                  \
		return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];                                                                \
	}                                                                                                                  \
	static inline void v3##s##_cross(type r[3], const type a[3], const type b[3])                                      \
	{                                                                                                                  \
		v3##s##_set(r, a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);               \
	}                                                                                                                  \
	static inline type v3##s##_length(const type a[3])                                                                 \
	{                                                                                                                  \
		return root(v3##s##_dot(a, a));                                                                                \
	}                                                                                                                  \
	/* Normalizes a; returns its length. Copies a and returns 0 if its squared length is 0 or not finite. */  \
	static inline type v3##s##_normalize(type r[3], const type a[3])                                                   \
	{                                                                                                                  \
		type length = v3##s##_length(a);                                                                               \
		int usable = length > 0 && length - length == 0;                                                               \
		type k = usable ? length : 1;                                                                                  \
		v3##s##_set(r, a[0] / k, a[1] / k, a[2] / k);                                                                  \
		return usable ? length : 0;                                                                                    \
	}                                                                                                                  \
	/* r = m a */                                                                                                      \
	static inline void m3##s##_apply(type r[3], const type m[3][3], const type a[3])                                   \
	{                                                                                                                  \
		v3##s##_set(r, v3##s##_dot(m[0], a), v3##s##_dot(m[1], a), v3##s##_dot(m[2], a));                              \
	}                                                                                                                  \
	/* r = transpose(m) a: the way back, if m is orthonormal */                                                        \
	static inline void m3##s##_apply_transposed(type r[3], const type m[3][3], const type a[3])                        \
	{                                                                                                                  \
		v3##s##_set(r, m[0][0] * a[0] + m[1][0] * a[1] + m[2][0] * a[2],                                               \
		            m[0][1] * a[0] + m[1][1] * a[1] + m[2][1] * a[2],                                                  \
		            m[0][2] * a[0] + m[1][2] * a[1] + m[2][2] * a[2]);                                                 \
	}                                                                                                                  \
	/* r = a b: apply b first */                                                                                       \
	static inline void m3##s##_multiply(type r[3][3], const type a[3][3], const type b[3][3])                          \
	{                                                                                                                  \
		type t[3][3];                                                                                                  \
		for (int i = 0; i < 3; i++)                                                                                    \
			m3##s##_apply_transposed(t[i], b, a[i]);                                                                   \
		for (int i = 0; i < 3; i++)                                                                                    \
			v3##s##_set(r[i], t[i][0], t[i][1], t[i][2]);                                                              \
	}                                                                                                                  \
	static inline type m3##s##_determinant(const type m[3][3])                                                         \
	{                                                                                                                  \
		type c[3];                                                                                                     \
		v3##s##_cross(c, m[1], m[2]);                                                                                  \
		return v3##s##_dot(m[0], c);                                                                                   \
	}

PSR_VEC_DEFINE(d, double, sqrt)
PSR_VEC_DEFINE(f, float, sqrtf)

#undef PSR_VEC_DEFINE

#endif
