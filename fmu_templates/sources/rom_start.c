/* Damped least squares (Levenberg 1944) in the real unknowns w = (re z_1 / a_1, im z_1 / a_1, ...), a_j the trained amplitude. */
#include "rom_start.h"

#include <math.h>
#include <string.h>

#define MAX_ITERATIONS 60
#define RIDGE 1e-14 /* of sum w^2: of all states that fit equally well, the smallest; moves a fit by 1e-14 of it */

typedef struct {
    double w[N_REDUCED];
    double misfit[ROM_AT_LEAST_ONE(N_SENSOR_ROW)];
    double cost;
} candidate;

static void state_of(const double w[], rom_complex z[])
{
    for (size_t j = 0; j < N_MODE; ++j) {
        z[j].re = w[2 * j] * rom_trained_amplitude(j);
        z[j].im = w[2 * j + 1] * rom_trained_amplitude(j);
    }
}

static void judge(const double target[], rom_workspace *work, candidate *c)
{
    rom_complex z[N_MODE];
    double x[ROM_AT_LEAST_ONE(N_SENSOR_ROW)];
    state_of(c->w, z);
    rom_chart(z, work);
    for (size_t kind = 0; kind < 2; ++kind)
        rom_sensors(work, kind, x + kind * N_SENSOR);
    c->cost = 0.0;
    for (size_t i = 0; i < N_SENSOR_ROW; ++i) {
        c->misfit[i] = (x[i] - target[i]) / rom_sensor_size(i);
        c->cost += c->misfit[i] * c->misfit[i];
    }
    for (size_t k = 0; k < N_REDUCED; ++k)
        c->cost += RIDGE * c->w[k] * c->w[k];
}

/* Normal equations at c: the lower triangle of J^T J + RIDGE I, and minus half the gradient. */
static void linearise(const candidate *c, rom_workspace *work, double normal[N_REDUCED][N_REDUCED], double right[])
{
    double slope[N_REDUCED][ROM_AT_LEAST_ONE(N_SENSOR_ROW)];
    rom_complex z[N_MODE];
    rom_output dout;
    state_of(c->w, z);
    for (size_t k = 0; k < N_REDUCED; ++k) {
        double unit[N_REDUCED] = {0.0};
        rom_complex dz[N_MODE];
        unit[k] = 1.0;
        state_of(unit, dz);
        rom_outputs_tangent(z, dz, work, &dout);
        for (size_t i = 0; i < N_SENSOR_ROW; ++i)
            slope[k][i] = dout.sensor[i] / rom_sensor_size(i);
    }
    for (size_t k = 0; k < N_REDUCED; ++k) {
        right[k] = -RIDGE * c->w[k];
        for (size_t i = 0; i < N_SENSOR_ROW; ++i)
            right[k] -= slope[k][i] * c->misfit[i];
        for (size_t l = 0; l <= k; ++l) {
            normal[k][l] = k == l ? RIDGE : 0.0;
            for (size_t i = 0; i < N_SENSOR_ROW; ++i)
                normal[k][l] += slope[k][i] * slope[l][i];
        }
    }
}

/* x <- (A + damping I)^-1 x by Cholesky's factors; false where A is not positive definite to rounding. */
static int solve(double A[N_REDUCED][N_REDUCED], double damping, double x[])
{
    double L[N_REDUCED][N_REDUCED];
    for (size_t i = 0; i < N_REDUCED; ++i)
        for (size_t j = 0; j <= i; ++j) {
            double sum = A[i][j] + (i == j ? damping : 0.0);
            for (size_t k = 0; k < j; ++k)
                sum -= L[i][k] * L[j][k];
            if (i == j && !(sum > 0.0))
                return 0;
            L[i][j] = i == j ? sqrt(sum) : sum / L[j][j];
        }
    for (size_t i = 0; i < N_REDUCED; ++i) {
        for (size_t k = 0; k < i; ++k)
            x[i] -= L[i][k] * x[k];
        x[i] /= L[i][i];
    }
    for (size_t i = N_REDUCED; i-- > 0;) {
        for (size_t k = i + 1; k < N_REDUCED; ++k)
            x[i] -= L[k][i] * x[k];
        x[i] /= L[i][i];
    }
    return 1;
}

/* One accepted step from c, with the damping raised until the cost falls; false where none does. */
static int improve(const double target[], rom_workspace *work, candidate *c, double *damping)
{
    double normal[N_REDUCED][N_REDUCED], right[N_REDUCED];
    linearise(c, work, normal, right);
    for (; *damping < 1e12; *damping *= 10.0) {
        candidate next = *c;
        double step[N_REDUCED];
        memcpy(step, right, sizeof step);
        if (!solve(normal, *damping, step))
            continue;
        for (size_t k = 0; k < N_REDUCED; ++k)
            next.w[k] += step[k];
        judge(target, work, &next);
        if (next.cost < c->cost) {
            *c = next;
            *damping *= 0.01;
            return 1;
        }
    }
    return 0;
}

double rom_find_start(const double target[], rom_workspace *work, rom_complex z[])
{
    candidate c;
    double wanted = 0.0, left = 0.0, damping = 1e-6;
    memset(&c, 0, sizeof c);
    for (size_t i = 0; i < N_SENSOR_ROW; ++i)
        wanted += target[i] / rom_sensor_size(i) * (target[i] / rom_sensor_size(i));
    judge(target, work, &c);
    for (int k = 0; wanted > 0.0 && k < MAX_ITERATIONS; ++k)
        if (!improve(target, work, &c, &damping))
            break;
    state_of(c.w, z);
    for (size_t i = 0; i < N_SENSOR_ROW; ++i)
        left += c.misfit[i] * c.misfit[i];
    return wanted > 0.0 ? sqrt(left / wanted) : 0.0;
}
