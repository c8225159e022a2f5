/* FMI 2.0 functions common to Model Exchange and Co-Simulation. */
#include <stdlib.h>
#include <string.h>

#include "rom_instance.h"
#include "rom_tables.h"

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    rom_instance *s = c;
    unsigned categories = n == 0 ? LOG_EVERYTHING : 0;
    if (!rom_permits(s, MODE_ANY, "fmi2SetDebugLogging"))
        return fmi2Error;
    if (n > 0 && names == NULL)
        return rom_refuse(s, "fmi2SetDebugLogging", "the list of categories is NULL");
    for (size_t k = 0; k < n; ++k) {
        if (rom_category_mask(names[k]) == 0)
            return rom_refuse(s, "fmi2SetDebugLogging", "unknown log category; see LogCategories in modelDescription.xml");
        categories |= rom_category_mask(names[k]);
    }
    s->logger.categories = on ? categories : LOG_PROBLEMS;
    return fmi2OK;
}

/* As many whole characters as there is room for */
static void copy_name(char target[], size_t size, const char *name)
{
    size_t n = 0;
    while (name[n] != '\0') {
        const size_t length = rom_utf8_length(name + n), step = length == 0 ? 1 : length;
        if (n + step >= size)
            break;
        memcpy(target + n, name + n, step);
        n += step;
    }
    target[n] = '\0';
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging_on)
{
    (void)visible;
    rom_logger logger;
    memset(&logger, 0, sizeof logger);
    if (callbacks == NULL)
        return NULL;
    logger.callback = callbacks->logger;
    logger.environment = callbacks->componentEnvironment;
    logger.categories = logging_on ? LOG_EVERYTHING : LOG_PROBLEMS;
    copy_name(logger.instance_name, sizeof logger.instance_name, name != NULL ? name : "");
    const char *reason = NULL;
    if (name == NULL || name[0] == '\0')
        reason = "the instance name is empty";
    else if (guid == NULL || strcmp(guid, MODEL_GUID) != 0)
        reason = "the GUID does not match; modelDescription.xml and binary belong to different exports";
    else if (type != fmi2ModelExchange && type != fmi2CoSimulation)
        reason = "the FMU type is neither Model Exchange nor Co-Simulation";
    rom_instance *s = reason == NULL ? calloc(1, sizeof *s) : NULL;
    if (s == NULL) {
        rom_log(&logger, fmi2Error, LOG_ERROR, "fmi2Instantiate", reason != NULL ? reason : "memory is exhausted");
        return NULL;
    }
    char path[ROM_PATH_SIZE];
    reason = rom_fill_tables(resources, &s->workspace.tables, path);
    if (reason != NULL) {
        rom_log(&logger, fmi2Error, LOG_ERROR, reason, path);
        free(s);
        return NULL;
    }
    s->workspace.wide = rom_has_avx();
    s->logger = logger;
    s->initial_categories = logger.categories;
    s->memory = rom_initial_memory(type);
    return s;
}

void fmi2FreeInstance(fmi2Component c)
{
    rom_instance *s = c;
    if (s == NULL)
        return;
    rom_free_snapshots(s);
    free(s);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop)
{
    rom_instance *s = c;
    (void)tolerance_defined; /* the internal step is fixed, see max_internal_step */
    (void)tolerance;
    if (!rom_permits(s, MODE_INSTANTIATED, "fmi2SetupExperiment"))
        return fmi2Error;
    if (!rom_is_finite(start) || (stop_defined && !(stop >= start)))
        return rom_refuse(s, "fmi2SetupExperiment", "the start time is not finite or the stop time is before it");
    s->memory.time = start;
    s->memory.stop_time_defined = stop_defined ? 1.0 : 0.0;
    s->memory.stop_time = stop_defined ? stop : 0.0;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    rom_instance *s = c;
    if (!rom_permits(s, MODE_INSTANTIATED, "fmi2EnterInitializationMode"))
        return fmi2Error;
    s->memory.mode = MODE_INITIALIZATION;
    rom_update_start(s);
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    rom_instance *s = c;
    if (!rom_permits(s, MODE_INITIALIZATION, "fmi2ExitInitializationMode"))
        return fmi2Error;
    const double ratio = rom_trust_ratio(s->memory.z);
    if (rom_beyond_hard_limit(s, ratio))
        return rom_fail(s, "fmi2ExitInitializationMode", "the start state lies beyond hard_limit times the trained range");
    s->memory.mode = s->memory.kind == (double)fmi2CoSimulation ? MODE_STEP_COMPLETE : MODE_EVENT;
    return rom_check_trust(s, ratio);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    rom_instance *s = c;
    if (!rom_permits(s, MODE_STEP_COMPLETE | MODE_EVENT | MODE_CONTINUOUS, "fmi2Terminate"))
        return fmi2Error;
    s->memory.mode = MODE_TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    rom_instance *s = c;
    if (!rom_permits(s, MODE_ANY, "fmi2Reset"))
        return fmi2Error;
    s->memory = rom_initial_memory(s->memory.kind == (double)fmi2CoSimulation ? fmi2CoSimulation : fmi2ModelExchange);
    s->logger.categories = s->initial_categories;
    rom_invalidate(s);
    return fmi2OK;
}
