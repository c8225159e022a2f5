/* Reading and writing variables, and their directional derivatives. */
#include <string.h>

#include "rom_instance.h"

/* True if every reference of a list is below `end`. */
static int references_exist(const rom_instance *s, const fmi2ValueReference vr[], size_t n, fmi2ValueReference end,
                            const char *function)
{
    for (size_t k = 0; k < n; ++k)
        if (vr == NULL || vr[k] >= end) {
            rom_refuse(s, function, "a value reference does not exist for this type");
            return 0;
        }
    return 1;
}

/* Shared by the types that no variable has: an empty list is fine, anything else names a missing variable. */
static fmi2Status no_such_variables(const rom_instance *s, int modes, size_t n, const char *function)
{
    if (!rom_permits(s, modes, function))
        return fmi2Error;
    return n == 0 ? fmi2OK : rom_refuse(s, function, "this model has no variable of this type");
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    rom_instance *s = c;
    if (!rom_permits(s, MODE_READABLE, "fmi2GetReal") || !references_exist(s, vr, n, VR_REAL_END, "fmi2GetReal"))
        return fmi2Error;
    if (n > 0 && value == NULL)
        return rom_refuse(s, "fmi2GetReal", "the array of values is NULL");
    for (size_t k = 0; k < n; ++k)
        value[k] = rom_get_real(s, vr[k]);
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[])
{
    (void)vr;
    (void)value;
    return no_such_variables(c, MODE_READABLE, n, "fmi2GetInteger");
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[])
{
    rom_instance *s = c;
    if (!rom_permits(s, MODE_READABLE, "fmi2GetBoolean") ||
        !references_exist(s, vr, n, VR_BOOLEAN_END, "fmi2GetBoolean"))
        return fmi2Error;
    if (n > 0 && value == NULL)
        return rom_refuse(s, "fmi2GetBoolean", "the array of values is NULL");
    for (size_t k = 0; k < n; ++k) {
        const int inside = rom_trust_ratio(s->memory.z) <= s->memory.trust_radius;
        value[k] = (vr[k] == VR_INSIDE_TRUST_REGION ? inside : s->memory.warn_on_crossing != 0.0) ? fmi2True : fmi2False;
    }
    return fmi2OK;
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[])
{
    (void)vr;
    (void)value;
    return no_such_variables(c, MODE_READABLE, n, "fmi2GetString");
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    rom_instance *s = c;
    if (!rom_permits(s, MODE_WRITABLE | MODE_WITHIN_STEP, "fmi2SetReal") ||
        !references_exist(s, vr, n, VR_REAL_END, "fmi2SetReal"))
        return fmi2Error;
    for (size_t k = 0; k < n; ++k)
        if (value == NULL || !rom_settable_real(s, vr[k], value[k]))
            return rom_refuse(s, "fmi2SetReal",
                              "a value is not finite or out of range, or its variable may not be set now; nothing was set");
    for (size_t k = 0; k < n; ++k)
        rom_set_real(s, vr[k], value[k]);
    if (((int)s->memory.mode & MODE_INITIALIZATION) != 0)
        rom_update_start(s);
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[])
{
    (void)vr;
    (void)value;
    return no_such_variables(c, MODE_WRITABLE, n, "fmi2SetInteger");
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[])
{
    rom_instance *s = c;
    if (!rom_permits(s, MODE_WRITABLE, "fmi2SetBoolean") ||
        !references_exist(s, vr, n, VR_BOOLEAN_END, "fmi2SetBoolean"))
        return fmi2Error;
    for (size_t k = 0; k < n; ++k)
        if (value == NULL || vr[k] != VR_WARN_ON_CROSSING || ((int)s->memory.mode & MODE_CONTINUOUS) != 0)
            return rom_refuse(s, "fmi2SetBoolean", "the variable is an output or may not be set now; nothing was set");
    for (size_t k = 0; k < n; ++k)
        s->memory.warn_on_crossing = value[k] ? 1.0 : 0.0;
    return fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[])
{
    (void)vr;
    (void)value;
    return no_such_variables(c, MODE_WRITABLE, n, "fmi2SetString");
}

