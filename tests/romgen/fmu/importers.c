/* What importers are seen to do with a unit: odd names and locations, no logger, stop times summed up in steps, steps of
   no length, parameters at the wrong moment, going on after an error, floating-point traps.
   Usage: importers LIBRARY. Prints "ok" and returns 0, or names the first check that failed. */
#include "interface.h"

#include <fenv.h>

#define TRUST_RATIO (FIRST_SENSOR + 2 * N_SENSOR + 2 * N_MODE)
enum { GAIN = TRUST_RATIO + 1, RADIUS, HARD_LIMIT, MAX_STEP };

static char last_name[1024], last_message[1024];
static int n_message;

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    (void)environment, (void)category;
    CHECK(status <= fmi2Fatal && strlen(name) < sizeof last_name && strlen(message) < sizeof last_message);
    strcpy(last_name, name);
    strcpy(last_message, message);
    ++n_message;
}

static fmi2CallbackFunctions callbacks = {logger, NULL, NULL, NULL, NULL};

/* Decodes strictly, as importers in Python do; false for anything that is no UTF-8 or would break a line. */
static int is_clean(const char *text)
{
    const unsigned char *c = (const unsigned char *)text;
    while (*c != '\0') {
        unsigned long code = *c;
        int more = code < 0x80 ? 0 : code < 0xc0 ? -1 : code < 0xe0 ? 1 : code < 0xf0 ? 2 : code < 0xf8 ? 3 : -1;
        const unsigned long least = more == 1 ? 0x80 : more == 2 ? 0x800 : more == 3 ? 0x10000 : ' ';
        if (more < 0)
            return 0;
        for (code &= more == 0 ? 0x7f : 0x3fu >> more; more > 0; --more)
            if ((*++c & 0xc0) != 0x80)
                return 0;
            else
                code = code << 6 | (*c & 0x3f);
        if (code < least || code > 0x10ffff || (code >= 0xd800 && code < 0xe000))
            return 0;
        ++c;
    }
    return 1;
}

static fmi2Component named(const char *name, fmi2Type type)
{
    fmi2Component c = Instantiate(name, type, MODEL_GUID, resources, &callbacks, fmi2False, fmi2False);
    CHECK(c != NULL);
    return c;
}

