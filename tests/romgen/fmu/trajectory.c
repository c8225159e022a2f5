/* Marches an exported library under a held input with known slope and prints every state, displacement and velocity of
   each step as hexadecimal numbers; the same program on Linux and on Windows.
   Usage: trajectory LIBRARY N_STEP. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef _WIN32
#include <windows.h>
#define FIND(name) (void *)GetProcAddress(library, name)
#else
#include <dlfcn.h>
#define FIND(name) dlsym(library, name)
#endif

#include "fmi2Functions.h"
#include "model_sizes.h"

#define N_STATE (2 * N_MODE)
#define N_ROW (N_STATE + 2 * N_SENSOR)
#define H 1e-4

static void quiet(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...)
{
    (void)e, (void)n, (void)s, (void)c, (void)m;
}

int main(int argc, char **argv)
{
    if (argc != 3)
        return 2;
#ifdef _WIN32
    HMODULE library = LoadLibraryA(argv[1]);
#else
    void *library = dlopen(argv[1], RTLD_NOW);
#endif
    if (library == NULL)
        return 3;
    fmi2InstantiateTYPE *instantiate;
    fmi2FreeInstanceTYPE *release;
    fmi2EnterInitializationModeTYPE *enter;
    fmi2ExitInitializationModeTYPE *leave;
    fmi2SetRealTYPE *set;
    fmi2GetRealTYPE *get;
    fmi2SetRealInputDerivativesTYPE *slope;
    fmi2DoStepTYPE *step;
    *(void **)(&instantiate) = FIND("fmi2Instantiate");
    *(void **)(&release) = FIND("fmi2FreeInstance");
    *(void **)(&enter) = FIND("fmi2EnterInitializationMode");
    *(void **)(&leave) = FIND("fmi2ExitInitializationMode");
    *(void **)(&set) = FIND("fmi2SetReal");
    *(void **)(&get) = FIND("fmi2GetReal");
    *(void **)(&slope) = FIND("fmi2SetRealInputDerivatives");
    *(void **)(&step) = FIND("fmi2DoStep");
    const fmi2CallbackFunctions callbacks = {quiet, NULL, NULL, NULL, NULL};
    const char *location = getenv("FMU_RESOURCES") != NULL ? getenv("FMU_RESOURCES") : "";
    fmi2Component c = instantiate("a", fmi2CoSimulation, MODEL_GUID, location, &callbacks, 0, 0);
    fmi2ValueReference rows[N_ROW];
    const fmi2ValueReference input = 2 * N_STATE;
    const fmi2Integer first = 1;
    double values[N_ROW];
    if (c == NULL)
        return 4;
    for (unsigned k = 0; k < N_STATE; ++k) {
        rows[k] = k;
        values[k] = 0.1 + 0.05 * k;
    }
    for (unsigned k = 0; k < 2 * N_SENSOR; ++k)
        rows[N_STATE + k] = 2 * N_STATE + N_INPUT + k;
    set(c, rows, N_STATE, values);
    enter(c);
    leave(c);
    for (int k = 0; k < atoi(argv[2]); ++k) {
        const double u = (double)(k * 7919 % 41 - 20), rise = (double)(k * 104729 % 23 - 11) / H; /* exact everywhere */
        set(c, &input, N_INPUT > 0, &u);
        slope(c, &input, N_INPUT > 0, &first, &rise);
        if (step(c, k * H, H, 1) > fmi2Warning || get(c, rows, N_ROW, values) != fmi2OK)
            return 5;
        for (unsigned i = 0; i < N_ROW; ++i)
            printf("%a ", values[i]);
        printf("\n");
    }
    release(c);
    return 0;
}
