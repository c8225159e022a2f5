/* FMI 2.0 functions for Model Exchange: the model has no events, only continuous states. */
#include <string.h>

#include "rom_instance.h"

/* As rom_permits, and only for an instance that was made for Model Exchange. */
static int permits_model_exchange(const rom_instance *s, int modes, const char *function)
{
    if (s != NULL && s->memory.kind != (double)fmi2ModelExchange) {
        rom_refuse(s, function, "the instance was made for Co-Simulation");
        return 0;
    }
    return rom_permits(s, modes, function);
}

static int is_state_vector(const rom_instance *s, const fmi2Real *x, size_t n, const char *function)
{
    if (x != NULL && n == N_REDUCED)
        return 1;
    rom_refuse(s, function, "the array is NULL or its length is not the number of continuous states");
    return 0;
}

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    rom_instance *s = c;
    if (!permits_model_exchange(s, MODE_EVENT | MODE_CONTINUOUS, "fmi2EnterEventMode"))
        return fmi2Error;
    s->memory.mode = MODE_EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    rom_instance *s = c;
    if (!permits_model_exchange(s, MODE_EVENT, "fmi2NewDiscreteStates"))
        return fmi2Error;
    if (info == NULL)
        return rom_refuse(s, "fmi2NewDiscreteStates", "the event information is NULL");
    memset(info, 0, sizeof *info); /* no events, no change */
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    rom_instance *s = c;
    if (!permits_model_exchange(s, MODE_EVENT, "fmi2EnterContinuousTimeMode"))
        return fmi2Error;
    s->memory.mode = MODE_CONTINUOUS;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set_state_prior, fmi2Boolean *enter_event_mode,
                                       fmi2Boolean *terminate)
{
    rom_instance *s = c;
    (void)no_set_state_prior;
    if (!permits_model_exchange(s, MODE_CONTINUOUS, "fmi2CompletedIntegratorStep"))
        return fmi2Error;
    if (enter_event_mode == NULL || terminate == NULL)
        return rom_refuse(s, "fmi2CompletedIntegratorStep", "the address of a result is NULL");
    *enter_event_mode = fmi2False;
    *terminate = fmi2False;
    const double ratio = rom_trust_ratio(s->memory.z);
    if (rom_beyond_hard_limit(s, ratio))
        return rom_fail(s, "fmi2CompletedIntegratorStep", "trust_ratio exceeds hard_limit");
    return rom_check_trust(s, ratio);
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    rom_instance *s = c;
    if (!permits_model_exchange(s, MODE_EVENT | MODE_CONTINUOUS, "fmi2SetTime"))
        return fmi2Error;
    if (!rom_is_finite(time))
        return rom_refuse(s, "fmi2SetTime", "the time is not finite");
    s->memory.time = time;
    return fmi2OK;
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n)
{
    rom_instance *s = c;
    if (!permits_model_exchange(s, MODE_CONTINUOUS, "fmi2SetContinuousStates") ||
        !is_state_vector(s, x, n, "fmi2SetContinuousStates"))
        return fmi2Error;
    for (size_t k = 0; k < n; ++k)
        if (!rom_is_finite(x[k]))
            return rom_refuse(s, "fmi2SetContinuousStates", "a state is not finite; nothing was set");
    memcpy(s->memory.z, x, sizeof s->memory.z);
    rom_invalidate(s);
    return fmi2OK;
}

/* Beyond the hard limit the answer is fmi2Discard: a trial stage of the solver went too far, a shorter step may help. */
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t n)
{
    rom_instance *s = c;
    if (!permits_model_exchange(s, MODE_READABLE, "fmi2GetDerivatives") ||
        !is_state_vector(s, derivatives, n, "fmi2GetDerivatives"))
        return fmi2Error;
    if (rom_beyond_hard_limit(s, rom_trust_ratio(s->memory.z))) {
        rom_log(&s->logger, fmi2Discard, LOG_DISCARD, "fmi2GetDerivatives", "trust_ratio exceeds hard_limit");
        return fmi2Discard;
    }
    rom_update_rate(s);
    memcpy(derivatives, s->rate, sizeof s->rate);
    return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t n)
{
    rom_instance *s = c;
    (void)indicators;
    if (!permits_model_exchange(s, MODE_READABLE, "fmi2GetEventIndicators"))
        return fmi2Error;
    return n == 0 ? fmi2OK : rom_refuse(s, "fmi2GetEventIndicators", "this model has no event indicators");
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
    rom_instance *s = c;
    if (!permits_model_exchange(s, MODE_READABLE, "fmi2GetContinuousStates") ||
        !is_state_vector(s, x, n, "fmi2GetContinuousStates"))
        return fmi2Error;
    memcpy(x, s->memory.z, sizeof s->memory.z);
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t n)
{
    rom_instance *s = c;
    if (!permits_model_exchange(s, MODE_ANY, "fmi2GetNominalsOfContinuousStates") ||
        !is_state_vector(s, nominals, n, "fmi2GetNominalsOfContinuousStates"))
        return fmi2Error;
    for (size_t k = 0; k < N_REDUCED; ++k)
        nominals[k] = rom_trained_amplitude(k / 2);
    return fmi2OK;
}
