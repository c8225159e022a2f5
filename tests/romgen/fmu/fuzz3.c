/* Random call sequences of FMI 3.0, also from within the intermediate update, with valid, missing and damaged arguments:
   every call returns a defined status, none crashes, and no value that can be read is ever undefined.
   Linked with the sources of a unit. Usage: fuzz3 N_SEQUENCE SEED. Prints "ok" and returns 0. */
#include "fmi3_instance.h"
#include "random_arguments.h"

#define N_ACTION 25
#define N_VALUE (VR_REAL_END + 1)

typedef struct {
    fmi3Instance c;
    fmi3FMUState saved;
    fmi3Byte bytes[8192];
    size_t size;
    double time;
    int within; /* an intermediate update is under way */
} subject;

static fmi3Status act(subject *s, unsigned action);

static void message(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text)
{
    (void)e;
    CHECK(status <= fmi3Fatal && category != NULL && text != NULL && text[0] != '\0');
}

/* An importer that does anything at all instead of setting its inputs */
static void update(fmi3InstanceEnvironment e, fmi3Float64 time, fmi3Boolean set, fmi3Boolean get, fmi3Boolean finished,
                   fmi3Boolean can_return, fmi3Boolean *early, fmi3Float64 *early_time)
{
    subject *s = e;
    CHECK(isfinite(time) && set != get && get == finished && !can_return && early != NULL && early_time != NULL);
    CHECK(!s->within); /* steps do not nest */
    s->within = 1;
    *early = below(2) != 0;
    for (unsigned k = below(3); k > 0; --k)
        CHECK(act(s, below(N_ACTION)) <= fmi3Error);
    s->within = 0;
}

static fmi3Status serialise(subject *s)
{
    s->size = 0;
    const fmi3Status status = fmi3SerializedFMUStateSize(s->c, s->saved, &s->size);
    CHECK(s->size <= sizeof s->bytes);
    return status == fmi3OK ? fmi3SerializeFMUState(s->c, s->saved, s->bytes, s->size - below(2)) : status;
}

static fmi3Status deserialise(subject *s)
{
    fmi3Byte damaged[sizeof s->bytes];
    fmi3FMUState fresh = NULL;
    memcpy(damaged, s->bytes, sizeof damaged);
    if (below(2) && s->size > 0)
        damaged[below((unsigned)s->size)] ^= (fmi3Byte)(1 + below(255));
    const size_t size = below(4) ? s->size : below(sizeof s->bytes);
    const fmi3Status status = fmi3DeserializeFMUState(s->c, damaged, size, &fresh);
    return status == fmi3OK ? fmi3SetFMUState(s->c, fresh) : status;
}

static fmi3Status read_everything(subject *s)
{
    double values[N_VALUE] = {0.0};
    fmi3ValueReference all[N_VALUE];
    size_t n = 0;
    for (fmi3ValueReference vr = 0; vr < VR_REAL_END; ++vr)
        if (rom3_block_length(vr) > 0)
            all[n++] = vr;
    const fmi3Status status = fmi3GetFloat64(s->c, all, n, values, VR_REAL_END);
    for (unsigned k = 0; k < N_REDUCED; ++k)
        CHECK(isfinite(values[k])); /* outputs of a state far out may overflow, a state may not */
    return status;
}

static fmi3Status step(subject *s)
{
    fmi3Boolean event = true, terminate = true, early = true;
    double reached = NAN;
    const double h = step_length();
    const fmi3Status status = fmi3DoStep(s->c, s->time, h, below(2) != 0, &event, &terminate, &early,
                                         below(9) ? &reached : NULL);
    CHECK(status > fmi3Warning || (!event && !terminate && !early));
    if (status <= fmi3Warning)
        s->time += h;
    return status;
}

static fmi3Status derivative(subject *s, fmi3ValueReference unknown, fmi3ValueReference known, int adjoint)
{
    double seed[N_VALUE], result[N_VALUE];
    const size_t n_unknown = rom3_block_length(unknown) + (below(9) == 0);
    const size_t n_known = rom3_block_length(known) + (below(9) == 0);
    for (size_t k = 0; k < N_VALUE; ++k)
        seed[k] = number();
    if (adjoint)
        return fmi3GetAdjointDerivative(s->c, &unknown, 1, &known, 1, below(9) ? seed : NULL, n_unknown, result, n_known);
    return fmi3GetDirectionalDerivative(s->c, &unknown, 1, &known, 1, below(9) ? seed : NULL, n_known, result, n_unknown);
}

static fmi3Status set(subject *s, fmi3ValueReference vr)
{
    double values[N_VALUE];
    for (size_t k = 0; k < N_VALUE; ++k)
        values[k] = number();
    return fmi3SetFloat64(s->c, below(9) ? &vr : NULL, 1, values, rom3_block_length(vr) + (below(9) == 0));
}

static fmi3Status discrete_states(subject *s)
{
    fmi3Boolean again, terminate, nominals, states, defined;
    double next;
    return fmi3UpdateDiscreteStates(s->c, &again, &terminate, &nominals, &states, &defined, below(9) ? &next : NULL);
}

