/* Times an exported library from plain C: instantiate and free; a step; set input, step, read the displacements.
   Usage: fmu_timing LIBRARY N RESOURCES. Prints the three in microseconds. */
#define _POSIX_C_SOURCE 199309L
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"
#include "model_sizes.h"

#define H 1e-4
#define FIRST_INPUT (4 * N_MODE)
#define FIRST_SENSOR (FIRST_INPUT + N_INPUT)

static double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static void quiet(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...)
{
    (void)e, (void)n, (void)s, (void)c, (void)m;
}

int main(int argc, char **argv)
{
    if (argc != 4)
        return 2;
    void *library = dlopen(argv[1], RTLD_NOW);
    if (library == NULL)
        return 3;
    fmi2InstantiateTYPE *instantiate;
    fmi2FreeInstanceTYPE *release;
    fmi2SetupExperimentTYPE *setup;
    fmi2EnterInitializationModeTYPE *enter;
    fmi2ExitInitializationModeTYPE *leave;
    fmi2SetRealTYPE *set;
    fmi2GetRealTYPE *get;
    fmi2DoStepTYPE *step;
    *(void **)(&instantiate) = dlsym(library, "fmi2Instantiate");
    *(void **)(&release) = dlsym(library, "fmi2FreeInstance");
    *(void **)(&setup) = dlsym(library, "fmi2SetupExperiment");
    *(void **)(&enter) = dlsym(library, "fmi2EnterInitializationMode");
    *(void **)(&leave) = dlsym(library, "fmi2ExitInitializationMode");
    *(void **)(&set) = dlsym(library, "fmi2SetReal");
    *(void **)(&get) = dlsym(library, "fmi2GetReal");
    *(void **)(&step) = dlsym(library, "fmi2DoStep");

    const fmi2CallbackFunctions callbacks = {quiet, NULL, NULL, NULL, NULL};
    const int n = atoi(argv[2]), n_instance = 1000;
    double start = now_us();
    for (int k = 0; k < n_instance; ++k)
        release(instantiate("a", fmi2CoSimulation, MODEL_GUID, argv[3], &callbacks, 0, 0));
    const double instantiate_us = (now_us() - start) / n_instance;

    fmi2Component c = instantiate("a", fmi2CoSimulation, MODEL_GUID, argv[3], &callbacks, 0, 0);
    const fmi2ValueReference state = 0, input = FIRST_INPUT;
    fmi2ValueReference sensors[N_SENSOR];
    double values[N_SENSOR], z = 0.5, u;
    for (unsigned k = 0; k < N_SENSOR; ++k)
        sensors[k] = FIRST_SENSOR + k;
    setup(c, 0, 0.0, 0.0, 0, 0.0);
    set(c, &state, 1, &z);
    enter(c);
    leave(c);
    start = now_us();
    for (int k = 0; k < n; ++k)
        if (step(c, k * H, H, 1) > fmi2Warning)
            return 4;
    const double step_us = (now_us() - start) / n;
    start = now_us();
    for (int k = n; k < 2 * n; ++k) {
        u = 1e-3 * (double)(k % 2);
        set(c, &input, N_INPUT > 0, &u);
        if (step(c, k * H, H, 1) > fmi2Warning)
            return 4;
        get(c, sensors, N_SENSOR, values);
    }
    const double pass_us = (now_us() - start) / n;
    release(c);
    printf("%.6f %.6f %.6f\n", instantiate_us, step_us, pass_us);
    return 0;
}
