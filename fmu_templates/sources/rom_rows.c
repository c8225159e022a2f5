#include "rom_rows.h"

#include <string.h>

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

#if defined(__GNUC__)

typedef double lanes __attribute__((vector_size(N_LANE * sizeof(double)), aligned(8), may_alias));

/* sum += factor c */
INLINE void add_multiple(lanes *sum, double factor, const double c[])
{
    *sum += factor * *(const lanes *)c;
}

/* sum += (a + b) c */
INLINE void add_product(lanes *sum, const lanes *a, const lanes *b, const double c[])
{
    *sum += (*a + *b) * *(const lanes *)c;
}

#else

typedef struct {
    double e[N_LANE];
} lanes;

INLINE void add_multiple(lanes *sum, double factor, const double c[])
{
    for (size_t e = 0; e < N_LANE; ++e)
        sum->e[e] += factor * c[e];
}

INLINE void add_product(lanes *sum, const lanes *a, const lanes *b, const double c[])
{
    for (size_t e = 0; e < N_LANE; ++e)
        sum->e[e] += (a->e[e] + b->e[e]) * c[e];
}

#endif

/* The N_LANE parts of n_row rows of a group of n_all; a constant number, so that all sums can stay in registers. Even and odd
   left monomials are summed apart: an addition need not wait for the one before. */
INLINE void parts_of(const double *C, size_t n_row, size_t n_all, const rom_blocks *blocks, const rom_pair *left,
                     const rom_pair *right, double part[][N_LANE])
{
    static const lanes zero[N_GROUP]; /* all 0 */
    lanes total[N_GROUP];
    memcpy(total, zero, sizeof total);
    for (size_t b = 0; b < blocks->n_block; ++b, right += N_LANE) {
        lanes even[N_GROUP], odd[N_GROUP];
        double last[N_LANE];
        memcpy(even, zero, sizeof even);
        memcpy(odd, zero, sizeof odd);
        for (const rom_pair *a = left, *end = left + blocks->count[b]; a < end; a += 2, C += 2 * n_all * N_LANE)
            for (size_t i = 0; i < n_row; ++i) {
                add_multiple(&even[i], a[0].left, C + i * N_LANE);
                add_multiple(&odd[i], a[1].left, C + (n_all + i) * N_LANE);
            }
        for (size_t e = 0; e < N_LANE; ++e)
            last[e] = right[e].right;
        for (size_t i = 0; i < n_row; ++i)
            add_product(&total[i], &even[i], &odd[i], last);
    }
    memcpy(part, total, n_row * sizeof *total);
}

/* Whether maps of this model leave n rows to a group */
#define LEAVES(n) (2 * N_MODE % N_GROUP == (n) || N_SENSOR % N_GROUP == (n))

INLINE void group(const double *C, size_t n_row, const rom_blocks *blocks, const rom_pair *left, const rom_pair *right,
                  double part[N_GROUP][N_LANE])
{
    if (n_row == N_GROUP)
        parts_of(C, N_GROUP, N_GROUP, blocks, left, right, part);
    else if (LEAVES(3) && n_row == 3)
        parts_of(C, 3, 3, blocks, left, right, part);
    else if (LEAVES(2) && n_row == 2)
        parts_of(C, 2, 2, blocks, left, right, part);
    else if (LEAVES(1))
        parts_of(C, 1, 1, blocks, left, right, part);
}

#if WITH_AVX

/* Row by row: few processors still come here, and it takes little code */
static void plain_group(const double *C, size_t n_row, const rom_blocks *blocks, const rom_pair *left, const rom_pair *right,
                        double part[N_GROUP][N_LANE])
{
    for (size_t i = 0; i < n_row; ++i)
        parts_of(C + i * N_LANE, 1, n_row, blocks, left, right, part + i);
}

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

static void plain_group(const double *C, size_t n_row, const rom_blocks *blocks, const rom_pair *left, const rom_pair *right,
                        double part[N_GROUP][N_LANE])
{
    group(C, n_row, blocks, left, right, part);
}

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
