/* Linked with the sources of an FMI 3.0 unit: goes through its interface without Python. Works for every choice of
   outputs and start values. Prints "ok" and returns 0, or names the first check that failed. */
#include "check.h"
#include "fmi3_instance.h"

static const fmi3ValueReference state = VR_STATE, rate = VR_RATE, sensor = VR_SENSOR, gain = VR_INPUT_GAIN;
static int n_message, n_update;

static void message(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text)
{
    (void)e;
    CHECK(status <= fmi3Fatal && category != NULL && text != NULL && text[0] != '\0');
    ++n_message;
}

static void update(fmi3InstanceEnvironment e, fmi3Float64 time, fmi3Boolean set, fmi3Boolean get, fmi3Boolean finished,
                   fmi3Boolean can_return, fmi3Boolean *early, fmi3Float64 *early_time)
{
    (void)e, (void)time, (void)set, (void)get, (void)finished, (void)can_return, (void)early, (void)early_time;
    ++n_update;
}

static fmi3Instance made(int exchange)
{
    fmi3Instance c = exchange
        ? fmi3InstantiateModelExchange("100% me", MODEL_GUID, NULL, fmi3False, fmi3True, NULL, message)
        : fmi3InstantiateCoSimulation("cs", MODEL_GUID, NULL, fmi3False, fmi3True, fmi3False, fmi3False, NULL, 0, NULL,
                                      message, update);
    CHECK(c != NULL);
    return c;
}

static void start(fmi3Instance c)
{
    double z[N_REDUCED] = {0.1, 0.2}, x[N_SENSOR];
    const fmi3ValueReference displaced = VR_START;
    for (size_t k = 0; k < N_SENSOR; ++k)
        x[k] = 1e-5;
    if (START_FROM_SENSORS)
        CHECK(fmi3SetFloat64(c, &displaced, 1, x, N_SENSOR) == fmi3OK);
    else
        CHECK(fmi3SetFloat64(c, &state, 1, z, N_REDUCED) == fmi3OK);
    CHECK(fmi3EnterInitializationMode(c, fmi3False, 0.0, 0.0, fmi3False, 0.0) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(c) <= fmi3Warning);
}

static void steps(fmi3Instance c, int first, int n)
{
    for (int k = first; k < first + n; ++k) {
        fmi3Boolean event, terminate, early;
        double reached;
        for (fmi3ValueReference i = 0; i < N_INPUT_ALL; ++i) {
            const fmi3ValueReference vr = VR_INPUT + i;
            const double u = 1e-3 * sin(0.07 * k);
            CHECK(fmi3SetFloat64(c, &vr, 1, &u, 1) == fmi3OK);
        }
        CHECK(fmi3DoStep(c, k * H, H, fmi3True, &event, &terminate, &early, &reached) <= fmi3Warning);
    }
}

/* Every Float64 there is, one variable after the other. */
static size_t read_all(fmi3Instance c, double values[VR_REAL_END])
{
    size_t n = 0;
    for (fmi3ValueReference vr = 0; vr < VR_REAL_END; ++vr) {
        const size_t length = rom3_block_length(vr);
        if (length == 0)
            continue;
        CHECK(n + length <= VR_REAL_END && fmi3GetFloat64(c, &vr, 1, values + n, length) == fmi3OK);
        n += length;
    }
    for (size_t k = 0; k < n; ++k)
        CHECK(isfinite(values[k]));
    return n;
}

static void co_simulation(void)
{
    double first[VR_REAL_END], again[VR_REAL_END];
    fmi3Instance c = made(0);
    fmi3FMUState saved = NULL, copy = NULL;
    size_t size;
    start(c);
    steps(c, 0, 20);
    CHECK(n_update > 0 && fmi3GetFMUState(c, &saved) == fmi3OK);
    CHECK(fmi3SerializedFMUStateSize(c, saved, &size) == fmi3OK);
    fmi3Byte *bytes = malloc(size);
    CHECK(bytes != NULL && fmi3SerializeFMUState(c, saved, bytes, size) == fmi3OK);
    steps(c, 20, 20);
    const size_t n = read_all(c, first);
    CHECK(n == VR_REAL_END); /* the blocks leave no gap */
    CHECK(fmi3DeserializeFMUState(c, bytes, size, &copy) == fmi3OK && fmi3SetFMUState(c, copy) == fmi3OK);
    steps(c, 20, 20);
    CHECK(read_all(c, again) == n && memcmp(first, again, n * sizeof *first) == 0);
    for (size_t k = 0; k < size; k += 7)
        CHECK(fmi3DeserializeFMUState(c, bytes, k, &copy) == fmi3Error);
    CHECK(fmi3FreeFMUState(c, &saved) == fmi3OK); /* `copy` is left to the instance */
    free(bytes);
    CHECK(fmi3Terminate(c) == fmi3OK && fmi3Reset(c) == fmi3OK);
    start(c);
    fmi3FreeInstance(c);
}

