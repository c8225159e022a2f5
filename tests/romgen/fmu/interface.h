/* Loads the 44 functions of FMI 2.0 from a library, for the programs that test it without Python. */
#ifndef INTERFACE_H
#define INTERFACE_H

#include <dlfcn.h>

#include "check.h"
#include "fmi2Functions.h"
#include "model_sizes.h"

#define N_STATE (2 * N_MODE)
#define N_REAL (2 * N_STATE + N_INPUT + 2 * N_SENSOR + 2 * N_MODE + 5 + 2 * N_MODE)
#define FIRST_INPUT (2 * N_STATE)
#define FIRST_SENSOR (FIRST_INPUT + N_INPUT)

/* One pointer per function of the standard, named like the function. */
#define ALL_FUNCTIONS(X)                                                                                         \
    X(GetTypesPlatform) X(GetVersion) X(SetDebugLogging) X(Instantiate) X(FreeInstance) X(SetupExperiment)       \
    X(EnterInitializationMode) X(ExitInitializationMode) X(Terminate) X(Reset) X(GetReal) X(GetInteger)          \
    X(GetBoolean) X(GetString) X(SetReal) X(SetInteger) X(SetBoolean) X(SetString) X(GetFMUstate)                \
    X(SetFMUstate) X(FreeFMUstate) X(SerializedFMUstateSize) X(SerializeFMUstate) X(DeSerializeFMUstate)         \
    X(GetDirectionalDerivative) X(EnterEventMode) X(NewDiscreteStates) X(EnterContinuousTimeMode)                \
    X(CompletedIntegratorStep) X(SetTime) X(SetContinuousStates) X(GetDerivatives) X(GetEventIndicators)         \
    X(GetContinuousStates) X(GetNominalsOfContinuousStates) X(SetRealInputDerivatives)                           \
    X(GetRealOutputDerivatives) X(DoStep) X(CancelStep) X(GetStatus) X(GetRealStatus) X(GetIntegerStatus)        \
    X(GetBooleanStatus) X(GetStringStatus)

#define DECLARE(name) static fmi2##name##TYPE *name;
ALL_FUNCTIONS(DECLARE)

static int n_function;
static const char *resources = ""; /* location of the resources, from FMU_RESOURCES; not every unit has one */

#define LOAD(name)                                            \
    *(void **)(&name) = dlsym(library, "fmi2" #name);         \
    n_function += name != NULL;

static void load(const char *path)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL)
        fprintf(stderr, "%s\n", dlerror());
    CHECK(library != NULL);
    ALL_FUNCTIONS(LOAD)
    CHECK(n_function == 44);
    if (getenv("FMU_RESOURCES") != NULL)
        resources = getenv("FMU_RESOURCES");
}

#endif
