/* FMI 3.0: variables, most of them arrays, and their derivatives. */
#include <string.h>

#include "fmi3_instance.h"

#define N_ALL ROM_AT_LEAST_ONE(VR_REAL_END)

typedef struct {
    fmi2ValueReference first, length;
} block;

static const block arrays[] = {
    {VR_STATE, N_REDUCED},
    {VR_RATE, N_REDUCED},
    {VR_SENSOR, N_SENSOR},
    {VR_SENSOR + N_SENSOR, N_SENSOR},
    {VR_ABSOLUTE, N_ABSOLUTE / 2},
    {VR_ABSOLUTE + N_ABSOLUTE / 2, N_ABSOLUTE / 2},
    {VR_AMPLITUDE, N_MODE},
    {VR_PHASE, N_MODE},
    {VR_START, N_START / 2},
    {VR_START + N_START / 2, N_START / 2},
    {VR_FREQUENCY, N_MODE},
    {VR_DAMPING, N_MODE},
};

size_t rom3_block_length(fmi3ValueReference vr)
{
    if (vr >= VR_REAL_END)
        return 0;
    for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; ++k)
        if (arrays[k].length > 0 && vr >= arrays[k].first && vr - arrays[k].first < arrays[k].length)
            return vr == arrays[k].first ? arrays[k].length : 0; /* elements have no reference of their own */
    return 1;
}

typedef struct {
    fmi2ValueReference vr[N_ALL];
    size_t n;
} scalars;

/* Lists the elements of the Float64 variables; false where a reference is unknown or the list names some twice. */
static int expand(const fmi3ValueReference vr[], size_t n, scalars *list)
{
    list->n = 0;
    for (size_t k = 0; k < n; ++k) {
        const size_t length = vr == NULL ? 0 : rom3_block_length(vr[k]);
        if (length == 0 || list->n + length > N_ALL)
            return 0;
        for (size_t i = 0; i < length; ++i)
            list->vr[list->n++] = vr[k] + (fmi2ValueReference)i;
    }
    return 1;
}

static const char *const bad_reference = "a value reference does not exist for this type, or the number of values does not fit";

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[], size_t n_value)
{
    rom3_instance *i = instance;
    size_t done = 0;
    if (i == NULL || !rom_permits(i->s, MODE_READABLE, "fmi3GetFloat64"))
        return fmi3Error;
    for (size_t k = 0; k < n; ++k) {
        const size_t length = vr == NULL ? 0 : (vr[k] == VR3_TIME ? 1 : rom3_block_length(vr[k]));
        if (length == 0 || values == NULL || done + length > n_value)
            return rom3_refuse(i, "fmi3GetFloat64", bad_reference);
        for (size_t e = 0; e < length; ++e)
            values[done++] = vr[k] == VR3_TIME ? i->s->memory.time : rom_get_real(i->s, vr[k] + (fmi2ValueReference)e);
    }
    return done == n_value ? fmi3OK : rom3_refuse(i, "fmi3GetFloat64", bad_reference);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[], size_t n_value)
{
    rom3_instance *i = instance;
    scalars list;
    if (i == NULL || !expand(vr, n, &list) || list.n != n_value)
        return rom3_refuse(i, "fmi3SetFloat64", bad_reference);
    return rom3_status(fmi2SetReal(i->s, list.vr, list.n, values));
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, fmi3Boolean values[], size_t n_value)
{
    rom3_instance *i = instance;
    if (i == NULL || n != n_value || (n > 0 && (vr == NULL || values == NULL)))
        return rom3_refuse(i, "fmi3GetBoolean", bad_reference);
    for (size_t k = 0; k < n; ++k) {
        const fmi2ValueReference old = vr[k] >= VR3_BOOLEAN ? vr[k] - VR3_BOOLEAN : VR_BOOLEAN_END;
        fmi2Boolean value = fmi2False;
        const fmi2Status status = fmi2GetBoolean(i->s, &old, 1, &value);
        if (status != fmi2OK)
            return rom3_status(status);
        values[k] = value != fmi2False;
    }
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, const fmi3Boolean values[], size_t n_value)
{
    rom3_instance *i = instance;
    if (i == NULL || n != n_value || (n > 0 && (vr == NULL || values == NULL)))
        return rom3_refuse(i, "fmi3SetBoolean", bad_reference);
    for (size_t k = 0; k < n; ++k) {
        const fmi2ValueReference old = vr[k] >= VR3_BOOLEAN ? vr[k] - VR3_BOOLEAN : VR_BOOLEAN_END;
        const fmi2Boolean value = values[k] ? fmi2True : fmi2False;
        const fmi2Status status = fmi2SetBoolean(i->s, &old, 1, &value);
        if (status != fmi2OK)
            return rom3_status(status);
    }
    return fmi3OK;
}

static const char *const bad_derivative = "a reference is unknown or named twice, or the number of values does not fit";

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknown[], size_t n_unknown,
                                        const fmi3ValueReference known[], size_t n_known, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    rom3_instance *i = instance;
    scalars u, k;
    if (i == NULL || !expand(unknown, n_unknown, &u) || !expand(known, n_known, &k) || u.n != n_sensitivity || k.n != n_seed)
        return rom3_refuse(i, "fmi3GetDirectionalDerivative", bad_derivative);
    return rom3_status(fmi2GetDirectionalDerivative(i->s, u.vr, u.n, k.vr, k.n, seed, sensitivity));
}

/* The transposed product, one column of the Jacobian at a time */
fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknown[], size_t n_unknown,
                                    const fmi3ValueReference known[], size_t n_known, const fmi3Float64 seed[],
                                    size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    rom3_instance *i = instance;
    scalars u, k;
    double column[N_ALL];
    if (i == NULL || !expand(unknown, n_unknown, &u) || !expand(known, n_known, &k) || u.n != n_seed ||
        k.n != n_sensitivity || (u.n > 0 && seed == NULL) || (k.n > 0 && sensitivity == NULL))
        return rom3_refuse(i, "fmi3GetAdjointDerivative", bad_derivative);
    for (size_t c = 0; c < k.n; ++c) {
        const double one = 1.0;
        const fmi2Status status = fmi2GetDirectionalDerivative(i->s, u.vr, u.n, &k.vr[c], 1, &one, column);
        if (status != fmi2OK)
            return rom3_status(status);
        sensitivity[c] = 0.0;
        for (size_t r = 0; r < u.n; ++r)
            sensitivity[c] += seed[r] * column[r];
    }
    return fmi3OK;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, const fmi3Int32 order[],
                                    fmi3Float64 values[], size_t n_value)
{
    rom3_instance *i = instance;
    size_t done = 0;
    for (size_t k = 0; k < n; ++k) {
        const fmi2Integer first = order == NULL ? 0 : order[k];
        scalars list;
        fmi2Integer orders[N_ALL];
        if (i == NULL || vr == NULL || values == NULL || !expand(&vr[k], 1, &list) || done + list.n > n_value)
            return rom3_refuse(i, "fmi3GetOutputDerivatives", bad_derivative);
        for (size_t e = 0; e < list.n; ++e)
            orders[e] = first;
        const fmi2Status status = fmi2GetRealOutputDerivatives(i->s, list.vr, list.n, orders, values + done);
        if (status != fmi2OK)
            return rom3_status(status);
        done += list.n;
    }
    return i != NULL && done == n_value ? fmi3OK : rom3_refuse(i, "fmi3GetOutputDerivatives", bad_derivative);
}
