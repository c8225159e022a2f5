#include "rom_etdrk4.h"

#include <math.h>

#define N_TAYLOR 20 /* |x| < 1: the first term left out is below 1/21! = 2e-20 */

static rom_complex times(rom_complex a, rom_complex b)
{
    rom_complex c = {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
    return c;
}

static rom_complex scaled(double s, rom_complex a)
{
    rom_complex c = {s * a.re, s * a.im};
    return c;
}

static rom_complex plus(rom_complex a, rom_complex b)
{
    rom_complex c = {a.re + b.re, a.im + b.im};
    return c;
}

static rom_complex exponential(rom_complex x)
{
    const double r = exp(x.re);
    rom_complex e = {r * cos(x.im), r * sin(x.im)};
    return e;
}

/* phi_k(x) = sum_j x^j / (j + k)!, by Horner's rule from the last term */
ROM_SMALL static rom_complex phi_series(int k, rom_complex x)
{
    rom_complex sum = {1.0, 0.0};
    for (int j = N_TAYLOR; j >= 1; --j) {
        sum = scaled(1.0 / (double)(j + k), times(x, sum));
        sum.re += 1.0;
    }
    double factorial = 1.0;
    for (int j = 2; j <= k; ++j)
        factorial *= (double)j;
    return scaled(1.0 / factorial, sum);
}

/* phi_0 = exp x, phi_k = (phi_{k-1} - 1/(k-1)!) / x; the recurrence cancels for small x, the series does not */
ROM_SMALL static void phi_functions(rom_complex x, rom_complex phi[4])
{
    phi[0] = exponential(x);
    const double square = x.re * x.re + x.im * x.im;
    if (square < 1.0) {
        for (int k = 1; k < 4; ++k)
            phi[k] = phi_series(k, x);
        return;
    }
    const rom_complex inverse = {x.re / square, -x.im / square};
    const double reciprocal_factorial[3] = {1.0, 1.0, 0.5};
    for (int k = 1; k < 4; ++k) {
        rom_complex difference = phi[k - 1];
        difference.re -= reciprocal_factorial[k - 1];
        phi[k] = times(difference, inverse);
    }
}

ROM_SMALL void rom_etdrk4_prepare(rom_etdrk4 *c, double h)
{
    if (c->h == h)
        return;
    for (size_t j = 0; j < N_MODE; ++j) {
        rom_complex full[4], half[4];
        phi_functions(scaled(h, rom_eigenvalue(j)), full);
        phi_functions(scaled(0.5 * h, rom_eigenvalue(j)), half);
        c->e[j] = full[0];
        c->e_half[j] = half[0];
        c->q[j] = scaled(0.5 * h, half[1]);
        c->f1[j] = scaled(h, plus(full[1], plus(scaled(-3.0, full[2]), scaled(4.0, full[3]))));
        c->f2[j] = scaled(h, plus(scaled(2.0, full[2]), scaled(-4.0, full[3])));
        c->f3[j] = scaled(h, plus(scaled(4.0, full[3]), scaled(-1.0, full[2])));
    }
    c->h = h;
}

/* a = E2 z + Q n0;  b = E2 z + Q na;  d = E2 a + Q (2 nb - n0);  z <- E z + f1 n0 + f2 (na + nb) + f3 nd */
void rom_etdrk4_step(const rom_etdrk4 *c, const double u_start[], const double u_middle[], const double u_end[],
                     rom_workspace *w, rom_complex z[])
{
    rom_complex n0[N_MODE], na[N_MODE], nb[N_MODE], nd[N_MODE], a[N_MODE], b[N_MODE], d[N_MODE];

    rom_nonlinear_rate(z, u_start, w, n0);
    for (size_t j = 0; j < N_MODE; ++j)
        a[j] = plus(times(c->e_half[j], z[j]), times(c->q[j], n0[j]));

    rom_nonlinear_rate(a, u_middle, w, na);
    for (size_t j = 0; j < N_MODE; ++j)
        b[j] = plus(times(c->e_half[j], z[j]), times(c->q[j], na[j]));

    rom_nonlinear_rate(b, u_middle, w, nb);
    for (size_t j = 0; j < N_MODE; ++j)
        d[j] = plus(times(c->e_half[j], a[j]), times(c->q[j], plus(scaled(2.0, nb[j]), scaled(-1.0, n0[j]))));

    rom_nonlinear_rate(d, u_end, w, nd);
    for (size_t j = 0; j < N_MODE; ++j) {
        const rom_complex linear = plus(times(c->e[j], z[j]), times(c->f1[j], n0[j]));
        const rom_complex middle = times(c->f2[j], plus(na[j], nb[j]));
        z[j] = plus(linear, plus(middle, times(c->f3[j], nd[j])));
    }
}
