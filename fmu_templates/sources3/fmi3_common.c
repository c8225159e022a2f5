/* FMI 3.0: making and freeing instances, modes, states. */
#include <stdlib.h>
#include <string.h>

#include "fmi3_instance.h"

#define MESSAGE_LENGTH 512

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

/* Hands a message of the runtime on; FMI 3.0 takes it as it is, so percent signs are single again. */
static void hand_on(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                    fmi2String message, ...)
{
    const rom3_instance *i = environment;
    char text[MESSAGE_LENGTH];
    size_t n = 0;
    (void)name;
    if (i->log == NULL)
        return;
    for (const char *c = message; *c != '\0' && n + 1 < sizeof text; ++c) {
        text[n++] = *c;
        if (c[0] == '%' && c[1] == '%')
            ++c;
    }
    text[n] = '\0';
    i->log(i->environment, rom3_status(status), category, text);
}

fmi3Status rom3_refuse(const rom3_instance *i, const char *function, const char *reason)
{
    return i == NULL ? fmi3Error : rom3_status(rom_refuse(i->s, function, reason));
}

static rom3_instance *new_instance(fmi2Type type, fmi3String name, fmi3String token, fmi3String resources,
                                   fmi3Boolean logging_on, const rom3_instance *settings)
{
    rom3_instance *i = calloc(1, sizeof *i);
    if (i == NULL)
        return NULL;
    *i = *settings;
    const fmi2CallbackFunctions callbacks = {hand_on, NULL, NULL, NULL, i};
    i->s = fmi2Instantiate(name, type, token, resources, &callbacks, fmi2False, logging_on ? fmi2True : fmi2False);
    if (i->s == NULL) {
        free(i);
        return NULL;
    }
    return i;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    const rom3_instance settings = {NULL, log, NULL, environment, 0};
    (void)visible;
    return new_instance(fmi2ModelExchange, name, token, resources, logging_on, &settings);
}

/* Asks the importer to set the inputs at a time within the step. */
static void request_inputs(void *importer, double time)
{
    rom3_instance *i = importer;
    fmi3Boolean early = fmi3False;
    fmi3Float64 early_time = time;
    i->updating = 1;
    i->update(i->environment, time, fmi3True, fmi3False, fmi3False, fmi3False, &early, &early_time);
    i->updating = 0;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging_on, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference required[], size_t n_required,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    const rom3_instance settings = {NULL, log, update, environment, 0};
    (void)visible;
    (void)early_return; /* no step returns early */
    (void)required;
    (void)n_required;
    rom3_instance *i = event_mode ? NULL : new_instance(fmi2CoSimulation, name, token, resources, logging_on, &settings);
    if (i == NULL && event_mode && log != NULL)
        log(environment, fmi3Error, "logStatusError", "fmi3InstantiateCoSimulation: this model has no event mode");
    if (i != NULL && update != NULL) {
        i->s->request_inputs = request_inputs;
        i->s->importer = i;
    }
    return i;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging_on,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback clock_update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging_on, (void)clock_update, (void)lock, (void)unlock;
    if (log != NULL)
        log(environment, fmi3Error, "logStatusError", "fmi3InstantiateScheduledExecution: not offered by this model");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    rom3_instance *i = instance;
    if (i == NULL)
        return;
    if (i->updating) {
        rom3_refuse(i, "fmi3FreeInstance", "the instance is within an intermediate update");
        return;
    }
    fmi2FreeInstance(i->s);
    free(i);
}