static fmi2Component started(fmi2Type type)
{
    const fmi2ValueReference first = 0;
    const double z = 0.3;
    fmi2Component c = named("one", type);
    CHECK(SetupExperiment(c, fmi2True, 1e-4, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(SetReal(c, &first, 1, &z) == fmi2OK);
    CHECK(EnterInitializationMode(c) == fmi2OK && ExitInitializationMode(c) == fmi2OK);
    return c;
}

static void read_all(fmi2Component c, double values[])
{
    fmi2ValueReference all[N_REAL];
    for (unsigned k = 0; k < N_REAL; ++k)
        all[k] = k;
    CHECK(GetReal(c, all, N_REAL, values) == fmi2OK);
}

static fmi2Status set(fmi2Component c, fmi2ValueReference vr, double value)
{
    return SetReal(c, &vr, 1, &value);
}

static void every_instance_logs_under_its_own_name(void)
{
    char name[400] = "x";
    for (int k = 0; k < 150; ++k)
        strcat(name, "\xc3\xbc");
    fmi2Component one = named("Br\xc3\xbc" "cke %s 1", fmi2CoSimulation), two = named(name, fmi2CoSimulation);
    CHECK(DoStep(one, 0.0, H, fmi2True) == fmi2Error && strcmp(last_name, "Br\xc3\xbc" "cke %s 1") == 0);
    CHECK(DoStep(two, 0.0, H, fmi2True) == fmi2Error && strncmp(last_name, name, strlen(last_name)) == 0);
    CHECK(strlen(last_name) > 100 && is_clean(last_name));
    FreeInstance(one);
    FreeInstance(two);
}

static void without_a_logger_nothing_is_logged(void)
{
    const fmi2CallbackFunctions silent = {NULL, NULL, NULL, NULL, NULL};
    CHECK(Instantiate("a", fmi2CoSimulation, "wrong", resources, &silent, fmi2False, fmi2True) == NULL);
    fmi2Component c = Instantiate("a", fmi2CoSimulation, MODEL_GUID, resources, &silent, fmi2False, fmi2True);
    CHECK(c != NULL && DoStep(c, 0.0, H, fmi2True) == fmi2Error && set(c, GAIN, NAN) == fmi2Error);
    CHECK(SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK && EnterInitializationMode(c) == fmi2OK);
    CHECK(set(c, 0, 1e6) == fmi2OK && ExitInitializationMode(c) == fmi2Error && Terminate(c) == fmi2Error);
    FreeInstance(c);
}

static void categories_choose_what_is_logged(void)
{
    const fmi2String errors[] = {"logStatusError"}, crossings[] = {"trustRegion"}, missing[] = {"logStatusError", NULL};
    fmi2Component c = started(fmi2CoSimulation);
    CHECK(SetDebugLogging(c, fmi2True, 1, crossings) == fmi2OK);
    n_message = 0;
    CHECK(DoStep(c, 0.0, -H, fmi2True) == fmi2Error && n_message == 0);
    CHECK(SetDebugLogging(c, fmi2True, 2, missing) == fmi2Error && SetDebugLogging(c, fmi2True, 1, errors) == fmi2OK);
    CHECK(DoStep(c, 0.0, -H, fmi2True) == fmi2Error && n_message == 1);
    CHECK(set(c, RADIUS, 1e-6) == fmi2OK && DoStep(c, 0.0, H, fmi2True) == fmi2Warning && n_message == 1);
    CHECK(SetDebugLogging(c, fmi2False, 0, NULL) == fmi2OK && DoStep(c, 0.0, -H, fmi2True) == fmi2Error && n_message == 2);
    FreeInstance(c);
}

static void a_wrong_location_is_named_readably(void)
{
#if COEFFICIENTS_IN_FILE
    char location[1000] = "file:///no%20where%2525/\xff\xc3(\n\xed\xa0\x80/\xc3\xbc";
    const char *message = last_message;
    CHECK(Instantiate("a", fmi2CoSimulation, MODEL_GUID, location, &callbacks, fmi2False, fmi2False) == NULL);
    CHECK(strstr(message, "/no where%%25/?" "?( ?" "?" "?/\xc3\xbc/coefficients.bin") != NULL && is_clean(message));
    for (int k = 0; k < 250; ++k)
        strcat(location, "\xc3\xbc/");
    CHECK(Instantiate("a", fmi2CoSimulation, MODEL_GUID, location, &callbacks, fmi2False, fmi2False) == NULL);
    CHECK(strlen(message) > 400 && is_clean(message));
#endif
}

static void times_may_be_summed_up(void)
{
    const double stop = 1000.0;
    double t = stop - H;
    fmi2Component c = named("one", fmi2CoSimulation);
    CHECK(SetupExperiment(c, fmi2False, 0.0, stop - 1.0, fmi2True, stop) == fmi2OK);
    CHECK(EnterInitializationMode(c) == fmi2OK && ExitInitializationMode(c) == fmi2OK);
    CHECK(DoStep(c, t + 1e-6, H, fmi2True) == fmi2OK); /* 1e7 steps of 1e-4 s, summed up one by one */
    CHECK(DoStep(c, stop - 0.4 * H, H, fmi2True) == fmi2Error && DoStep(c, stop, H, fmi2True) == fmi2Error);
    CHECK(DoStep(c, t, H, fmi2False) == fmi2OK); /* neither refusal has harmed it */
    FreeInstance(c);
}

static void refused_steps_change_nothing(void)
{
    double plain[N_REAL], disturbed[N_REAL];
    fmi2Component a = started(fmi2CoSimulation), b = started(fmi2CoSimulation);
    for (int k = 0; k < 20; ++k) {
        CHECK(DoStep(a, k * H, H, fmi2True) == fmi2OK && DoStep(b, k * H, H, fmi2False) == fmi2OK);
        CHECK(DoStep(b, k * H, 0.0, fmi2False) == fmi2Error && DoStep(b, k * H, 1e9, fmi2True) == fmi2Error);
        CHECK(set(b, MAX_STEP, 1e-6) == fmi2Error && set(b, 0, 0.1) == fmi2Error && set(b, TRUST_RATIO, 0.1) == fmi2Error);
    }
    read_all(a, plain);
    read_all(b, disturbed);
    CHECK(memcmp(plain, disturbed, sizeof plain) == 0);
    FreeInstance(a);
    FreeInstance(b);
}

static void a_saved_state_and_reset_help_after_an_error(void)
{
    double fresh[N_REAL], again[N_REAL], kept[N_REAL];
    fmi2FMUstate saved = NULL;
    fmi2Component c = started(fmi2CoSimulation);
    CHECK(DoStep(c, 0.0, H, fmi2True) == fmi2OK && GetFMUstate(c, &saved) == fmi2OK);
    read_all(c, fresh);
    CHECK(set(c, HARD_LIMIT, 1e-6) == fmi2OK && DoStep(c, H, H, fmi2True) == fmi2Error);
    read_all(c, kept); /* the last good state is still there */
    CHECK(memcmp(fresh, kept, N_STATE * sizeof *fresh) == 0);
    CHECK(DoStep(c, H, H, fmi2True) == fmi2Error && Terminate(c) == fmi2Error);
    CHECK(SetFMUstate(c, saved) == fmi2OK && DoStep(c, H, H, fmi2True) == fmi2OK && SetFMUstate(c, saved) == fmi2OK);
    CHECK(set(c, HARD_LIMIT, 1e-6) == fmi2OK && DoStep(c, H, H, fmi2True) == fmi2Error && Reset(c) == fmi2OK);
    CHECK(SetupExperiment(c, fmi2True, 1e-4, 0.0, fmi2False, 0.0) == fmi2OK && set(c, 0, 0.3) == fmi2OK);
    CHECK(EnterInitializationMode(c) == fmi2OK && ExitInitializationMode(c) == fmi2OK);
    CHECK(DoStep(c, 0.0, H, fmi2True) == fmi2OK);
    read_all(c, again);
    CHECK(memcmp(fresh, again, sizeof fresh) == 0);
    CHECK(Terminate(c) == fmi2OK && Terminate(c) == fmi2Error);
    read_all(c, again);
    CHECK(memcmp(fresh, again, sizeof fresh) == 0 && set(c, GAIN, 2.0) == fmi2Error);
    FreeInstance(c);
}

static void parameters_are_taken_when_the_standard_says(void)
{
    double value;
    const fmi2ValueReference gain = GAIN, longest = MAX_STEP;
    fmi2Component c = named("one", fmi2ModelExchange);
    fmi2EventInfo info;
    CHECK(GetReal(c, &gain, 1, &value) == fmi2Error); /* before initialisation nothing can be read */
    CHECK(set(c, GAIN, 2.0) == fmi2OK && set(c, MAX_STEP, 1e-5) == fmi2OK && set(c, MAX_STEP, 0.0) == fmi2Error);
    CHECK(EnterInitializationMode(c) == fmi2OK); /* without fmi2SetupExperiment, as some importers do */
    CHECK(GetReal(c, &gain, 1, &value) == fmi2OK && value == 2.0);
    CHECK(set(c, MAX_STEP, 2e-5) == fmi2OK && GetReal(c, &longest, 1, &value) == fmi2OK && value == 2e-5);
    CHECK(ExitInitializationMode(c) == fmi2OK && set(c, GAIN, 3.0) == fmi2OK && set(c, MAX_STEP, 1e-5) == fmi2Error);
    CHECK(NewDiscreteStates(c, &info) == fmi2OK && EnterContinuousTimeMode(c) == fmi2OK);
    CHECK(set(c, GAIN, 4.0) == fmi2Error && EnterEventMode(c) == fmi2OK && set(c, GAIN, 4.0) == fmi2OK);
    CHECK(EnterEventMode(c) == fmi2OK && Terminate(c) == fmi2OK);
    CHECK(GetReal(c, &gain, 1, &value) == fmi2OK && value == 4.0);
    FreeInstance(c);
}

/* Programs in Fortran often trap invalid operations; rest is where a phase or a ratio could be 0 / 0. */
static void no_floating_point_traps(void)
{
#ifdef FE_NOMASK_ENV
    double values[N_REAL], one = 1.0, slope;
    const fmi2Integer first = 1;
    feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
    fmi2Component c = named("one", fmi2CoSimulation);
    CHECK(SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2True, 1.0) == fmi2OK);
    CHECK(EnterInitializationMode(c) == fmi2OK && ExitInitializationMode(c) == fmi2OK);
    for (int k = 0; k < 40; ++k) {
        if (k == 20 && N_INPUT > 0)
            CHECK(set(c, FIRST_INPUT, 5.0) == fmi2OK);
        read_all(c, values);
        for (unsigned vr = FIRST_SENSOR; vr <= TRUST_RATIO; ++vr) {
            const fmi2ValueReference output = vr, state = vr % N_STATE;
            CHECK(GetDirectionalDerivative(c, &output, 1, &state, 1, &one, &slope) == fmi2OK);
            CHECK(GetRealOutputDerivatives(c, &output, 1, &first, &slope) == fmi2OK);
        }
        CHECK(DoStep(c, k * H, H, fmi2True) == fmi2OK);
    }
    FreeInstance(c);
    fedisableexcept(FE_ALL_EXCEPT);
#endif
}

int main(int argc, char **argv)
{
    CHECK(argc == 2);
    load(argv[1]);
    every_instance_logs_under_its_own_name();
    without_a_logger_nothing_is_logged();
    categories_choose_what_is_logged();
    a_wrong_location_is_named_readably();
    times_may_be_summed_up();
    refused_steps_change_nothing();
    a_saved_state_and_reset_help_after_an_error();
    parameters_are_taken_when_the_standard_says();
    no_floating_point_traps();
    printf("ok\n");
    return 0;
}