static void derivatives(fmi3Instance c)
{
    double along[N_SENSOR], back[N_REDUCED], seed[N_REDUCED] = {1.0}, weight[N_SENSOR] = {1.0};
    CHECK(fmi3GetDirectionalDerivative(c, &sensor, 1, &state, 1, seed, N_REDUCED, along, N_SENSOR) == fmi3OK);
    CHECK(fmi3GetAdjointDerivative(c, &sensor, 1, &state, 1, weight, N_SENSOR, back, N_REDUCED) == fmi3OK);
    CHECK(fabs(along[0] - back[0]) <= 1e-12 * fabs(along[0]));
    CHECK(fmi3GetDirectionalDerivative(c, &sensor, 1, &state, 1, seed, N_REDUCED - 1, along, N_SENSOR) == fmi3Error);
    CHECK(fmi3GetAdjointDerivative(c, &sensor, 1, &rate, 1, weight, N_SENSOR, back, N_REDUCED) == fmi3Error);
}

static void model_exchange(void)
{
    double x[N_REDUCED], dx[N_REDUCED], nominal[N_REDUCED];
    fmi3Boolean again, terminate, nominals, states, defined, enter;
    double next;
    fmi3Instance c = made(1);
    start(c);
    CHECK(fmi3UpdateDiscreteStates(c, &again, &terminate, &nominals, &states, &defined, &next) == fmi3OK && !again);
    CHECK(fmi3EnterContinuousTimeMode(c) == fmi3OK);
    CHECK(fmi3GetNominalsOfContinuousStates(c, nominal, N_REDUCED) == fmi3OK);
    for (int k = 0; k < 20; ++k) {
        CHECK(fmi3SetTime(c, k * 1e-7) == fmi3OK && fmi3GetContinuousStates(c, x, N_REDUCED) == fmi3OK);
        CHECK(fmi3GetContinuousStateDerivatives(c, dx, N_REDUCED) == fmi3OK);
        for (size_t i = 0; i < N_REDUCED; ++i)
            x[i] += 1e-7 * dx[i];
        CHECK(fmi3SetContinuousStates(c, x, N_REDUCED) == fmi3OK);
        CHECK(fmi3CompletedIntegratorStep(c, fmi3True, &enter, &terminate) <= fmi3Warning && !enter && !terminate);
    }
    derivatives(c);
    fmi3FreeInstance(c);
}

static void misuse(void)
{
    double value = NAN, many[VR_REAL_END + 1];
    const fmi3ValueReference far = 100000;
    CHECK(fmi3InstantiateModelExchange("a", "{wrong}", NULL, fmi3False, fmi3False, NULL, message) == NULL);
    CHECK(n_message > 0);
    fmi3Instance c = made(0);
    CHECK(fmi3GetFloat64(c, &far, 1, many, 1) == fmi3Error && fmi3SetFloat64(c, &gain, 1, &value, 1) == fmi3Error);
    CHECK(fmi3GetFloat64(NULL, &gain, 1, many, 1) == fmi3Error && fmi3Reset(NULL) == fmi3Error);
    CHECK(fmi3SetFMUState(c, &value) == fmi3Error && fmi3EnterContinuousTimeMode(c) == fmi3Error);
    start(c);
    CHECK(fmi3GetFloat64(c, &sensor, 1, many, N_SENSOR + 1) == fmi3Error);
    CHECK(fmi3SetFloat64(c, &sensor, 1, many, N_SENSOR) == fmi3Error);
    fmi3FreeInstance(c);
    fmi3FreeInstance(NULL);
}

