/* Repeatable random arguments, a share of them odd: what both fuzz programs draw from. */
#ifndef RANDOM_ARGUMENTS_H
#define RANDOM_ARGUMENTS_H

#include "check.h"

#define N_CALL 30 /* calls of one sequence */

static unsigned long long random_state;

static unsigned below(unsigned n)
{
    random_state = random_state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (unsigned)(random_state >> 33) % n;
}

static double number(void)
{
    const double odd[] = {NAN, INFINITY, -INFINITY, 0.0, -0.0, 1e308, -1e-308, -1.0};
    return below(6) == 0 ? odd[below(8)] : 1e-3 * (double)below(2000) - 1.0;
}

static double step_length(void)
{
    const double odd[] = {NAN, 0.0, -H, INFINITY, 1e9};
    return below(8) == 0 ? odd[below(5)] : H * (double)(1 + below(3));
}

/* Runs n sequences from a seed, both decimal. */
static void fuzz(const char *n, const char *seed, void (*sequence)(void))
{
    random_state = strtoull(seed, NULL, 10);
    for (long k = strtol(n, NULL, 10); k > 0; --k)
        sequence();
    printf("ok\n");
}

#endif
