#include "rom_instance.h"

#include <math.h>
#include <string.h>

static const double two_pi = 6.283185307179586476925;

rom_memory rom_initial_memory(fmi2Type kind)
{
    rom_memory memory;
    memset(&memory, 0, sizeof memory);
    memory.kind = (double)kind;
    memory.mode = MODE_INSTANTIATED;
    memory.input_gain = 1.0;
    memory.trust_radius = 1.0;
    memory.hard_limit = DEFAULT_HARD_LIMIT;
    memory.max_internal_step = DEFAULT_MAX_INTERNAL_STEP;
    memory.warn_on_crossing = 1.0;
    memory.inside = 1.0;
    return memory;
}

fmi2Status rom_refuse(const rom_instance *s, const char *function, const char *reason)
{
    if (s != NULL)
        rom_log(&s->logger, fmi2Error, LOG_ERROR, function, reason);
    return fmi2Error;
}

fmi2Status rom_fail(rom_instance *s, const char *function, const char *reason)
{
    s->memory.mode = MODE_ERROR;
    return rom_refuse(s, function, reason);
}

int rom_permits(const rom_instance *s, int modes, const char *function)
{
    if (s == NULL)
        return 0;
    if (((int)s->memory.mode & modes) != 0)
        return 1;
    rom_refuse(s, function, "this function may not be called in the present mode of the FMI state machine");
    return 0;
}

void rom_invalidate(rom_instance *s)
{
    s->known = 0;
}

void rom_update_rate(rom_instance *s)
{
    if ((s->known & KNOWN_RATE) != 0)
        return;
    double u[N_INPUT_STORED];
    for (size_t i = 0; i < N_INPUT_STORED; ++i)
        u[i] = s->memory.input_gain * s->memory.input[i];
    rom_rate(s->memory.z, u, &s->workspace, s->rate);
    s->known |= KNOWN_RATE;
}

/* Sensor row k, computed with the others of its kind */
static double sensor(rom_instance *s, size_t k)
{
    const size_t kind = k < N_SENSOR ? 0 : 1;
    const unsigned known = kind == 0 ? KNOWN_DISPLACEMENT : KNOWN_VELOCITY;
    if ((s->known & KNOWN_CHART) == 0)
        rom_chart(s->memory.z, &s->workspace);
    if ((s->known & known) == 0)
        rom_sensors(&s->workspace, kind, s->output.sensor + kind * N_SENSOR);
    s->known |= KNOWN_CHART | known;
    return s->output.sensor[k];
}

static const rom_output *amplitudes(rom_instance *s)
{
    if ((s->known & KNOWN_AMPLITUDE) == 0)
        rom_amplitudes(s->memory.z, &s->output);
    s->known |= KNOWN_AMPLITUDE;
    return &s->output;
}

fmi2Status rom_check_trust(rom_instance *s, double ratio)
{
    const int was_inside = s->memory.inside != 0.0;
    const int is_inside = ratio <= s->memory.trust_radius;
    s->memory.inside = is_inside ? 1.0 : 0.0;
    if (was_inside && !is_inside) {
        const int warn = s->memory.warn_on_crossing != 0.0;
        const fmi2Status status = warn ? fmi2Warning : fmi2OK;
        rom_log_value(&s->logger, status, LOG_TRUST_REGION,
                      "the motion left the trained range (trust_ratio > trust_radius); results are extrapolated from t =",
                      s->memory.time, "s on");
        return status;
    }
    if (!was_inside && is_inside)
        rom_log_value(&s->logger, fmi2OK, LOG_TRUST_REGION, "the motion is back in the trained range from t =",
                      s->memory.time, "s on");
    return fmi2OK;
}

int rom_beyond_hard_limit(const rom_instance *s, double ratio)
{
    return !(ratio <= s->memory.hard_limit);
}

static double constant(fmi2ValueReference vr)
{
    const size_t mode = vr < VR_DAMPING ? vr - VR_FREQUENCY : vr - VR_DAMPING;
    const rom_complex lambda = rom_eigenvalue(mode);
    const double omega = sqrt(lambda.re * lambda.re + lambda.im * lambda.im);
    return vr < VR_DAMPING ? omega / two_pi : -lambda.re / omega;
}

/* Component i of (re z_1, im z_1, re z_2, ...) */
static double part(const rom_complex z[], size_t i)
{
    return i % 2 == 0 ? z[i / 2].re : z[i / 2].im;
}

/* What the motion of the base adds to sensor row k, displacements first */
static double base_motion(const rom_memory *memory, size_t k)
{
    const size_t input = k < N_SENSOR ? N_INPUT : N_INPUT + 1;
    return rom_base_share(k % N_SENSOR) * memory->input_gain * memory->input[ABSOLUTE_OUTPUTS ? input : 0];
}

