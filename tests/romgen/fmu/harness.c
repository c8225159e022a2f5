/* Loads an exported library without any Python and goes through the whole FMI 2.0 interface.
   Usage: harness LIBRARY. Prints "ok" and returns 0, or names the first check that failed. */
#include "interface.h"

static int n_message;

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    (void)environment;
    CHECK(name != NULL && category != NULL && message != NULL && message[0] != '\0' && status <= fmi2Fatal);
    for (const char *c = message; *c != '\0'; ++c) /* every percent sign is doubled */
        if (*c == '%')
            CHECK(*++c == '%');
    ++n_message;
}

static const fmi2CallbackFunctions callbacks = {logger, NULL, NULL, NULL, NULL};
static fmi2ValueReference all_reals[N_REAL], states[N_STATE], inputs[N_INPUT + 1];

static fmi2Component instance(fmi2Type type)
{
    fmi2Component c = Instantiate("100% one", type, MODEL_GUID, resources, &callbacks, fmi2False, fmi2False);
    CHECK(c != NULL);
    return c;
}

static fmi2Component started(fmi2Type type)
{
    double z[N_STATE];
    fmi2Component c = instance(type);
    for (size_t k = 0; k < N_STATE; ++k)
        z[k] = 0.1 + 0.05 * (double)k;
    CHECK(SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(SetReal(c, states, N_STATE, z) == fmi2OK);
    CHECK(EnterInitializationMode(c) == fmi2OK);
    CHECK(ExitInitializationMode(c) == fmi2OK);
    return c;
}

static void steps(fmi2Component c, int first, int n)
{
    for (int k = first; k < first + n; ++k) {
        double u[N_INPUT + 1], slope[N_INPUT + 1];
        fmi2Integer order[N_INPUT + 1];
        for (size_t i = 0; i < N_INPUT; ++i) {
            u[i] = 5.0 * sin(0.07 * k);
            slope[i] = 5.0 * (sin(0.07 * (k + 1)) - sin(0.07 * k)) / H;
            order[i] = 1;
        }
        CHECK(SetReal(c, inputs, N_INPUT, u) == fmi2OK);
        CHECK(SetRealInputDerivatives(c, inputs, N_INPUT, order, slope) == fmi2OK);
        CHECK(DoStep(c, k * H, H, fmi2True) == fmi2OK);
    }
}

static void read_all(fmi2Component c, double values[])
{
    CHECK(GetReal(c, all_reals, N_REAL, values) == fmi2OK);
    for (size_t k = 0; k < N_REAL; ++k)
        CHECK(isfinite(values[k]));
}

static void saved_states_replay_exactly(void)
{
    double first[N_REAL], again[N_REAL];
    fmi2FMUstate saved = NULL, copy = NULL;
    size_t size = 0;
    fmi2Component c = started(fmi2CoSimulation), other = instance(fmi2CoSimulation);
    steps(c, 0, 50);
    CHECK(GetFMUstate(c, &saved) == fmi2OK);
    CHECK(GetFMUstate(c, &saved) == fmi2OK); /* overwrites */
    CHECK(SerializedFMUstateSize(c, saved, &size) == fmi2OK);
    char *bytes = malloc(size);
    CHECK(bytes != NULL && SerializeFMUstate(c, saved, bytes, size) == fmi2OK);
    steps(c, 50, 50);
    read_all(c, first);
    CHECK(SetFMUstate(c, saved) == fmi2OK);
    steps(c, 50, 50);
    read_all(c, again);
    CHECK(memcmp(first, again, sizeof first) == 0);
    CHECK(DeSerializeFMUstate(other, bytes, size, &copy) == fmi2OK);
    CHECK(SetFMUstate(other, copy) == fmi2OK);
    steps(other, 50, 50);
    read_all(other, again);
    CHECK(memcmp(first, again, sizeof first) == 0);
    CHECK(SetFMUstate(c, copy) == fmi2Error); /* a handle of another instance */
    bytes[size - 1] ^= 1;
    CHECK(DeSerializeFMUstate(other, bytes, size, &copy) == fmi2Error);
    for (size_t n = 0; n < size; n += 7)
        CHECK(DeSerializeFMUstate(other, bytes, n, &copy) == fmi2Error);
    fmi2FMUstate dead = saved;
    CHECK(FreeFMUstate(c, &saved) == fmi2OK && saved == NULL);
    CHECK(FreeFMUstate(c, &saved) == fmi2OK);
    CHECK(FreeFMUstate(c, &dead) == fmi2Error);
    free(bytes);
    FreeInstance(other); /* still owns `copy` */
    CHECK(Terminate(c) == fmi2OK);
    FreeInstance(c);
}

static void reset_equals_fresh(void)
{
    double fresh[N_REAL], again[N_REAL], z[N_STATE];
    fmi2Component c = started(fmi2CoSimulation);
    steps(c, 0, 30);
    read_all(c, fresh);
    CHECK(Reset(c) == fmi2OK);
    for (size_t k = 0; k < N_STATE; ++k)
        z[k] = 0.1 + 0.05 * (double)k;
    CHECK(SetReal(c, states, N_STATE, z) == fmi2OK);
    CHECK(EnterInitializationMode(c) == fmi2OK && ExitInitializationMode(c) == fmi2OK);
    steps(c, 0, 30);
    read_all(c, again);
    CHECK(memcmp(fresh, again, sizeof fresh) == 0);
    FreeInstance(c);
}

static void instances_do_not_meet(void)
{
    double alone[N_REAL], beside[N_REAL];
    fmi2Component a = started(fmi2CoSimulation);
    steps(a, 0, 40);
    read_all(a, alone);
    FreeInstance(a);
    fmi2Component b = started(fmi2CoSimulation), other = started(fmi2CoSimulation);
    for (int k = 0; k < 40; ++k) {
        steps(b, k, 1);
        CHECK(DoStep(other, k * 3.7e-5, 3.7e-5, fmi2True) == fmi2OK);
    }
    read_all(b, beside);
    CHECK(memcmp(alone, beside, sizeof alone) == 0);
    FreeInstance(b);
    FreeInstance(other);
}

static void model_exchange(void)
{
    double x[N_STATE], rate[N_STATE], nominal[N_STATE];
    fmi2EventInfo info;
    fmi2Boolean enter = fmi2True, terminate = fmi2True;
    fmi2Component c = started(fmi2ModelExchange);
    CHECK(NewDiscreteStates(c, &info) == fmi2OK && !info.newDiscreteStatesNeeded && !info.nextEventTimeDefined);
    CHECK(EnterContinuousTimeMode(c) == fmi2OK);
    CHECK(GetNominalsOfContinuousStates(c, nominal, N_STATE) == fmi2OK && nominal[0] > 0.0);
    CHECK(GetContinuousStates(c, x, N_STATE) == fmi2OK && x[0] == 0.1);
    for (int k = 0; k < 20; ++k) {
        CHECK(SetTime(c, k * 1e-7) == fmi2OK);
        CHECK(GetDerivatives(c, rate, N_STATE) == fmi2OK);
        for (size_t i = 0; i < N_STATE; ++i)
            x[i] += 1e-7 * rate[i];
        CHECK(SetContinuousStates(c, x, N_STATE) == fmi2OK);
        CHECK(GetEventIndicators(c, NULL, 0) == fmi2OK);
        CHECK(CompletedIntegratorStep(c, fmi2True, &enter, &terminate) == fmi2OK && !enter && !terminate);
    }
    CHECK(SetContinuousStates(c, x, N_STATE - 1) == fmi2Error);
    x[0] = NAN;
    CHECK(SetContinuousStates(c, x, N_STATE) == fmi2Error);
    x[0] = 1e30;
    CHECK(SetContinuousStates(c, x, N_STATE) == fmi2OK);
    CHECK(GetDerivatives(c, rate, N_STATE) == fmi2Discard);
    CHECK(DoStep(c, 0.0, H, fmi2True) == fmi2Error);
    CHECK(EnterEventMode(c) == fmi2OK && Terminate(c) == fmi2OK);
    FreeInstance(c);
}

static void misuse_is_refused(void)
{
    double values[N_REAL], one = 1.0, nan = NAN;
    fmi2Integer integer, order = 1, second = 2;
    fmi2Boolean boolean;
    fmi2String string;
    fmi2Status status;
    fmi2FMUstate nothing = NULL;
    const fmi2ValueReference far = N_REAL, sensor = FIRST_SENSOR, zero = 0, one_boolean = 1;
    const fmi2String category = "noSuchCategory";
    CHECK(Instantiate("a", fmi2CoSimulation, "{wrong}", resources, &callbacks, fmi2False, fmi2False) == NULL);
    CHECK(Instantiate("", fmi2CoSimulation, MODEL_GUID, resources, &callbacks, fmi2False, fmi2False) == NULL);
    CHECK(Instantiate("a", fmi2CoSimulation, NULL, resources, &callbacks, fmi2False, fmi2False) == NULL);
    CHECK(Instantiate("a", fmi2CoSimulation, MODEL_GUID, resources, NULL, fmi2False, fmi2False) == NULL);
    fmi2Component c = instance(fmi2CoSimulation);
    CHECK(GetReal(c, &zero, 1, values) == fmi2Error);
    CHECK(DoStep(c, 0.0, H, fmi2True) == fmi2Error);
    CHECK(SetupExperiment(c, fmi2False, 0.0, 1.0, fmi2True, 0.5) == fmi2Error);
    CHECK(SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2True, 2.5 * H) == fmi2OK);
    CHECK(SetReal(c, &zero, 1, &nan) == fmi2Error);
    CHECK(EnterInitializationMode(c) == fmi2OK && EnterInitializationMode(c) == fmi2Error);
    CHECK(ExitInitializationMode(c) == fmi2OK);
    CHECK(SetReal(c, &zero, 1, &one) == fmi2Error && SetReal(c, &sensor, 1, &one) == fmi2Error);
    CHECK(SetReal(c, &far, 1, &one) == fmi2Error && GetReal(c, &far, 1, values) == fmi2Error);
    CHECK(SetReal(c, inputs, N_INPUT, NULL) == (N_INPUT ? fmi2Error : fmi2OK));
    CHECK(DoStep(c, 0.0, 0.0, fmi2True) == fmi2Error && DoStep(c, 0.0, -H, fmi2True) == fmi2Error);
    CHECK(DoStep(c, 0.0, NAN, fmi2True) == fmi2Error && DoStep(c, NAN, H, fmi2True) == fmi2Error);
    CHECK(DoStep(c, 0.0, 3.0 * H, fmi2True) == fmi2Error); /* beyond the stop time */
    CHECK(DoStep(c, 0.0, H, fmi2True) == fmi2OK);
    CHECK(GetInteger(c, &zero, 1, &integer) == fmi2Error && GetInteger(c, NULL, 0, NULL) == fmi2OK);
    CHECK(GetString(c, &zero, 1, &string) == fmi2Error && SetString(c, &zero, 1, &category) == fmi2Error);
    CHECK(SetInteger(c, &zero, 1, &order) == fmi2Error);
    boolean = fmi2False;
    CHECK(SetBoolean(c, &zero, 1, &boolean) == fmi2Error && SetBoolean(c, &one_boolean, 1, &boolean) == fmi2OK);
    CHECK(GetBoolean(c, &one_boolean, 1, &boolean) == fmi2OK && boolean == fmi2False);
    CHECK(SetRealInputDerivatives(c, &sensor, 1, &order, &one) == fmi2Error);
    CHECK(SetRealInputDerivatives(c, inputs, N_INPUT, &second, &one) == (N_INPUT ? fmi2Error : fmi2OK));
    CHECK(GetRealOutputDerivatives(c, &sensor, 1, &order, values) == fmi2OK);
    CHECK(GetRealOutputDerivatives(c, &sensor, 1, &second, values) == fmi2Error);
    CHECK(GetRealOutputDerivatives(c, &zero, 1, &order, values) == fmi2Error);
    CHECK(GetDirectionalDerivative(c, &sensor, 1, &zero, 1, &one, values) == fmi2OK);
    CHECK(GetDirectionalDerivative(c, &zero, 1, &zero, 1, &one, values) == fmi2Error);
    CHECK(GetDirectionalDerivative(c, &sensor, 1, &sensor, 1, &one, values) == fmi2Error);
    CHECK(SetFMUstate(c, &one) == fmi2Error && SetFMUstate(c, NULL) == fmi2Error);
    CHECK(GetFMUstate(c, NULL) == fmi2Error && FreeFMUstate(c, &nothing) == fmi2OK);
    CHECK(SetDebugLogging(c, fmi2True, 1, &category) == fmi2Error && SetDebugLogging(c, fmi2True, 0, NULL) == fmi2OK);
    CHECK(GetStatus(c, fmi2DoStepStatus, &status) == fmi2Discard && CancelStep(c) == fmi2Error);
    CHECK(GetRealStatus(c, fmi2LastSuccessfulTime, values) == fmi2OK && values[0] == H);
    CHECK(GetBooleanStatus(c, fmi2Terminated, &boolean) == fmi2OK && boolean == fmi2False);
    CHECK(GetIntegerStatus(c, fmi2DoStepStatus, &integer) == fmi2Discard);
    CHECK(GetStringStatus(c, fmi2PendingStatus, &string) == fmi2Discard);
    CHECK(EnterEventMode(c) == fmi2Error && GetDerivatives(c, values, N_STATE) == fmi2Error);
    read_all(c, values);
    CHECK(Terminate(c) == fmi2OK && DoStep(c, H, H, fmi2True) == fmi2Error);
    FreeInstance(c);
    FreeInstance(NULL);
    CHECK(DoStep(NULL, 0.0, H, fmi2True) == fmi2Error && Reset(NULL) == fmi2Error && CancelStep(NULL) == fmi2Error);
    CHECK(GetFMUstate(NULL, &nothing) == fmi2Error && GetReal(NULL, &zero, 1, values) == fmi2Error);
    CHECK(n_message > 0);
}

int main(int argc, char **argv)
{
    CHECK(argc == 2);
    for (size_t k = 0; k < N_REAL; ++k)
        all_reals[k] = (fmi2ValueReference)k;
    for (size_t k = 0; k < N_STATE; ++k)
        states[k] = (fmi2ValueReference)k;
    for (size_t k = 0; k < N_INPUT; ++k)
        inputs[k] = (fmi2ValueReference)(FIRST_INPUT + k);
    load(argv[1]);
    CHECK(strcmp(GetVersion(), "2.0") == 0 && strcmp(GetTypesPlatform(), "default") == 0);
    saved_states_replay_exactly();
    reset_equals_fresh();
    instances_do_not_meet();
    model_exchange();
    misuse_is_refused();
    printf("ok\n");
    return 0;
}
