/* Drives any unit of FMI 2.0 from one C loop inside the calling process, so that two units are timed by the same clock
   and the same caller; and functions that return at once, to time an importer by itself. */
#define _POSIX_C_SOURCE 199309L
#include <stddef.h>
#include <time.h>

typedef int step_function(void *, double, double, int);
typedef int set_function(void *, const unsigned *, size_t, const double *);
typedef int get_function(void *, const unsigned *, size_t, double *);

static double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

/* Microseconds per step; -1 where one fails. */
double time_steps(step_function *step, void *unit, int n, double h)
{
    const double start = now_us();
    for (int k = 0; k < n; ++k)
        if (step(unit, k * h, h, 1) > 1)
            return -1.0;
    return (now_us() - start) / n;
}

/* Microseconds per set + step + get; -1 where one fails. */
double time_passes(set_function *set, step_function *step, get_function *get, void *unit, int n, double h,
                   const unsigned *inputs, size_t n_input, const unsigned *outputs, size_t n_output)
{
    double u[16] = {0.0}, y[16];
    if (n_input > 16 || n_output > 16)
        return -1.0;
    const double start = now_us();
    for (int k = 0; k < n; ++k) {
        u[0] = 1e-3 * (double)(k % 2);
        if (set(unit, inputs, n_input, u) > 1 || step(unit, k * h, h, 1) > 1 || get(unit, outputs, n_output, y) > 1)
            return -1.0;
    }
    return (now_us() - start) / n;
}

int fmi2SetReal(void *unit, const unsigned *vr, size_t n, const double *value)
{
    (void)unit, (void)vr, (void)n, (void)value;
    return 0;
}

int fmi2GetReal(void *unit, const unsigned *vr, size_t n, double *value)
{
    (void)unit, (void)vr, (void)n, (void)value;
    return 0;
}

int fmi2DoStep(void *unit, double time, double h, int no_set_state_prior)
{
    (void)unit, (void)time, (void)h, (void)no_set_state_prior;
    return 0;
}