/* Calls of the runtime that need no more than another name. */
#define RUNTIME(instance) ((instance) == NULL ? NULL : ((rom3_instance *)(instance))->s)

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t n, const fmi3String categories[])
{
    return rom3_status(fmi2SetDebugLogging(RUNTIME(instance), on ? fmi2True : fmi2False, n, categories));
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop)
{
    const fmi2Status status = fmi2SetupExperiment(RUNTIME(instance), tolerance_defined ? fmi2True : fmi2False, tolerance,
                                                  start, stop_defined ? fmi2True : fmi2False, stop);
    return rom3_status(status > fmi2Warning ? status : fmi2EnterInitializationMode(RUNTIME(instance)));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    return rom3_status(fmi2ExitInitializationMode(RUNTIME(instance)));
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    return rom3_status(fmi2Terminate(RUNTIME(instance)));
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    return rom3_status(fmi2Reset(RUNTIME(instance)));
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    return rom3_status(fmi2GetFMUstate(RUNTIME(instance), state));
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
    return rom3_status(fmi2SetFMUstate(RUNTIME(instance), state));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    return rom3_status(fmi2FreeFMUstate(RUNTIME(instance), state));
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    return rom3_status(fmi2SerializedFMUstateSize(RUNTIME(instance), state, size));
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return rom3_status(fmi2SerializeFMUstate(RUNTIME(instance), state, (fmi2Byte *)bytes, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    return rom3_status(fmi2DeSerializeFMUstate(RUNTIME(instance), (const fmi2Byte *)bytes, size, state));
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_state_prior,
                      fmi3Boolean *event_needed, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last_time)
{
    rom3_instance *i = instance;
    if (i == NULL || event_needed == NULL || terminate == NULL || early == NULL || last_time == NULL)
        return rom3_refuse(i, "fmi3DoStep", "the address of a result is NULL");
    if (i->updating)
        return rom3_refuse(i, "fmi3DoStep", "the instance is within an intermediate update");
    const fmi2Status status = fmi2DoStep(i->s, time, step, no_set_state_prior ? fmi2True : fmi2False);
    *event_needed = *terminate = *early = fmi3False;
    *last_time = i->s->memory.time;
    if (status <= fmi2Warning && i->update != NULL) {
        fmi3Boolean wish = fmi3False;
        fmi3Float64 wished_time = *last_time;
        i->updating = 1;
        i->update(i->environment, *last_time, fmi3False, fmi3True, fmi3True, fmi3False, &wish, &wished_time);
        i->updating = 0;
    }
    return rom3_status(status);
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    return rom3_status(fmi2EnterEventMode(RUNTIME(instance)));
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    return rom3_status(fmi2EnterContinuousTimeMode(RUNTIME(instance)));
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *states, fmi3Boolean *next_defined,
                                    fmi3Float64 *next)
{
    fmi2EventInfo info;
    if (again == NULL || terminate == NULL || nominals == NULL || states == NULL || next_defined == NULL || next == NULL)
        return rom3_refuse(instance, "fmi3UpdateDiscreteStates", "the address of a result is NULL");
    const fmi2Status status = fmi2NewDiscreteStates(RUNTIME(instance), &info);
    *again = *terminate = *nominals = *states = *next_defined = fmi3False;
    *next = 0.0;
    return rom3_status(status);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean no_set_state_prior, fmi3Boolean *enter_event,
                                       fmi3Boolean *terminate)
{
    fmi2Boolean enter = fmi2False, end = fmi2False;
    if (enter_event == NULL || terminate == NULL)
        return rom3_refuse(instance, "fmi3CompletedIntegratorStep", "the address of a result is NULL");
    const fmi2Boolean prior = no_set_state_prior ? fmi2True : fmi2False;
    const fmi2Status status = fmi2CompletedIntegratorStep(RUNTIME(instance), prior, &enter, &end);
    *enter_event = enter != fmi2False;
    *terminate = end != fmi2False;
    return rom3_status(status);
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    return rom3_status(fmi2SetTime(RUNTIME(instance), time));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 x[], size_t n)
{
    return rom3_status(fmi2SetContinuousStates(RUNTIME(instance), x, n));
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 x[], size_t n)
{
    return rom3_status(fmi2GetContinuousStates(RUNTIME(instance), x, n));
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[], size_t n)
{
    return rom3_status(fmi2GetDerivatives(RUNTIME(instance), derivatives, n));
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 indicators[], size_t n)
{
    return rom3_status(fmi2GetEventIndicators(RUNTIME(instance), indicators, n));
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t n)
{
    return rom3_status(fmi2GetNominalsOfContinuousStates(RUNTIME(instance), nominals, n));
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *n)
{
    if (instance == NULL || n == NULL)
        return rom3_refuse(instance, "fmi3GetNumberOfEventIndicators", "the address of the result is NULL");
    *n = 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *n)
{
    if (instance == NULL || n == NULL)
        return rom3_refuse(instance, "fmi3GetNumberOfContinuousStates", "the address of the result is NULL");
    *n = N_REDUCED;
    return fmi3OK;
}
