#include "rom_kernel.h"

#include <math.h>
#include <string.h>

#include "coefficients.h"

static const rom_blocks chart_blocks = {chart_count, N_CHART_BLOCK, N_CHART_ENTRY};
static const rom_blocks sensor_blocks = {sensor_count, N_SENSOR_BLOCK, N_SENSOR_ENTRY};

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

static void with_conjugate(rom_complex a, rom_complex p[2])
{
    const rom_complex conjugate = {a.re, -a.im};
    p[0] = a;
    p[1] = conjugate;
}

/* 1, z and products, each followed by its conjugate. Sizes that may be 0 come as arguments: compilers object to loops over
   a constant 0. */
static void base_monomials(const rom_complex z[], size_t n_product, rom_complex p[])
{
    const rom_complex one = {1.0, 0.0};
    rom_complex *next = p + 2 + N_REDUCED;
    p[0] = p[1] = one;
    for (size_t j = 0; j < N_MODE; ++j)
        with_conjugate(z[j], p + 2 + 2 * j);
    for (size_t k = 0; k < n_product; ++k, next += 2)
        with_conjugate(multiply(p[base_product[k].left], p[base_product[k].right]), next);
}

ROM_SMALL static void base_tangents(const rom_complex p[], const rom_complex dz[], size_t n_product, rom_complex dp[])
{
    const rom_complex zero = {0.0, 0.0};
    rom_complex *next = dp + 2 + N_REDUCED;
    dp[0] = dp[1] = zero;
    for (size_t j = 0; j < N_MODE; ++j)
        with_conjugate(dz[j], dp + 2 + 2 * j);
    for (size_t k = 0; k < n_product; ++k, next += 2) {
        const size_t a = base_product[k].left, b = base_product[k].right;
        with_conjugate(add(multiply(dp[a], p[b]), multiply(p[a], dp[b])), next);
    }
}

/* Monomials of two times m variables, x_j and y_j */
static void pair_monomials(const rom_pair x[], size_t n_product, rom_pair p[])
{
    rom_pair *next = p + 1 + N_MODE;
    p[0].left = p[0].right = 1.0;
    memcpy(p + 1, x, N_MODE * sizeof *p);
    for (size_t k = 0; k < n_product; ++k, ++next) {
        const rom_pair a = p[half_product[k].left], b = p[half_product[k].right];
        next->left = a.left * b.left;
        next->right = a.right * b.right;
    }
}

ROM_SMALL static void pair_tangents(const rom_pair p[], const rom_pair dx[], size_t n_product, rom_pair dp[])
{
    rom_pair *next = dp + 1 + N_MODE;
    dp[0].left = dp[0].right = 0.0;
    memcpy(dp + 1, dx, N_MODE * sizeof *dp);
    for (size_t k = 0; k < n_product; ++k, ++next) {
        const size_t a = half_product[k].left, b = half_product[k].right;
        next->left = dp[a].left * p[b].left + p[a].left * dp[b].left;
        next->right = dp[a].right * p[b].right + p[a].right * dp[b].right;
    }
}

/* (Re z_j, Im z_j) */
static void real_parts(const rom_complex z[], rom_pair x[])
{
    for (size_t j = 0; j < N_MODE; ++j) {
        x[j].left = z[j].re;
        x[j].right = z[j].im;
    }
}

/* (y_j, y_{m + j}) */
static void halves(const double y[], rom_pair x[])
{
    for (size_t j = 0; j < N_MODE; ++j) {
        x[j].left = y[j];
        x[j].right = y[N_MODE + j];
    }
}

/* Monomials of |z_k|^2, twice each, for the two parts of complex coefficients */
static void squares(const rom_complex z[], rom_pair p[])
{
    rom_pair square[N_MODE];
    for (size_t j = 0; j < N_MODE; ++j)
        square[j].left = square[j].right = z[j].re * z[j].re + z[j].im * z[j].im;
    pair_monomials(square, N_FORM_PRODUCT, p);
}

ROM_SMALL static void squares_tangent(const rom_complex z[], const rom_complex dz[], const rom_pair p[], rom_pair dp[])
{
    rom_pair change[N_MODE];
    for (size_t j = 0; j < N_MODE; ++j)
        change[j].left = change[j].right = 2.0 * (z[j].re * dz[j].re + z[j].im * dz[j].im);
    pair_tangents(p, change, N_FORM_PRODUCT, dp);
}

