#include "rom_rows.h"

/* GCC for Windows may put AVX registers where its stack is not aligned for them (its bug 54412). */
#if defined(__x86_64__) && (defined(__clang__) || (defined(__GNUC__) && !defined(_WIN32)))
#define WITH_AVX 1
#include <cpuid.h>
#else
#define WITH_AVX 0
#endif

#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

/* The N_LANE parts of n_row rows, a constant number, so that all sums can stay in registers. Even and odd left monomials
   are summed apart: an addition need not wait for the one before. */
INLINE void parts_of(const double *C, size_t n_row, const rom_blocks *blocks, const rom_pair *left, const rom_pair *right,
                     double part[N_GROUP][N_LANE])
{
    double total[N_GROUP][N_LANE] = {{0.0}};
    for (size_t b = 0; b < blocks->n_block; ++b, right += N_LANE) {
        double even[N_GROUP][N_LANE] = {{0.0}}, odd[N_GROUP][N_LANE] = {{0.0}};
        for (const rom_pair *a = left, *end = left + blocks->count[b]; a < end; a += 2, C += 2 * n_row * N_LANE)
            for (size_t i = 0; i < n_row; ++i)
                for (size_t e = 0; e < N_LANE; ++e) {
                    even[i][e] += C[i * N_LANE + e] * a[0].left;
                    odd[i][e] += C[(n_row + i) * N_LANE + e] * a[1].left;
                }
        for (size_t i = 0; i < n_row; ++i)
            for (size_t e = 0; e < N_LANE; ++e)
                total[i][e] += (even[i][e] + odd[i][e]) * right[e].right;
    }
    for (size_t i = 0; i < n_row; ++i)
        for (size_t e = 0; e < N_LANE; ++e)
            part[i][e] = total[i][e];
}

INLINE void group(const double *C, size_t n_row, const rom_blocks *blocks, const rom_pair *left, const rom_pair *right,
                  double part[N_GROUP][N_LANE])
{
    if (n_row == 4)
        parts_of(C, 4, blocks, left, right, part);
    else if (n_row == 3)
        parts_of(C, 3, blocks, left, right, part);
    else if (n_row == 2)
        parts_of(C, 2, blocks, left, right, part);
    else
        parts_of(C, 1, blocks, left, right, part);
}

static void plain_group(const double *C, size_t n_row, const rom_blocks *blocks, const rom_pair *left, const rom_pair *right,
                        double part[N_GROUP][N_LANE])
{
    group(C, n_row, blocks, left, right, part);
}

#if WITH_AVX

__attribute__((target("avx"))) static void wide_group(const double *C, size_t n_row, const rom_blocks *blocks,
                                                      const rom_pair *left, const rom_pair *right,
                                                      double part[N_GROUP][N_LANE])
{
    group(C, n_row, blocks, left, right, part);
}

/* The processor has it, and the system keeps its registers (Intel's manual, volume 1, section 14.3) */
int rom_has_avx(void)
{
    const unsigned needed = bit_OSXSAVE | bit_AVX;
    unsigned a, b, c, d, low, high;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & needed) != needed)
        return 0;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return (low & 6) == 6;
}

#else

#define wide_group plain_group

int rom_has_avx(void)
{
    return 0;
}

#endif

void rom_rows(const double C[], size_t n_row, const rom_blocks *blocks, const rom_pair left[], const rom_pair right[],
              int wide, double x[])
{
    double part[N_GROUP][N_LANE];
    for (size_t first = 0; first < n_row; first += N_GROUP, C += N_GROUP * blocks->n_entry) {
        const size_t n = n_row - first < N_GROUP ? n_row - first : N_GROUP;
        if (wide)
            wide_group(C, n, blocks, left, right, part);
        else
            plain_group(C, n, blocks, left, right, part);
        for (size_t i = 0; i < n; ++i)
            x[first + i] = (part[i][0] + part[i][2]) + (part[i][1] + part[i][3]);
    }
}
