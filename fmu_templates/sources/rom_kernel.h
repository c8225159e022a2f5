/* The reduced model: z' = Lambda z + N zeta^E + G u,  y/s = Re(T zeta^E),  x = W (y/s)^E,  x' = W_v (y/s)^E,
   with zeta = (z_1 .. z_m, conj z_1 .. conj z_m). Nothing here allocates, and no data is ever written but the arguments.

   All monomials are products of a few. In N those of abs(z_k)^2, which are real, are summed first for each of the rest.
   Chart, as a polynomial of (Re z, Im z), and sensors are sum_ab C_ab left_a right_b, with monomials of the first and of
   the last half of the variables. */
#ifndef ROM_KERNEL_H
#define ROM_KERNEL_H

#include <stddef.h>

#include "rom_rows.h"

#define N_REDUCED (2 * N_MODE)
#define N_SENSOR_ROW (2 * N_SENSOR)
#define ROM_AT_LEAST_ONE(n) ((n) > 0 ? (n) : 1)

#define N_HALF_MONOMIAL (1 + N_MODE + N_HALF_PRODUCT)
#define N_HALF_PADDED ((N_HALF_MONOMIAL + N_LANE - 1) / N_LANE * N_LANE)
#define N_BASE_MONOMIAL (2 * (1 + N_MODE + N_BASE_PRODUCT)) /* each followed by its conjugate */

#define N_BASE_MOTION (ABSOLUTE_OUTPUTS ? 2 : 0) /* displacement and velocity of the base, inputs */
#define N_ABSOLUTE (ABSOLUTE_OUTPUTS ? N_SENSOR_ROW : 0)
#define N_START (START_FROM_SENSORS ? N_SENSOR_ROW : 0)

typedef struct {
    double re, im;
} rom_complex;

/* By arithmetic: the macros of math.h call into one particular C library on some platforms. */
static inline int rom_is_finite(double x)
{
    return x - x == 0.0;
}

/* Monomials: 1, the variables, then products of two earlier ones. */
typedef struct {
    unsigned short left, right;
} rom_product;

/* Terms of N with the same monomial `base` but for its pairs z_k conj z_k: `count` coefficients over the monomials of these. */
typedef struct {
    unsigned short base, count;
} rom_group;

/* The large tables of coefficients: doubles only, so that a file can hold them as one array. Each instance has its own. */
typedef struct {
    rom_complex form[ROM_AT_LEAST_ONE(N_FORM_TERM)];
    double chart[N_REDUCED * N_CHART_ENTRY];
    double sensor[2][N_SENSOR * N_SENSOR_ENTRY]; /* displacements, velocities */
} rom_tables;

/* Tables, and monomials and their tangents; kept with the instance so that no step needs memory or much stack. */
typedef struct {
    rom_tables tables;
    int wide; /* whether the processor has AVX; results do not depend on it */
    rom_complex base[N_BASE_MONOMIAL], base_tangent[N_BASE_MONOMIAL];
    rom_pair square[N_HALF_MONOMIAL], square_tangent[N_HALF_MONOMIAL];
    rom_pair chart[N_HALF_PADDED], sensor[N_HALF_PADDED], tangent[N_HALF_PADDED]; /* what pads the last block stays 0 */
} rom_workspace;

typedef struct {
    double sensor[ROM_AT_LEAST_ONE(N_SENSOR_ROW)]; /* displacements in m, then velocities in m/s */
    double amplitude[N_MODE];                      /* |z_j| */
    double phase[N_MODE];                          /* arg z_j in rad, 0 at rest */
    double trust_ratio;                            /* max_k n_k . |z|, n_k the facets of the trained range */
} rom_output;

/* N zeta^E + G u, 1/s */
void rom_nonlinear_rate(const rom_complex z[], const double u[], rom_workspace *w, rom_complex rate[]);

/* z' = Lambda z + N zeta^E + G u, 1/s */
void rom_rate(const rom_complex z[], const double u[], rom_workspace *w, rom_complex rate[]);

/* d z' along (dz, du), 1/s */
void rom_rate_tangent(const rom_complex z[], const rom_complex dz[], const double du[], rom_workspace *w,
                      rom_complex drate[]);

/* y/s = Re(T zeta^E): its monomials for the sensors, kept in the workspace */
void rom_chart(const rom_complex z[], rom_workspace *w);

/* The N_SENSOR displacements (kind 0) or velocities (kind 1) x; after rom_chart */
void rom_sensors(const rom_workspace *w, size_t kind, double x[]);

/* |z_j|, arg z_j and the trust ratio */
void rom_amplitudes(const rom_complex z[], rom_output *out);

/* d outputs along dz; at z_j = 0, where |z_j| has a kink, its derivative is taken as 0 */
void rom_outputs_tangent(const rom_complex z[], const rom_complex dz[], rom_workspace *w, rom_output *dout);

double rom_trust_ratio(const rom_complex z[]);
rom_complex rom_eigenvalue(size_t mode);
double rom_trained_amplitude(size_t mode);

/* Share of the motion of the base that sensor k sees. */
double rom_base_share(size_t sensor);

/* Typical size of a sensor output, by which a misfit is measured. */
double rom_sensor_size(size_t row);

#endif
