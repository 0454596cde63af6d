/* Compiles one kernel for several instruction sets: kernels are written once as always-inline functions on 8-wide
 * vectors and instantiated for AVX-512, AVX2 and the baseline; the widest the processor has is called. The choice
 * depends on the machine alone, so results repeat to the bit on one machine. */
#ifndef GNP_CORE_SIMD_H
#define GNP_CORE_SIMD_H

#define GNP_SIMD_WIDTH 8
typedef double gnp_v8 __attribute__((vector_size(64)));
typedef double gnp_v8u __attribute__((vector_size(64), aligned(8))); /* for unaligned loads and stores */

typedef double gnp_v4 __attribute__((vector_size(32)));
typedef double gnp_v4u __attribute__((vector_size(32), aligned(8)));

#define GNP_INLINE static inline __attribute__((always_inline))

#if defined(__x86_64__)
#define GNP_TARGET_AVX512 __attribute__((target("avx512f,avx512dq,avx512vl,avx512bw,avx2,fma,prefer-vector-width=512")))
#define GNP_TARGET_AVX2 __attribute__((target("avx2,fma")))

/* Defines `void name(parameters)` that runs wide(arguments) under AVX-512, else narrow(arguments) under the widest
 * instruction set present. GNP_SIMD_DISPATCH: one body for all. */
#define GNP_SIMD_DISPATCH_TWO(linkage, name, wide, narrow, parameters, arguments)                               \
	GNP_TARGET_AVX512 static void name##_avx512 parameters { wide arguments; }                                  \
	GNP_TARGET_AVX2 static void name##_avx2 parameters { narrow arguments; }                                    \
	linkage void name parameters                                                                                \
	{                                                                                                           \
		if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&                          \
		    __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))                           \
			name##_avx512 arguments;                                                                            \
		else if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))                               \
			name##_avx2 arguments;                                                                              \
		else                                                                                                    \
			narrow arguments;                                                                                   \
	}
#else
#define GNP_SIMD_DISPATCH_TWO(linkage, name, wide, narrow, parameters, arguments) \
	linkage void name parameters { narrow arguments; }
#endif
#define GNP_SIMD_DISPATCH(linkage, name, body, parameters, arguments) \
	GNP_SIMD_DISPATCH_TWO(linkage, name, body, body, parameters, arguments)

/* Rounds a count up to whole vectors. */
#define GNP_SIMD_PAD(count) (((count) + GNP_SIMD_WIDTH - 1) / GNP_SIMD_WIDTH * GNP_SIMD_WIDTH)

#endif