double rom_output_part(const rom_output *out, const double u[], fmi2ValueReference vr)
{
    if (vr < VR_ABSOLUTE)
        return out->sensor[vr - VR_SENSOR];
    if (vr < VR_AMPLITUDE) {
        const size_t k = vr - VR_ABSOLUTE, input = k < N_SENSOR ? N_INPUT : N_INPUT + 1;
        return out->sensor[k] + rom_base_share(k % N_SENSOR) * u[ABSOLUTE_OUTPUTS ? input : 0];
    }
    if (vr < VR_PHASE)
        return out->amplitude[vr - VR_AMPLITUDE];
    return vr < VR_TRUST_RATIO ? out->phase[vr - VR_PHASE] : out->trust_ratio;
}

void rom_update_start(rom_instance *s)
{
    if (!START_FROM_SENSORS)
        return;
    s->memory.start_misfit = rom_find_start(s->memory.start, &s->workspace, s->memory.z);
    rom_invalidate(s);
}

/* `vr` has been checked to be below VR_REAL_END */
double rom_get_real(rom_instance *s, fmi2ValueReference vr)
{
    if (vr < VR_RATE)
        return part(s->memory.z, vr - VR_STATE);
    if (vr < VR_INPUT) {
        rom_update_rate(s);
        return part(s->rate, vr - VR_RATE);
    }
    if (rom_in_block(vr, VR_INPUT, N_INPUT_ALL))
        return s->memory.input[vr - VR_INPUT];
    if (vr < VR_AMPLITUDE) {
        const size_t k = vr - (vr < VR_ABSOLUTE ? VR_SENSOR : VR_ABSOLUTE);
        return sensor(s, k) + (vr < VR_ABSOLUTE ? 0.0 : base_motion(&s->memory, k));
    }
    if (vr <= VR_TRUST_RATIO)
        return rom_output_part(amplitudes(s), NULL, vr);
    if (rom_in_block(vr, VR_START, N_START))
        return s->memory.start[vr - VR_START];
    if (rom_in_block(vr, VR_START_MISFIT, START_FROM_SENSORS))
        return s->memory.start_misfit;
    switch (vr) {
    case VR_INPUT_GAIN:
        return s->memory.input_gain;
    case VR_TRUST_RADIUS:
        return s->memory.trust_radius;
    case VR_HARD_LIMIT:
        return s->memory.hard_limit;
    case VR_MAX_INTERNAL_STEP:
        return s->memory.max_internal_step;
    default:
        return constant(vr);
    }
}

/* Whether `vr` may be set to `value` in the present mode. */
int rom_settable_real(const rom_instance *s, fmi2ValueReference vr, double value)
{
    const int mode = (int)s->memory.mode;
    const int before_start = (mode & (MODE_INSTANTIATED | MODE_INITIALIZATION)) != 0;
    if (!rom_is_finite(value))
        return 0;
    if (vr < VR_RATE)
        return before_start && !START_FROM_SENSORS;
    if (rom_in_block(vr, VR_INPUT, N_INPUT_ALL))
        return 1;
    if (mode == MODE_WITHIN_STEP)
        return 0;
    if (rom_in_block(vr, VR_START, N_START))
        return before_start;
    switch (vr) {
    case VR_INPUT_GAIN:
        return (mode & MODE_CONTINUOUS) == 0;
    case VR_TRUST_RADIUS:
    case VR_HARD_LIMIT:
        return value > 0.0 && (mode & MODE_CONTINUOUS) == 0;
    case VR_MAX_INTERNAL_STEP:
        return value > 0.0 && before_start;
    default:
        return 0;
    }
}

void rom_set_real(rom_instance *s, fmi2ValueReference vr, double value)
{
    s->known &= vr < VR_RATE ? 0U : ~(unsigned)KNOWN_RATE; /* what is kept of the outputs depends on no input */
    if (vr < VR_RATE && vr % 2 == 0)
        s->memory.z[vr / 2].re = value;
    else if (vr < VR_RATE)
        s->memory.z[vr / 2].im = value;
    else if (rom_in_block(vr, VR_START, N_START))
        s->memory.start[vr - VR_START] = value;
    else if (rom_in_block(vr, VR_INPUT, N_INPUT_ALL)) {
        s->memory.input[vr - VR_INPUT] = value;
        s->memory.input_derivative[vr - VR_INPUT] = 0.0;
    } else if (vr == VR_INPUT_GAIN)
        s->memory.input_gain = value;
    else if (vr == VR_TRUST_RADIUS)
        s->memory.trust_radius = value;
    else if (vr == VR_HARD_LIMIT)
        s->memory.hard_limit = value;
    else
        s->memory.max_internal_step = value;
}