/* No logger, an event mode that is not offered, refused and failed steps, reset after an error, reading after the end. */
static void importers(void)
{
    fmi3Boolean event, terminate, early;
    double reached, ratio, limit = 1e-9;
    const fmi3ValueReference hard_limit = VR_HARD_LIMIT, trust_ratio = VR_TRUST_RATIO;
    n_message = 0;
    CHECK(fmi3InstantiateCoSimulation("a", MODEL_GUID, NULL, fmi3False, fmi3False, fmi3True, fmi3False, NULL, 0, NULL,
                                      message, NULL) == NULL && n_message == 1);
    CHECK(fmi3InstantiateModelExchange("a", "{wrong}", NULL, fmi3False, fmi3False, NULL, NULL) == NULL);
    fmi3Instance c = fmi3InstantiateCoSimulation("a", MODEL_GUID, NULL, fmi3False, fmi3False, fmi3False, fmi3False, NULL,
                                                 0, NULL, NULL, NULL);
    CHECK(c != NULL && fmi3DoStep(c, 0.0, H, fmi3True, &event, &terminate, &early, &reached) == fmi3Error);
    start(c);
    steps(c, 0, 3);
    CHECK(fmi3DoStep(c, 3 * H, 0.0, fmi3True, &event, &terminate, &early, &reached) == fmi3Error && reached == 3 * H);
    CHECK(fmi3DoStep(c, 3 * H, 1e9, fmi3True, &event, &terminate, &early, &reached) == fmi3Error && !early);
    steps(c, 3, 3);
    CHECK(fmi3SetFloat64(c, &hard_limit, 1, &limit, 1) == fmi3OK);
    CHECK(fmi3DoStep(c, 6 * H, H, fmi3True, &event, &terminate, &early, &reached) == fmi3Error && reached == 6 * H);
    CHECK(fmi3GetFloat64(c, &trust_ratio, 1, &ratio, 1) == fmi3OK && ratio > 0.0);
    CHECK(fmi3Terminate(c) == fmi3Error && fmi3Reset(c) == fmi3OK);
    start(c);
    steps(c, 0, 3);
    CHECK(fmi3Terminate(c) == fmi3OK && fmi3GetFloat64(c, &trust_ratio, 1, &ratio, 1) == fmi3OK);
    fmi3FreeInstance(c);
}

/* An importer that does more within a step than it may: only inputs can be set, no step begins, nothing is freed. */
static void restless(fmi3InstanceEnvironment e, fmi3Float64 time, fmi3Boolean set, fmi3Boolean get, fmi3Boolean finished,
                     fmi3Boolean can_return, fmi3Boolean *early, fmi3Float64 *early_time)
{
    fmi3Instance c = *(fmi3Instance *)e;
    fmi3FMUState saved = NULL;
    fmi3Boolean event, terminate;
    const fmi3ValueReference input = VR_INPUT;
    const double one = 1.0;
    double reached, value = 0.0;
    (void)finished, (void)can_return;
    CHECK(set != get && fmi3SetFloat64(c, &input, 1, &one, 1) == fmi3OK);
    CHECK(fmi3DoStep(c, time, H, fmi3True, &event, &terminate, early, early_time) == fmi3Error);
    CHECK((fmi3GetFloat64(c, &gain, 1, &value, 1) == fmi3OK) == get && (get || value == 0.0));
    CHECK(get || fmi3SetFloat64(c, &gain, 1, &one, 1) == fmi3Error);
    CHECK(get || (fmi3GetFMUState(c, &saved) == fmi3Error && fmi3Reset(c) == fmi3Error && fmi3Terminate(c) == fmi3Error));
    CHECK(fmi3DoStep(c, time, H, fmi3True, &event, &terminate, early, &reached) == fmi3Error);
    fmi3FreeInstance(c);
    ++n_update;
}

static void steps_do_not_nest(void)
{
    fmi3Instance c;
    c = fmi3InstantiateCoSimulation("cs", MODEL_GUID, NULL, fmi3False, fmi3True, fmi3False, fmi3False, NULL, 0, &c,
                                    NULL, restless);
    CHECK(c != NULL);
    n_update = 0;
    start(c);
    steps(c, 0, 20);
    CHECK(n_update >= 60); /* two updates or more within each step, one after it */
    fmi3FreeInstance(c);
}

int main(void)
{
    co_simulation();
    model_exchange();
    misuse();
    importers();
    steps_do_not_nest();
    printf("ok\n");
    return 0;
}