/* A direction in the knowns: states, and inputs after the gain. */
typedef struct {
    rom_complex dz[N_MODE];
    double du[N_INPUT_STORED];
} direction;

/* Adds `dv` along the known `vr`; false if it is no known of the model structure. */
static int add_known(const rom_memory *memory, fmi2ValueReference vr, double dv, direction *d)
{
    if (vr < VR_RATE) {
        if (vr % 2 == 0)
            d->dz[vr / 2].re += dv;
        else
            d->dz[vr / 2].im += dv;
    } else if (rom_in_block(vr, VR_INPUT, N_INPUT_ALL))
        d->du[vr - VR_INPUT] += memory->input_gain * dv;
    else if (vr == VR_INPUT_GAIN)
        for (size_t i = 0; i < N_INPUT_STORED; ++i)
            d->du[i] += memory->input[i] * dv;
    else
        return vr == VR_TRUST_RADIUS || vr == VR_HARD_LIMIT || vr == VR_MAX_INTERNAL_STEP; /* no Real depends on these */
    return 1;
}

static int is_rate(fmi2ValueReference vr)
{
    return vr >= VR_RATE && vr < VR_INPUT;
}

static int is_output(fmi2ValueReference vr)
{
    return vr >= VR_SENSOR && vr <= VR_TRUST_RATIO;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real dv_known[],
                                        fmi2Real dv_unknown[])
{
    static const char function[] = "fmi2GetDirectionalDerivative";
    rom_instance *s = c;
    direction d;
    rom_complex drate[N_MODE];
    rom_output dout;
    memset(&d, 0, sizeof d);
    if (!rom_permits(s, MODE_READABLE, function) || !references_exist(s, unknown, n_unknown, VR_REAL_END, function) ||
        !references_exist(s, known, n_known, VR_REAL_END, function))
        return fmi2Error;
    for (size_t k = 0; k < n_known; ++k)
        if (dv_known == NULL || !rom_is_finite(dv_known[k]) || !add_known(&s->memory, known[k], dv_known[k], &d))
            return rom_refuse(s, function, "a known is neither state, input nor tunable parameter, or its seed is not finite");
    for (size_t k = 0; k < n_unknown; ++k)
        if (dv_unknown == NULL || !(is_rate(unknown[k]) || is_output(unknown[k])))
            return rom_refuse(s, function, "an unknown is neither state derivative nor Real output");
    rom_rate_tangent(s->memory.z, d.dz, d.du, &s->workspace, drate);
    rom_outputs_tangent(s->memory.z, d.dz, &s->workspace, &dout);
    for (size_t k = 0; k < n_unknown; ++k) {
        const size_t i = unknown[k] - VR_RATE;
        dv_unknown[k] = is_output(unknown[k]) ? rom_output_part(&dout, d.du, unknown[k])
                                              : (i % 2 == 0 ? drate[i / 2].re : drate[i / 2].im);
    }
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[])
{
    static const char function[] = "fmi2GetRealOutputDerivatives";
    rom_instance *s = c;
    rom_output dout;
    double slope[N_INPUT_STORED];
    if (!rom_permits(s, MODE_STEP_COMPLETE | MODE_TERMINATED | MODE_ERROR, function) ||
        !references_exist(s, vr, n, VR_REAL_END, function))
        return fmi2Error;
    for (size_t k = 0; k < n; ++k)
        if (order == NULL || value == NULL || order[k] != 1 || !is_output(vr[k]))
            return rom_refuse(s, function, "only first derivatives of Real outputs exist");
    rom_update_rate(s);
    rom_outputs_tangent(s->memory.z, s->rate, &s->workspace, &dout);
    for (size_t i = 0; i < N_INPUT_STORED; ++i)
        slope[i] = s->memory.input_gain * s->memory.input_derivative[i];
    for (size_t k = 0; k < n; ++k)
        value[k] = rom_output_part(&dout, slope, vr[k]);
    return fmi2OK;
}