static fmi3Status completed_step(subject *s)
{
    fmi3Boolean enter, terminate;
    return fmi3CompletedIntegratorStep(s->c, below(2) != 0, below(9) ? &enter : NULL, &terminate);
}

/* Types and functions that the model does not have */
static fmi3Status absent(subject *s, fmi3ValueReference vr)
{
    fmi3Float32 single = 0.0F;
    fmi3UInt64 whole = 0;
    fmi3Clock clock = false;
    size_t n;
    switch (below(6)) {
    case 0: return fmi3GetFloat32(s->c, &vr, below(2), &single, below(2));
    case 1: return fmi3SetUInt64(s->c, &vr, below(2), &whole, below(2));
    case 2: return fmi3GetClock(s->c, &vr, below(2), &clock);
    case 3: return fmi3EnterConfigurationMode(s->c);
    case 4: return fmi3GetNumberOfContinuousStates(s->c, below(2) ? &n : NULL);
    default: return fmi3GetEventIndicators(s->c, NULL, below(2));
    }
}

static fmi3Status act(subject *s, unsigned action)
{
    double x[N_REDUCED] = {number(), number()}, result[N_VALUE];
    const fmi3ValueReference vr = below(VR3_TIME + 3), other = below(VR3_TIME + 3);
    const fmi3Int32 order = (fmi3Int32)below(3);
    fmi3Boolean yes = below(2) != 0;
    const size_t length = rom3_block_length(vr);
    const fmi3String category = below(2) ? "logAll" : NULL;
    switch (action) {
    case 0: return fmi3EnterInitializationMode(s->c, yes, number(), number(), below(2) != 0, number());
    case 1: return fmi3ExitInitializationMode(s->c);
    case 2: return set(s, vr);
    case 3: return set(s, VR_INPUT + below(ROM_AT_LEAST_ONE(N_INPUT_ALL)));
    case 4: return fmi3GetFloat64(s->c, below(9) ? &vr : NULL, 1, below(9) ? result : NULL, below(9) ? length : 0);
    case 5: return fmi3GetBoolean(s->c, &vr, 1, below(9) ? &yes : NULL, below(9) != 0);
    case 6: return fmi3SetBoolean(s->c, &vr, 1, &yes, below(9) != 0);
    case 7: return derivative(s, vr, other, 0);
    case 8: return derivative(s, vr, other, 1);
    case 9: return fmi3GetOutputDerivatives(s->c, &vr, 1, below(9) ? &order : NULL, result, below(9) ? length : 0);
    case 10: return fmi3GetFMUState(s->c, below(9) ? &s->saved : NULL);
    case 11: return fmi3SetFMUState(s->c, below(5) ? s->saved : (fmi3FMUState)&vr);
    case 12: return fmi3FreeFMUState(s->c, &s->saved);
    case 13: return serialise(s);
    case 14: return deserialise(s);
    case 15: return read_everything(s);
    case 16: return below(5) ? fmi3EnterContinuousTimeMode(s->c) : fmi3Reset(s->c);
    case 17: return discrete_states(s);
    case 18: return fmi3SetContinuousStates(s->c, x, N_REDUCED - (below(9) == 0));
    case 19: return fmi3GetContinuousStateDerivatives(s->c, below(9) ? result : NULL, N_REDUCED);
    case 20: return completed_step(s);
    case 21: return below(5) ? fmi3SetTime(s->c, number()) : fmi3Terminate(s->c);
    case 22: return fmi3SetDebugLogging(s->c, yes, below(2), below(9) ? &category : NULL);
    case 23: return absent(s, vr);
    default: return step(s);
    }
}

static fmi3Instance made(subject *s)
{
    if (below(2))
        return fmi3InstantiateModelExchange("fuzz", MODEL_GUID, NULL, fmi3False, below(2) != 0, s, message);
    return fmi3InstantiateCoSimulation("fuzz", MODEL_GUID, NULL, fmi3False, below(2) != 0, fmi3False, below(2) != 0,
                                       NULL, 0, s, below(3) ? message : NULL, below(3) ? update : NULL);
}

static void sequence(void)
{
    subject s = {NULL, NULL, {0}, 0, 0.0, 0};
    s.c = made(&s);
    CHECK(s.c != NULL);
    if (below(4)) { /* most sequences start properly, so that they get somewhere */
        CHECK(fmi3EnterInitializationMode(s.c, fmi3False, 0.0, 0.0, fmi3False, 0.0) == fmi3OK);
        CHECK(fmi3ExitInitializationMode(s.c) == fmi3OK);
    }
    for (unsigned k = 0; k < N_CALL; ++k) {
        CHECK(act(&s, below(N_ACTION + 4)) <= fmi3Error); /* the surplus makes steps more frequent */
        CHECK(!s.within);
    }
    fmi3FreeInstance(s.c);
}

int main(int argc, char **argv)
{
    CHECK(argc == 3);
    fuzz(argv[1], argv[2], sequence);
    return 0;
}
