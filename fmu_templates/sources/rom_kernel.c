#include "rom_kernel.h"

#include <math.h>
#include <string.h>

#include "coefficients.h"

static rom_complex multiply(rom_complex a, rom_complex b)
{
    rom_complex c = {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
    return c;
}

static rom_complex add(rom_complex a, rom_complex b)
{
    rom_complex c = {a.re + b.re, a.im + b.im};
    return c;
}

static double modulus(rom_complex a)
{
    return sqrt(a.re * a.re + a.im * a.im);
}

/* zeta = (z, conj z) */
static void pair_with_conjugate(const rom_complex z[], rom_complex zeta[])
{
    for (size_t j = 0; j < N_MODE; ++j) {
        zeta[j] = z[j];
        zeta[N_MODE + j].re = z[j].re;
        zeta[N_MODE + j].im = -z[j].im;
    }
}

static rom_complex times_real(double s, rom_complex a)
{
    rom_complex c = {s * a.re, s * a.im};
    return c;
}

/* The first N_MODE of p are z */
static void complex_monomials(const rom_product product[], size_t n_product, const rom_product pair[], size_t n_pair,
                              rom_complex p[])
{
    rom_complex *next = p + N_REDUCED;
    double square[N_MODE];
    for (size_t j = 0; j < N_MODE; ++j)
        square[j] = p[j].re * p[j].re + p[j].im * p[j].im;
    for (size_t k = 0; k < n_product; ++k)
        *next++ = multiply(p[product[k].left], p[product[k].right]);
    for (size_t k = 0; k < n_pair; ++k)
        *next++ = times_real(square[pair[k].right], p[pair[k].left]);
}

static void complex_tangents(const rom_product product[], size_t n_product, const rom_product pair[], size_t n_pair,
                             const rom_complex p[], rom_complex dp[])
{
    rom_complex *next = dp + N_REDUCED;
    for (size_t k = 0; k < n_product; ++k) {
        const size_t a = product[k].left, b = product[k].right;
        *next++ = add(multiply(dp[a], p[b]), multiply(p[a], dp[b]));
    }
    for (size_t k = 0; k < n_pair; ++k) {
        const size_t a = pair[k].left, j = pair[k].right;
        const double square = p[j].re * p[j].re + p[j].im * p[j].im;
        const double change = 2.0 * (p[j].re * dp[j].re + p[j].im * dp[j].im);
        *next++ = add(times_real(square, dp[a]), times_real(change, p[a]));
    }
}

/* rate_j = sum over the stored terms of row j of N */
static void normal_form_rows(const rom_tables *t, const rom_complex p[], rom_complex rate[])
{
    for (size_t j = 0; j < N_MODE; ++j) {
        rom_complex sum = {0.0, 0.0};
        for (size_t k = form_row[j]; k < form_row[j + 1]; ++k)
            sum = add(sum, multiply(t->form[k], p[form_term[k]]));
        rate[j] = sum;
    }
}

/* Sizes that may be 0 come as arguments: compilers object to loops over a constant 0. */
static void add_inputs(const double u[], size_t n_input, rom_complex rate[])
{
    for (size_t i = 0; i < n_input; ++i)
        for (size_t j = 0; j < N_MODE; ++j) {
            rate[j].re += input_matrix[i][j].re * u[i];
            rate[j].im += input_matrix[i][j].im * u[i];
        }
}

static void real_monomials(const rom_run run[], size_t n_run, double p[])
{
    size_t next = N_REDUCED;
    for (size_t k = 0; k < n_run; ++k) {
        const size_t n = run[k].count;
        const double x = p[run[k].factor], *restrict left = p + run[k].left;
        double *restrict target = p + next; /* behind all that is read */
        for (size_t i = 0; i < n; ++i)
            target[i] = left[i] * x;
        next += n;
    }
}

static void real_tangents(const rom_run run[], size_t n_run, const double p[], double dp[])
{
    double *next = dp + N_REDUCED;
    for (size_t k = 0; k < n_run; ++k) {
        const size_t b = run[k].factor, end = run[k].left + (size_t)run[k].count;
        for (size_t a = run[k].left; a < end; ++a)
            *next++ = dp[a] * p[b] + p[a] * dp[b];
    }
}

/* y/s = Re(T p); conjugate pairs of monomials are folded into one when the coefficients are written. Even and odd
   monomials are summed apart, so that an addition need not wait for the one before it. */
static void chart_rows(const rom_tables *t, const rom_complex p[], double y[])
{
    double sum[2][N_REDUCED] = {{0.0}};
    size_t k = N_CHART_MONOMIAL % 2;
    for (size_t l = 0; k > 0 && l < N_REDUCED; ++l)
        sum[0][l] = t->chart_re[0][l] * p[0].re - t->chart_im[0][l] * p[0].im;
    for (; k < N_CHART_MONOMIAL; k += 2)
        for (size_t e = 0; e < 2; ++e)
            for (size_t l = 0; l < N_REDUCED; ++l)
                sum[e][l] += t->chart_re[k + e][l] * p[k + e].re - t->chart_im[k + e][l] * p[k + e].im;
    for (size_t l = 0; l < N_REDUCED; ++l)
        y[l] = sum[0][l] + sum[1][l];
}

/* a . b in four sums, as above; arrays of two, which compilers take for vectors */
static double dot(const double a[], const double b[], size_t n)
{
    double even[2] = {0.0, 0.0}, odd[2] = {0.0, 0.0};
    size_t k = n % 4;
    for (size_t e = 0; e < k; ++e)
        even[0] += a[e] * b[e];
    for (; k < n; k += 4) {
        even[0] += a[k] * b[k];
        even[1] += a[k + 1] * b[k + 1];
        odd[0] += a[k + 2] * b[k + 2];
        odd[1] += a[k + 3] * b[k + 3];
    }
    return (even[0] + odd[0]) + (even[1] + odd[1]);
}

static void sensor_rows(const rom_tables *t, const double p[], size_t first, size_t end, double x[])
{
    for (size_t i = first; i < end; ++i)
        x[i] = dot(t->sensor[i], p, N_SENSOR_MONOMIAL);
}

void rom_nonlinear_rate(const rom_complex z[], const double u[], rom_workspace *w, rom_complex rate[])
{
    pair_with_conjugate(z, w->form);
    complex_monomials(form_product, N_FORM_PRODUCT, form_pair, N_FORM_PAIR, w->form);
    normal_form_rows(&w->tables, w->form, rate);
    add_inputs(u, N_INPUT, rate);
}

void rom_rate(const rom_complex z[], const double u[], rom_workspace *w, rom_complex rate[])
{
    rom_nonlinear_rate(z, u, w, rate);
    for (size_t j = 0; j < N_MODE; ++j)
        rate[j] = add(rate[j], multiply(eigenvalue[j], z[j]));
}

void rom_rate_tangent(const rom_complex z[], const rom_complex dz[], const double du[], rom_workspace *w,
                      rom_complex drate[])
{
    rom_nonlinear_rate(z, du, w, drate); /* for the monomials */
    pair_with_conjugate(dz, w->form_tangent);
    complex_tangents(form_product, N_FORM_PRODUCT, form_pair, N_FORM_PAIR, w->form, w->form_tangent);
    normal_form_rows(&w->tables, w->form_tangent, drate);
    add_inputs(du, N_INPUT, drate);
    for (size_t j = 0; j < N_MODE; ++j)
        drate[j] = add(drate[j], multiply(eigenvalue[j], dz[j]));
}

void rom_chart(const rom_complex z[], rom_workspace *w)
{
    pair_with_conjugate(z, w->chart);
    complex_monomials(chart_product, N_CHART_PRODUCT, chart_pair, N_CHART_PAIR, w->chart);
    chart_rows(&w->tables, w->chart, w->sensor);
    real_monomials(sensor_run, N_SENSOR_RUN, w->sensor);
}

void rom_sensors(const rom_workspace *w, size_t first, size_t end, double x[])
{
    sensor_rows(&w->tables, w->sensor, first, end, x);
}

void rom_amplitudes(const rom_complex z[], rom_output *out)
{
    for (size_t j = 0; j < N_MODE; ++j) {
        out->amplitude[j] = modulus(z[j]);
        out->phase[j] = atan2(z[j].im, z[j].re);
    }
    out->trust_ratio = rom_trust_ratio(z);
}

/* n_k . r of one facet of the trained range */
static double facet_value(size_t k, const double r[])
{
    double sum = 0.0;
    for (size_t j = 0; j < N_MODE; ++j)
        sum += trained_facet[k][j] * r[j];
    return sum;
}

/* d|z_j| = Re(conj z_j dz_j) / |z_j|, d arg z_j = Im(conj z_j dz_j) / |z_j|^2, both taken as 0 at rest; the trust ratio follows the facet that leads it */
static void amplitude_tangents(const rom_complex z[], const rom_complex dz[], rom_output *dout)
{
    double r[N_MODE], leading = -1.0;
    for (size_t j = 0; j < N_MODE; ++j) {
        r[j] = modulus(z[j]);
        dout->amplitude[j] = r[j] > 0.0 ? (z[j].re * dz[j].re + z[j].im * dz[j].im) / r[j] : 0.0;
        dout->phase[j] = r[j] > 0.0 ? (z[j].re * dz[j].im - z[j].im * dz[j].re) / r[j] / r[j] : 0.0;
    }
    for (size_t k = 0; k < N_FACET; ++k) {
        const double ratio = facet_value(k, r);
        if (ratio > leading) {
            leading = ratio;
            dout->trust_ratio = facet_value(k, dout->amplitude);
        }
    }
}

void rom_outputs_tangent(const rom_complex z[], const rom_complex dz[], rom_workspace *w, rom_output *dout)
{
    memset(dout, 0, sizeof *dout);
    rom_chart(z, w);
    pair_with_conjugate(dz, w->chart_tangent);
    complex_tangents(chart_product, N_CHART_PRODUCT, chart_pair, N_CHART_PAIR, w->chart, w->chart_tangent);
    chart_rows(&w->tables, w->chart_tangent, w->sensor_tangent);
    real_tangents(sensor_run, N_SENSOR_RUN, w->sensor, w->sensor_tangent);
    sensor_rows(&w->tables, w->sensor_tangent, 0, N_SENSOR_ROW, dout->sensor);
    amplitude_tangents(z, dz, dout);
}

double rom_trust_ratio(const rom_complex z[])
{
    double r[N_MODE], ratio = 0.0;
    for (size_t j = 0; j < N_MODE; ++j)
        r[j] = modulus(z[j]);
    for (size_t k = 0; k < N_FACET; ++k) {
        const double value = facet_value(k, r);
        if (!(value <= ratio)) /* a NaN must win */
            ratio = value;
    }
    return ratio;
}

rom_complex rom_eigenvalue(size_t mode)
{
    return eigenvalue[mode];
}

double rom_trained_amplitude(size_t mode)
{
    return trained_amplitude[mode];
}

double rom_base_share(size_t sensor)
{
    return base_share[sensor];
}

double rom_sensor_size(size_t row)
{
    return sensor_size[row / N_SENSOR];
}
