/* Random call sequences with valid, missing and damaged arguments: every call returns a defined status, none crashes,
   and no variable that can be read is ever undefined.
   Usage: fuzz LIBRARY N_SEQUENCE SEED. Prints "ok" and returns 0. */
#include "interface.h"
#include "random_arguments.h"

#define N_ACTION 20

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    (void)environment;
    CHECK(name != NULL && category != NULL && message != NULL && message[0] != '\0' && status <= fmi2Fatal);
}

typedef struct {
    fmi2Component c;
    fmi2FMUstate saved;
    char bytes[4096];
    size_t size;
    double time;
} subject;

static fmi2Status serialise(subject *s)
{
    s->size = 0;
    const fmi2Status status = SerializedFMUstateSize(s->c, s->saved, &s->size);
    CHECK(s->size <= sizeof s->bytes);
    return status == fmi2OK ? SerializeFMUstate(s->c, s->saved, s->bytes, s->size) : status;
}

static fmi2Status deserialise(subject *s)
{
    char damaged[sizeof s->bytes];
    fmi2FMUstate fresh = NULL;
    memcpy(damaged, s->bytes, sizeof damaged);
    if (below(2) && s->size > 0)
        damaged[below((unsigned)s->size)] ^= (char)(1 + below(255));
    const fmi2Status status = DeSerializeFMUstate(s->c, damaged, below(4) ? s->size : below(sizeof s->bytes), &fresh);
    return status == fmi2OK ? SetFMUstate(s->c, fresh) : status;
}

static fmi2Status read_everything(subject *s)
{
    double values[N_REAL];
    fmi2ValueReference all[N_REAL];
    for (unsigned k = 0; k < N_REAL; ++k)
        all[k] = k;
    const fmi2Status status = GetReal(s->c, all, N_REAL, values);
    for (unsigned k = 0; status == fmi2OK && k < N_STATE; ++k)
        CHECK(isfinite(values[k]));
    return status;
}

static fmi2Status act(subject *s, unsigned action)
{
    double x[N_STATE] = {number(), number()}, value = number(), result[N_STATE];
    fmi2ValueReference vr = below(N_REAL + 3), other = below(N_REAL + 3);
    fmi2Integer order = (fmi2Integer)below(3);
    fmi2Boolean yes = (fmi2Boolean)below(2), enter, end;
    fmi2EventInfo info;
    switch (action) {
    case 0: return SetupExperiment(s->c, yes, number(), number(), (fmi2Boolean)below(2), number());
    case 1: return EnterInitializationMode(s->c);
    case 2: return ExitInitializationMode(s->c);
    case 3: return SetReal(s->c, below(9) ? &vr : NULL, 1, &value);
    case 4: return SetRealInputDerivatives(s->c, &vr, 1, &order, &value);
    case 5: return GetRealOutputDerivatives(s->c, &vr, 1, &order, result);
    case 6: return GetDirectionalDerivative(s->c, &vr, 1, &other, 1, &value, result);
    case 7: return GetFMUstate(s->c, &s->saved);
    case 8: return SetFMUstate(s->c, below(5) ? s->saved : (fmi2FMUstate)&value);
    case 9: return FreeFMUstate(s->c, &s->saved);
    case 10: return serialise(s);
    case 11: return deserialise(s);
    case 12: return read_everything(s);
    case 13: return below(5) ? EnterContinuousTimeMode(s->c) : Reset(s->c);
    case 14: return NewDiscreteStates(s->c, below(9) ? &info : NULL);
    case 15: return SetContinuousStates(s->c, x, N_STATE - (below(9) == 0));
    case 16: return GetDerivatives(s->c, result, N_STATE);
    case 17: return CompletedIntegratorStep(s->c, yes, &enter, &end);
    case 18: return SetBoolean(s->c, &vr, 1, &yes);
    default: {
        const double h = step_length();
        const fmi2Status status = DoStep(s->c, s->time, h, yes);
        s->time += status <= fmi2Warning ? h : 0.0;
        return status;
    }
    }
}

static void sequence(void)
{
    const fmi2CallbackFunctions callbacks = {logger, NULL, NULL, NULL, NULL};
    subject s = {NULL, NULL, {0}, 0, 0.0};
    s.c = Instantiate("fuzz", below(2) ? fmi2CoSimulation : fmi2ModelExchange, MODEL_GUID, resources, &callbacks, 0, 0);
    CHECK(s.c != NULL);
    if (below(4)) { /* most sequences start properly, so that they get somewhere */
        CHECK(SetupExperiment(s.c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
        CHECK(EnterInitializationMode(s.c) == fmi2OK && ExitInitializationMode(s.c) == fmi2OK);
    }
    for (unsigned k = 0; k < N_CALL; ++k)
        CHECK(act(&s, below(N_ACTION + 4)) <= fmi2Error); /* the surplus makes steps more frequent */
    FreeInstance(s.c);
}

int main(int argc, char **argv)
{
    CHECK(argc == 4);
    load(argv[1]);
    fuzz(argv[2], argv[3], sequence);
    return 0;
}
