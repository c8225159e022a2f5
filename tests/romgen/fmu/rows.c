/* Rows of random numbers with and without AVX, bit by bit. Prints "ok", or "no AVX" where there is none. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "rom_rows.c"

#define MAX_ROW 8
#define N_BLOCK 5
#define N_ENTRY (N_LANE * 60)

static const unsigned short count[N_BLOCK] = {36, 16, 6, 2, 0};

/* A linear congruential generator (Knuth, The Art of Computer Programming, volume 2), from -1 to 1 */
static double random_number(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*state >> 11) / 4503599627370496.0 - 1.0;
}

int main(void)
{
    static double C[MAX_ROW * N_ENTRY];
    static rom_pair p[36];
    const rom_blocks blocks = {count, N_BLOCK, N_ENTRY};
    double plain[MAX_ROW], wide[MAX_ROW];
    uint64_t state = 1;
    if (!rom_has_avx()) {
        puts("no AVX");
        return 0;
    }
    for (int trial = 0; trial < 100; ++trial) {
        for (size_t k = 0; k < MAX_ROW * N_ENTRY; ++k)
            C[k] = random_number(&state);
        for (size_t k = 0; k < 36; ++k) {
            p[k].left = random_number(&state);
            p[k].right = random_number(&state);
        }
        for (size_t k = 0; k < 4; ++k) {
            const size_t n = (k < 2 ? 2 * N_MODE : N_SENSOR) + N_GROUP * (k % 2);
            rom_rows(C, n, &blocks, p, p, 0, plain);
            rom_rows(C, n, &blocks, p, p, 1, wide);
            if (memcmp(plain, wide, n * sizeof *wide) != 0)
                return 1;
        }
    }
    puts("ok");
    return 0;
}
