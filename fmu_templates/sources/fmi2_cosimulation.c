/* FMI 2.0 functions for Co-Simulation. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "rom_instance.h"

#define MAX_SUB_STEPS 1e7 /* beyond this a step length or max_internal_step is a mistake, not a wish */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    static const char function[] = "fmi2SetRealInputDerivatives";
    rom_instance *s = c;
    if (!rom_permits(s, MODE_INSTANTIATED | MODE_INITIALIZATION | MODE_STEP_COMPLETE, function))
        return fmi2Error;
    for (size_t k = 0; k < n; ++k) {
        if (vr == NULL || order == NULL || value == NULL || !rom_in_block(vr[k], VR_INPUT, N_INPUT_ALL))
            return rom_refuse(s, function, "a value reference is no input");
        if (order[k] != 1 || !rom_is_finite(value[k]))
            return rom_refuse(s, function, "only finite first derivatives of inputs are taken");
    }
    for (size_t k = 0; k < n; ++k)
        s->memory.input_derivative[vr[k] - VR_INPUT] = value[k];
    return fmi2OK;
}

/* u(t) = gain (u_0 + u_0' tau), tau measured from the communication point */
static void input_at(const rom_memory *memory, double tau, double u[])
{
    for (size_t i = 0; i < N_INPUT_STORED; ++i)
        u[i] = memory->input_gain * (memory->input[i] + memory->input_derivative[i] * tau);
}

/* The inputs at tau, asked for if the importer wants to give them within the step */
static void sample(rom_instance *s, double tau, double u[])
{
    if (s->request_inputs == NULL)
        input_at(&s->memory, tau, u);
    else {
        if (tau > 0.0) {
            s->memory.mode = MODE_WITHIN_STEP;
            s->request_inputs(s->importer, s->memory.time + tau);
            s->memory.mode = MODE_STEP_COMPLETE;
        }
        input_at(&s->memory, 0.0, u);
    }
}

/* n = ceil(H / h_max), forgiving round-off in H, so that the number of sub-steps never depends on accumulated time */
static double sub_step_count(const rom_memory *memory, double step)
{
    const double n = step / memory->max_internal_step - 1e-9;
    return n <= 1.0 ? 1.0 : ceil(n);
}

/* Integrates over `step` in n sub-steps in place on a copy of the state; NULL, or the reason of a failure. `ratio`
   becomes the trust ratio at the end. */
static const char *integrate(rom_instance *s, double step, double n, rom_complex z[], double *ratio)
{
    const double h = step / n;
    double u_start[N_INPUT_STORED], u_middle[N_INPUT_STORED], u_end[N_INPUT_STORED];
    rom_etdrk4_prepare(&s->integrator, h);
    for (double k = 0.0; k < n; k += 1.0) {
        sample(s, k * h, u_start);
        sample(s, (k + 0.5) * h, u_middle);
        sample(s, (k + 1.0) * h, u_end);
        rom_etdrk4_step(&s->integrator, u_start, u_middle, u_end, &s->workspace, z);
        *ratio = rom_trust_ratio(z);
        if (!rom_is_finite(*ratio))
            return "the state became infinite or undefined; the state of the last communication point is kept";
        if (rom_beyond_hard_limit(s, *ratio))
            return "trust_ratio exceeds hard_limit; the state of the last communication point is kept";
    }
    return NULL;
}

/* What rounding may add to a time that an importer has summed up step by step: n additions err by at most n eps |t|
   (Higham, Accuracy and Stability of Numerical Algorithms, section 4.2); never more than half a step. */
static double time_slack(double time, double step)
{
    const double slack = 1e-6 * step + fabs(time) / step * DBL_EPSILON * fabs(time);
    return slack < 0.5 * step ? slack : 0.5 * step;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real current_time, fmi2Real step, fmi2Boolean no_set_state_prior)
{
    rom_instance *s = c;
    rom_complex z[N_MODE];
    double input[N_INPUT_STORED];
    const double time = s != NULL ? s->memory.time : 0.0;
    double ratio = 0.0;
    (void)no_set_state_prior; /* nothing is kept for a possible rollback: states are copied on request */
    if (!rom_permits(s, MODE_STEP_COMPLETE, "fmi2DoStep"))
        return fmi2Error;
    if (!rom_is_finite(current_time) || !rom_is_finite(step) || !(step > 0.0))
        return rom_refuse(s, "fmi2DoStep", "the communication step must be positive and finite");
    if (s->memory.stop_time_defined != 0.0 &&
        current_time + step > s->memory.stop_time + time_slack(s->memory.stop_time, step))
        return rom_refuse(s, "fmi2DoStep", "the step passes the stop time given to fmi2SetupExperiment");
    const double n = sub_step_count(&s->memory, step);
    if (n > MAX_SUB_STEPS)
        return rom_refuse(s, "fmi2DoStep", "the communication step holds more than 1e7 internal steps");
    memcpy(z, s->memory.z, sizeof z);
    memcpy(input, s->memory.input, sizeof input);
    s->memory.time = current_time;
    const char *reason = integrate(s, step, n, z, &ratio);
    if (reason != NULL) {
        s->memory.time = time;
        memcpy(s->memory.input, input, sizeof input);
        return rom_fail(s, "fmi2DoStep", reason);
    }
    memcpy(s->memory.z, z, sizeof z);
    for (size_t i = 0; i < N_INPUT_STORED; ++i)
        s->memory.input[i] += s->memory.input_derivative[i] * step;
    s->memory.time = current_time + step;
    rom_invalidate(s);
    return rom_check_trust(s, ratio);
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return rom_refuse(c, "fmi2CancelStep", "steps are computed synchronously, there is none to cancel");
}

/* A status that only asynchronous steps have. */
static fmi2Status no_pending_step(const rom_instance *s, const char *function)
{
    if (!rom_permits(s, MODE_STEP_COMPLETE | MODE_TERMINATED | MODE_ERROR, function))
        return fmi2Error;
    rom_log(&s->logger, fmi2Discard, LOG_DISCARD, function, "steps are computed synchronously, this status does not exist");
    return fmi2Discard;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)kind;
    (void)value;
    return no_pending_step(c, "fmi2GetStatus");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    const rom_instance *s = c;
    if (kind != fmi2LastSuccessfulTime || value == NULL)
        return no_pending_step(s, "fmi2GetRealStatus");
    if (!rom_permits(s, MODE_STEP_COMPLETE | MODE_TERMINATED | MODE_ERROR, "fmi2GetRealStatus"))
        return fmi2Error;
    *value = s->memory.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)kind;
    (void)value;
    return no_pending_step(c, "fmi2GetIntegerStatus");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    const rom_instance *s = c;
    if (kind != fmi2Terminated || value == NULL)
        return no_pending_step(s, "fmi2GetBooleanStatus");
    if (!rom_permits(s, MODE_STEP_COMPLETE | MODE_TERMINATED | MODE_ERROR, "fmi2GetBooleanStatus"))
        return fmi2Error;
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)kind;
    (void)value;
    return no_pending_step(c, "fmi2GetStringStatus");
}