/* rate_j += sum over the groups of row j of base P(|z_1|^2, ..) */
static void add_normal_form(const rom_tables *t, const rom_complex base[], const rom_pair square[], rom_complex rate[])
{
    const rom_complex *c = t->form;
    for (size_t j = 0; j < N_MODE; ++j) {
        rom_complex sum = rate[j];
        for (size_t k = form_row[j]; k < form_row[j + 1]; ++k) {
            rom_complex P = {0.0, 0.0};
            for (size_t i = 0; i < form_group[k].count; ++i, ++c) {
                P.re += c->re * square[i].left;
                P.im += c->im * square[i].right;
            }
            sum = add(sum, multiply(base[form_group[k].base], P));
        }
        rate[j] = sum;
    }
}

static void inputs(const double u[], size_t n_input, rom_complex rate[])
{
    memset(rate, 0, N_MODE * sizeof *rate);
    for (size_t i = 0; i < n_input; ++i)
        for (size_t j = 0; j < N_MODE; ++j) {
            rate[j].re += input_matrix[i][j].re * u[i];
            rate[j].im += input_matrix[i][j].im * u[i];
        }
}

void rom_nonlinear_rate(const rom_complex z[], const double u[], rom_workspace *w, rom_complex rate[])
{
    base_monomials(z, N_BASE_PRODUCT, w->base);
    squares(z, w->square);
    inputs(u, N_INPUT, rate);
    add_normal_form(&w->tables, w->base, w->square, rate);
}

ROM_SMALL void rom_rate(const rom_complex z[], const double u[], rom_workspace *w, rom_complex rate[])
{
    rom_nonlinear_rate(z, u, w, rate);
    for (size_t j = 0; j < N_MODE; ++j)
        rate[j] = add(rate[j], multiply(eigenvalue[j], z[j]));
}

ROM_SMALL void rom_rate_tangent(const rom_complex z[], const rom_complex dz[], const double du[], rom_workspace *w,
                      rom_complex drate[])
{
    base_monomials(z, N_BASE_PRODUCT, w->base);
    base_tangents(w->base, dz, N_BASE_PRODUCT, w->base_tangent);
    squares(z, w->square);
    squares_tangent(z, dz, w->square, w->square_tangent);
    inputs(du, N_INPUT, drate);
    add_normal_form(&w->tables, w->base_tangent, w->square, drate);
    add_normal_form(&w->tables, w->base, w->square_tangent, drate);
    for (size_t j = 0; j < N_MODE; ++j)
        drate[j] = add(drate[j], multiply(eigenvalue[j], dz[j]));
}

void rom_chart(const rom_complex z[], rom_workspace *w)
{
    rom_pair x[N_MODE];
    double y[N_REDUCED];
    real_parts(z, x);
    pair_monomials(x, N_CHART_PRODUCT, w->chart);
    rom_rows(w->tables.chart, N_REDUCED, &chart_blocks, w->chart, w->chart, w->wide, y);
    halves(y, x);
    pair_monomials(x, N_SENSOR_PRODUCT, w->sensor);
}

void rom_sensors(const rom_workspace *w, size_t kind, double x[])
{
    rom_rows(w->tables.sensor[kind], N_SENSOR, &sensor_blocks, w->sensor, w->sensor, w->wide, x);
}

/* d(left right) = d left right + left d right */
ROM_SMALL static void rows_tangent(const double C[], size_t n_row, const rom_blocks *blocks, const rom_pair p[], const rom_pair dp[],
                         int wide, double dx[])
{
    double second[N_SENSOR > N_REDUCED ? N_SENSOR : N_REDUCED];
    rom_rows(C, n_row, blocks, dp, p, wide, dx);
    rom_rows(C, n_row, blocks, p, dp, wide, second);
    for (size_t i = 0; i < n_row; ++i)
        dx[i] += second[i];
}

ROM_SMALL void rom_amplitudes(const rom_complex z[], rom_output *out)
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
ROM_SMALL static void amplitude_tangents(const rom_complex z[], const rom_complex dz[], rom_output *dout)
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

ROM_SMALL void rom_outputs_tangent(const rom_complex z[], const rom_complex dz[], rom_workspace *w, rom_output *dout)
{
    rom_pair dx[N_MODE];
    double dy[N_REDUCED];
    memset(dout, 0, sizeof *dout);
    rom_chart(z, w);
    real_parts(dz, dx);
    pair_tangents(w->chart, dx, N_CHART_PRODUCT, w->tangent);
    rows_tangent(w->tables.chart, N_REDUCED, &chart_blocks, w->chart, w->tangent,
                 w->wide, dy);
    halves(dy, dx);
    pair_tangents(w->sensor, dx, N_SENSOR_PRODUCT, w->tangent);
    for (size_t kind = 0; kind < 2; ++kind)
        rows_tangent(w->tables.sensor[kind], N_SENSOR, &sensor_blocks, w->sensor,
                     w->tangent, w->wide, dout->sensor + kind * N_SENSOR);
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
