/* Exponential time differencing Runge-Kutta of order 4 (Cox and Matthews 2002) on the diagonal linear part. */
#ifndef ROM_ETDRK4_H
#define ROM_ETDRK4_H

#include "rom_kernel.h"

/* Coefficients of one step length; a pure function of h, so caching them changes no result. */
typedef struct {
    double h;
    rom_complex e[N_MODE], e_half[N_MODE], q[N_MODE], f1[N_MODE], f2[N_MODE], f3[N_MODE];
} rom_etdrk4;

/* Prepares the coefficients for the step h in s; does nothing when they are there already. */
void rom_etdrk4_prepare(rom_etdrk4 *c, double h);

/* Advances z by c->h; u is sampled at the start, the middle and the end of the step. */
void rom_etdrk4_step(const rom_etdrk4 *c, const double u_start[], const double u_middle[], const double u_end[],
                     rom_workspace *w, rom_complex z[]);

#endif
