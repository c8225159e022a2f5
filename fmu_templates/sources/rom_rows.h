/* Rows of a polynomial map over products of the monomials of two halves of its variables. */
#ifndef ROM_ROWS_H
#define ROM_ROWS_H

#include <stddef.h>

#include "rom_names.h"

/* For functions in which no step spends its time, among others that are compiled for speed */
#if defined(__clang__)
#define ROM_SMALL __attribute__((minsize))
#elif defined(__GNUC__)
#define ROM_SMALL __attribute__((cold))
#else
#define ROM_SMALL
#endif

/* The same monomial of the left and of the right half of the variables */
typedef struct {
    double left, right;
} rom_pair;

/* The monomials of a map in blocks of N_LANE of the right half; block b holds them times the first count[b] of the left,
   which are even in number. That makes n_entry coefficients in a row. */
typedef struct {
    const unsigned short *count;
    size_t n_block, n_entry;
} rom_blocks;

/* x_i = sum_ab C_iab left_a right_b for n_row rows. C comes in the order of use: N_GROUP rows at a time; of these, block by
   block and for each left monomial, N_LANE numbers of each row. `wide` must be 0 where rom_has_avx() is; the bits do not
   depend on it, as each row is summed in N_LANE parts whatever the processor adds at once. */
void rom_rows(const double C[], size_t n_row, const rom_blocks *blocks, const rom_pair left[], const rom_pair right[],
              int wide, double x[]);

int rom_has_avx(void);

#endif
